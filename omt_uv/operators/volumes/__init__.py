"""Operators on bodies: moved without a change of volume, and mapped with their insides.

Imports operators.base, operators.properties, blender.volumes, pipelines.volumes, session and solver.
Main names: OBJECT_OT_omt_flow, UV_OT_omt_flow, FlowDrag.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    drag="FlowDrag UVDrag",
    flow="OBJECT_OT_omt_flow",
    volume="OBJECT_OT_omt_volume",
    uv_flow="UV_OT_omt_flow",
)
