"""Several painted regions at once, and pictures with detail laid over what is magnified; no Blender.

Imports the solver, settings and pipelines.
Main names: magnify_several, NamedRegion, JointShares, region_factors, detailed_picture, parsed_inset.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    detail="box_of detailed_picture parsed_inset",
    several="JointShares NamedRegion magnify_several region_factors",
)
