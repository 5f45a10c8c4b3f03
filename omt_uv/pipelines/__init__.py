"""The one path of each operator and command, from what was read to what is to be written; holds no Blender.

Imports settings, errors, solver, xatlas_charts.
Main names: lay_out, refine_islands, magnify.magnify, project, remesh_series, carry, Reading.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    attributes="Attributes Layer Marks ShapeKey",
    carry_attributes="carry",
    distortion="measure_readings",
    globe="Globe GlobeJob Globes Markers project",
    layout="Layout PlacedIsland Refusal UnwrapJob pack_islands",
    magnify="Magnified Region Shares warped_picture",
    panorama_redraw="redraw",
    reading="Reading",
    refine="RefinedLayout refine_islands",
    remesh="LevelOfDetail RemeshJob Series remesh_series",
    texel_density="Texels with_texel_density",
    subdivision="evaluated subdivided_target",
    unwrap="lay_out",
)
