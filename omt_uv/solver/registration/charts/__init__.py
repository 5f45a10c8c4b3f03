"""Surfaces of any topology matched chart by chart, along seams that cut both alike.

Imports solver.mesh, solver.linalg and solver.registration.
Main names: register_charts, SeamArcs.
"""

from ...lazy import lazy

__getattr__, __all__ = lazy(__name__, chart_maps="register_charts", seam_arcs="SeamArcs")
