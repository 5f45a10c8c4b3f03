"""Pictures of distortion: colours over the mesh and its UVs, and histograms.

Imports solver, pipelines and blender.
Main names: overlay.show, overlay.hide, histogram.histogram, thumbnail, area_colours, shear_colours.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    canvas="set_preview",
    colormaps="area_colours shear_colours",
    histogram="thumbnail",
)
