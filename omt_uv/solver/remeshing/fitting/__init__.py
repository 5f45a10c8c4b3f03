"""Fit of a mesh to the surface: the mean square distance by least squares, then the largest ones by local trials.

Imports solver, solver.mesh, solver.linalg, solver.remeshing.edits and solver.remeshing.relaxation.
Main names: fit_to_surface, FitState, ClosestPairs, displacements, lower_peaks.
"""

from ...lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    closest_pairs="ClosestPairs Pairing",
    fit="fit_to_surface",
    fit_state="FitState",
    hausdorff_peaks="lower_peaks",
    least_squares="DistanceWeighting displacements",
    ring_patches="RingPatches cut_patches",
    shape_terms="Fairness ShapeForces",
)
