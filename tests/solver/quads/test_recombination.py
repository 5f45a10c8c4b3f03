"""What was made of quads and triangulated gets them back; what was not has none."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.topology import halfedges, pair_keys, twins
from omt_uv.solver.quads.recombination import quad_diagonals, with_shorter_diagonals


def quads_of(rows, columns, bend=0.3, seed=0):
    """A bent grid of crooked quads."""
    rng = np.random.default_rng(seed)
    i, j = np.divmod(np.arange((rows + 1) * (columns + 1)), columns + 1)
    V = np.column_stack([i, j + 0.2 * i, bend * np.sin(i) * np.cos(j)]) + rng.uniform(-0.08, 0.08, (len(i), 3))
    i, j = np.divmod(np.arange(rows * columns), columns)
    low = i * (columns + 1) + j
    return V, np.stack([low, low + columns + 1, low + columns + 2, low + 1], axis=1)


def triangulated(quads, seed=0):
    """Along diagonals that chance has chosen, the triangles in any order and from any corner on."""
    rng = np.random.default_rng(seed)
    turned = np.where(rng.random(len(quads))[:, None] < 0.5, quads, np.roll(quads, 1, axis=1))
    F = np.concatenate([turned[:, [0, 1, 2]], turned[:, [0, 2, 3]]])
    F = np.take_along_axis(F, (np.arange(3) + rng.integers(3, size=(len(F), 1))) % 3, axis=1)
    return F[rng.permutation(len(F))], pair_keys(turned[:, 0], turned[:, 2])


def inner(F):
    """Both halfedges of all inner edges (e,2)."""
    twin = twins(F)
    h = np.flatnonzero(twin > np.arange(len(twin)))
    return np.stack([h, twin[h]], axis=1)


def found(V, F, pair=None):
    """The keys of the diagonals."""
    pair = inner(F) if pair is None else pair
    tail, head = halfedges(F)
    h = pair[quad_diagonals(V, F, pair), 0]
    return set(pair_keys(tail[h], head[h]).tolist())


@pytest.mark.parametrize("seed", range(4))
def test_what_was_triangulated_gets_its_quads_back(seed):
    V, Q = quads_of(9, 12, seed=seed)
    F, diagonals = triangulated(Q, seed)
    assert found(V, F) == set(diagonals.tolist())


def test_turn_size_place_and_order_do_not_matter():
    V, Q = quads_of(6, 7)
    F, diagonals = triangulated(Q)
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    assert found(1e-3 * V @ turn.T + [5, -2, 1], F[::-1]) == set(diagonals.tolist())
    assert found(V, F, inner(F)[::-1, ::-1]) == set(diagonals.tolist())


@pytest.mark.parametrize("mesh", [meshes.icosphere(3), meshes.random_disk(), meshes.icosphere(0)])
def test_what_was_made_of_triangles_has_no_quads(mesh):
    """Pairs of equilateral triangles have corners that are 30 degrees off; of others some are quads by chance."""
    assert not found(*mesh)


def test_each_triangle_is_in_one_quad_and_none_is_where_it_may_not_be():
    V, Q = quads_of(8, 8)
    F, diagonals = triangulated(Q)
    pair, rng = inner(F), np.random.default_rng(0)
    chosen = pair[quad_diagonals(V, F, pair)]
    assert len(np.unique(chosen // 3)) == chosen.size
    barred = pair[rng.random(len(pair)) < 0.9]
    tail, head = halfedges(F)
    assert found(V, F, barred) <= set(pair_keys(tail[barred[:, 0]], head[barred[:, 0]]).tolist())
    assert len(quad_diagonals(V, F, pair[:0])) == 0


def test_a_sharp_fold_is_no_diagonal():
    """The edges of a box are no diagonals though triangles on both sides of them fit as well as those of its sides."""
    V = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    Q = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    F, diagonals = triangulated(Q)
    assert found(V, F) == set(diagonals.tolist())


def test_faces_to_opposite_sides_and_a_quad_that_would_be_there_twice_are_none():
    V, Q = quads_of(1, 1, bend=0)
    F = np.concatenate([Q[:, [0, 1, 2]], Q[:, [0, 2, 3]]])
    assert quad_diagonals(V, F, np.array([[2, 3]])).tolist() == [True]
    turned = np.stack([F[0], F[1][[0, 2, 1]]])
    assert quad_diagonals(V, turned, np.array([[2, 5]])).tolist() == [False]
    # The same quad from below, along its other diagonal: a pillow.
    both = np.concatenate([F, Q[:, [1, 0, 3]], Q[:, [1, 3, 2]]])
    assert not quad_diagonals(V, both, np.array([[2, 3], [8, 9]])).any()


@pytest.mark.parametrize("seed", range(3))
def test_other_diagonals_leave_all_other_edges_as_they_are(seed):
    V, Q = quads_of(5, 6, seed=seed)
    F, diagonals = triangulated(Q, seed)
    pair = inner(F)
    chosen = pair[quad_diagonals(V, F, pair)]
    now, place = with_shorter_diagonals(V, F, chosen)
    assert sorted(place.tolist()) == list(range(3 * len(F)))
    (tail, head), (a, b) = halfedges(F), halfedges(now)
    sides = ~np.isin(np.arange(3 * len(F)), chosen)
    np.testing.assert_array_equal(a[place][sides], tail[sides])
    np.testing.assert_array_equal(b[place][sides], head[sides])
    # Halves of a diagonal are joined as before, and its quad is cut along the shorter one.
    h, g = place[chosen].T
    np.testing.assert_array_equal(a[h], b[g])
    before = np.linalg.norm(V[tail[chosen[:, 0]]] - V[head[chosen[:, 0]]], axis=1)
    after = np.linalg.norm(V[a[h]] - V[b[h]], axis=1)
    assert (after <= before).all() and (after < before).any()
    np.testing.assert_array_equal(now, with_shorter_diagonals(V, now, place[chosen])[0])


@pytest.mark.parametrize("angle, taken", [(6.0, True), (9.0, True), (12.0, True)])
def test_quads_may_have_acute_corners(angle, taken):
    """A dart of few degrees beside good quads is a quad all the same; what is nearly straight is none."""
    V, Q = quads_of(4, 4, bend=0.0)
    n, a = len(V), np.radians(angle / 2)
    far = 2.0
    kite = np.array([[0, 0], [np.cos(a), -np.sin(a)], [np.cos(a) + 0.25, 0], [np.cos(a), np.sin(a)]]) * far + 20
    V = np.concatenate([V, np.column_stack([kite, np.zeros(4)])])
    F, _ = triangulated(Q)
    F = np.concatenate([F, [[n, n + 1, n + 2], [n, n + 2, n + 3]]])
    pair = inner(F)
    tail, head = halfedges(F)
    mine = np.isin(tail[pair[:, 0]], (n, n + 2)) & np.isin(head[pair[:, 0]], (n, n + 2))
    assert mine.sum() == 1 and quad_diagonals(V, F, pair)[mine].tolist() == [taken]


def test_quads_have_no_straight_corners():
    V, Q = quads_of(4, 4, bend=0.0)
    n = len(V)
    flat = np.array([[0, 0, 0], [1, -0.02, 0], [2, 0, 0], [1, 1, 0.0]]) + 20
    F = np.concatenate([triangulated(Q)[0], [[n, n + 1, n + 3], [n + 1, n + 2, n + 3]]])
    pair = inner(F)
    mine = (F.ravel()[pair] >= n).all(axis=1)
    assert mine.sum() == 1 and not quad_diagonals(np.concatenate([V, flat]), F, pair)[mine].any()
