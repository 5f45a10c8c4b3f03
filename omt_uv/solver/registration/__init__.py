"""One surface matched with another: a map without folds from surface to surface that meets landmarks.

Imports solver.mesh, solver.linalg, solver.analysis, solver.maps, solver.refinement, solver.parameterization and
solver.sphere.
Main names: register (in register), Registration, RegistrationOptions, Landmarks, vertex_landmarks.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    landmarks="Landmarks vertex_landmarks",
    results="OnSurface Registration RegistrationOptions",
    suggestions="Suggestions suggest_landmarks",
)
