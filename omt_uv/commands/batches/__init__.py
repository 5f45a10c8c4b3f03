"""Commands over many files, which need no Blender in their own process: `add` declares options, `run` carries it out.

Imports batch, supervision and commands. Each file is a run of another command in a process apart.
Main names: SomeFailed, run_batch.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(__name__, batch="SomeFailed run_batch")
