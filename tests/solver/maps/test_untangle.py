"""Maps with folds: none are left, and a map without any stays what it is."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.untangle import (
    arc_length_boundary,
    circle_boundary,
    count_folds,
    map_energy,
    untangle,
)
from omt_uv.solver.mesh.topology import boundary_loops


def disk():
    V, F = meshes.random_disk()
    loop = boundary_loops(F)[0]
    return V, F, loop, V[loop, :2]


def test_folds_are_counted():
    V, F, _, _ = disk()
    uv = V[:, :2]
    assert count_folds(uv, F) == 0 and count_folds(uv * [-1, 1], F) == len(F)
    assert count_folds(uv, np.concatenate([F[:5, ::-1], F[5:]])) == 5


def test_a_valid_map_stays_where_it_is():
    V, F, loop, boundary = disk()
    uv, warning = untangle(V[:, :2], V, F, loop, boundary)
    np.testing.assert_allclose(uv, V[:, :2], atol=1e-9)
    assert warning is None


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_folds_are_straightened(seed):
    V, F, loop, boundary = disk()
    uv = V[:, :2] + 0.15 * np.random.default_rng(seed).normal(size=(len(V), 2))
    assert count_folds(uv, F) > 0 and map_energy(uv, V, F) == np.inf
    found, _ = untangle(uv, V, F, loop, circle_boundary(V[:, :2], loop, 1.0))
    assert count_folds(found, F) == 0 and np.isfinite(map_energy(found, V, F))


def test_energy_of_a_map_knows_no_scale():
    V, F, _, _ = disk()
    assert map_energy(1e3 * V[:, :2], V, F) == pytest.approx(map_energy(V[:, :2], 1e-3 * V, F), rel=1e-9)
    flat = V * [1, 1, 0]
    assert map_energy(V[:, :2], flat, F) == pytest.approx(0, abs=1e-9)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("squeeze", [[0, 0], [1, 0]])
def test_a_map_without_area_has_no_finite_energy(squeeze):
    V, F = meshes.bumpy(4, 4)
    assert map_energy(V[:, :2] * squeeze, V, F) == np.inf > map_energy(V[:, :2], V, F)


def test_a_boundary_on_the_circle():
    V, F, loop, _ = disk()
    found = circle_boundary(V[:, :2], loop, 2.0)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 2)
    np.testing.assert_allclose(np.angle(found @ [1, 1j]), np.angle(V[loop, :2] @ [1, 1j]))
    # About a point outside of the map the boundary goes there and back.
    assert circle_boundary(V[:, :2] + 5, loop, 1.0) is None
    assert circle_boundary(V[:, :2], loop[::-1], 1.0) is None


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("at", [[0], [0, 3], slice(None)])
def test_a_boundary_through_the_middle_is_on_no_circle_and_nothing_is_divided_by_nothing(at):
    V, F, loop, _ = disk()
    uv = V[:, :2].copy()
    uv[loop[at]] = 0
    assert circle_boundary(uv, loop, 1.0) is None


def test_a_boundary_by_length():
    V, F = meshes.grid(4, 4)
    loop = boundary_loops(F)[0]
    found = arc_length_boundary(V, loop, 3.0)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 3)
    step = np.linalg.norm(np.roll(found, -1, axis=0) - found, axis=1)
    np.testing.assert_allclose(step, step[0])
