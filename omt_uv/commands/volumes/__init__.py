"""Commands on bodies: parts moved without a change of volume, and insides mapped.

Imports commands, pipelines.volumes, blender.volumes, files and solver.
Main names: run_flow, run_volume.
"""

from ...solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    flow="run_flow",
    volume="run_volume",
)
