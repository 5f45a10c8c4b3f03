"""Process geometry in numpy and scipy alone; nothing in here knows Blender.

Imports nothing until a name is used: `from omt_uv import solver as omt` costs no time.
Main names: unwrap, refine, magnify, remesh, sphere_map, distortion; `steps` has the same as generators.

Conventions, stated once: triangles are counter-clockwise seen from outside, areas of
counter-clockwise triangles are positive, Laplacians are positive semidefinite, angles are
radians, arrays are float64 and int64.
"""

from .lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    api="MagnifiedUVs UVs distortion magnify polygon_surface refine remesh sphere_map steps unwrap",
    errors="MeshError",
    progress="Progress drain",
)
