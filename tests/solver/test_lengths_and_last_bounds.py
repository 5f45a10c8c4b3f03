"""Bounds that are a share of the size, points that are exactly as far apart as asked for, prices of loops, and areas
that overflow: told by plain sums."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.straight_paths import TURN, closed_price
from omt_uv.solver.errors import LandmarkError
from omt_uv.solver.flows.handles import farthest_points
from omt_uv.solver.mesh.polygon_areas import polygon_areas
from omt_uv.solver.registration.landmarks import SAME, check_landmarks, no_landmarks


@pytest.mark.parametrize("count", [3, 4, 7])
def test_a_loop_costs_its_length_and_the_turns_between_its_sides(count):
    positions = np.random.default_rng(count).normal(size=(2 * count, 3))
    loop = np.random.default_rng(count + 1).permutation(2 * count)[:count]
    price = 0.0
    for k in range(count):
        before, after = (
            positions[loop[k]] - positions[loop[k - 1]],
            positions[loop[(k + 1) % count]] - positions[loop[k]],
        )
        one, other = np.linalg.norm(before), np.linalg.norm(after)
        price += after @ after / other + TURN * (1 - before @ after / (one * other)) * (one + other) / 2
    for given in (loop, np.roll(loop, 1), loop[::-1]):
        assert closed_price(positions, given) == pytest.approx(price)


@pytest.mark.parametrize("size", [1e-300, 1e-200, 1e-100, 1e-6, 1.0, 1e6, 1e200, 1e300])
def test_landmarks_are_one_by_a_share_of_the_size_of_the_surface(size):
    apart = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0]]) * size
    for off, refused in ((SAME / 2, True), (2 * SAME, False)):
        near = apart + [[0, 0, 0], [0, 0, 0], [2 * size, off * size, 0]]
        for source, target, name in ((near, apart, "source"), (apart, near, "target")):
            if refused:
                with pytest.raises(LandmarkError, match=f"Landmarks 0 and 2 are the same point of the {name}"):
                    check_landmarks(no_landmarks(), source, target)
            else:
                check_landmarks(no_landmarks(), source, target)


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize(("spacing", "count"), [(0.5, 9), (1.0, 9), (1.0 + 1e-9, 5), (2.0, 5), (4.0, 3), (4.5, 1)])
def test_points_exactly_as_far_apart_as_asked_for_are_all_taken(dimension, spacing, count):
    points = np.arange(9.0)[:, None] * np.eye(dimension)[0]
    rows = farthest_points(points, spacing, 99)
    assert len(rows) == count and rows[0] == 4
    taken = points[rows]
    between = np.linalg.norm(taken[:, None] - taken, axis=2) + np.diag(np.full(count, np.inf))
    assert between.min() >= spacing
    assert len(farthest_points(points, spacing, 2)) == min(count, 2)


def test_areas_beyond_all_numbers_are_infinite_and_leave_others_as_they_are():
    """Of a quad, of a polygon of three triangles, and of a triangle, one as large as no number."""
    V, F = meshes.grid(2, 1)[:2]
    polygons = np.array([0, 0, 1, 1])
    plain = polygon_areas(V, F, polygons)
    with np.errstate(all="ignore"):
        for far in range(2):
            huge = V.copy()
            huge[F[2 * far : 2 * far + 2].ravel()] *= 1e200
            apart = np.concatenate([V, huge])
            both = np.concatenate([F, F[2 * far : 2 * far + 2] + len(V)])
            found = polygon_areas(apart, both, np.append(polygons, [2, 2]))
            assert np.isinf(found[4:]).all() and not np.isnan(found).any()
            np.testing.assert_array_equal(found[:4], plain)
