"""UVs that exist: islands found, refined where they lie, followed while dragged, magnified, and images warped along.

Imports solver.errors, solver.progress, solver.mesh, solver.linalg, solver.analysis, solver.maps and solver.refinement.
Main names: uv_islands.uv_islands, refine_island.refine_island, refine_together.refine_together,
LiveMap, magnify_region, magnify_map, warp_image.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    image_warp="warp_image",
    live_map="LiveMap",
    magnify="Magnification RegionMagnification magnify_map magnify_region",
    outline="Outline recognise_outline",
    uv_islands="Island Islands",
)
