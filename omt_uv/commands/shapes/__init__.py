"""Commands on shapes: one file's mesh matched with another's, and the mean of many.

Imports commands, pipelines.shapes, blender.shapes, files and, when they run, of the solver what they need.
Main names: match.run, average.run.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    average="Registered",
    match="kinds_of",
)
