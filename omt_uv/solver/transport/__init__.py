"""Semi-discrete optimal transport in the plane and on the sphere: power diagrams with cells of prescribed areas.

Imports solver.mesh and solver.linalg.
Main names: transport, sphere_transport, PowerDiagram, Disk, ConvexPolygon, Rectangle.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    convex_domain="ConvexPolygon Disk Domain Rectangle",
    power_diagram="PowerDiagram",
    semidiscrete="Transport transport",
    semidiscrete_sphere="SphereTransport sphere_transport",
)
