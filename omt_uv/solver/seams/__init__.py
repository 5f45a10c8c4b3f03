"""Where to cut so that little is left to shear: a search for seams on the predicted scale of a flat map.

Imports solver.mesh, solver.linalg, solver.analysis and solver.cutting.
Main names: SeamSearch, SearchOptions, CoarseSurface, ScaleModel.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    coarse_surface="CoarseSurface",
    predicted_scale="ScaleModel",
    search="SeamSearch",
    options="SearchOptions",
)
