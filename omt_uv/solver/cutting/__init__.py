"""Any surface to disk charts: repaired, taken apart, filled and cut along short paths where they are least seen.

Imports solver.errors, solver.mesh, solver.linalg and solver.analysis.
Main names: cut_to_disks, DiskCharts, cut, Cuts, fill_holes.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    component="CutComponent Topology",
    cuts="ComponentCut Cuts cut",
    disk_charts="DiskCharts cut_to_disks",
    hole_filling="fill_holes",
)
