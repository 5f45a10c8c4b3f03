"""What goes on in Blender's window: the solver that runs, islands that follow the mouse, the last result, presets.

Imports pipelines, blender and, of the solver, editing and parameterization.
Main names: Run, Disturbed, aside, Session, Summary, Notice, figures.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    last_run="Notice Summary figures",
    live="Session",
    run="Disturbed Run aside",
)
