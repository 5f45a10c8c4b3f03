"""The rules of Catmull and Clark against loops over vertices, edges and polygons, with creases of every sharpness."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.subdivision import catmull_clark, modifier
from omt_uv.solver.subdivision.catmull_clark import (
    SHARP,
    Cage,
    bilinear,
    straight_boundary,
    straight_corners,
    subdivide,
)
from omt_uv.solver.subdivision.modifier import SubdivisionModifier, subdivided_uv


def cage_of(polygons, creases=None, corners=None):
    """A cage of polygons with sharpness by edge and by vertex."""
    corner = np.concatenate(polygons)
    n = int(corner.max()) + 1
    creases = {} if creases is None else creases
    sharp = np.zeros(n)
    for v, s in (corners or {}).items():
        sharp[v] = s
    start = np.r_[0, np.cumsum([len(p) for p in polygons])]
    ends = np.array(list(creases), np.int64).reshape(-1, 2)
    return Cage(corner, start, n, ends, np.array(list(creases.values()), float), sharp)


def grid(columns=3, rows=3):
    _, quads = meshes.quad_grid(columns, rows)
    # A triangle and a pentagon among the quads.
    middle = quads.pop(4)
    return [*quads, middle[:3], [middle[0], middle[2], middle[3]]]


def box():
    return [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]


def edges_of(polygons):
    """Polygons at every edge."""
    found = {}
    for k, p in enumerate(polygons):
        for i in range(len(p)):
            found.setdefault(tuple(sorted((p[i], p[(i + 1) % len(p)]))), []).append(k)
    return found


def one_level(polygons, points, creases, corners):
    """Where vertices, edges and polygons go in a level, by the rules as they are written."""
    at = edges_of(polygons)
    sharp = {e: SHARP if len(f) != 2 else creases.get(e, creases.get(e[::-1], 0.0)) for e, f in at.items()}
    centre = [np.mean([points[v] for v in p], axis=0) for p in polygons]
    middle = {e: (points[e[0]] + points[e[1]]) / 2 for e in at}
    edge = {}
    for e, faces in at.items():
        s = min(sharp[e], 1)
        smooth = 0.0 if len(faces) != 2 else (points[e[0]] + points[e[1]] + centre[faces[0]] + centre[faces[1]]) / 4
        edge[e] = s * middle[e] + (1 - s) * smooth

    def ruled(v, level):
        mine = [e for e in at if v in e]
        hard = [e for e in mine if sharp[e] > level]
        if corners.get(v, 0.0) > level or len(hard) > 2:
            return "corner", points[v]
        if len(hard) == 2:
            return "crease", (6 * points[v] + sum(points[sum(e) - v] for e in hard)) / 8
        faces = [k for k, p in enumerate(polygons) if v in p]
        k = len(faces)
        around = sum(points[sum(e) - v] for e in mine) + sum(centre[f] for f in faces)
        return "smooth", (k - 2) / k * points[v] + around / k**2

    vertex = []
    for v in range(len(points)):
        (rule, before), (later, after) = ruled(v, 0.0), ruled(v, 1.0)
        passing = [sharp[e] for e in at if v in e and 0 < sharp[e] < 1]
        passing += [corners[v]] if 0 < corners.get(v, 0.0) < 1 else []
        share = 1.0 if rule == later or not passing else np.mean(passing)
        vertex.append(share * before + (1 - share) * after)
    return np.array(vertex), edge, np.array(centre)


CREASED = {
    "none": ({}, {}),
    "whole": ({(0, 1): 2.0, (1, 2): 1.0, (5, 6): 3.0}, {}),
    "parts": ({(0, 1): 0.5, (1, 5): 0.25, (1, 2): 0.75, (2, 6): 1.0}, {}),
    "corner": ({(5, 6): 0.5}, {5: 0.5, 6: 2.0, 1: 0.25}),
}


@pytest.mark.parametrize("kind", CREASED)
@pytest.mark.parametrize("make", [grid, box])
def test_points_of_a_level_are_those_of_the_rules(make, kind):
    polygons = make()
    creases, corners = CREASED[kind]
    creases = {e: s for e, s in creases.items() if e in edges_of(polygons)}
    cage = cage_of(polygons, creases, corners)
    points = np.random.default_rng(3).standard_normal((cage.count, 3))
    found = subdivide(cage, 1, limit=False)
    fine = found.matrix @ points
    vertex, edge, centre = one_level(polygons, points, creases, corners)
    n, e = len(points), len(edge)
    assert fine[:n] == pytest.approx(vertex) and fine[n + e :] == pytest.approx(centre)
    k = 0
    for p, polygon in enumerate(polygons):
        for i in range(len(polygon)):
            a, here, b = polygon[i - 1], polygon[i], polygon[(i + 1) % len(polygon)]
            quad = fine[found.quads[k]]
            want = [vertex[here], edge[tuple(sorted((here, b)))], centre[p], edge[tuple(sorted((a, here)))]]
            assert quad == pytest.approx(np.array(want)) and found.polygon[k] == p
            k += 1


@pytest.mark.parametrize("kind", ["whole", "parts", "corner"])
def test_creases_lose_one_of_their_sharpness_in_every_level(kind):
    polygons = box()
    creases, corners = CREASED[kind]
    creases = {e: s for e, s in creases.items() if e in edges_of(polygons)}
    cage = cage_of(polygons, creases, corners)
    points = np.random.default_rng(5).standard_normal((8, 3))
    vertex, edge, centre = one_level(polygons, points, creases, corners)
    number = {e: 8 + k for k, e in enumerate(sorted(edge))}
    fine = np.concatenate([vertex, [edge[e] for e in sorted(edge)], centre])
    finer, halves = [], {}
    for p, polygon in enumerate(polygons):
        for i in range(len(polygon)):
            a, here, b = polygon[i - 1], polygon[i], polygon[(i + 1) % len(polygon)]
            ends = tuple(sorted((here, b))), tuple(sorted((a, here)))
            finer.append([here, number[ends[0]], 8 + len(edge) + p, number[ends[1]]])
    for e, s in creases.items():
        for v in e:
            halves[tuple(sorted((v, number[e])))] = max(s - 1, 0.0)
    later = {v: max(s - 1, 0.0) for v, s in corners.items()}
    want = one_level(finer, fine, halves, later)[0]
    assert (subdivide(cage, 2, limit=False).matrix @ points)[: len(want)] == pytest.approx(want)


@pytest.mark.parametrize(
    ("creased", "corners"),
    [([], []), ([(0, 1), (1, 2), (2, 3), (0, 3)], []), ([(0, 1), (1, 2), (2, 3), (0, 3)], [1, 6])],
)
def test_the_limit_is_where_many_levels_go(creased, corners):
    # A crease that ends within the surface has no limit rule of its own, for Blender neither.
    cage = cage_of(box(), dict.fromkeys(creased, SHARP), dict.fromkeys(corners, SHARP))
    points = np.random.default_rng(7).standard_normal((8, 3))
    limit = subdivide(cage, 1, limit=True).matrix @ points
    steps = [subdivide(cage, k, limit=False).matrix[: len(limit)] @ points for k in (4, 5)]
    gaps = [np.abs(x - limit).max() for x in steps]
    assert gaps[1] < 0.02 and gaps[1] <= 0.6 * gaps[0] + 1e-12


@pytest.mark.parametrize("levels", [1, 2])
def test_bilinear_levels_are_means_of_ends_and_corners(levels):
    polygons = grid()
    cage = cage_of(polygons)
    points = np.random.default_rng(2).standard_normal((cage.count, 2))
    found = bilinear(cage, levels)
    fine = (found.matrix @ points)[found.quads]
    quads, owner = [points[p] for p in polygons], list(range(len(polygons)))
    for _ in range(levels):
        pieces, of = [], []
        for q, k in zip(quads, owner, strict=True):
            for i in range(len(q)):
                pieces.append(np.array([q[i], (q[i] + q[(i + 1) % len(q)]) / 2, q.mean(axis=0), (q[i] + q[i - 1]) / 2]))
                of.append(k)
        quads, owner = pieces, of
    assert fine == pytest.approx(np.array(quads)) and found.polygon.tolist() == owner


def test_straight_outlines_and_corners_have_vertices_of_their_own():
    polygons = grid()
    cage = cage_of(polygons, corners={5: 0.5})
    outer = {v for e, f in edges_of(polygons).items() if len(f) == 1 for v in e}
    sharp = straight_boundary(cage).corner_sharpness
    assert set(np.flatnonzero(sharp == SHARP).tolist()) == outer and sharp[5] == 0.5
    alone = {v for v in range(16) if sum(v in p for p in polygons) == 1}
    sharp = straight_corners(cage).corner_sharpness
    assert set(np.flatnonzero(sharp == SHARP).tolist()) == alone == {0, 3, 12, 15} and sharp[5] == 0.5


def two_islands():
    """A grid of 2 x 2 quads whose UVs are parted along the middle: vertices of UVs, and those of the surface."""
    _, quads = meshes.quad_grid(2, 2)
    vertex = np.array(quads).ravel()
    parted = vertex.copy()
    right = np.repeat([False, True, False, True], 4)
    parted[right] = np.where(np.isin(vertex[right], [1, 4, 7]), 9 + vertex[right] // 3, vertex[right])
    ids = np.concatenate([np.arange(9), [1, 4, 7]])
    return parted, np.arange(0, 17, 4), ids


def test_creases_of_uvs_are_those_between_their_vertices_of_the_surface():
    vertex, start, ids = two_islands()
    given = SubdivisionModifier(1, ends=np.array([[4, 1], [3, 4], [7, 8]]), sharpness=np.array([1.0, 2.0, 0.5]))
    ends, sharpness = modifier._creases(vertex, start, ids, given)
    found = {}
    for e, s in zip(ends.tolist(), sharpness.tolist(), strict=True):
        found.setdefault(tuple(sorted(e)), set()).add(s)
    assert found == {(1, 4): {1.0}, (9, 10): {1.0}, (3, 4): {2.0}, (8, 11): {0.5}}
    none = SubdivisionModifier(1)
    assert len(modifier._creases(vertex, start, ids, none)[0]) == 0


@pytest.mark.parametrize(
    ("smooth", "sharp"),
    [
        (modifier.SMOOTH_UV, set()),
        ("PRESERVE_CORNERS", {0, 2, 6, 8, 1, 7, 9, 11}),
        ("PRESERVE_CORNERS_AND_JUNCTIONS", {0, 2, 6, 8, 1, 7, 9, 11}),
        (modifier.STRAIGHT_UV, {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}),
    ],
)
def test_uvs_keep_the_corners_that_the_modifier_names(smooth, sharp, monkeypatch):
    vertex, start, ids = two_islands()
    given = []
    monkeypatch.setattr(modifier, "subdivide", lambda cage, levels, limit: given.append((cage, levels, limit)))
    for limit in (True, False):
        subdivided_uv(vertex, start, ids, SubdivisionModifier(1, uv_smooth=smooth, limit=limit), 3)
    cage = given[0][0]
    assert [found[1:] for found in given] == [(3, True), (3, False)]
    assert set(np.flatnonzero(cage.corner_sharpness == SHARP).tolist()) == sharp


def test_uvs_keep_the_places_where_three_and_more_islands_meet():
    # Three quads about a vertex, each an island of its own, and a fourth beside.
    vertex, start = np.arange(16), np.arange(0, 17, 4)
    ids = np.array([0, 1, 2, 3, 0, 3, 4, 5, 0, 5, 6, 1, 6, 7, 8, 1])
    given = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(modifier, "subdivide", lambda cage, *_: given.append(cage))
        # Corners alone in their polygons would all be sharp.
        patch.setattr(modifier, "straight_corners", lambda cage: cage)
        for smooth in ("PRESERVE_CORNERS", "PRESERVE_CORNERS_AND_JUNCTIONS"):
            subdivided_uv(vertex, start, ids, SubdivisionModifier(1, uv_smooth=smooth), 1)
    assert not given[0].corner_sharpness.any()
    several = {v for v in range(9) if (ids == v).sum() > 2}
    assert several == {0, 1} and set(ids[given[1].corner_sharpness == SHARP].tolist()) == several


@pytest.mark.parametrize("own", [False, True])
def test_uvs_have_the_sharpness_of_vertices_of_the_surface(own):
    sharpness = np.array([0.5, 0.0, 2.0]) if own else None
    found = modifier._corner_sharpness(np.array([2, -1, 0]), SubdivisionModifier(1, corner_sharpness=sharpness))
    assert found.tolist() == ([2.0, 0.0, 0.5] if own else [0, 0, 0])


def test_scaled_rows_and_neighbours_are_those_of_dense_matrices():
    ends = np.array([[0, 1], [1, 2], [3, 1]])
    dense = np.zeros((4, 4))
    for a, b in ends:
        dense[a, b] = dense[b, a] = 1
    found = catmull_clark._neighbours(ends, 4)
    assert np.array_equal(found.toarray(), dense)
    factor = np.array([1.0, 2.0, 0.0, -1.0])
    assert np.array_equal(catmull_clark._scaled(factor, found).toarray(), factor[:, None] * dense)
    with pytest.raises(ValueError, match="at least 1"):
        subdivide(replace(cage_of(grid())), 0)
