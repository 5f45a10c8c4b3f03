"""Flattened disks: exact where they are flat, conformal and of least scale otherwise."""

import meshes
import numpy as np

from omt_uv.solver.conformal.boundary_first import boundary_first
from omt_uv.solver.maps.contacts import covers_itself
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


def test_what_is_bent_by_all_of_its_turns_is_the_flat_map_and_by_none_is_convex():
    V, F = meshes.head(24)
    flat, loop = flattened(V, F), boundary_loops(F)[0]
    whole = flat.bent(1.0)
    np.testing.assert_allclose(fitted(whole, flat.uv), flat.uv, atol=1e-9 * np.ptp(flat.uv))
    side = np.diff(np.append(flat.bent(0.0)[loop], flat.bent(0.0)[loop[:1]], axis=0), axis=0) @ [1, 1j]
    turn = np.angle(np.roll(side, -1) / side)
    assert (turn > 0).all() and abs(turn.sum() - 2 * np.pi) < 1e-9


def test_a_strip_that_covers_itself_comes_apart_where_it_is_bent():
    """Wound round a cylinder by more than a turn in its own plane, as a spring that is pressed flat."""
    V, F = meshes.bumpy(120, 4, height=0.0)
    x, y = V[:, 0] - V[:, 0].min(), V[:, 1]
    turn, r = 2.6 * np.pi * x / np.ptp(x), 1 + 0.1 * (y - y.mean()) / np.ptp(y)
    V = np.column_stack([r * np.cos(turn), r * np.sin(turn), 0.02 * turn])
    flat, loop = flattened(V, F), boundary_loops(F)[0]
    assert covers_itself(flat.uv @ [1, 1j], loop)
    asked: list[bool] = []

    def is_apart(uv):
        asked.append(not covers_itself(uv @ [1, 1j], loop))
        return asked[-1]

    apart = flat.bent_until(is_apart)
    assert any(asked) and not covers_itself(apart @ [1, 1j], loop) and count_folds(apart, F) == 0
    assert flat.bent_until(lambda uv: False) is None
    # Hardly any shear, as in every conformal map.
    assert distortion(V, F, apart[F], overlap=False).angle_mean < 1.1


def test_bent_maps_turn_with_the_surface_and_grow_with_it():
    V, F = meshes.head(16)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    one, other = flattened(V, F).bent(0.5), flattened(3 * V @ turn.T + 5, F).bent(0.5)
    np.testing.assert_allclose(fitted(other, one), one, atol=1e-6 * np.ptp(one))


def fitted(uv, other):
    """The map uv (n,2) moved, turned and scaled to where the other one is."""
    a, b = (x @ [1, 1j] for x in (uv, other))
    a, middle = a - a.mean(), b.mean()
    w = middle + a * (np.vdot(a, b - middle) / np.vdot(a, a))
    return np.column_stack([w.real, w.imag])
