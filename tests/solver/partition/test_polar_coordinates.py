"""Distances and directions are those of the unfolded surface, whatever the triangles."""

import meshes
import numpy as np

from omt_uv.solver.partition import polar_coordinates as polar
from omt_uv.solver.partition.polar_coordinates import WindowMesh, polar_coordinates
from omt_uv.solver.partition.sites import Sites, inner


def some_sites(triangles, count, seed=0):
    rng = np.random.default_rng(seed)
    return Sites(rng.integers(len(triangles), size=count), inner(rng.dirichlet(np.ones(3), count)))


def seen(V, F, sites, radius):
    return polar_coordinates(
        WindowMesh(V, F), sites, np.full(len(sites.triangle), radius), np.arange(len(sites.triangle))
    )


def test_a_plane_is_exact_to_the_last_digits():
    V, F = meshes.grid(13, 9, 3.0, 1.0)
    inside = (V[:, :2] > 0).all(axis=1) & (V[:, :2] < [3, 1]).all(axis=1)
    V[inside, :2] += 0.03 * np.random.default_rng(1).uniform(-1, 1, (inside.sum(), 2))
    sites = some_sites(F, 20)
    pairs = seen(V, F, sites, 10.0)
    place = sites.positions(V, F)
    expected = np.linalg.norm(V[F[pairs.face]] - place[pairs.site][:, None], axis=2) ** 2
    assert len(pairs.face) == 20 * len(F) and not pairs.last.any()
    assert np.allclose(pairs.squared, expected, atol=1e-10)
    assert np.allclose((pairs.log**2).sum(axis=2), pairs.squared, rtol=1e-9)


def test_directions_of_a_plane_are_those_of_the_plane_turned():
    V, F = meshes.grid(8, 8)
    sites = some_sites(F, 5)
    pairs = seen(V, F, sites, 10.0)
    place = sites.positions(V, F)
    for k in range(5):
        mine = pairs.site == k
        flat = (V[F[pairs.face[mine]]] - place[k]).reshape(-1, 3)[:, :2]
        log = pairs.log[mine].reshape(-1, 2)
        turn = np.linalg.lstsq(flat, log, rcond=None)[0]
        assert np.allclose(flat @ turn, log, atol=1e-4) and np.allclose(turn @ turn.T, np.eye(2), atol=1e-4)


def test_a_sphere_has_great_circles():
    V, F = meshes.icosphere(4)
    sites = some_sites(F, 6)
    pairs = seen(V, F, sites, 1.0)
    place = sites.positions(V, F)
    place /= np.linalg.norm(place, axis=1)[:, None]
    along = np.arccos(np.clip(np.einsum("pcd,pd->pc", V[F[pairs.face]], place[pairs.site]), -1, 1))
    far = along > 0.2
    assert np.abs(np.sqrt(pairs.squared)[far] / along[far] - 1).max() < 0.01


def test_windows_end_where_the_radius_does_and_say_so():
    V, F = meshes.grid(30, 30)
    sites = Sites(np.array([900]), np.full((1, 3), 1 / 3))
    pairs = seen(V, F, sites, 0.2)
    assert 0 < len(pairs.face) < len(F) / 4
    assert pairs.last.any() and np.sqrt(pairs.farthest[~pairs.last]).max() < 0.25


def test_parts_that_only_lie_near_are_not_seen():
    V, F = meshes.grid(4, 4)
    V2 = np.concatenate([V, V + [0, 0, 0.01]])
    pairs = seen(V2, np.concatenate([F, F + len(V)]), Sites(np.array([0]), np.full((1, 3), 1 / 3)), 5.0)
    assert set(pairs.face.tolist()) == set(range(len(F)))


def test_corners_of_slivers_do_not_shorten_each_other_without_an_end(monkeypatch):
    V, F = meshes.grid(60, 60)
    V = V * [1, 0.01, 1] + [0, 0, 1] * np.random.default_rng(1).standard_normal((len(V), 1))
    sites, spread, rounds = some_sites(F, 4), polar._spread_from, []

    def counted(*arguments):
        rounds.append(1)
        return spread(*arguments)

    monkeypatch.setattr(polar, "_spread_from", counted)
    pairs = seen(V, F, sites, 30.0)
    few = len(rounds)
    monkeypatch.setattr(polar, "MORE", 1.0)
    exact = seen(V, F, sites, 30.0)
    assert few < 0.6 * (len(rounds) - few)
    apart = np.sqrt(pairs.squared) / np.sqrt(exact.squared) - 1
    assert np.abs(apart).mean() < 1e-3
