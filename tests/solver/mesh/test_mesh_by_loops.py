"""Pieces of meshes: orders, components, diagonals, closest points, mirrors, against loops over each."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import EmptyMeshError, NonFiniteError
from omt_uv.solver.mesh import closest_point, edge_flips, mirror, polygon_areas, repair, surface, topology
from omt_uv.solver.mesh.geometry import below_one, bounding_box, complex_cross, face_areas, part_by_part
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.quads import diagonals


@pytest.mark.parametrize("count", [10, 9000])
def test_orders_are_stable_however_they_are_found(count):
    rng = np.random.default_rng(count)
    values = rng.integers(0, count // 3, count)
    expected = np.array(sorted(range(count), key=lambda k: (values[k], k)))
    np.testing.assert_array_equal(topology.order_of_numbers(values), expected)
    np.testing.assert_array_equal(topology._counted(values.astype(np.int32), int(values.max())), expected)
    other = rng.integers(0, 50, count)
    keys = topology.pair_keys(values, other)
    pairs = [(min(a, b), max(a, b)) for a, b in zip(values.tolist(), other.tolist(), strict=True)]
    np.testing.assert_array_equal(topology.order_of_pairs(keys), sorted(range(count), key=lambda k: (pairs[k], k)))
    assert topology.paired(keys).tolist() == [list(p) for p in pairs]
    # Numbers too large to be counted: as many as that would take the memory of the machine.
    large = values << 33
    np.testing.assert_array_equal(topology.order_of_numbers(large), expected)
    np.testing.assert_array_equal(topology.order_of_pairs(topology.pair_keys(values, values + 2**30)), expected)


@pytest.mark.parametrize("seed", range(3))
def test_components_of_few_are_those_of_a_walk(seed):
    rng = np.random.default_rng(seed)
    n = 30
    a, b = rng.integers(0, n, (2, 20 + 4 * seed))
    count, label = topology._few_components(a, b, n)
    beside = {v: set() for v in range(n)}
    for x, y in zip(a.tolist(), b.tolist(), strict=True):
        beside[x].add(y)
        beside[y].add(x)
    seen, parts = set(), 0
    for v in range(n):
        if v in seen:
            continue
        found, left = {v}, [v]
        while left:
            for u in beside[left.pop()] - found:
                found.add(u)
                left.append(u)
        seen |= found
        assert set(np.flatnonzero(label == label[v]).tolist()) == found and label[v] == parts
        parts += 1
    assert count == parts


def test_steps_to_the_goals_of_cycles():
    following = np.array([1, 2, 3, 0, 5, 4, 6])
    found = topology._steps_to(following, np.array([0, 4, 6]), 4)
    assert found.tolist() == [0, 3, 2, 1, 0, 1, 0]


def test_corners_follow_each_other_around_polygons():
    assert topology.next_corners(np.array([0, 3, 3, 7])).tolist() == [1, 2, 0, 4, 5, 6, 3]


def test_boxes_products_and_powers():
    points = np.array([[1.0, 5, 2], [3, -4, 2]])
    low, size = bounding_box(points)
    np.testing.assert_allclose([low, size] if np.ndim(size) else low, [[1, -4, 2], [3, 5, 2]] if np.ndim(size) else low)
    assert complex_cross(np.array([1 + 2j]), np.array([3 - 1j]))[0] == -7
    for power in (-1030, -3, 0, 1000):
        p = np.ldexp(np.array([[0.7, -3.0, 1.0]]), power)
        scaled, exponent = below_one(p)
        np.testing.assert_array_equal(np.ldexp(scaled, exponent), p)
        assert np.abs(scaled).max() <= 1


def test_parts_are_put_together_again():
    rows = np.arange(100_000.0).reshape(-1, 2)
    np.testing.assert_array_equal(part_by_part(lambda x: x.sum(axis=1), rows), rows.sum(axis=1))
    np.testing.assert_array_equal(part_by_part(lambda x, y: x + y, rows, 2 * rows), 3 * rows)


@pytest.mark.parametrize("seed", range(2))
def test_quads_are_cut_along_the_shorter_diagonal_that_may_be(seed):
    rng = np.random.default_rng(seed)
    V = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + rng.normal(0, 0.3, (60, 4, 2))
    V = np.concatenate([V, 0.1 * rng.normal(size=(60, 4, 1))], axis=2).reshape(-1, 3)
    quads, rank = np.arange(240).reshape(-1, 4), rng.permutation(240)
    found = diagonals._convex_and_longer(V, quads, rank)
    for k, q in enumerate(quads):
        p = V[q]
        own = np.cross(p[2] - p[0], p[3] - p[1])
        ears = [np.cross(p[(c + 1) % 4] - p[c], p[c - 1] - p[c]) @ own / (own @ own) for c in range(4)]
        assert found[k, 0] == (min(ears) > 1e-3)
        assert found[k, 1] == (np.linalg.norm(p[1] - p[3]) < np.linalg.norm(p[0] - p[2]))
    assert 5 < found[:, 0].sum() < 60
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    for least in range(4):
        rank = np.roll(np.arange(4), least)
        assert diagonals._convex_and_longer(square, np.arange(4)[None], rank)[0, 1] == (rank.argmin() % 2 == 1)


def test_keys_that_are_there_several_times():
    assert diagonals._several(np.array([5, 3, 5, 7, 3, 9])).tolist() == [True, True, True, False, True, False]


def test_surfaces_are_cut_along_shorter_diagonals_in_their_rows():
    V = np.array([[0, 0, 0], [2, 0.2, 0], [1.5, 1, 0], [0, 1, 0], [4, 0, 0], [4, 1, 0]], float)
    quads = [[0, 1, 2, 3], [1, 4, 5, 2]]
    given = meshes.polygon_surface(V, quads)
    found = diagonals.cut_along_shorter(given)
    assert (found.triangle_face == given.triangle_face).all()
    for face, quad in enumerate(quads):
        rows = found.corner_vertex[found.triangles[found.triangle_face == face]]
        shared = set(rows[0].tolist()) & set(rows[1].tolist())
        a, b, c, d = quad
        shorter = {a, c} if np.linalg.norm(V[a] - V[c]) < np.linalg.norm(V[b] - V[d]) else {b, d}
        assert shared == shorter and set(rows.ravel().tolist()) == set(quad)
        before = V[given.corner_vertex[given.triangles[given.triangle_face == face]]]
        assert face_areas(V, rows).sum() == pytest.approx(
            face_areas(before.reshape(-1, 3), np.arange(6).reshape(2, 3)).sum()
        )
    again = diagonals.cut_along_shorter(found)
    np.testing.assert_array_equal(np.sort(again.triangles, axis=1), np.sort(found.triangles, axis=1))


@pytest.mark.parametrize("bent", [0.0, 0.3])
def test_triangles_of_quads_are_aligned_by_their_normals(bent):
    rng = np.random.default_rng(0)
    points = rng.normal(size=(20, 4, 3)) * [1, 1, bent]
    found = polygon_areas._alignment(points)
    for q in range(20):
        normals = [
            np.cross(points[q, b] - points[q, a], points[q, c] - points[q, a])
            for a, b, c in polygon_areas.BOTH.tolist()
        ]
        own = normals[0] + normals[1]
        expected = [n @ own / np.linalg.norm(n) / np.linalg.norm(own) for n in normals]
        np.testing.assert_allclose(found[q], expected, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_pairs_of_triangles_are_quads_where_a_side_runs_both_ways(seed):
    rng = np.random.default_rng(seed)
    F = np.array([rng.choice(5, 3, replace=False) for _ in range(80)])
    first, second = np.arange(0, 80, 2), np.arange(1, 80, 2)
    corners, joined = polygon_areas.quad_corners(F, first, second)
    for k in range(40):
        one, two = F[2 * k].tolist(), F[2 * k + 1].tolist()
        sides = [{(t[c], t[(c + 1) % 3]) for c in range(3)} for t in (one, two)]
        shared = {(a, b) for a, b in sides[0] if (b, a) in sides[1]}
        assert joined[k] == (len(shared) == 1 and set(one) != set(two))
        if joined[k]:
            b, c, d, a = F.ravel()[corners[k]].tolist()
            assert {b, d} == set(next(iter(shared))) and a in one and c in two and a != c
            assert {(a, b), (d, a)} <= sides[0] and {(b, c), (c, d)} <= sides[1]


def nearest_on(p, a, b, c):
    """The point of a triangle nearest to p, by its plane and its sides."""
    n = np.cross(b - a, c - a)
    q = p - (p - a) @ n / (n @ n) * n
    weights = np.linalg.lstsq(np.column_stack([a, b, c]), q, rcond=None)[0]
    inside = [np.cross(y - x, q - x) @ n > 0 for x, y in ((a, b), (b, c), (c, a))]
    if all(inside):
        return q
    found = []
    for x, y in ((a, b), (b, c), (c, a)):
        t = min(max((p - x) @ (y - x) / ((y - x) @ (y - x)), 0), 1)
        found.append(x + t * (y - x))
    assert np.isfinite(weights).all()
    return min(found, key=lambda z: np.linalg.norm(z - p))


def test_distances_from_faces_are_from_their_nearest_points():
    rng = np.random.default_rng(0)
    V, F = rng.normal(size=(60, 3)), np.arange(60).reshape(20, 3)
    index = closest_point.ClosestPoint(V, F, 0.3)
    points, faces = 2 * rng.normal(size=(200, 3)), rng.integers(0, 20, 200)
    barycentric, square = index.distance(points, faces)
    np.testing.assert_allclose(barycentric.sum(axis=1), 1)
    assert (barycentric >= -1e-12).all()
    places = index.at(faces, barycentric)
    kinds = set()
    for k in range(200):
        expected = nearest_on(points[k], *V[F[faces[k]]])
        np.testing.assert_allclose(places[k], expected, atol=1e-9)
        assert square[k] == pytest.approx(((points[k] - expected) ** 2).sum())
        kinds.add(int((barycentric[k] > 1e-9).sum()))
    assert kinds == {1, 2, 3}
    several = index.distance(points[:5], np.stack([faces[:5], faces[5:10]], axis=1))
    np.testing.assert_allclose(several[1][:, 0], square[:5])
    np.testing.assert_allclose(
        index._best(points[:5], np.arange(20)[None].repeat(5, 0)),
        [index.distance(p[None].repeat(20, 0), np.arange(20))[1].argmin() for p in points[:5]],
    )


def test_a_thin_face_answers_with_its_sides():
    V = np.array([[0, 0, 0], [1, 0, 0], [2.0, 0, 0]])
    index = closest_point.ClosestPoint(V, np.array([[0, 1, 2]]), 0.3)
    for p, expected in (([1.5, 1, 0], 1.5), ([-3, 0, 1], 0.0), ([9, 0, 0], 2.0), ([0.25, 0, 2], 0.25)):
        barycentric, _ = index.distance(np.array([p], float), np.array([0]))
        np.testing.assert_allclose(index.at(np.array([0]), barycentric), [[expected, 0, 0]], atol=1e-12)


def test_candidates_are_those_within_reach_and_the_nearest_stands_for_the_others():
    V, F = meshes.grid(6, 6)
    index = closest_point.ClosestPoint(V, F, 0.2)
    owner, samples = index._spread
    points = np.array([[0.52, 0.47, 0.05], [0.5, 0.5, 9.0]])
    near, faces = index._candidates(owner, index._plain, points, 0.3)
    assert near.tolist() == [True, False] and faces.shape == (1, min(8, len(owner)))
    away = np.linalg.norm(samples - points[0], axis=1)
    assert set(faces[0].tolist()) <= set(owner[away <= 0.3].tolist()) and faces[0, 0] == owner[away.argmin()]
    nearest = np.linalg.norm(samples - points[0], axis=1).argmin()
    assert index.nearest_face(points)[0] == owner[nearest]


def test_points_are_reflected_in_planes_through_nothing():
    rng = np.random.default_rng(0)
    points, normal = rng.normal(size=(4, 2, 3)), np.array([0.6, 0.0, 0.8])
    found = mirror._reflected(points, normal)
    np.testing.assert_allclose(found @ normal, -(points @ normal))
    np.testing.assert_allclose(np.cross(found - points, normal), 0, atol=1e-12)


def test_rows_are_among_others_in_any_order():
    rows, others = np.array([[1, 2, 3], [4, 5, 6], [2, 2, 3]]), np.array([[3, 1, 2], [6, 5, 7]])
    assert mirror._among(rows, others).tolist() == [True, False, False]


@pytest.mark.parametrize("normal", [(1, 0, 0), (0, 1, 0)])
def test_corners_find_the_nearest_corner_of_the_image_of_their_polygon(normal):
    V, F = meshes.grid(4, 4)
    V = V - V.mean(axis=0)
    polygons = mirror._Polygons(V, F, np.tile(np.arange(16), 2))
    normal = np.array(normal, float)
    other = polygons.images_of_polygons(normal)
    for k in range(16):
        np.testing.assert_allclose(
            polygons.centres[other[k]], mirror._reflected(polygons.centres[k], normal), atol=1e-9
        )
    corner, to = polygons._nearest_corners(other, normal, np.ones(16, bool))
    for c, v in zip(corner, to, strict=True):
        np.testing.assert_allclose(V[v], mirror._reflected(V[polygons.vertex[c]], normal), atol=1e-9)
        assert v in polygons.vertex[polygons.polygon == other[polygons.polygon[c]]]
    some, there = polygons._nearest_corners(other, normal, np.arange(16) < 5)
    np.testing.assert_array_equal(some, np.flatnonzero(polygons.polygon < 5))
    np.testing.assert_array_equal(there, to[some])
    # An image that is none.
    wrong = np.roll(other, 1)
    assert (polygons._nearest_corners(wrong, normal, np.ones(16, bool))[1] < 0).any()
    assert polygons.images_of_corners(wrong, normal, np.ones(16, bool)) is None


def test_two_triangles_cut_otherwise_than_their_images_are_a_quad():
    V, F = meshes.two_bumps(6)
    image = np.array([int(np.linalg.norm(V - [1 - p[0], p[1], p[2]], axis=1).argmin()) for p in V])
    keys = {frozenset(f) for f in F.tolist()}
    # Turn the diagonal of one quad.
    for one, other in combinations(range(len(F)), 2):
        shared = set(F[one].tolist()) & set(F[other].tolist())
        spread = np.ptp(V[F[[one, other]]].reshape(-1, 3), axis=0)[:2]
        if len(shared) == 2 and np.allclose(spread, 1 / 6) and V[F[one]][:, 0].max() < 0.4:
            break
    (a, b), p, q = sorted(shared), *(next(v for v in F[k].tolist() if v not in shared) for k in (one, other))
    G = F.copy()
    tail = F[one].tolist()
    a, b = (a, b) if tail[(tail.index(a) + 1) % 3] == b else (b, a)
    G[one], G[other] = [p, a, q], [p, q, b]
    rest = np.array(
        [t for t in range(len(G)) if frozenset(image[G[t]].tolist()) not in {frozenset(g) for g in G.tolist()}]
    )
    assert len(rest) == 4 and keys
    found = {frozenset(x) for x in mirror._recut(G, image, rest).tolist()}
    there = {t for t in rest.tolist() if t not in (one, other)}
    assert found == {frozenset((one, other)), frozenset(there)}
    assert len(mirror._recut(G, image, rest[:0])) == 0 and len(mirror._recut(G, image, np.arange(len(G)))) == 0


def test_perimeters_are_sums_of_sides():
    V = np.random.default_rng(0).normal(size=(9, 3))
    polygons = [[0, 1, 2, 3], [4, 5, 6], [2, 7, 8, 5, 1]]
    found = repair._perimeters(meshes.polygon_surface(V, polygons))
    expected = [sum(np.linalg.norm(V[p[k]] - V[p[k - 1]]) for k in range(len(p))) for p in polygons]
    np.testing.assert_allclose(found, expected)


def test_groups_of_more_than_one_value():
    group, value = np.array([0, 0, 1, 1, 2]), np.array([5, 6, 7, 7, 8])
    assert repair._more_than_one(group, value).tolist() == [True, True, False, False, False]


def test_faces_have_no_area_where_none_of_their_triangles_has():
    V = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0.0]])
    F = np.array([[0, 1, 2], [0, 1, 3], [0, 2, 1], [1, 2, 0]])
    assert repair.faces_without_area(V, F, np.array([0, 0, 1, 2])) == 2
    assert repair.faces_without_area(V, F, np.array([0, 0, 0, 0])) == 0
    assert repair._size(np.array([[0, 0, 0], [1e308, 0, 0], [-0.7e308, 3, 0]])) == pytest.approx(1.7e308)


@pytest.mark.parametrize("height, bad", [(0.9e-10, True), (1.1e-10, False)])
def test_triangles_are_lines_below_a_share_of_their_longest_side_squared(height, bad):
    V = np.array([[0, 0, 0], [3, 0, 0], [1, 2 * 3 * height, 0], [0, 2, 0.0]])
    found = surface.degenerate_triangles(V, np.array([[0, 1, 2], [0, 1, 3]]))
    assert found.tolist() == [bad, False]


def test_surfaces_to_unwrap_are_somewhere():
    V, F = meshes.grid(2, 1)
    with pytest.raises(EmptyMeshError, match="There are no faces to unwrap"):
        surface.chosen_triangles(triangle_surface(V, F), np.zeros(len(F), bool))
    V = V.copy()
    V[F[0][0], 1] = np.nan
    with pytest.raises(NonFiniteError) as error:
        surface.chosen_triangles(triangle_surface(V, F), None)
    assert error.value.elements.tolist() == [F[0][0]] and error.value.kind == "vertex"
    others = ~(F[0][0] == F).any(axis=1)
    faces, triangles, owner = surface.chosen_triangles(triangle_surface(V, F), others)
    np.testing.assert_array_equal(owner, np.flatnonzero(others))
    np.testing.assert_array_equal(F.ravel()[triangles], F[others])
    assert faces.tolist() == others.tolist()


def test_boundary_vertices_lie_on_one_another_where_parts_touch():
    V, F = meshes.grid(1, 1)
    from short_cuts import gluing_of

    both = np.concatenate([V, V + [1, 0, 0]])
    T = np.concatenate([F, F + 4])
    gluing = gluing_of(both, T)
    component = np.repeat([0, 1], 2)
    made = SimpleNamespace(positions=both)
    assert repair.coincident_boundary_vertices(made, gluing, component, np.ones(2, bool)) == 4
    assert repair.coincident_boundary_vertices(made, gluing, 0 * component, np.ones(1, bool)) == 0
    assert repair.coincident_boundary_vertices(made, gluing, 0 * component, np.zeros(1, bool)) == 4


@pytest.mark.parametrize("rounds", [0, 1, 2, 3, 4, 9])
def test_edges_that_want_to_flip_do_so_in_rounds_the_worst_first(rounds):
    """A fan of five triangles, 0 | 1 | 2 | 3 | 4: the edges between them wait for those in the same triangles."""
    triangles = np.array([[0, k, k + 1] for k in range(1, 6)])
    twin = topology.twins(triangles)
    score = {frozenset((0, k)): -float(k) for k in range(2, 6)}
    flipped, asked = [], []

    def violation(edges):
        tail, head = triangles.ravel()[edges], triangles[:, [1, 2, 0]].ravel()[edges]
        ends = [frozenset((int(a), int(b))) for a, b in zip(tail, head, strict=True)]
        asked.append(set(ends))
        return np.array([0.0 if e in flipped else score.get(e, 1.0) for e in ends])

    def flip(edges):
        tail, head = triangles.ravel()[edges], triangles[:, [1, 2, 0]].ravel()[edges]
        flipped.extend(frozenset((int(a), int(b))) for a, b in zip(tail, head, strict=True))

    count, ended = edge_flips.flip_until_none(twin, violation, flip, rounds)
    # 5 is worse than 4, which waits and is then alone beside 3; so are 3 and 2.
    order = [frozenset((0, k)) for k in (5, 4, 3, 2)]
    assert flipped == order[: min(rounds, 4)] and count == min(rounds, 4) and ended == (rounds > 4)
    assert not asked or asked[0] == set(order)
