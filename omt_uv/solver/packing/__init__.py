"""Islands packed into a square: on a raster, as large as a search finds them to fit, around what has to stay.

Imports solver.errors, solver.mesh and solver.progress.
Main names: pack, pack_turned, Packing, stack, covered_area, MarginError.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    outline_raster="IslandOutline outlines_of grown_cells",
    pack_square="MarginError Packing covered_area pack stack",
    placement="Item Turned place turned_masks",
    raster_grid="RasterGrid rectangles_of",
    shelves="Block blocks_of",
    single_precision="without_rounded_folds",
    turning="in_smallest_box pack_turned",
)
