"""Divide a surface into cells of prescribed capacities: semi-discrete optimal transport on the surface itself.

Imports solver.mesh, solver.linalg and solver.transport.
Main names: divide, Division, DivisionOptions, cut_along_cells, follow_faces, site_distances.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    cut_mesh="CellMesh cut_along_cells",
    division="Division DivisionOptions divide",
    face_labels="FaceCells follow_faces",
    sites="Sites",
    spacing="site_distances",
)
