"""Maps of the sphere laid out over the unit square: rotations, projections, and corners on copies of the square.

Imports solver.mesh, solver.linalg and solver.sphere.
Main names: along_axes, by_markers, to_plane, to_sphere, unfold, correct_areas.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    exact_areas="ExactAreas correct_areas equirectangular_areas",
    pole_vertices="move_vertices_onto",
    projections="to_plane to_sphere",
    rotation="MarkerError along_axes by_markers",
    unfolding="Polygons Unfolding gather_polygons unfold",
)
