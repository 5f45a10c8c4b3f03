"""One module for each command of the command line: `add` declares its options, `run` carries it out.

Imports pipelines, blender, files, display and, when they run, of the solver what they need.
Main names: CommandError, read_file, read_layers, write_layers, write_report.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    common="CommandError write_report",
    layers="read_layers write_layers",
    selection="read_file",
)
