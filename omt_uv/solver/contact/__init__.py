"""Faces of a mesh in space that pass through one another, or nearly: found, told from those of before, taken apart.

Imports solver, solver.mesh and solver.linalg.
Main names: FaceCrossings, intersecting_pairs, NewCrossings, new_intersections, separated, brought, close_pairs.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    barrier="brought",
    new_crossings="NewCrossings new_intersections touched",
    proximity="ClosePairs close_pairs",
    self_intersections="FaceCrossings intersecting_pairs",
    separation="separated",
)
