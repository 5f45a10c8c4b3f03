"""Flips restore, keep the metric, and end in a Delaunay triangulation."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal import intrinsic_triangulation as intrinsic
from omt_uv.solver.mesh.topology import boundary_loops, next_halfedge, previous_halfedge, twins


def heron(log_length):
    a, b, c = np.exp(log_length.reshape(-1, 3)).T
    s = (a + b + c) / 2
    return np.sqrt(np.maximum(s * (s - a) * (s - b) * (s - c), 0))


def cycles(tri):
    """Every triangle as its cyclically smallest list of (vertex, length of the outgoing edge)."""
    length = np.round(tri.log_length.reshape(-1, 3), 9)
    rows = []
    for t, sides in zip(tri.triangles, length, strict=True):
        k = int(t.argmin())
        rows.append(tuple(np.roll(t, -k)) + tuple(np.roll(sides, -k)))
    return sorted(rows)


def consistent(tri):
    """Twins point back at each other, join the same two vertices the other way round, and share a length."""
    h = np.flatnonzero(tri.twin >= 0)
    flat, g = tri.triangles.ravel(), tri.twin[h]
    assert (tri.twin[g] == h).all()
    assert (flat[h] == flat[next_halfedge(g)]).all() and (flat[g] == flat[next_halfedge(h)]).all()
    np.testing.assert_array_equal(tri.log_length[h], tri.log_length[g])


def independent(tri, rng):
    h = rng.permutation(np.flatnonzero(tri.twin > np.arange(len(tri.twin))))
    taken, chosen = set(), []
    for e in h:
        pair = {e // 3, tri.twin[e] // 3}
        if not pair & taken:
            taken |= pair
            chosen.append(e)
    return np.array(chosen)


def convex(tri, h):
    """Those of the halfedges whose quadrilateral is convex, so that flipping keeps its area."""
    before, after = heron(tri.log_length), heron(intrinsic.flip(tri, h, intrinsic.euclidean_diagonal).log_length)
    t, s = h // 3, tri.twin[h] // 3
    return h[np.isclose(before[t] + before[s], after[t] + after[s])]


@pytest.mark.parametrize("diagonal", [intrinsic.ptolemy_diagonal, intrinsic.euclidean_diagonal])
def test_flipping_twice_restores(diagonal):
    rng = np.random.default_rng(1)
    V, F = meshes.grid(9, 7)
    tri = intrinsic.from_mesh(V + 0.02 * rng.normal(size=V.shape) * [1, 1, 0], F)
    h = convex(tri, independent(tri, rng))
    assert len(h) > 10
    once = intrinsic.flip(tri, h, diagonal)
    consistent(once)
    assert cycles(once) != cycles(tri)
    # The new diagonal is the middle halfedge of both triangles of the flipped pair.
    twice = intrinsic.flip(once, 3 * (h // 3) + 1, diagonal)
    consistent(twice)
    assert cycles(twice) == cycles(tri)


def test_ptolemy_commutes_with_conformal_scaling():
    V, F = meshes.bumpy(8, 8)
    rng = np.random.default_rng(2)
    tri, u = intrinsic.from_mesh(V, F), rng.normal(size=len(V))
    h = independent(tri, rng)
    after = intrinsic.flip(tri, h, intrinsic.ptolemy_diagonal).scaled(u)
    scaled = intrinsic.IntrinsicTriangulation(tri.triangles, tri.twin, tri.scaled(u))
    np.testing.assert_allclose(after, intrinsic.flip(scaled, h, intrinsic.ptolemy_diagonal).log_length, atol=1e-12)


def test_euclidean_delaunay_keeps_area_and_meets_its_condition():
    total = 0
    for V, F in (meshes.head(20), meshes.bumpy(12, 12, 2.0), meshes.random_disk(200, height=3.0)):
        tri = intrinsic.from_mesh(V, F)
        delaunay, flips = intrinsic.make_delaunay(tri, intrinsic.euclidean_diagonal)
        consistent(delaunay)
        total += flips
        assert heron(delaunay.log_length).sum() == pytest.approx(heron(tri.log_length).sum(), rel=1e-9)
        cosine = intrinsic.opposite_cosines(delaunay.log_length)
        inner = delaunay.twin >= 0
        assert (cosine[inner] + cosine[delaunay.twin[inner]]).min() > -1e-10
        assert intrinsic.make_delaunay(delaunay, intrinsic.euclidean_diagonal)[1] == 0
    assert total > 0


def test_delaunay_of_points_in_the_plane_is_scipys():
    from scipy.spatial import Delaunay

    V, F = meshes.random_disk(150, height=0.0)
    rng = np.random.default_rng(3)
    tri = intrinsic.from_mesh(V, F)
    for _ in range(4):
        # Spoil the triangulation, but only by flips of convex quadrilaterals.
        tri = intrinsic.flip(tri, convex(tri, independent(tri, rng)), intrinsic.euclidean_diagonal)
    back, flips = intrinsic.make_delaunay(tri, intrinsic.euclidean_diagonal)
    assert flips > 0
    expected = {tuple(sorted(t)) for t in Delaunay(V[:, :2]).simplices}
    assert {tuple(sorted(t)) for t in back.triangles} == expected


def test_split_boundary_edge_keeps_the_metric():
    V, F = meshes.single_triangle()
    tri = intrinsic.from_mesh(V, F)
    split, loop = intrinsic.split_boundary_edge(tri, boundary_loops(F)[0], len(V))
    assert sorted(loop) == [0, 1, 2, 3] and len(split.triangles) == 2
    assert heron(split.log_length).sum() == pytest.approx(heron(tri.log_length).sum())
    consistent(split)


def test_halfedge_conventions():
    V, F = meshes.bumpy(5, 5)
    twin = twins(F)
    h = np.arange(len(twin))
    assert (previous_halfedge(next_halfedge(h)) == h).all()
    assert (next_halfedge(next_halfedge(next_halfedge(h))) == h).all()
    (loop,) = boundary_loops(F)
    assert len(loop) == (twin < 0).sum()
    tail, head = F.ravel()[twin < 0], F[:, [1, 2, 0]].ravel()[twin < 0]
    assert set(zip(loop, np.roll(loop, -1), strict=True)) == set(zip(tail, head, strict=True))
