"""Operators on shapes: one object matched with another, its landmarks, what is like it, cells of equal area.

Imports settings, solver, pipelines, blender, their rooms for shapes, session and operators.
Main names: OBJECT_OT_omt_match, OBJECT_OT_omt_similar, OBJECT_OT_omt_strain, MESH_OT_omt_partition, those of landmarks.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    landmarks="OBJECT_OT_omt_landmarks OBJECT_OT_omt_landmarks_clear OBJECT_OT_omt_landmarks_suggest",
    match="OBJECT_OT_omt_match",
    similar="OBJECT_OT_omt_similar",
    strain="OBJECT_OT_omt_strain",
    partition="MESH_OT_omt_partition",
)
