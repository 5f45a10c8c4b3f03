"""How alike surfaces are: their areas as they lie on the conformal sphere, compared by optimal transport.

Imports solver.mesh, linalg, analysis, conformal, canonical, sphere, registration, transport and partition.
Main names: signature (in signature), Signature, shape_distance, ShapeDistance, nearest.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    embedding="classes_of_nearest classical_scaling",
    marked="marked_signature",
    reference="ExactTransport exact_transport",
    signature="Signature closed_part",
    wasserstein="ShapeDistance distance_of nearest prepared shape_distance",
)
