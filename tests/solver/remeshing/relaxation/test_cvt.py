"""Relaxation evens a mesh out on its surface, at fixed topology, and leaves fixed vertices alone."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import angles, topology

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.relaxation import cvt
from omt_uv.solver.remeshing.relaxation.cvt import relax_cvt
from omt_uv.solver.remeshing.relaxation.surface_carrier import SurfaceCarrier
from omt_uv.solver.remeshing.relaxation.voronoi_cells import voronoi_cells


def shaken():
    V, F = meshes.grid(12, 12)
    fixed = np.zeros(len(V), dtype=bool)
    fixed[boundary_loops(F)[0]] = True
    order = np.argsort(~fixed, kind="stable")
    V, F, fixed = V[order], np.argsort(order)[F], fixed[order]
    V[~fixed, :2] += np.random.default_rng(0).uniform(-0.025, 0.025, ((~fixed).sum(), 2))
    mesh = WorkingMesh(V, F, fixed, np.zeros(0, np.int64))
    return mesh, SurfaceCarrier(ClosestPoint(*meshes.grid(4, 4), 1 / 12), np.ones(32), len(V))


def test_the_energy_falls_and_steps_get_small():
    mesh, carrier = shaken()
    relaxed, step = drain(relax_cvt(mesh, 30, carrier))
    energies = [voronoi_cells(m.points, m.triangles, np.ones(len(m.points))).energy for m in (mesh, relaxed)]
    assert energies[1] < energies[0] and step < 0.03
    assert topology(relaxed.triangles) == topology(mesh.triangles)
    np.testing.assert_array_equal(relaxed.points[mesh.fixed], mesh.points[mesh.fixed])
    assert np.abs(relaxed.points[:, 2]).max() < 1e-12
    assert np.percentile(angles(relaxed.points, relaxed.triangles).min(axis=1), 10) > np.percentile(
        angles(mesh.points, mesh.triangles).min(axis=1), 10
    )


def test_without_rounds_vertices_go_to_the_surface_alone():
    mesh, carrier = shaken()
    same, step = drain(relax_cvt(mesh, 0, carrier))
    np.testing.assert_allclose(same.points, mesh.points, atol=1e-12)
    assert step == 0


def test_samples_correct_no_cell_that_covers_what_is_seen():
    mesh, carrier = shaken()
    normals = np.tile([0.0, 0, 1], (len(mesh.points), 1))
    found = cvt._sample_correction(mesh.points, mesh.triangles, normals, carrier)
    assert (found.share >= 0).all() and (found.share[~mesh.fixed] < 1).all() and found.share.mean() < 0.1
    # Of a mesh that covers a tenth of what is seen, every cell is corrected, to the mass and the middle that are seen.
    small = cvt._sample_correction(0.3 * mesh.points, mesh.triangles, normals, carrier)
    assert small.share[small.mass > 0].mean() > 0.5 and not small.share[small.mass == 0].any()


@pytest.mark.parametrize(("rounds", "returns"), [(1, 1), (2, 2), (4, 3), (5, 3), (6, 4)])
def test_vertices_go_back_to_the_surface_every_second_round_and_at_the_end(rounds, returns):
    """Before the first round they are on it already, once more."""
    mesh, carrier = shaken()
    asked = []

    class Counting:
        def __getattr__(self, name):
            return getattr(carrier, name)

        def closest(self, points, normals):
            asked.append(len(points))
            return carrier.closest(points, normals)

    relaxed, _ = drain(relax_cvt(mesh, rounds, Counting()))
    assert len(asked) == 1 + returns and np.abs(relaxed.points[:, 2]).max() < 1e-12
