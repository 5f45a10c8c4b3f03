"""Quads: the diagonals that they are cut along, and those that a mesh was made of before it was triangulated.

Imports solver.mesh.
Main names: cut_along_shorter, longer_diagonals, shorter_diagonals, quad_diagonals, with_shorter_diagonals.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    diagonals="cut_along_shorter longer_diagonals shorter_diagonals",
    recombination="quad_diagonals with_shorter_diagonals",
)
