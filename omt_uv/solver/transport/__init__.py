"""Semi-discrete optimal transport in the plane and on the sphere: power diagrams with cells of prescribed areas.

Imports solver.mesh and solver.linalg.
Main names: transport, sphere_transport, PowerDiagram, SphericalCells, Disk, ConvexPolygon, Rectangle.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    cell_polygons="CellPolygons planar_cells spherical_cell_polygons",
    convex_domain="ConvexPolygon Disk Domain Rectangle",
    polar_factorization="PolarFactorisation polar_factorisation",
    power_diagram="PowerDiagram",
    regular_triangulation="RegularTriangulation",
    semidiscrete="Transport transport",
    semidiscrete_sphere="SphereTransport sphere_transport",
    spherical_power_diagram="Hull SphericalCells spherical_cells",
)
