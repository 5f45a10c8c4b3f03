"""Values carried to a new mesh that lies on the old one: where it lies, and values per vertex, corner and face.

Imports solver.mesh.
Main names: correspond, Correspondence, to_vertices, to_corners, to_faces.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    correspondence="Correspondence correspond",
    interpolate="nearest_to_corners nearest_to_vertices to_corners to_faces to_vertices",
)
