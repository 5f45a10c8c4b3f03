"""Arrange UV islands that exist: put equal ones on one another, make halves the same, grids of quads rectangles.

Imports settings, pipelines and, of the solver, mesh, editing and arranging.
Main names: stack_islands, symmetrize_islands, rectify_islands, Arranged.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    actions="rectify_islands stack_islands symmetrize_islands",
    found="Arranged PlacedUV islands_of",
)
