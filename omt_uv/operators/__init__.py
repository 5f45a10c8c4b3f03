"""Operators: read objects, run a solver, write what it found, and report.

Imports links, pipelines, blender, files, display, session and, when they run, of the solver what they need.
Main names: SolverOperator, QuickOperator, Complaint, and one class for every operator.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    base="Complaint QuickOperator SolverOperator",
    distortion="UV_OT_omt_histogram UV_OT_omt_measure UV_OT_omt_overlay",
    live="UV_OT_omt_live",
    magnify="UV_OT_omt_magnify",
    preset="UV_OT_omt_preset",
    refine="UV_OT_omt_refine",
    remesh="OBJECT_OT_omt_remesh",
    report="WM_OT_omt_copy_report WM_OT_omt_help",
    seams="UV_OT_omt_seams",
    sphere="UV_OT_omt_sphere",
    texel_density="UV_OT_omt_density_get UV_OT_omt_density_set",
    unwrap="UV_OT_omt_unwrap",
)
