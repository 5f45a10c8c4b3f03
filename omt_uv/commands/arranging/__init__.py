"""Commands on UV islands that exist, and on objects one after the other: stack, symmetrize, rectify, queue.

Imports commands, pipelines with arranging, and blender.
Main names: islands.run, queue.run, TooSlowError.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    islands="arrange",
    queue="TooSlowError",
)
