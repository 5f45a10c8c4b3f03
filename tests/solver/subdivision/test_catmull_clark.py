"""Catmull-Clark surfaces: known points, and what holds for every mesh."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from omt_uv.solver.subdivision.catmull_clark import (
    Cage,
    bilinear,
    cage_of,
    straight_boundary,
    straight_corners,
    subdivide,
)

CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
FACES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])


def cube() -> Cage:
    return cage_of(FACES.ravel(), np.arange(0, 25, 4), 8)


def grid(k: int = 4) -> tuple[Cage, np.ndarray]:
    corner = np.arange((k + 1) * k).reshape(k, k + 1)[:, :-1].ravel()
    quads = np.column_stack([corner, corner + 1, corner + k + 2, corner + k + 1])
    y, x = np.divmod(np.arange((k + 1) ** 2), k + 1)
    return cage_of(quads.ravel(), np.arange(0, 4 * len(quads) + 1, 4), (k + 1) ** 2), np.column_stack([x, y]) / k


@pytest.mark.parametrize("limit", [False, True])
@pytest.mark.parametrize("levels", [1, 3])
def test_rows_sum_to_one_and_quads_lie_polygon_by_polygon(levels, limit):
    found = subdivide(cube(), levels, limit)
    assert np.allclose(np.asarray(found.matrix.sum(axis=1)), 1)
    assert (found.polygon == np.repeat(np.arange(6), 4**levels)).all()


@pytest.mark.parametrize("pages", [1, 2, 3, 5])
@pytest.mark.parametrize("limit", [False, True])
def test_a_straight_boundary_stays_where_other_than_two_polygons_meet(pages, limit):
    """Pages of two quads each, one behind the other, bound along an edge: within a book of two nothing is kept."""
    turn = 2 * np.pi * np.arange(pages) / max(pages, 1)
    spine = np.array([[0, 0, 0], [0.3, 0.4, 1.2], [0, 0, 2]])
    rest = [[r * np.cos(t), r * np.sin(t), z] for t in turn for r in (1, 2) for z in (0.0, 1, 2)]
    V = np.concatenate([spine, rest])
    quads = []
    for k in range(pages):
        rows = [[0, 1, 2], *([3 + 6 * k + 3 * r + z for z in range(3)] for r in range(2))]
        quads += [[a[z], b[z], b[z + 1], a[z + 1]] for a, b in pairwise(rows) for z in range(2)]
    sides = [frozenset((q[i], q[i - 1])) for q in quads for i in range(4)]
    stays = sorted({v for side in sides if sides.count(side) != 2 for v in side})
    cage = cage_of(np.array(quads).ravel(), np.arange(0, 4 * len(quads) + 1, 4), len(V))
    moved = np.linalg.norm((subdivide(straight_boundary(cage), 2, limit).matrix @ V)[: len(V)] - V, axis=1)
    np.testing.assert_allclose(moved[stays], 0, atol=1e-12)
    assert (1 in stays) == (pages != 2)
    assert {tuple(sorted(s)) for s in sides if sides.count(s) != 2} >= ({(0, 1), (1, 2)} if pages != 2 else set())


def test_points_of_a_cube_after_a_level():
    points = subdivide(cube(), 1, limit=False).matrix @ CUBE
    assert np.allclose(points[:8], CUBE * 5 / 9)
    assert np.allclose(np.abs(points[8:20]).max(axis=1), 0.75)
    assert np.allclose(np.abs(points[20:]).max(axis=1), 1)


def test_levels_do_not_change_the_limit():
    coarse, fine = (subdivide(cube(), levels).matrix @ CUBE for levels in (1, 3))
    assert np.allclose(fine[:26], coarse)


@pytest.mark.parametrize("smoothed", [straight_boundary, straight_corners])
def test_flat_regular_grids_stay_flat(smoothed):
    cage, uv = grid()
    found = subdivide(smoothed(cage), 2)
    points = found.matrix @ uv
    assert points.min() == pytest.approx(0) and points.max() == pytest.approx(1)
    assert np.allclose(bilinear(cage, 2).matrix.sum(axis=1), 1)


def test_straight_boundaries_stay_where_they_are():
    cage, uv = grid()
    bent = uv + np.where(uv[:, :1] == 0, 0.1 * np.sin(5 * uv[:, 1:]), 0)
    points = subdivide(straight_boundary(cage), 2).matrix @ bent
    assert np.allclose(points[:25][uv[:, 0] == 0], bent[uv[:, 0] == 0])
    assert not np.allclose((subdivide(cage, 2).matrix @ bent)[:25][uv[:, 0] == 0], bent[uv[:, 0] == 0])


def test_a_crease_for_ever_keeps_an_edge_and_half_a_one_lies_between():
    def middle(sharpness):
        cage = cube()
        creased = Cage(
            cage.corner_vertex, cage.face_start, 8, np.array([[0, 1]]), np.array([sharpness]), cage.corner_sharpness
        )
        return (subdivide(creased, 1, limit=False).matrix @ CUBE)[8]

    assert np.allclose(middle(10.0), [-1, -1, 0])
    assert np.allclose(middle(0.5), (middle(0.0) + middle(10.0)) / 2)


def test_no_levels_are_refused():
    with pytest.raises(ValueError, match="levels"):
        subdivide(cube(), 0)
