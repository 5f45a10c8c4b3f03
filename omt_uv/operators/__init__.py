"""Operators: read, solve, write, report."""
