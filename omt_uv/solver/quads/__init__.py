"""Quads among the polygons: the diagonals that they are cut along.

Imports solver.mesh.
Main names: cut_along_shorter, longer_diagonals, shorter_diagonals.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(__name__, diagonals="cut_along_shorter longer_diagonals shorter_diagonals")
