"""Shared by all tests. The Blender session lives in tests/blender/conftest.py."""
