"""Corners of polygons, and the barrier that keeps them convex."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.parameterization.polygons.polygon_corners import (
    CONVEX,
    CornerBarrier,
    PolygonCorners,
    convex_corners,
    straight_share,
)


def test_only_corners_of_convex_polygons_count_and_no_straight_ones():
    V = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [1, 2, 0], [0.5, 0.5, 0], [3, 0, 0], [3, 2, 0]], float)
    polygons = [[0, 1, 2, 4, 3], [0, 1, 5, 3], [1, 6, 7], [1, 6, 7, 2]]
    surface = meshes.polygon_surface(1e5 + 1e-3 * V, polygons)
    corner, polygon, share = convex_corners(surface)
    assert sorted(surface.corner_vertex[corner[polygon == 0, 0]]) == [0, 1, 2, 3]
    assert set(polygon) == {0, 3}
    np.testing.assert_allclose(share[polygon == 3], 0.5, rtol=1e-6)


def test_the_barrier_is_the_integral_of_its_gradient():
    rng = np.random.default_rng(0)
    w = rng.normal(size=6) + 1j * rng.normal(size=6)
    corners = PolygonCorners(
        np.array([[0, 1, 2], [2, 3, 4], [5, 1, 0]]), np.arange(3), np.ones(3), np.ones(3), np.zeros(3)
    )
    barrier = CornerBarrier(corners, np.full(3, 9.0), np.array([1.0, 2, 3]))
    direction = rng.normal(size=6) + 1j * rng.normal(size=6)
    difference = (barrier.energy(w + 1e-6 * direction) - barrier.energy(w - 1e-6 * direction)) / 2e-6
    slope, vertices, rows = barrier.derivatives(w)
    assert difference == pytest.approx((slope.conj() @ direction).real, rel=1e-6)
    assert vertices.shape == rows.shape == (3, 3)


def test_corners_of_a_regular_polygon_have_equal_shares():
    angle = 2 * np.pi * np.arange(7) / 7
    surface = meshes.polygon_surface(np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), [list(range(7))])
    corner, polygon, share = convex_corners(surface)
    assert len(corner) == 7 and (polygon == 0).all() and np.ptp(share) < 1e-12
    # The corner of a regular n-gon: sin(t) (1 - cos t) of n sin(t) / 2, with t = 2 pi / n.
    assert share[0] == pytest.approx(2 * (1 - np.cos(2 * np.pi / 7)) / 7)


def test_reflex_and_convex_are_told_by_the_signed_area():
    w = np.array([0, 1, 1 + 1j, 1j, 0.5 + 1e-3j])
    corners = PolygonCorners(
        triangles=np.array([[0, 1, 3], [0, 3, 1], [0, 1, 4]]),
        polygon=np.arange(3),
        target=np.full(3, 0.5),
        whole=np.ones(3),
        least=np.zeros(3),
    )
    np.testing.assert_allclose(corners.areas(w), [0.5, -0.5, 5e-4])
    assert corners.reflex(w).tolist() == [False, True, False]
    assert corners.convex(w).tolist() == [True, False, False] and CONVEX * 0.5 > 5e-4
    some = corners.of(np.array([True, False, True]), np.array([4, 3, 2, 1, 0]))
    np.testing.assert_allclose(some.areas(w[::-1]), corners.areas(w)[[0, 2]])


def test_the_barrier_is_least_at_the_target_and_infinite_without_area():
    corners = PolygonCorners(np.array([[0, 1, 2]]), np.zeros(1, int), np.array([0.5]), np.ones(1), np.zeros(1))
    barrier = CornerBarrier(corners, np.zeros(1), np.ones(1))
    right = np.array([0, 1, 1j])
    assert barrier.energy(right) == 0 and np.abs(barrier.derivatives(right)[0]).max() == 0
    assert barrier.energy(right.conj()) == np.inf and barrier.energy(2 * right) > 0


def test_no_corner_of_a_regular_polygon_is_straight():
    for sides in (4, 5, 8, 13, 40, 1000):
        angle = 2 * np.pi * np.arange(sides) / sides
        V = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
        _, _, share = convex_corners(meshes.polygon_surface(V, [list(range(sides))]), straight=True)
        assert len(share) == sides and (share > 2 * straight_share(np.full(sides, sides))).all()


def test_a_polygon_of_many_sides_with_a_deep_notch_is_not_convex():
    angle = 2 * np.pi * np.arange(40) / 40
    V = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    V[0] *= 0.9
    assert not len(convex_corners(meshes.polygon_surface(V, [list(range(40))]), straight=True)[0])
