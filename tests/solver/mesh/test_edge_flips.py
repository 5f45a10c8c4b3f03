"""Flips of edges: they keep area and connectivity, undo themselves, and make a triangulation Delaunay."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.edge_flips import (
    flip_in_place,
    flip_until_none,
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


def glued(seed, count=12):
    """Opposite halfedges of triangles that are glued to one another in any way, two of them to themselves, as around
    the tips of cones, and a number for each of their edges, the worst of all within a triangle."""
    rng = np.random.default_rng(seed)
    ends = np.vstack([[[0, 1], [5, 3]], rng.permutation(np.r_[2, 4, 6 : 3 * count - 2]).reshape(-1, 2)])
    twin = np.full(3 * count, -1)
    twin[ends[:, 0]], twin[ends[:, 1]] = ends[:, 1], ends[:, 0]
    edges = np.flatnonzero(twin > np.arange(len(twin)))
    score = dict(zip(edges.tolist(), rng.normal(size=len(edges)) - 0.5, strict=True))
    return twin, {**score, 0: -9.0, 3: -8.0}


@pytest.mark.parametrize("seed", range(8))
def test_rounds_flip_the_worst_edges_of_their_triangles_and_none_within_one(seed):
    twin, score = glued(seed)
    inside = {h for h in score if h // 3 == twin[h] // 3}
    flipped = []

    def flip(several):
        asking = {h for h, x in score.items() if x < 0} - inside
        rivals = {h: [g for g in asking if {h // 3, twin[h] // 3} & {g // 3, twin[g] // 3}] for h in asking}
        assert set(several.tolist()) == {h for h in asking if score[h] == min(score[g] for g in rivals[h])}
        flipped.extend(several.tolist())
        score.update(dict.fromkeys(several.tolist(), 1.0))

    found = flip_until_none(twin, lambda some: np.array([score[h] for h in some.tolist()]), flip, 100)
    assert found == (len(flipped), True) and flipped
    assert {0, 3} <= {h for h in score if score[h] < 0} <= inside
