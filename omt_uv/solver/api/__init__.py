"""Run the solvers from a script: plain functions on arrays, drained of their progress.

Imports every package of the solver; nothing in the solver imports it.
Main names: unwrap, refine, magnify, remesh, sphere_map, distortion; steps has the same as generators.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    arrays="polygon_surface",
    functions="distortion magnify refine remesh sphere_map unwrap",
    results="MagnifiedUVs UVs",
)
