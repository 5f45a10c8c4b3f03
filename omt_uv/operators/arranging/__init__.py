"""Arrange UV islands that exist, and unwrap many objects one after the other.

Imports operators, session, blender and, of the pipelines, arranging.
Main names: UV_OT_omt_stack, UV_OT_omt_symmetrize, UV_OT_omt_rectify, UV_OT_omt_queue.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    islands="UV_OT_omt_rectify UV_OT_omt_stack UV_OT_omt_symmetrize",
    queue="UV_OT_omt_queue UV_OT_omt_queue_stop",
)
