"""Act on what the panel says of a result: remedies, worst faces, a checker to look at.

Imports operators, session, display, blender, pipelines and, of the solver, maps.
Main names: UV_OT_omt_remedy, UV_OT_omt_worst, UV_OT_omt_checker.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    checker="UV_OT_omt_checker UV_OT_omt_checker_remove",
    compare="OBJECT_OT_omt_compare",
    distance="OBJECT_OT_omt_distance",
    layouts="OBJECT_OT_omt_diagram UV_OT_omt_layout_image",
    regions="UV_OT_omt_attributes UV_OT_omt_regions",
    remedy="UV_OT_omt_remedy",
    worst="UV_OT_omt_worst",
)
