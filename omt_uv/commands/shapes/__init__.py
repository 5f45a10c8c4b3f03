"""Commands on shapes: one file's mesh matched with another's, the mean of many, cells of equal area.

Imports commands, settings, pipelines, blender and their rooms for shapes, files and, when they run, the solver.
Main names: match.run, average.run, partition.run.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    average="Registered",
    match="kinds_of",
    partition="of_cells",
)
