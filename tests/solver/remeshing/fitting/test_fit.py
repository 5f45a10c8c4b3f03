"""A fit brings the mesh nearer to the surface; vertex counts, topology and fixed vertices stay."""

from __future__ import annotations

import meshes
import numpy as np
from mesh_checks import topology

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.fitting.fit import fit_to_surface


def test_a_sphere_gets_its_volume():
    """Vertices on a sphere make a body that is too small; fitted ones lie outside of it by about as much as faces do
    inside."""
    V, F = meshes.icosphere(4)
    P, Q = meshes.icosphere(2)
    fixed = np.arange(len(P)) < 3
    mesh = WorkingMesh(P, Q, fixed, np.zeros(0, np.int64))
    found = drain(fit_to_surface(mesh, ClosestPoint(V, F, 0.28), np.ones(len(F))))
    volumes = [np.linalg.det(W[T]).sum() / 6 for W, T in ((V, F), (P, Q), (found.points, found.triangles))]
    assert abs(volumes[2] - volumes[0]) < 0.25 * abs(volumes[1] - volumes[0])
    assert topology(found.triangles) == (2, 0) and len(found.points) == len(P)
    np.testing.assert_array_equal(found.points[fixed], P[fixed])


def test_what_lies_on_a_plane_stays_on_it():
    V, F = meshes.grid(10, 10)
    P, Q = meshes.grid(4, 4)
    on_boundary = ((P[:, :2] == 0) | (P[:, :2] == 1)).any(axis=1)
    order = np.argsort(~on_boundary, kind="stable")
    mesh = WorkingMesh(P[order], np.argsort(order)[Q], on_boundary[order], np.zeros(0, np.int64))
    found = drain(fit_to_surface(mesh, ClosestPoint(V, F, 0.25), np.ones(len(F))))
    assert np.abs(found.points[:, 2]).max() < 1e-12
