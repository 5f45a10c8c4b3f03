"""Subdivision surfaces of polygon meshes, and UVs of the cage that are right on the subdivided surface.

Imports solver.mesh, solver.maps and solver.refinement.
Main names: Cage, Subdivision, cage_of, subdivide, bilinear, SubdivisionModifier,
subdivided_surface, subdivided_uv, subdivided_elements, refine_cage.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    cage_refinement="CageMap refine_cage subdivided_elements",
    catmull_clark="Cage Subdivision bilinear cage_of straight_boundary straight_corners subdivide",
    modifier="SubdividedSurface SubdivisionModifier subdivided_surface subdivided_uv",
)
