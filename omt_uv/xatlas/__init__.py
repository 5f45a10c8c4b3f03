"""All that xatlas does: packing islands into the unit square, and charts of low distortion.

Imports errors, solver.mesh, and the library xatlas only when it is used.
Main names: pack, Packing, chart_seams.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    packing="MarginError Packing PackingError covered_area pack stack turn_upright",
    segmentation="SegmentationError chart_seams",
)
