"""Triangle and polygon meshes as arrays: connectivity, measures, checks and repair, charts, closest points.

Imports solver.errors alone.
Main names: Surface, Chart, strict_charts, Gluing, repaired_gluing, CutMesh, ClosestPoint, ClosedSurface.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    charts="Chart charts_of check_disk check_edges strict_charts triangle_rows",
    closed_surface="ClosedSurface",
    closest_point="ClosestPoint ClosestPointTracker SurfacePoints closest_on_triangles spread_points",
    cut_mesh="CutMesh cut_open",
    edge_flips="flip_in_place flip_until_none",
    geometry="angle_defects cotangent_laplacian face_areas face_normals signed_areas vertex_areas vertex_normals",
    gluing="Gluing components corner_classes orientations turn_over",
    point_location="locate",
    polygon_areas="polygon_fans quad_corners quads triangle_pairs",
    repair="Repaired perturbed repaired_gluing with_area",
    spherical_geometry="signed_volumes spherical_areas",
    surface="Surface chosen_triangles strict_gluing triangle_surface",
    topology="boundary_edges boundary_loops halfedges pair_keys twins",
)
