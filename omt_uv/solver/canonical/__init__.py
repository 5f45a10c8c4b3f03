"""Maps of the papers by name, with no refinement after them: conformal, and polar factorisation; and what fixes them.

Imports solver.mesh, solver.maps, solver.transport and solver.conformal.
Main names: conformal_map, polar_map, NamedMap, MapMarkers, ChartMarkers, natural_aspect.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    embeddings="evened_sites mean_value_sites",
    markers="ChartMarkers MapMarkers markers_of_chart",
    named_maps="NamedMap NamedProblem conformal_map polar_map",
    rectangles="natural_aspect rectangle_corners",
)
