"""Relaxation on the surface: centroidal Voronoi tessellation, and vertices carried to where the density asks for them.

Imports solver, solver.mesh, solver.linalg and solver.remeshing.edits.
Main names: relax_cvt, balance_vertices, SurfaceCarrier, voronoi_cells.
"""

from ...lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    cvt="relax_cvt",
    surface_carrier="SurfaceCarrier",
    surface_samples="SurfaceSamples area_samples crest_samples tip_samples",
    vertex_balance="BalancedMesh balance_vertices",
    voronoi_cells="VoronoiCells",
)
