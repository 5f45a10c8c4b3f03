"""A surface to texture coordinates: charts, their conformal maps, optimal transport, refinement, convex polygons.

Imports solver.errors, solver.progress, solver.mesh, solver.linalg, solver.analysis, solver.maps, solver.transport,
solver.cutting, solver.conformal, solver.refinement and solver.parameterization.polygons.
Main names: UnwrapOptions, SurfaceMap, map_chart, MapOptions, ChartMap, CornerPins, bound_shear; `unwrap.unwrap` bears
the name of its module.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    chart_map="ChartMap map_chart",
    chart_indices="ChartPins CornerPins clear_of_pins",
    initial_map="InitialChartMap",
    options="MapOptions UnwrapOptions",
    shear_bound="BoundedShear bound_shear",
    unwrap="SurfaceMap",
)
