"""How far one surface is from another: distances both ways, normals, curvature, boundary, topology and shapes.

Imports solver.mesh and solver.analysis.
Main names: Comparison, compare, compare_shapes, distances_to.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    bumps="Bumps bumps_of curvature_error",
    comparison_figures="Comparison compare distances_to",
    greatest="GreatestDistance exact_distances greatest_distance",
    triangle_shapes="TriangleShapes compare_shapes",
)
