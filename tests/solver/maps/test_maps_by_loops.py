"""Pieces of what measures and lays out maps, against loops over faces, edges and points."""

from __future__ import annotations

from collections import Counter, defaultdict
from itertools import combinations, pairwise
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps import (
    boxes,
    contacts,
    development,
    distortion,
    embedding,
    energy,
    local_untangle,
    overlap,
    polygon_elements,
    upright,
)
from omt_uv.solver.mesh import geometry
from omt_uv.solver.mesh.geometry import face_areas, signed_areas


def rough(seed=0, n=40):
    """A flat disk in triangles, its places with noise that folds some of them: V (n,3), F (m,3), uv (n,2)."""
    V, F = meshes.random_disk(n, seed)
    rng = np.random.default_rng(seed)
    return V, F, V[:, :2] + rng.normal(0, 0.08, (len(V), 2))


def cross(a, b):
    return a[0] * b[1] - a[1] * b[0]


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.99, 1.0])
def test_quantiles_are_the_first_values_that_reach_the_share(share):
    rng = np.random.default_rng(3)
    values, weights = rng.normal(size=17), rng.integers(1, 5, 17).astype(float)
    reached = [v for v in values if weights[values <= v].sum() / weights.sum() >= share]
    assert distortion._weighted_quantile(values, weights, share) == min(reached)


def test_corners_are_welded_by_their_vertex_and_place():
    rng = np.random.default_rng(1)
    F = rng.integers(0, 6, (20, 3))
    uv = rng.integers(0, 2, (20, 3, 2)) * [3.0, 2.0] + rng.uniform(-1, 1, (20, 3, 2)) * 1e-9 + 0.5
    found = distortion._welded_corners(F, uv).ravel()
    keys = [(v, round(p[0] - 0.5), round(p[1] - 0.5)) for v, p in zip(F.ravel(), uv.reshape(-1, 2), strict=True)]
    for a, b in combinations(range(60), 2):
        assert (found[a] == found[b]) == (keys[a] == keys[b])
    assert not distortion._is_one_to_a_vertex(F, uv)
    assert distortion._is_one_to_a_vertex(F, np.arange(12).reshape(6, 2)[F])


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_shear_of_polygons_is_the_mean_over_what_is_not_turned(mirrored):
    # Quads, bent in space; a pentagon in three triangles; one quad turned over as a whole, one in a half.
    rng = np.random.default_rng(5)
    V = np.array([[x, y, 0.1 * x * y] for y in range(3) for x in range(4)], float) + rng.normal(0, 0.05, (12, 3))
    quads = [[y * 4 + x, y * 4 + x + 1, y * 4 + x + 5, y * 4 + x + 4] for y in range(2) for x in range(3)]
    F = np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])])
    polygons = np.repeat(np.arange(6), 2)
    uv = (V[:, :2] @ [[1.2, 0.1], [0.0, 0.8]])[F]
    uv[4:6] = uv[4:6, :, ::-1]
    uv[9, 2] = uv[9, :2].mean(axis=0) - 0.2 * (uv[9, 2] - uv[9, :2].mean(axis=0))
    flip = np.full(len(F), mirrored)
    if mirrored:
        uv = uv * [-1, 1]
    mesh = distortion._Triangles(V, F, uv, face_areas(V, F))
    found, turned = distortion._shear_of_polygons(mesh, polygons, flip)
    sign = -1 if mirrored else 1
    total = 0
    for k in range(6):
        corners = [
            (F[2 * k][0], uv[2 * k][0]),
            (F[2 * k][1], uv[2 * k][1]),
            (F[2 * k][2], uv[2 * k][2]),
            (F[2 * k + 1][2], uv[2 * k + 1][2]),
        ]
        shears, areas, forward = [], [], []
        for trio in ((0, 1, 2), (0, 2, 3), (1, 2, 3), (1, 3, 0)):
            p, q = np.array([V[corners[i][0]] for i in trio]), np.array([corners[i][1] for i in trio])
            x = (p[1] - p[0]) / np.linalg.norm(p[1] - p[0])
            y = p[2] - p[0] - x * (x @ (p[2] - p[0]))
            areas.append(np.linalg.norm(np.cross(p[1] - p[0], p[2] - p[0])) / 2)
            y /= np.linalg.norm(y)
            E = np.array([[x @ (p[i] - p[0]), y @ (p[i] - p[0])] for i in (1, 2)]).T
            s = np.linalg.svd(np.array([q[1] - q[0], q[2] - q[0]]).T @ np.linalg.inv(E), compute_uv=False)
            shears.append(s[0] / s[1])
            forward.append(sign * cross(q[1] - q[0], q[2] - q[0]) > 1e-3)
        if k == 4:
            continue  # its corners in the map are not those of one quad
        assert turned[k] == (not any(forward))
        used = np.array(areas) * (forward if any(forward) else 1)
        assert found[k] == pytest.approx(used @ shears / used.sum())
        total += turned[k]
    assert total == 1


@pytest.mark.parametrize("seed", range(3))
def test_vertices_of_uvs_are_joined_where_they_are_one_vertex_and_near(seed):
    V, F, uv = rough(seed, 20)
    corner = uv[F].reshape(-1, 2)
    apart = F[:, 0].argmax()
    corner[3 * apart] += 0.5
    points, faces, boundary = local_untangle.uv_vertices(F, corner, 1e-7)
    names, sides = {}, Counter()
    for k, (v, p) in enumerate(zip(F.ravel(), corner, strict=True)):
        names.setdefault((v, *np.round(p / 1e-7)), []).append(k)
    assert len(points) == len(names)
    for rows in names.values():
        assert len(set(faces.ravel()[rows])) == 1
        np.testing.assert_array_equal(points[faces.ravel()[rows[0]]], corner[rows[0]])
    for a, b, c in faces.tolist():
        for edge in ((a, b), (b, c), (c, a)):
            sides[frozenset(edge)] += 1
    outer = {v for edge, count in sides.items() if count == 1 for v in edge}
    assert set(np.flatnonzero(boundary)) == outer and len(outer) < len(points)


def test_sides_that_those_around_disagree_with_are_no_sides():
    V, F, _ = rough(1, 25)
    side = np.random.default_rng(2).integers(-1, 2, len(F))
    found = local_untangle._agreed(F, side)
    for k in range(len(F)):
        around = sum(side[j] for j in range(len(F)) if j != k and len(set(F[j]) & set(F[k])) == 2)
        assert found[k] == (side[k] if around * side[k] >= 0 else 0)
    assert (found != side).any() and (found != 0).any()


@pytest.mark.parametrize("height, is_folded", [(-1, True), (0, True), (1.9e-6, True), (2.1e-6, False), (1, False)])
def test_faces_with_a_millionth_of_their_longest_side_squared_are_folded(height, is_folded):
    uv, F = np.array([[0, 0], [3, 0], [1.5, 3 * height]], float), np.array([[0, 1, 2]])
    if abs(height) < 1:
        assert local_untangle._folded(uv, F, np.array([1])).tolist() == [is_folded]
        assert local_untangle._folded(uv, F[:, ::-1], np.array([-1])).tolist() == [is_folded]
    else:
        assert local_untangle._folded(uv, F, np.array([1])).tolist() == [height < 0]
    assert local_untangle._folded(uv, F, np.array([0])).tolist() == [False]


def test_areas_around_faces_are_means_over_means_at_their_corners():
    _, F, uv = rough(2)
    size = np.abs(signed_areas(uv, F))
    at = {v: size[(v == F).any(axis=1)].mean() for v in set(F.ravel().tolist())}
    np.testing.assert_allclose(local_untangle._area_around(uv, F), [np.mean([at[v] for v in f]) for f in F.tolist()])


def test_mean_value_weights_of_a_map_average_to_its_vertices_and_are_floaters():
    V, F, _ = rough(0)
    uv = V[:, :2]
    found = local_untangle._mean_value_matrix(uv, F).toarray()
    expected = np.zeros_like(found)
    for face in F:
        for k in range(3):
            v, a, b = face[k], face[(k + 1) % 3], face[(k + 2) % 3]
            x, y = uv[a] - uv[v], uv[b] - uv[v]
            half = np.tan(np.arccos(x @ y / np.linalg.norm(x) / np.linalg.norm(y)) / 2)
            expected[v, a] += half / np.linalg.norm(x)
            expected[v, b] += half / np.linalg.norm(y)
    expected /= expected.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    free = np.array([v for v in range(len(V)) if np.linalg.norm(uv[v]) < 0.6][:5])
    moved = uv.copy()
    moved[free] += 0.3
    solved = local_untangle._solved(moved, local_untangle._mean_value_matrix(uv, F), free)
    np.testing.assert_allclose(solved, uv, atol=1e-9)
    assert local_untangle._solved(moved, None, free[:0]) is moved


def test_a_grid_lists_what_touches_its_cells():
    rng = np.random.default_rng(0)
    tri = rng.uniform(0, 1, (30, 1, 2)) * [4, 1] + rng.uniform(0, 1, (30, 3, 2))
    grid = overlap._Grid(tri)
    side, low = grid.side, tri.reshape(-1, 2).min(axis=0)
    assert side == 8 and grid.extent == np.ptp(tri.reshape(-1, 2), axis=0).max()
    lists = defaultdict(list)
    for k, t in enumerate(tri):
        ends = t.min(axis=0), t.max(axis=0)
        (c0, r0), (c1, r1) = (np.minimum((x - low) / grid.extent * side, side - 1).astype(int) for x in ends)
        for column in range(c0, c1 + 1):
            for row in range(r0, r1 + 1):
                lists[column * side + row].append(k)
    for cell in range(side * side):
        assert grid.owner[grid.start[cell] : grid.start[cell + 1]].tolist() == lists[cell]
    assert grid.pair_count() == sum(len(x) * (len(x) - 1) // 2 for x in lists.values())
    points = rng.uniform(0, 1, (200, 2)) * [5, 2]
    expected = Counter()
    for i, p in enumerate(points):
        for k, t in enumerate(tri):
            sides = [cross(t[(c + 1) % 3] - t[c], p - t[c]) for c in range(3)]
            if min(sides) > 0 or max(sides) < 0:
                expected[i, k] += 1
    assert Counter(zip(*(x.tolist() for x in grid.inside(points)), strict=True)) == expected and len(expected) > 20
    np.testing.assert_array_equal(
        grid.covered_twice(points), [sum(i == k for k, _ in expected) > 1 for i in range(200)]
    )
    cells = np.minimum(((points - low) / grid.extent * side).astype(int).clip(0), side - 1)
    np.testing.assert_array_equal(grid.candidates(points), [len(lists[c * side + r]) for c, r in cells])
    # In parts, too, with their numbers.
    pairs = overlap.cover_pairs(tri, points)
    assert Counter(zip(*(x.tolist() for x in pairs), strict=True)) == expected


def test_areas_in_common_are_bounded_pair_by_pair():
    rng = np.random.default_rng(4)
    tri = rng.uniform(0, 1, (12, 1, 2)) + rng.uniform(0, 0.4, (12, 3, 2))
    grid, total = overlap._Grid(tri), 0.0
    ccw = [t if cross(t[1] - t[0], t[2] - t[0]) > 0 else t[::-1] for t in tri]
    lists = np.split(grid.owner, grid.start[1:-1])
    together = {(a, b) for cell in lists for a in cell for b in cell}

    def reach(one, other):
        return min(max(cross(one[(k + 1) % 3] - one[k], p - one[k]) for p in other) for k in range(3))

    for a, b in combinations(range(12), 2):
        if (a, b) in together:
            total += max(min(reach(ccw[a], ccw[b]), reach(ccw[b], ccw[a])), 0)
    assert grid.common_area() == pytest.approx(total) and total > 0


def test_points_are_compared_in_parts_of_so_many_pairs(monkeypatch):
    monkeypatch.setattr(overlap, "CHUNK", 10)
    each = np.random.default_rng(0).integers(0, 4, 60)
    points = np.arange(120.0).reshape(60, 2)
    parts = overlap._chunks(points, np.cumsum(each))
    np.testing.assert_array_equal(np.concatenate(parts), points)
    begin = 0
    for part in parts:
        count = each[begin : begin + len(part)].sum()
        begin += len(part)
        assert count < 10 + 4
    assert len(parts) >= each.sum() // 14


def test_points_are_drawn_by_area_and_evenly_within_each_triangle():
    tri = np.array([[[0, 0], [2, 0], [0, 2]], [[10, 0], [11, 0], [10, 1]]], float)
    points = overlap._draw(tri, np.array([2.0, 0.5]), 20_000, 0)
    first = points[:, 0] < 5
    assert first.mean() == pytest.approx(0.8, abs=0.01)
    np.testing.assert_allclose(points[first].mean(axis=0), [2 / 3, 2 / 3], atol=0.02)
    np.testing.assert_allclose(points[~first].mean(axis=0), [10 + 1 / 3, 1 / 3], atol=0.02)
    # An even triangle has a covariance of legs squared over 18 and -36.
    np.testing.assert_allclose(np.cov(points[first].T), [[4 / 18, -4 / 36], [-4 / 36, 4 / 18]], atol=0.01)


@pytest.mark.parametrize("few", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_boxes_meet_where_they_have_a_point_in_common(few, seed, monkeypatch):
    rng = np.random.default_rng(seed)
    low1, low2 = rng.integers(0, 12, (25, 2)).astype(float), rng.integers(0, 12, (30, 2)).astype(float)
    high1, high2 = low1 + rng.integers(0, 4, (25, 2)), low2 + rng.integers(0, 4, (30, 2))
    if not few:
        monkeypatch.setattr(boxes, "SWEPT_PER_BOX", 0)
    expected = [
        (i, j) for i in range(25) for j in range(30) if (low1[i] <= high2[j]).all() and (low2[j] <= high1[i]).all()
    ]
    found = boxes.box_pairs(low1, high1, low2, high2)
    assert list(zip(*(x.tolist() for x in found), strict=True)) == expected
    assert len(boxes.box_pairs(low1[:0], high1[:0], low2, high2)[0]) == 0


def test_a_sweep_finds_each_pair_along_its_way_once_and_gives_up_where_there_are_too_many():
    rng = np.random.default_rng(8)
    low1, low2 = rng.integers(0, 9, (12, 2)).astype(float), rng.integers(0, 9, (10, 2)).astype(float)
    high1, high2 = low1 + 1.0, low2 + 2.0
    for axis in range(2):
        pairs = Counter(zip(*(x.tolist() for x in boxes._swept(low1, high1, low2, high2, axis)), strict=True))
        begin1, end1, begin2, end2 = (x @ np.roll([1.0, boxes.SLANT], axis) for x in (low1, high1, low2, high2))
        expected = {(i, j) for i in range(12) for j in range(10) if begin1[i] <= end2[j] and begin2[j] <= end1[i]}
        assert set(pairs) == expected and set(pairs.values()) == {1}
    many = np.zeros((100, 2)), np.ones((100, 2))
    assert boxes._swept(*many, *many, 0) is None
    few = np.zeros((boxes.SWEPT_PER_BOX, 2)), np.ones((boxes.SWEPT_PER_BOX, 2))
    assert len(boxes._swept(*few, *few, 0)[0]) == boxes.SWEPT_PER_BOX**2


def test_boxes_along_the_sides_of_a_square_are_not_all_compared():
    along = np.linspace(0.0, 1.0, 101)[:-1]
    sides = np.concatenate([along, 1 + 1j * along, 1 - along + 1j, 1j * (1 - along)])
    low = np.column_stack([sides.real, sides.imag])
    assert len(boxes._swept(low, low + 0.01, low, low + 0.01, 0)[0]) < 20 * len(low)
    assert len(boxes.box_pairs(low, low + 0.01, low, low + 0.01)[0]) < 5 * len(low)


@pytest.mark.parametrize("depth", [0.0, 0.1])
def test_lines_pass_points_on_either_side_farther_than_the_depth(depth):
    rng = np.random.default_rng(1)
    a, b, p, q = rng.normal(size=(4, 300)) + 1j * rng.normal(size=(4, 300))
    found = contacts._passes(a, b, p, q, depth)
    off = [[((x - s) / (e - s) * abs(e - s)).imag for s, e, x in zip(a, b, t, strict=True)] for t in (p, q)]
    expected = [x * y < 0 and min(abs(x), abs(y)) > depth for x, y in zip(*off, strict=True)]
    np.testing.assert_array_equal(found, expected)
    assert 0 < found.sum() < 300


def test_turns_from_one_direction_to_another_are_counted_to_a_whole_one():
    along = np.exp(0.3j) * np.array([2, 1, 1, 1, 3])
    to = along * np.exp(1j * np.array([0.0, 0.0005, 0.002, np.pi, -0.1]))
    np.testing.assert_allclose(contacts._turn(to, along), [2 * np.pi, 2 * np.pi, 0.002, np.pi, 2 * np.pi - 0.1])


@pytest.mark.parametrize("across_long", [False, True])
def test_triangles_are_developed_from_their_parents_frames(across_long):
    V, F = meshes.bumpy(5, 4)
    local = development._local_frames(V, F)
    for t, face in enumerate(F):
        np.testing.assert_allclose(
            [abs(local[t, (k + 1) % 3] - local[t, k]) for k in range(3)],
            [np.linalg.norm(V[face[(k + 1) % 3]] - V[face[k]]) for k in range(3)],
        )
        assert local[t, 0] == 0 and local[t, 1].imag == 0 and local[t, 2].imag > 0
    parent, turn, shift = development._motions(local, F, across_long)
    roots = np.flatnonzero(parent == np.arange(len(F)))
    assert roots.tolist() == [0] and turn[0] == 1 and shift[0] == 0
    np.testing.assert_allclose(np.abs(turn), 1)
    for t in range(1, len(F)):
        shared = list(set(F[t]) & set(F[parent[t]]))
        assert len(shared) == 2
        own = [local[t, list(F[t]).index(v)] * turn[t] + shift[t] for v in shared]
        there = [local[parent[t], list(F[parent[t]]).index(v)] for v in shared]
        np.testing.assert_allclose(own, there, atol=1e-12)
    whole, offset = development._composed(parent, turn, shift)
    for t in range(len(F)):
        at, z = t, local[t]
        while parent[at] != at:
            z, at = turn[at] * z + shift[at], parent[at]
        np.testing.assert_allclose(whole[t] * local[t] + offset[t], z, atol=1e-12)
    w, gap = development.developed(V, F, across_long)
    corners = whole[:, None] * local + offset[:, None]
    for v in range(len(V)):
        mine = corners[v == F]
        assert w[v] == pytest.approx(mine.mean())
        assert gap[v] == pytest.approx(np.abs(mine - mine.mean()).max())


def test_hat_gradients_are_the_slopes_of_hats_and_slivers_have_finite_ones():
    p = np.random.default_rng(0).normal(size=(8, 3, 3))
    area, gradient = geometry.hat_gradients(p.reshape(-1, 3), np.arange(24).reshape(8, 3))
    for t in range(8):
        x = (p[t, 1] - p[t, 0]) / np.linalg.norm(p[t, 1] - p[t, 0])
        n = np.cross(x, p[t, 2] - p[t, 0])
        assert area[t] == pytest.approx(np.linalg.norm(np.cross(p[t, 1] - p[t, 0], p[t, 2] - p[t, 0])) / 2)
        y = np.cross(n / np.linalg.norm(n), x)
        flat = np.array([[x @ q, y @ q, 1] for q in p[t]])
        hats = np.linalg.inv(flat)[:2].T @ [1, 1j]
        np.testing.assert_allclose(gradient[t], hats)
    thin = np.array([[[0, 0, 0], [2, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [5, 0, 0]]], float)
    area, gradient = geometry.hat_gradients(thin.reshape(-1, 3), np.arange(6).reshape(2, 3))
    np.testing.assert_allclose(area, [0.5 * 2 * 2e-9, 0.5 * 1 * 5e-9])
    assert np.isfinite(gradient).all()


def test_charts_apart_keep_their_shapes_and_meet_nowhere():
    rng = np.random.default_rng(0)
    chart = np.repeat(np.arange(5), 4)
    uv = rng.uniform(0, 1, (20, 3, 2)) * [3, 1] + [5, -4]
    found = embedding._apart(uv, 5, chart)
    boxes_ = []
    for k in range(5):
        moved = found[chart == k] - uv[chart == k]
        np.testing.assert_allclose(moved, np.broadcast_to(moved[0, 0], moved.shape), atol=1e-12)
        boxes_.append((found[chart == k].min((0, 1)), found[chart == k].max((0, 1))))
    for (low, high), (low2, high2) in combinations(boxes_, 2):
        assert (low > high2).any() or (low2 > high).any()
    assert np.ptp(found.reshape(-1, 2), axis=0).max() < 3.3 * 3 and found.min() == 0


@pytest.mark.parametrize("turned", [False, True])
def test_edges_of_layouts_know_their_other_side_and_what_is_not_sound(turned):
    V, F, _ = rough(0, 20)
    edges = embedding._edges(F, np.full(len(F), turned))
    for k in range(3 * len(F)):
        a, b = F[k // 3, k % 3], F[k // 3, (k % 3 + 1) % 3]
        assert (edges.tail[k], edges.head[k]) == ((b, a) if turned else (a, b)) and edges.triangle[k] == k // 3
        others = [j for j in range(3 * len(F)) if j != k and {F[j // 3, j % 3], F[j // 3, (j % 3 + 1) % 3]} == {a, b}]
        assert edges.twin[k] == (others[0] if others else -1)
    assert edges.sound
    assert not embedding._edges(np.array([[0, 1, 2], [0, 1, 3]]), np.zeros(2, bool)).sound
    assert embedding._edges(np.array([[0, 1, 2], [0, 1, 3]]), np.array([False, True])).sound
    assert not embedding._edges(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), np.zeros(3, bool)).sound


def test_angles_of_triangles_in_the_plane():
    uv = np.random.default_rng(0).normal(size=(9, 3, 2))
    found = embedding._angles(uv)
    np.testing.assert_allclose(found.sum(axis=1), np.pi)
    for t in range(9):
        for k in range(3):
            a, b = uv[t, (k + 1) % 3] - uv[t, k], uv[t, (k + 2) % 3] - uv[t, k]
            assert np.cos(found[t, k]) == pytest.approx(a @ b / np.linalg.norm(a) / np.linalg.norm(b))


def edges_of(*loops):
    """tail, head, begin, end of closed loops of points."""
    tail, head, points = [], [], np.concatenate([np.array(x, float) for x in loops])
    first = 0
    for loop in loops:
        k = np.arange(len(loop)) + first
        tail, head, first = [*tail, *k], [*head, *np.roll(k, -1)], first + len(loop)
    return np.array(tail), np.array(head), points[tail], points[head]


SQUARE = [(0, 0), (4, 0), (4, 4), (0, 4)]
HOLE = [(1, 1), (1, 2), (2, 2), (2, 1)]


@pytest.mark.parametrize(
    "loops, once",
    [
        ([SQUARE], True),
        ([SQUARE[::-1]], False),
        ([SQUARE, HOLE], True),
        ([SQUARE, HOLE[::-1]], False),
        ([SQUARE, HOLE, [(1.2, 1.2), (1.8, 1.2), (1.8, 1.8), (1.2, 1.8)]], True),
        ([SQUARE, [(x + 9, y) for x, y in SQUARE]], True),
        ([SQUARE, [(x + 9, y) for x, y in SQUARE[::-1]]], False),
    ],
)
def test_outlines_wind_once_around_what_is_inside_of_each(loops, once):
    for order in (loops, loops[::-1]):
        assert embedding._wind_once(*edges_of(*order)) == once


@pytest.mark.parametrize("shift, touches", [((9, 0), False), ((2, 2), True), ((4, 0), True), ((4.001, 0), False)])
def test_edges_touch_at_points_of_no_common_vertex(shift, touches):
    assert embedding._touch(*edges_of(SQUARE, [(x + shift[0], y + shift[1]) for x, y in SQUARE])) == touches
    assert not embedding._touch(*edges_of(SQUARE))


def islands(uv, V, F, owner, polygons=None):
    return upright._Islands(V, uv, F, np.arange(len(F)) if polygons is None else polygons, owner, int(owner.max()) + 1)


@pytest.mark.parametrize("angle", [0.0, 0.4, 1.3])
def test_the_main_direction_is_that_of_most_length(angle):
    # Of a grid of quads in triangles, and of a triangle by itself.
    V, F = meshes.grid(4, 3)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    uv = V[:, :2] @ turn
    tail, head = F.ravel(), F[:, [1, 2, 0]].ravel()
    one = islands(uv, V, F, np.zeros(len(F), int))
    share, direction = upright._main_direction(one, tail, head, np.ones(len(tail), bool))
    length = np.linalg.norm(uv[head] - uv[tail], axis=1)
    along = np.arctan2(*(uv[head] - uv[tail]).T[::-1])
    off = np.abs((along - direction[0] + np.pi / 4) % (np.pi / 2) - np.pi / 4)
    assert share[0] == pytest.approx(length[off < np.radians(1.7)].sum() / length.sum())
    assert abs((direction[0] - angle + np.pi / 4) % (np.pi / 2) - np.pi / 4) < 1e-9
    only = np.zeros(len(tail), bool)
    only[5] = True
    share, direction = upright._main_direction(one, tail, head, only)
    assert share[0] == pytest.approx(1) and abs((direction[0] - along[5] + 0.1) % (np.pi / 2) - 0.1) < 1e-9


def test_slopes_of_heights_in_the_map_are_those_of_the_plane_through_the_corners():
    V, F, uv = rough(3)
    rng = np.random.default_rng(0)
    V = V + rng.normal(0, 0.2, V.shape)
    area = signed_areas(uv, F)
    axis = np.array([[0.2, -0.5, 0.8]])
    found = upright._rises(islands(uv, V, F, np.zeros(len(F), int)), axis, F, np.zeros(len(F), int), area)
    for t, f in enumerate(F):
        height = V[f] @ axis[0]
        slope = np.linalg.solve(np.column_stack([uv[f], np.ones(3)]), height)[:2]
        np.testing.assert_allclose(found[t, :2], slope * abs(area[t]), rtol=1e-6)
        assert found[t, 2] == pytest.approx(height.mean())


def test_level_directions_lead_away_and_right():
    away, right = upright._level(np.array([[0, 0, 2.0], [0, 3.0, 0.0], [0, 0, 1.0]]), None)
    np.testing.assert_allclose(away[0] / np.linalg.norm(away[0]), [0, 1, 0])
    np.testing.assert_allclose(right[0], [1, 0, 0])
    np.testing.assert_allclose(right[1], np.cross([0, 0, 1], [0, 1, 0]))
    viewer = np.array([[1.0, -1.0, 0.5]])
    away, right = upright._level(np.array([[0, 0, 1.0]]), viewer)
    np.testing.assert_allclose(away, [[-np.sqrt(0.5), np.sqrt(0.5), 0]])
    np.testing.assert_allclose(right, [[np.sqrt(0.5), np.sqrt(0.5), 0]])
    away, right = upright._level(np.array([[0, 0, 1.0]]), np.array([[0, 0, 1.0]]))
    np.testing.assert_array_equal(right, [[0, 0, 0]])


def test_turns_are_least_up_to_quarters():
    for value in np.linspace(-4, 4, 33):
        (found,) = upright._least_turn(np.array([value]))
        quarters = (value - found) / (np.pi / 2)
        assert abs(found) <= np.pi / 4 + 1e-12 and quarters == pytest.approx(round(quarters))


@pytest.mark.parametrize("slope", [-0.3, 0.3])
def test_a_ridge_is_where_what_rises_from_two_sides_is_highest(slope):
    # A roof over y = 0, rising along x by the slope.
    V, F = meshes.grid(8, 8)
    V = V - V.mean(axis=0)
    uv = V[:, :2]
    V = np.column_stack([uv, slope * uv[:, 0] - np.abs(uv[:, 1])])
    one = islands(uv, V, F, np.zeros(len(F), int))
    area = signed_areas(uv, F)
    rises = upright._rises(one, np.array([[0, 0, 1.0]]), F, np.zeros(len(F), int), area)
    (found,) = upright._along_ridge(one, area, rises[:, 2], rises[:, :2])
    assert abs(found - (0 if slope > 0 else np.pi)) % (2 * np.pi) < 0.1
    flat = upright._along_ridge(one, area, 0 * rises[:, 2], np.ones((len(F), 2)) * [1, 0])
    assert not np.isnan(flat[0])
    round_ = np.column_stack([uv, (uv**2).sum(axis=1)])
    one = islands(uv, round_, F, np.zeros(len(F), int))
    rises = upright._rises(one, np.array([[0, 0, 1.0]]), F, np.zeros(len(F), int), area)
    assert np.isnan(upright._along_ridge(one, area, rises[:, 2], rises[:, :2])[0])


def test_regions_err_by_the_worse_of_both_sides():
    rng = np.random.default_rng(0)
    area, ratio, region, now = rng.random(9), rng.random(9) + 0.5, rng.random(9), rng.random(9)
    faces = SimpleNamespace(area=area, ratio=ratio, region=region)
    due = area * ratio / (area * ratio).sum()
    error = now / now.sum() - due
    whole, single = [], []
    for side in (region, 1 - region):
        whole.append(abs(sum(side * error)) / sum(side * due))
        single.append(sum(side * abs(error)) / sum(side * due))
    np.testing.assert_allclose(energy._region_error(faces, now), (max(whole), max(single)))
    assert energy._region_error(SimpleNamespace(region=None), now) == (0.0, 0.0)
    assert energy._area_error(faces, now) == pytest.approx(abs(error).sum())


def test_negative_curvature_is_left_out_of_2_by_2_matrices():
    rng = np.random.default_rng(1)
    aa, ab, bb = rng.normal(size=(3, 60))
    found = energy.without_negative(aa, ab, bb)
    (c1, s1, v1), (c2, s2, v2) = energy._split(aa, ab, bb)
    for k in range(60):
        value, vector = np.linalg.eigh([[aa[k], ab[k]], [ab[k], bb[k]]])
        expected = (vector * np.maximum(value, 0)) @ vector.T
        np.testing.assert_allclose([[found[0][k], found[1][k]], [found[1][k], found[2][k]]], expected, atol=1e-12)
        split = v1[k] * np.outer([c1[k], s1[k]], [c1[k], s1[k]]) + v2[k] * np.outer([c2[k], s2[k]], [c2[k], s2[k]])
        np.testing.assert_allclose(split, expected, atol=1e-12)


def test_areas_of_polygons_are_those_of_their_triangles_times_how_bent_and_dented_they_are():
    V = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 1], [0, 2, 0], [5, 0, 0], [7, 0, 0], [5.5, 0.5, 0], [5, 2, 0]], float)
    quads = np.array([[0, 1, 2, 3], [4, 5, 6, 7]])

    def area(a, b, c):
        return np.linalg.norm(np.cross(V[b] - V[a], V[c] - V[a])) / 2

    found = polygon_elements._dented(V, quads)
    assert found[0] == pytest.approx(1)
    # A dart has its own area, the sum of the two triangles on its reflex corner, and not the mean with the other two.
    own = area(4, 5, 6) + area(4, 6, 7)
    assert found[1] == pytest.approx(own / ((own + area(5, 6, 7) + area(4, 5, 7)) / 2))
    assert polygon_elements._convex(V, quads).tolist() == [True, False]


@pytest.mark.parametrize("count", [1, 2, 3, 50])
def test_elements_in_turn_are_all_of_them_once(count):
    V, F = meshes.grid(3, 2)
    polygons = np.concatenate([np.repeat([0, 1, 2], 2), np.arange(3, 3 + len(F) - 6)])
    V = V + np.random.default_rng(0).normal(0, 0.02, V.shape)
    faces = polygon_elements.polygon_elements(V, F, face_areas(V, F), polygons)
    w = V[:, :2] @ [1.3, 1j]
    each = energy.energies(faces, w, 2.0)
    seen = []
    for some, here, _, _ in polygon_elements.in_turn(faces, count):
        np.testing.assert_allclose(energy.energies(some, w, 2.0), each[here])
        seen += range(*here.indices(len(each)))
        assert here.stop - here.start <= count
    assert seen == list(range(len(each)))
    assert all(a < b for a, b in pairwise(seen))
