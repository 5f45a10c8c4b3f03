"""One piecewise linear map to the plane: embedding, energy and its derivatives, distortion, overlap, and folds mended.

Imports solver.errors, solver.mesh and solver.linalg.
Main names: Distortion, face_distortion, overlap_share, Elements, elements, Similarity, straighten_folds,
mean_value_weights; `distortion.distortion`, `energy.energy`, `tutte.tutte` and `untangle.untangle` bear the names of
their modules.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    distortion="Distortion face_distortion uv_charts",
    energy="Elements FaceDerivatives area_error elements energies face_derivatives gradient",
    local_untangle="straighten_folds uv_vertices",
    overlap="overlap_share",
    similarity="Similarity fit_similarity",
    tutte="arc_length_parameters mean_value_weights",
    untangle="count_folds",
)
