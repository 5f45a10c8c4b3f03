"""How alike surfaces are: their areas as they lie on the conformal sphere, compared by optimal transport.

Imports solver.mesh, solver.analysis, solver.conformal, solver.sphere and solver.registration.
Main names: signature (in signature), Signature, shape_distance, ShapeDistance, nearest.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    embedding="classes_of_nearest classical_scaling",
    signature="Signature closed_part",
    wasserstein="ShapeDistance distance_of nearest prepared shape_distance",
)
