"""Flattened disks: exact where they are flat, conformal and of least scale otherwise."""

import meshes
import numpy as np

from omt_uv.solver.conformal.boundary_first import boundary_first
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.maps.untangle import count_folds
from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.mesh.topology import boundary_loops


def flattened(V, F):
    return boundary_first(V, F, boundary_loops(F)[0])


def test_a_flat_disk_keeps_its_shape_and_size():
    V, F = meshes.bumpy(9, 7, height=0.0)
    found = flattened(V, F)
    length = np.linalg.norm(V[F] - V[F[:, [1, 2, 0]]], axis=2)
    np.testing.assert_allclose(np.linalg.norm(found.uv[F] - found.uv[F[:, [1, 2, 0]]], axis=2), length, atol=1e-9)
    np.testing.assert_allclose(found.log_scale, 0, atol=1e-9)
    assert found.spread(vertex_areas(V, F)) < 1e-15


def test_a_curved_disk_is_nearly_conformal_and_its_scale_is_1_on_the_boundary():
    V, F = meshes.hemisphere()
    found = flattened(V, F)
    assert count_folds(found.uv, F) == 0
    assert distortion(V, F, found.uv[F], overlap=False).angle_mean < 1.1
    loop = boundary_loops(F)[0]
    np.testing.assert_array_equal(found.log_scale[loop], 0)
    # Of a hemisphere, stereographic projection: half the length at the pole.
    assert abs(found.log_scale.min() + np.log(2)) < 0.02


def test_the_spread_is_of_what_the_target_does_not_ask_for():
    V, F = meshes.hemisphere()
    found = flattened(V, F)
    area = vertex_areas(V, F)
    assert found.spread(area) > 0.01
    assert found.spread(3 * area * np.exp(2 * found.log_scale)) < 1e-20


def test_moving_and_turning_the_surface_changes_no_shape():
    V, F = meshes.bumpy(8, 8, height=0.3)
    turn = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    np.testing.assert_allclose(flattened(V @ turn + 5, F).uv, flattened(V, F).uv, atol=1e-9)
