"""Bodies in the world, handles of flows, and tetrahedra in and out of Blender.

Imports blender, pipelines.volumes, solver and errors.
Main names: read_body, write_frames, scene_handles, wall_of.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    bodies="read_body write_frames write_positions",
    flow_handles="grip scene_handles wall_of",
)
