"""Paint regions, and give them factors of their own.

Imports operators, session, settings, display, blender and, of the pipelines and the solver, what weighs vertices.
Main names: OBJECT_OT_omt_weights, UV_OT_omt_region_add, UV_OT_omt_region_remove.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    factors="UV_OT_omt_region_add UV_OT_omt_region_remove",
    weights="OBJECT_OT_omt_weights",
)
