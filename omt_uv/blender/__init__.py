"""Meshes, vertex groups and attributes in and out of Blender: the only place that reads or writes them.

Imports pipelines, whose inputs it makes and whose results it writes, and the solver.
Main names: read, write_uv, target_layer, mark_seams, group_weights, read_request, new_objects.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    markers="globe_densities group_markers picked_markers",
    mesh="TargetError check_target read read_mesh target_layer write_uv",
    remesh_objects="Request SourceError new_objects read_request",
    seams="mark_seams",
    subdivision="modifier_of subdivision_warnings",
    vertex_groups="GroupError group_weights write_group",
    weights="Weights region_weights",
)
