"""Figures of parts of a surface and of its UVs: of regions, and of every face as values for nodes and shaders.

Imports solver and pipelines; holds no Blender.
Main names: FaceValues, RegionFigures, face_values, figures_by_region.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    diagrams="Diagram",
    per_face="FaceValues face_values",
    region_figures="RegionFigures figures_by_region",
)
