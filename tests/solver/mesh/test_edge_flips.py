"""Flips of edges: they keep area and connectivity, undo themselves, and make a triangulation Delaunay."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.edge_flips import (
    LEAST_CORNER,
    flip_in_place,
    flip_until_none,
    longer_diagonals,
    shorter_diagonals,
)
from omt_uv.solver.mesh.geometry import angles_from_lengths, halfedge_lengths, signed_areas
from omt_uv.solver.mesh.topology import pair_keys, twins


def one_in_a_convex_pair(uv, F):
    """The halfedge of an inner edge whose two triangles make a convex quadrangle."""
    twin = twins(F)
    for h in np.flatnonzero(twin > np.arange(len(twin))):
        G, t = F.copy(), twin.copy()
        flip_in_place(G, t, np.array([h]))
        if (signed_areas(uv, G) > 0).all():
            return np.array([h])
    raise ValueError("there is none")


def test_a_flip_keeps_area_and_gives_the_twins_of_the_new_triangles():
    V, F = meshes.random_disk()
    uv, h = V[:, :2], one_in_a_convex_pair(V[:, :2], F)
    G, twin = F.copy(), twins(F)
    flip_in_place(G, twin, h)
    assert (G != F).any()
    np.testing.assert_array_equal(twin, twins(G))
    assert signed_areas(uv, G).sum() == pytest.approx(signed_areas(uv, F).sum(), rel=1e-12)
    # The two ends of the edge have one triangle less each, the two corners opposite to it one more.
    change = np.bincount(G.ravel(), minlength=len(V)) - np.bincount(F.ravel(), minlength=len(V))
    assert sorted(change[change != 0]) == [-1, -1, 1, 1]


def test_what_is_carried_stays_with_the_outer_edges():
    V, F = meshes.random_disk()
    h = one_in_a_convex_pair(V[:, :2], F)
    G, twin = F.copy(), twins(F)
    carried = pair_keys(F.ravel(), F[:, [1, 2, 0]].ravel())
    flip_in_place(G, twin, h, carried)
    outer = np.ones(F.size, bool)
    outer[3 * (np.concatenate([h, twins(F)[h]]) // 3) + 1] = False
    np.testing.assert_array_equal(carried[outer], pair_keys(G.ravel(), G[:, [1, 2, 0]].ravel())[outer])


def test_two_flips_of_an_edge_give_its_triangles_again():
    V, F = meshes.random_disk()
    h = one_in_a_convex_pair(V[:, :2], F)
    G, twin = F.copy(), twins(F)
    flip_in_place(G, twin, h)
    flip_in_place(G, twin, 3 * (h // 3) + 1)
    assert {frozenset(t) for t in G.tolist()} == {frozenset(t) for t in F.tolist()}


def test_flips_until_none_end_at_delaunay():
    V, F = meshes.random_disk(height=0.0)
    uv = V[:, :2]
    rng = np.random.default_rng(1)
    G, twin = F.copy(), twins(F)
    # Away from Delaunay first, by random flips of convex pairs.
    for _ in range(20):
        h = rng.choice(np.flatnonzero(twin >= 0), 1)
        H, t = G.copy(), twin.copy()
        flip_in_place(H, t, h)
        if (signed_areas(uv, H) > 1e-6).all():
            G, twin = H, t

    def excess(h):
        """pi minus the sum of the angles opposite to an edge: negative where it is not Delaunay."""
        angle = angles_from_lengths(halfedge_lengths(uv, G).reshape(-1, 3)).ravel()
        return np.pi + 1e-9 - angle[h] - angle[twin[h]]

    flips, ended = flip_until_none(twin, excess, lambda h: flip_in_place(G, twin, h), 100)
    assert flips and ended
    np.testing.assert_array_equal(twin, twins(G))
    assert (signed_areas(uv, G) > 0).all() and (excess(np.flatnonzero(twin >= 0)) >= 0).all()


def test_convex_quads_are_cut_along_the_shorter_diagonal():
    """Of parallelograms of all shapes, in all places, apart from one another."""
    rng = np.random.default_rng(5)
    corner, one, other = (rng.normal(size=(200, 3)) for _ in range(3))
    V = np.stack([corner, corner + one, corner + one + other, corner + other], axis=1).reshape(-1, 3)
    quads = np.arange(800).reshape(-1, 4)
    sine = np.linalg.norm(np.cross(one, other), axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
    thick = sine > 0.3
    cut = shorter_diagonals(V, quads, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    assert thick.sum() > 100
    np.testing.assert_array_equal(np.sort(cut, axis=1), quads)
    mine, left = (np.linalg.norm(V[cut[:, k]] - V[cut[:, k + 2]], axis=1)[thick] for k in (0, 1))
    assert (mine <= left).all()


@pytest.mark.parametrize("seed", range(3))
def test_of_any_quads_those_are_turned_that_bulge_out_and_whose_other_diagonal_is_shorter(seed):
    """Corner by corner: flat ones, crooked ones and arrowheads, apart from one another."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform(0, 1, (300, 4, 2))
    V = np.concatenate([flat, 0.1 * rng.normal(size=(300, 4, 1)) * (np.arange(300) % 2)[:, None, None]], axis=2)
    V, quads = V.reshape(-1, 3), np.arange(1200).reshape(-1, 4)
    found = longer_diagonals(V, quads, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    seen = set()
    for q, turned in zip(quads, found, strict=True):
        a, b, c, d = p = V[q]
        own = np.cross(c - a, d - b)
        corners = [np.cross(p[(k + 1) % 4] - p[k], p[k - 1] - p[k]) @ own / (own @ own) for k in range(4)]
        if min(abs(x - LEAST_CORNER) for x in corners) < 1e-9:
            continue
        bulges = min(corners) > LEAST_CORNER
        assert turned == (bulges and np.linalg.norm(d - b) < np.linalg.norm(c - a))
        seen.add((bulges, bool(turned)))
    assert seen == {(True, True), (True, False), (False, False)}
