"""Bodies in the world, handles of flows, and tetrahedra in and out of Blender.

Imports blender, pipelines.volumes, solver.flows, solver.volumes and errors.
Main names: read_body, write_frames, scene_handles, wall_of.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    bodies="read_body write_frames write_positions",
    flow_handles="grip scene_handles wall_of",
    tet_objects="point_object read_volume_body shell_objects slice_object tet_object",
)
