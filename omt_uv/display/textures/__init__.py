"""Test pictures: checkers, circles and maps of the world to look at UVs with, layouts in colours, power diagrams.

Imports the rest of display, pipelines and, of the solver, maps.
Main names: labelled_checker, circle_packing, world_map, layout_picture, cells_picture.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    layouts="cells_picture layout_picture",
    patterns="circle_packing labelled_checker picture_of",
    world="world_map",
)
