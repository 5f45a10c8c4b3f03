"""Operators on shapes: one object matched with another, and its landmarks.

Imports operators, blender.shapes, pipelines.shapes, session and solver.
Main names: OBJECT_OT_omt_match, OBJECT_OT_omt_landmarks, OBJECT_OT_omt_landmarks_suggest, OBJECT_OT_omt_strain.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    landmarks="OBJECT_OT_omt_landmarks OBJECT_OT_omt_landmarks_clear OBJECT_OT_omt_landmarks_suggest",
    match="OBJECT_OT_omt_match",
    strain="OBJECT_OT_omt_strain",
)
