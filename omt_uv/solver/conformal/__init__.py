"""Discrete conformal maps: flat metrics by Yamabe flow, the disk and the rectangle, Moebius maps of disk and sphere.

Imports solver.mesh, solver.linalg and solver.maps.
Main names: conformal_disk, conformal_rectangle, YamabeFlow, flatten_punctured_sphere, IntrinsicTriangulation.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    boundary_first="FlatDisk",
    disk_map="ConformalMap conformal_disk conformal_rectangle",
    intrinsic_triangulation="IntrinsicTriangulation make_delaunay",
    moebius="centre_on_sphere to_plane to_sphere",
    punctured_sphere="FlatPolygon flatten_punctured_sphere",
    rectangle_to_disk="centre_in_disk",
    yamabe_flow="YamabeFlow",
)
