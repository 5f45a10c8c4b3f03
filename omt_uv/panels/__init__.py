"""Menus and sidebar."""
