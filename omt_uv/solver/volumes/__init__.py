"""Insides of bodies: tetrahedra, maps to ball and cube with exact volumes, registration, shells, samples, transfer.

Imports solver.errors, solver.progress, solver.mesh, solver.linalg, solver.flows and solver.sphere.
Main names: volume_map, VolumeMap, tetrahedra, TetMesh, registered, shell_surfaces, interior_points, TetLocation.
"""

from ..lazy import lazy

__getattr__, __all__ = lazy(
    __name__,
    domains="BallDomain CubeDomain",
    envelope="FilledBody filled",
    paper_flow="PaperFlow",
    registration="VolumeRegistration registered",
    sampling="ball_index interior_points sampled_field",
    shells="Shell shell_surfaces",
    slices="Slice dilation plane_slice",
    tet_mesh="share_error tet_volumes vertex_share_error",
    meshing="TetMesh tetrahedra",
    transfer="TetLocation",
    body_map="VolumeMap into_body volume_map",
)
