"""Islands by their shape: equal ones found, put on one another or mirrored, grids of quads made rectangles.

Imports solver.errors and solver.mesh.
Main names: matching, Match, Stacks, Halves, symmetric_map, rectangle, GridRectangle.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    congruence="Match matching mirrored_match",
    halves="Halves symmetric_map",
    quad_grid="GridRectangle rectangle",
    stacks="Stacks",
)
