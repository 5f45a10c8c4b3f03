"""Regions that objects name, and figures written into attributes of faces.

Imports blender, pipelines and what these import.
Main names: placed_mesh, regions_of, write_distances, write_face_values.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__, distances="placed_mesh write_distances", face_attributes="write_face_values", region_labels="regions_of"
)
