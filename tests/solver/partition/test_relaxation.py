"""Sites in the plane: they see one another where they are, go to the centroids of their cells, and keep apart."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.partition.cells import geodesic_cells
from omt_uv.solver.partition.polar_coordinates import WindowMesh, polar_coordinates
from omt_uv.solver.partition.relaxation import karcher_means, sights, spaced
from omt_uv.solver.partition.sites import Sites, allot, inner, spread
from omt_uv.solver.transport.convex_domain import ConvexPolygon
from omt_uv.solver.transport.power_diagram import power_diagram

SQUARE = ConvexPolygon(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]))


def scattered(count, columns=6, seed=0):
    V, F = meshes.grid(columns, columns)
    rng = np.random.default_rng(seed)
    sites = Sites(rng.integers(len(F), size=count), inner(rng.dirichlet(np.ones(3), count)))
    mesh = WindowMesh(V, F)
    return V, F, mesh, sites, polar_coordinates(mesh, sites, np.full(count, 5.0), np.arange(count))


def test_sites_see_one_another_where_they_are():
    V, F, mesh, sites, pairs = scattered(9)
    i, j, place, distance = sights(mesh, sites, pairs)
    at = sites.positions(V, F)
    assert {(a, b) for a, b in zip(i.tolist(), j.tolist(), strict=True)} == {
        (a, b) for a in range(9) for b in range(9) if a != b
    }
    away = at[j] - at[i]
    assert distance == pytest.approx(np.linalg.norm(away, axis=1), abs=1e-7)
    assert np.hypot(*place.T) == pytest.approx(distance, rel=1e-6)
    # Directions of one site are turned by one angle.
    turn = (place @ [1, 1j]) / (away[:, :2] @ [1, 1j])
    for k in range(9):
        mine = turn[i == k]
        assert np.minimum(np.abs(mine - mine[0]), np.abs(mine / mine.conj() - mine[0] / mine[0].conj())).max() < 1e-4


@pytest.mark.parametrize("count", [3, 12])
def test_sites_go_to_the_centroids_of_their_cells(count):
    V, F, _, sites, pairs = scattered(count)
    moved = karcher_means(sites, pairs, geodesic_cells(pairs, np.zeros(count), face_areas(V, F)))
    expected = power_diagram(sites.positions(V, F)[:, :2] - 0.5, np.zeros(count), SQUARE).centroid + 0.5
    assert np.abs(moved.positions(V, F)[:, :2] - expected).max() < 2e-3
    assert moved.barycentric.sum(axis=1) == pytest.approx(1) and (moved.barycentric > 0).all()


def test_masses_pull_the_means():
    """A square twice as heavy on its right half: its mean lies at 7 / 12."""
    V, F, _, sites, pairs = scattered(1)
    mass = face_areas(V, F) * np.where(V[F].mean(axis=1)[:, 0] > 0.5, 2.0, 1.0)
    moved = karcher_means(sites, pairs, geodesic_cells(pairs, np.zeros(1), mass))
    assert moved.positions(V, F)[0, :2] == pytest.approx([7 / 12, 0.5], abs=2e-3)


def test_sites_that_are_much_too_near_are_pushed_apart_and_no_others():
    V, F, mesh, _, _ = scattered(1)
    at = np.array([[x, y] for x in (0.17, 0.5, 0.83) for y in (0.2, 0.55, 0.8)])
    at = np.concatenate([at, [[0.52, 0.55]]])
    corner = V[F][:, :, :2]
    triangle, share = [], []
    for p in at:
        weights = np.array([np.linalg.solve(np.vstack([c.T, np.ones(3)]), np.append(p, 1)) for c in corner])
        triangle.append(int(weights.min(axis=1).argmax()))
        share.append(weights[triangle[-1]])
    sites = Sites(np.array(triangle), inner(np.array(share)))
    radius = np.full(10, 5.0)
    pairs = polar_coordinates(mesh, sites, radius, np.arange(10))
    found, _ = spaced(mesh, sites, pairs, np.full(10, 0.17), radius)
    before, after = (s.positions(V, F)[:, :2] for s in (sites, found))
    moved = np.linalg.norm(after - before, axis=1) > 1e-3
    assert moved[[4, 9]].all() and np.linalg.norm(after[4] - after[9]) > 2 * np.linalg.norm(before[4] - before[9])
    # The line between them is the way that they go.
    assert np.abs((after - before)[[4, 9], 1]).max() < 0.02 < np.abs((after - before)[[4, 9], 0]).max()
    assert not moved[[0, 2, 6, 8]].any()


def test_cells_are_allotted_in_proportion():
    cases = [([1, 1], 4, [2, 2]), ([3, 1], 4, [3, 1]), ([100, 1, 1], 3, [1, 1, 1]), ([10, 1], 5, [4, 1])]
    for mass, count, expected in cases:
        assert allot(np.array(mass, float), count).tolist() == expected
    V, F, *_ = scattered(1)
    part = (V[F].mean(axis=1)[:, 0] > 0.5).astype(int)
    found = spread(V, F, face_areas(V, F), part, np.array([3, 7]), 0)
    assert np.bincount(part[found.triangle]).tolist() == [3, 7]
    again = spread(V, F, face_areas(V, F), part, np.array([3, 7]), 0)
    np.testing.assert_array_equal(found.triangle, again.triangle)
