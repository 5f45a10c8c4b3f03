"""Splits, collapses, flips and shares of vertices against what is found edge by edge."""

from __future__ import annotations

from fractions import Fraction

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.geometry import face_areas, face_normals
from omt_uv.solver.mesh.topology import halfedges, pair_keys, twins
from omt_uv.solver.remeshing.edits import delaunay_flips, split_collapse, vertex_count


def bent():
    V, F = meshes.bumpy(7, 6)
    return V + 0.03 * np.random.default_rng(0).normal(size=V.shape), F


def ears():
    """Few triangles, two of which hang on the rest by one side."""
    return meshes.bumpy(3, 2)


def tipped():
    """A ball, on some of whose faces a vertex with three edges stands."""
    V, F = meshes.icosphere(1)
    chosen = np.arange(0, len(F), 7)
    tip = len(V) + np.arange(len(chosen))
    a, b, c = F[chosen].T
    fans = [np.column_stack([x, y, tip]) for x, y in ((a, b), (b, c), (c, a))]
    return np.concatenate([V, 1.1 * V[F[chosen]].mean(axis=1)]), np.concatenate([np.delete(F, chosen, 0), *fans])


MESHES = {
    "tips": tipped,
    "disk": bent,
    "ears": ears,
    "ball": lambda: meshes.icosphere(1),
    "ring": lambda: meshes.torus(9, 6),
    "cube": meshes.cube,
}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]()


def edges_of(F):
    found = {}
    for t, f in enumerate(F):
        for k in range(3):
            found.setdefault(frozenset((int(f[k]), int(f[(k + 1) % 3]))), []).append((t, int(f[(k + 2) % 3])))
    return found


def test_splits_cut_both_triangles_of_an_edge(mesh):
    V, F = mesh
    h = split_collapse.independent_splits(F, np.random.default_rng(0).permutation(3 * len(F)))
    tail, head = halfedges(F)
    edit = split_collapse.split_edges(V, F, h)
    expected = {frozenset(f) for f in F.tolist()}
    for k, (a, b) in enumerate(zip(tail[h], head[h], strict=True)):
        np.testing.assert_allclose(edit.points[len(V) + k], (V[a] + V[b]) / 2)
        assert edit.split_ends[k].tolist() == [a, b] and edit.origin[len(V) + k] == -1
        for t, c in edges_of(F)[frozenset((int(a), int(b)))]:
            expected.remove(frozenset(F[t].tolist()))
            expected |= {frozenset((int(a), len(V) + k, c)), frozenset((int(b), len(V) + k, c))}
    assert {frozenset(f) for f in edit.triangles.tolist()} == expected
    # They look the same way, and the first halves are where their triangles were.
    assert face_areas(edit.points, edit.triangles).sum() == pytest.approx(face_areas(V, F).sum())
    np.testing.assert_allclose(face_normals(edit.points, edit.triangles[: len(F)]), face_normals(V, F), atol=1e-12)
    np.testing.assert_array_equal(edit.origin[: len(V)], np.arange(len(V)))


def test_chosen_splits_are_those_that_come_first(mesh):
    _, F = mesh
    h, twin = np.random.default_rng(1).permutation(3 * len(F))[: len(F)], twins(F)
    rank = np.full(len(F), len(h))
    for k, x in reversed(list(enumerate(h))):
        rank[x // 3] = k
        if twin[x] >= 0:
            rank[twin[x] // 3] = k
    for k, x in reversed(list(enumerate(h))):
        rank[x // 3] = min(rank[x // 3], k)
    expected = []
    for k, x in enumerate(h):
        pair = {x // 3} | ({twin[x] // 3} if twin[x] >= 0 else set())
        before = {t for y in h[:k] for t in ({y // 3} | ({twin[y] // 3} if twin[y] >= 0 else set()))}
        if not pair & before:
            expected.append(x)
    assert split_collapse.independent_splits(F, h).tolist() == expected


def test_what_may_collapse_is_what_keeps_the_surface(mesh):
    """Every edge alone, by counting what is left: Euler's number, edges of two faces, one fan at every vertex."""
    V, F = mesh
    h = split_collapse.interior_edges(F, np.zeros(0, np.int64))
    before = shape_of(F)
    tail, head = halfedges(F)
    assert {frozenset((int(a), int(b))) for a, b in zip(tail[h], head[h], strict=True)} == {
        e for e, t in edges_of(F).items() if len(t) == 2
    }
    fixed = np.zeros(len(V), bool)
    for x in h[:: max(len(h) // 20, 1)]:
        edit = split_collapse.collapse_edges(V, F, np.array([x]), fixed, 1, split_collapse.ANY_COSINE)
        if len(edit.points) == len(V):
            continue
        assert shape_of(edit.triangles) == before and len(edit.triangles) == len(F) - 2
        keep = edit.new_number[[tail[x], head[x]]]
        assert keep[0] == keep[1]
        outer = [v for v in (tail[x], head[x]) if any(len(t) == 1 for e, t in edges_of(F).items() if v in e)]
        place = V[outer[0]] if outer else (V[tail[x]] + V[head[x]]) / 2
        np.testing.assert_allclose(edit.points[keep[0]], place)
        others = np.setdiff1d(np.arange(len(V)), [tail[x], head[x]])
        np.testing.assert_array_equal(edit.points[edit.new_number[others]], V[others])


def shape_of(F):
    """Euler's number, edges by how many faces they have, and whether every vertex has one fan."""
    edges = edges_of(F)
    counts = sorted({len(t) for t in edges.values()})
    for v in np.unique(F):
        ring = [frozenset(f.tolist()) - {v} for f in F[(v == F).any(axis=1)]]
        groups = []
        for pair in ring:
            touching = [g for g in groups if g & pair]
            groups = [g for g in groups if not g & pair] + [frozenset().union(pair, *touching)]
        assert len(groups) == 1 and len(set(ring)) == len(ring)
    return len(np.unique(F)) - len(edges) + len(F), counts, sum(len(t) == 1 for t in edges.values()) > 0


def test_collapses_at_once_are_apart_and_turn_no_face_too_far(mesh):
    V, F = mesh
    h = np.random.default_rng(0).permutation(split_collapse.interior_edges(F, np.zeros(0, np.int64)))
    edit = split_collapse.collapse_edges(V, F, h, np.zeros(len(V), bool), 5)
    gone = np.flatnonzero(np.bincount(edit.new_number, minlength=len(edit.points))[edit.new_number] > 1)
    assert len(V) - len(edit.points) <= 5
    pairs = {}
    for v in gone:
        pairs.setdefault(edit.new_number[v], []).append(v)
    touched = [np.flatnonzero(np.isin(F, pair).any(axis=1)) for pair in pairs.values()]
    assert len(np.unique(np.concatenate(touched))) == sum(map(len, touched))
    assert shape_of(edit.triangles) == shape_of(F)
    for f, normal in zip(F, face_normals(V, F), strict=True):
        g = edit.new_number[f]
        if len(set(g.tolist())) == 3:
            assert face_normals(edit.points, g[None])[0] @ normal >= 0.3 - 1e-12


def test_cotangents_are_those_of_opposite_angles(mesh):
    V, F = mesh
    found = delaunay_flips._cotangents(V, F)
    for t, f in enumerate(F):
        for k in range(3):
            u, v = V[f[k]] - V[f[(k + 2) % 3]], V[f[(k + 1) % 3]] - V[f[(k + 2) % 3]]
            assert found[t, k] == pytest.approx(u @ v / np.linalg.norm(np.cross(u, v)), abs=1e-12)


def test_vertices_are_joined_where_an_edge_says_so(mesh):
    _, F = mesh
    edges = edges_of(F)
    a, b = np.random.default_rng(0).integers(0, F.max() + 1, (2, 200))
    expected = [frozenset((int(x), int(y))) in edges for x, y in zip(a, b, strict=True)]
    assert delaunay_flips._already_joined(F, a, b).tolist() == expected
    keys = np.sort(pair_keys(*np.random.default_rng(1).integers(0, 9, (2, 20))))
    some = pair_keys(*np.random.default_rng(2).integers(0, 9, (2, 50)))
    np.testing.assert_array_equal(delaunay_flips._is_in(some, keys), np.isin(some, keys))


@pytest.mark.parametrize("fold", [0.0, 0.5, 1.0, 1.4, 2.0])
def test_a_flip_is_upright_where_its_faces_lean_little(fold):
    """A square folded along a diagonal: the new faces lean against the old ones, and against each other, as differences
    of normals say."""
    c, s = np.cos(fold), np.sin(fold)
    P = np.array([[0, 0, 0], [1, 1, 0], [0, 1, 0], [1, 0, 0.0]])
    axis = np.array([1, 1, 0]) / np.sqrt(2)
    P[3] = P[3] * c + np.cross(axis, P[3]) * s + axis * (axis @ P[3]) * (1 - c)
    i, j, k, far = (np.array([x]) for x in range(4))

    def normal(*corners):
        a, b, c = P[list(corners)]
        n = np.cross(b - a, c - a)
        return n / np.linalg.norm(n)

    old = normal(0, 1, 2) + normal(1, 0, 3)
    old /= np.linalg.norm(old)
    new = normal(0, 3, 2), normal(1, 2, 3)
    expected = min(old @ n for n in new) > 0.5 and new[0] @ new[1] > 0
    assert delaunay_flips._unfolded(P, i, j, k, far)[0] == expected


@pytest.mark.parametrize("seed", range(20))
def test_whole_numbers_are_shared_out_by_largest_remainders(seed):
    rng = np.random.default_rng(seed)
    proportion, least = rng.integers(1, 20, 5).astype(float), rng.integers(0, 6, 5)
    count = int(least.sum() + rng.integers(0, 40))
    found = vertex_count.apportion(count, proportion, least)
    assert found.sum() == count and (found >= least).all()
    # In exact fractions: those below their least get it, the others share what is left.
    free = set(range(5))
    while True:
        room = count - sum(int(least[k]) for k in range(5) if k not in free)
        whole = sum(int(proportion[k]) for k in free)
        share = {k: Fraction(room * int(proportion[k]), whole) for k in free} if whole else {}
        low = {k for k in free if share[k] < least[k]}
        if not low:
            break
        free -= low
    for k in range(5):
        if k in free:
            assert abs(Fraction(int(found[k])) - share[k]) < 1
        else:
            assert found[k] in (least[k], least[k] + 1)
    # No one has been rounded up whose remainder is smaller than that of one who has not.
    up = [share[k] - int(share[k]) for k in free if found[k] > share[k]]
    down = [share[k] - int(share[k]) for k in free if found[k] < share[k]]
    if up and down and not (set(range(5)) - free):
        assert min(up) >= max(down)


def test_edge_lengths_are_those_of_equilateral_triangles():
    """A hexagon of seven vertices with sides of one: area and boundary lead back to the length."""
    area, boundary = 6 * np.sqrt(3) / 4, 6.0
    for rings in (1, 2, 5):
        count = 1 + 3 * rings * (rings + 1)
        # All inner vertices stand for two triangles; those of the boundary for less.
        length = vertex_count.edge_length(rings**2 * area, rings * boundary, count)
        assert length == pytest.approx(1, rel=0.25 / rings)
    assert vertex_count.edge_length(np.sqrt(3) / 2 * 400, 0.0, 400) == pytest.approx(1)
