"""Polygons in the map of a chart: how they are cut into triangles for it, and how those that are convex stay so.

Imports solver, solver.mesh, solver.linalg, solver.quads, solver.maps, solver.transport, solver.conformal,
solver.canonical and solver.refinement.
Main names: polygon_disk, DiskMesh, keep_convex, CornerPatches, PolygonCorners.
"""

from ...lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    convexity="dented_faces keep_convex reflex_triangles",
    corner_solver="CornerMesh CornerPatches",
    polygon_corners="CornerBarrier Forced PolygonCorners convex_corners",
    polygon_disk="DiskMesh PolygonDisk",
)
