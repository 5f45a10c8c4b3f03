"""A command over many files: a child process for each, a manifest of what was done, a table and a page of the results.

Imports errors, temporary, supervision and lazy names; no Blender. numpy, rich, distributed, pyarrow when they are used.
Main names: BatchPlan, FileTask, Manifest, carry_out, page_of, summary_of, table_of, tasks_of.
"""

from ..solver.lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    engine="carry_out",
    manifest="Manifest",
    pages="page_of",
    plan="BatchError BatchPlan FileTask tasks_of",
    statistics="summary_of",
    tables="table_of",
)
