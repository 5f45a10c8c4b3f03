"""Thin walls: bodies with a small thickness everywhere, and where their two sides come apart.

Imports solver.mesh and solver.linalg.
Main names: wall_edges, Faces.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    opposite="Faces",
    two_sides="wall_edges",
)
