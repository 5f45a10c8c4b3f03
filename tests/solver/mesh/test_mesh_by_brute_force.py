"""What finds, pairs, spreads and cuts, against loops over everything; and parts that know nothing of each other."""

from __future__ import annotations

import functools

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.curvature import gaussian_curvature, mean_curvature, sharpness
from omt_uv.solver.analysis.vertex_scores import scaled_vertex_areas
from omt_uv.solver.mesh import closest_point, geometry, topology
from omt_uv.solver.mesh.closest_point import ClosestPoint, random_points, spread_points, subdivision_centroids
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.point_location import locate
from omt_uv.solver.mesh.polygon_areas import polygon_areas, polygon_fans

random = np.random.default_rng


# ---- pairs and labels ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("k", [0, 1, 2, 40])
def test_keys_that_occur_once_and_first_ones(k, seed):
    keys = random(seed).integers(0, max(k // 2, 1), k)
    assert topology.only_once(keys).tolist() == [i for i in range(k) if (keys == keys[i]).sum() == 1]
    label = np.unique(keys, return_inverse=True)[1].ravel()
    assert topology.first_of(label).tolist() == [label.tolist().index(x) for x in label]


@pytest.mark.parametrize("seed", range(6))
def test_opposite_sides_run_against_each_other_and_are_two(seed):
    """Sides of no length, and pairs that run the same way, are none."""
    rng = random(seed)
    place, ends = rng.integers(0, 6, 9), rng.integers(0, 9, (2, 24))
    tail, head = place[ends]
    expected = set()
    for i in range(24):
        alike = [j for j in range(24) if {tail[j], head[j]} == {tail[i], head[i]}]
        if len(alike) == 2 and tail[alike[0]] == head[alike[1]] != head[alike[0]]:
            expected.add(tuple(alike))
    found = set(zip(*(x.tolist() for x in topology.opposite_sides(place, ends)), strict=True))
    assert found == expected


@pytest.mark.parametrize("seed", range(12))
def test_sides_of_polygons_that_lie_on_one_another_choose_among_the_others(seed):
    rng = random(seed)
    ends, twin = rng.integers(0, 5, (2, 24)), rng.integers(0, 12, 24)
    tail, head = ends
    alike = [[j for j in range(24) if {tail[j], head[j]} == {tail[i], head[i]}] for i in range(24)]
    to = [
        [j for j in alike[i] if tail[j] == head[i] != tail[i] and twin[i] != twin[j]] if len(alike[i]) <= 4 else []
        for i in range(24)
    ]
    expected = {(i, to[i][0]) for i in range(24) if len(to[i]) == 1 and len(to[to[i][0]]) == 1 and i < to[i][0]}
    found = set(zip(*(x.tolist() for x in topology.opposite_sides(np.arange(5), ends, twin)), strict=True))
    assert found == expected and (seed or expected)


def test_a_pair_of_sides_of_no_length_is_no_pair():
    place = np.array([0, 0, 0, 1])
    first, second = topology.opposite_sides(place, np.array([[0, 1, 0, 3], [1, 2, 3, 2]]))
    assert (first.tolist(), second.tolist()) == ([2], [3])


@pytest.mark.parametrize("seed", range(4))
def test_what_is_joined_along_sides_has_one_number(seed):
    rng = random(seed)
    n, first, second = 12, rng.integers(0, 12, (2, 4)), rng.integers(0, 12, (2, 4))
    group = {v: {v} for v in range(n)}
    pairs = [(a, b) for p in range(4) for a, b in ((first[0, p], second[1, p]), (first[1, p], second[0, p]))]
    for a, b in pairs:
        union = group[a] | group[b]
        for v in union:
            group[v] = union
    label = topology.joined_along(n, first, second)
    assert [[label[a] == label[b] for b in range(n)] for a in range(n)] == [
        [b in group[a] for b in range(n)] for a in range(n)
    ]


@pytest.mark.parametrize("rings", [0, 1, 2, 3])
def test_vertices_around_are_so_many_edges_away(rings):
    V, F = meshes.bumpy(6, 5)
    chosen = np.zeros(len(F), bool)
    chosen[[3, 20]] = True
    away = np.full(len(V), 99)
    away[F[chosen]] = 0
    for _ in range(9):
        for a, b, c in F:
            for u, v in ((a, b), (b, c), (c, a)):
                away[u], away[v] = min(away[u], away[v] + 1), min(away[v], away[u] + 1)
    assert np.array_equal(topology.vertices_around(F, chosen, len(V), rings), away <= rings)


# ---- places on triangles ------------------------------------------------------------------------------------


@pytest.mark.parametrize("k", [1, 2, 3, 7])
def test_centroids_of_similar_triangles(k):
    """Each of the k^2 pieces, upright and upside down, has one: its own."""
    pieces = []
    for i in range(k):
        for j in range(k - i):
            pieces.append(np.array([[i, j], [i + 1, j], [i, j + 1]]))
            if i + j < k - 1:
                pieces.append(np.array([[i + 1, j + 1], [i + 1, j], [i, j + 1]]))
    expected = np.array(sorted((np.mean(piece, axis=0) / k).tolist() for piece in pieces))
    found = subdivision_centroids(k)
    assert len(found) == k * k
    np.testing.assert_allclose(np.array(sorted(found[:, 1:].tolist())), expected, atol=1e-12)
    np.testing.assert_allclose(found.sum(axis=1), 1)


def test_points_are_spread_as_far_as_asked_for_and_no_more_than_there_may_be(monkeypatch):
    V, F = meshes.bumpy(3, 4)
    V = V * [1, 3, 1]
    owner, points = spread_points(V, F, 0.3)
    for f in range(len(F)):
        p = V[F[f]]
        longest = max(np.linalg.norm(p[a] - p[a - 1]) for a in range(3))
        k = max(int(np.ceil(longest / 0.3)), 1)
        mine = points[owner == f]
        np.testing.assert_allclose(np.sort(mine, axis=0), np.sort(subdivision_centroids(k) @ p, axis=0), atol=1e-12)
    monkeypatch.setattr(closest_point, "MOST_SAMPLES", 60)
    few = spread_points(V, F, 0.3)[0]
    assert len(few) <= 60 and np.array_equal(np.unique(few), np.arange(len(F)))


def test_random_points_go_by_the_mass():
    mass, count = np.array([1.0, 0.0, 5.0, 2.0]), 800
    face, bary = random_points(mass, count, random(0))
    assert np.abs(np.bincount(face, minlength=4) - count * mass / 8).max() <= 1
    np.testing.assert_allclose(bary.sum(axis=1), 1)
    assert bary.min() >= 0 and np.abs(bary.mean(axis=0) - 1 / 3).max() < 0.03
    # The share of a triangle next to a corner is the square of its size.
    for corner in range(3):
        assert abs((bary[:, corner] > 0.5).mean() - 0.25) < 0.05


def test_points_are_located_in_the_triangle_they_are_in():
    V, F = meshes.bumpy(9, 8)
    uv, rng = V[:, :2] + 0.02 * np.sin(9 * V[:, [1, 0]]), random(1)
    face, bary = random_points(np.ones(len(F)), 300, rng)
    points = np.einsum("kc,kcd->kd", bary, uv[F[face]])
    found, there = locate(uv, F, points)
    np.testing.assert_allclose(np.einsum("kc,kcd->kd", there, uv[F[found]]), points, atol=1e-12)
    assert np.array_equal(found, face) and there.min() >= 0
    # Outside: at the boundary, coordinates clamped.
    low, high = uv.min(axis=0), uv.max(axis=0)
    found, there = locate(uv, F, np.array([low - 1, high + 1, [low[0] - 1, high[1] + 1]]))
    on = np.einsum("kc,kcd->kd", there, uv[F[found]])
    assert there.min() >= 0 and np.abs(there.sum(axis=1) - 1).max() < 1e-12
    twin = topology.twins(F).reshape(-1, 3)
    assert (twin[found] < 0).any(axis=1).all() and (on >= low - 1e-12).all() and (on <= high + 1e-12).all()


def test_points_on_the_sphere_are_located_along_themselves():
    V, F = meshes.icosphere(2)
    face, bary = random_points(np.ones(len(F)), 200, random(2))
    points = geometry.unit(np.einsum("kc,kcd->kd", bary, V[F[face]]))
    found, there = locate(V, F, points)
    assert np.array_equal(found, face)
    np.testing.assert_allclose(there, bary, atol=1e-9)


def nearest(V, F, point):
    """The distance to a surface: the least over a fine grid of every triangle, and then of finer ones around it."""
    best = np.inf
    for corners in V[F]:
        grid = subdivision_centroids(12) @ corners
        best = min(best, np.linalg.norm(grid - point, axis=1).min())
    return best


def test_closest_points_are_no_farther_than_any_other():
    V, F = meshes.bumpy(6, 6)
    V, rng = V * [1, 1, 0.3], random(3)
    normal = geometry.vertex_normals(V, F)
    at = rng.integers(0, len(V), 40)
    points = V[at] + 0.01 * normal[at] + 0.01 * rng.normal(size=(40, 3))
    index = ClosestPoint(V, F, float(np.sqrt(face_areas(V, F).mean())))
    found = index(points, normal[at])
    distance = np.linalg.norm(found.points - points, axis=1)
    np.testing.assert_allclose(np.einsum("kc,kcd->kd", found.barycentric, V[F[found.faces]]), found.points, atol=1e-12)
    for k in range(40):
        assert distance[k] <= nearest(V, F, points[k]) + 1e-12


def test_the_side_that_looks_the_same_way_comes_before_the_nearer_one():
    """A thin plate: what looks up finds the upper side from below as well."""
    V, F = meshes.grid(4, 4)
    both = np.vstack([V, V - [0, 0, 0.01]])
    index = ClosestPoint(both, np.vstack([F, F[:, ::-1] + len(V)]), 0.25)
    up = geometry.face_normals(V, F)[0]
    points = V.mean(axis=0) + up * np.array([[-0.02], [0.003], [0.02]]) * up[2]
    found = index(points, np.tile(up, (3, 1)))
    assert (found.faces < len(F)).all()
    assert (index(points, -np.tile(up, (3, 1))).faces >= len(F)).all()


# ---- polygons -----------------------------------------------------------------------------------------------


def cut(*rings):
    """Triangles of polygons, each a fan from its first corner, and whose each is."""
    triangles = [[r[0], r[j], r[j + 1]] for r in rings for j in range(1, len(r) - 1)]
    return np.array(triangles), np.repeat(np.arange(len(rings)), [len(r) - 2 for r in rings])


def test_fans_of_convex_polygons_and_of_no_others():
    """Dented ones, those cut in two, quads and triangles have none; centres are numbered as they come."""
    t = 2 * np.pi * np.arange(6) / 6
    hexagon = np.column_stack([np.cos(t), np.sin(t), 0 * t])
    dented = hexagon.copy()
    dented[2] *= 0.2
    V = np.vstack([hexagon, dented + [3, 0, 0], hexagon + [6, 0, 0], hexagon[:5] + [9, 0, 0]])
    rings = [range(6), range(6, 12), range(12, 18), range(18, 23), (0, 1, 7, 6), (0, 1, 7)]
    triangles, owner = cut(*map(list, rings))
    # A polygon of two pieces that touch in nothing.
    pieces = np.array([[0, 1, 2], [12, 13, 14], [18, 19, 20]])
    triangles, owner = np.vstack([triangles, pieces]), np.append(owner, [6, 6, 6])
    centre, fan, of = polygon_fans(V, triangles, owner)
    assert np.unique(of).tolist() == [0, 2, 3]
    np.testing.assert_allclose(centre, [V[:6].mean(axis=0), V[12:18].mean(axis=0), V[18:23].mean(axis=0)])
    for k, polygon in enumerate((0, 2, 3)):
        ring, mine = list(rings[polygon]), fan[of == polygon]
        assert {tuple(x) for x in mine.tolist()} == {
            (a, b, len(V) + k) for a, b in zip(ring, [*ring[1:], ring[0]], strict=True)
        }


def test_polygons_have_the_area_of_their_fans_or_triangles():
    """Convex in space: the fan. Dented: its triangles. In whatever order they come, under whatever names."""
    rng = random(4)
    t = 2 * np.pi * np.arange(7) / 7
    ring = np.column_stack([np.cos(t), np.sin(t), 0.1 * rng.normal(size=7)])
    dented = ring.copy()
    dented[3] *= -0.6
    V = np.vstack([ring, dented + [4, 0, 0]])
    triangles, owner = cut(list(range(7)), list(range(7, 14)))
    centre = ring.mean(axis=0)
    fan = sum(np.linalg.norm(np.cross(ring[k] - centre, ring[k - 1] - centre)) / 2 for k in range(7))
    plain = face_areas(V, triangles)[owner == 1].sum()
    names = np.array([40, 3])
    order = rng.permutation(len(owner))
    area = polygon_areas(V, triangles[order], names[owner[order]])
    assert np.bincount(owner[order], area) == pytest.approx([fan, plain])
    share = area / face_areas(V, triangles[order])
    assert np.ptp(share[owner[order] == 0]) < 1e-12


# ---- parts that know nothing of each other ------------------------------------------------------------------

# Functions of a surface, and whether they say something of vertices, faces or halfedges (pairs of them: matrices).
OF_SURFACES = {
    "face_areas": geometry.face_areas,
    "face_normals": geometry.face_normals,
    "vertex_normals": geometry.vertex_normals,
    "vertex_areas": geometry.vertex_areas,
    "least_angles": geometry.least_angles,
    "halfedge_lengths": geometry.halfedge_lengths,
    "gaussian_curvature": gaussian_curvature,
    "mean_curvature": mean_curvature,
    "sharpness": sharpness,
    "on_boundary": lambda V, F: topology.on_boundary(F, len(V)),
    "has a twin": lambda V, F: topology.twins(F) >= 0,
    "polygon_areas": lambda V, F: polygon_areas(V, F, np.arange(len(F)) // 2),
}
PARTS = {
    "one triangle": lambda: (np.array([[0, 0, 0], [1, 0, 0.2], [0.3, 0.8, 0]]), np.array([[0, 1, 2]])),
    "two triangles": lambda: meshes.bumpy(1, 1),
    "patch": lambda: meshes.bumpy(4, 3),
    "body": lambda: meshes.icosphere(1),
    "ring": meshes.torus,
}  # fmt: skip


@functools.cache
def part(name):
    return PARTS[name]()


@pytest.mark.parametrize("second", PARTS)
@pytest.mark.parametrize("first", ["one triangle", "patch", "body"])
@pytest.mark.parametrize("name", OF_SURFACES)
def test_parts_know_nothing_of_each_other(name, first, second):
    (V, F), (W, G) = part(first), part(second)
    if name == "polygon_areas" and len(F) % 2:
        pytest.skip("a polygon of both parts")
    whole = OF_SURFACES[name](np.vstack([V, W + 3]), np.vstack([F, G + len(V)]))
    apart = np.concatenate([OF_SURFACES[name](V, F), OF_SURFACES[name](W + 3, G)])
    np.testing.assert_allclose(whole, apart, atol=1e-12)


@pytest.mark.parametrize("name", OF_SURFACES)
def test_no_faces_are_no_values(name):
    if name in ("gaussian_curvature", "mean_curvature", "sharpness"):
        pytest.skip("of vertices, which have none")
    found = OF_SURFACES[name](np.zeros((3, 3)), np.zeros((0, 3), np.int64))
    assert len(found) in (0, 3) and not np.any(found)


@pytest.mark.parametrize("way", ["vertices", "faces", "corners"])
@pytest.mark.parametrize("name", [k for k in OF_SURFACES if k != "polygon_areas"])
def test_numbers_of_vertices_and_faces_mean_nothing(name, way):
    V, F = part("patch")
    rng = random(5)
    before = OF_SURFACES[name](V, F)
    if way == "vertices":
        new = rng.permutation(len(V))
        other = np.empty_like(V)
        other[new] = V
        after = OF_SURFACES[name](other, new[F])
        after = after[new] if len(after) == len(V) else after
    elif way == "faces":
        order = rng.permutation(len(F))
        after = OF_SURFACES[name](V, F[order])
        if len(after) == len(F):
            before = before[order]
        elif len(after) == 3 * len(F):
            before = before.reshape(len(F), 3)[order].ravel()
    else:
        after = OF_SURFACES[name](V, np.roll(F, 1, axis=1))
        if len(after) == 3 * len(F):
            before = np.roll(before.reshape(len(F), 3), 1, axis=1).ravel()
    np.testing.assert_allclose(after, before, atol=1e-12)


@pytest.mark.parametrize("second", PARTS)
def test_the_laplacian_of_parts_is_that_of_each(second):
    (V, F), (W, G) = part("patch"), part(second)
    whole = geometry.cotangent_laplacian(np.vstack([V, W]), np.vstack([F, G + len(V)])).toarray()
    n = len(V)
    np.testing.assert_allclose(whole[:n, :n], geometry.cotangent_laplacian(V, F).toarray(), atol=1e-12)
    np.testing.assert_allclose(whole[n:, n:], geometry.cotangent_laplacian(W, G).toarray(), atol=1e-12)
    assert not whole[:n, n:].any() and not whole[n:, :n].any()


def test_areas_of_vertices_by_their_scale_sum_to_the_whole():
    V, F = part("patch")
    for factor in (1.0, 1e-6, 1e6):
        area = scaled_vertex_areas(factor * V, F)
        assert area / area.sum() == pytest.approx(geometry.vertex_areas(V, F) / face_areas(V, F).sum())
