"""Thin walls: bodies that are a sheet with a thickness, and where their two sides come apart.

Imports solver.mesh and solver.linalg.
Main names: wall_edges.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    two_sides="wall_edges",
)
