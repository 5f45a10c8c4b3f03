"""What is read off a surface: curvature, saliency, feature edges, target densities, and where an artist would cut.

Imports solver.errors, solver.mesh and solver.linalg.
Main names: Target, target_density, exact_density, painted_density, vertex_score, soft_weights, sharp_edges,
SeamCosts, SymmetryPlane, Facing, face_occlusion, straighten.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    curvature="gaussian_curvature mean_curvature sharpness",
    density="Target checked_density from_polygons from_vertices gaussian_curvature_density graded_density "
    "mean_curvature_density normalised_density painted_density region_share relative_entropy",
    facing="Facing ahead towards",
    feature_edges="edge_union fold_angles region_borders resolved_features sharp_edges value_jumps",
    heat_means="HeatMeans",
    occlusion="face_occlusion vertex_occlusion",
    region_density="RegionDensity exact_density target_density",
    seam_costs="SeamCosts SeamPreferences",
    straight_paths="EdgeNetwork edge_network straighten turning_angles",
    symmetry_plane="MirrorImages SymmetryPlane",
    vertex_scores="distance scaled_vertex_areas soft_weights vertex_score",
)
