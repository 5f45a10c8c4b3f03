"""Projections of the sphere: bijections, equal-area ones with one Jacobian, and the rotations that turn a globe."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.globe.projections import (
    EQUIRECT,
    LAMBERT,
    OCTAHEDRAL,
    PROJECTIONS,
    octahedral_to_plane,
    to_plane,
    to_sphere,
    wrap_octahedral,
)


def random_points(count=4000, seed=0):
    points = np.random.default_rng(seed).normal(size=(count, 3))
    return points / np.linalg.norm(points, axis=1, keepdims=True)


def near_poles(count=400):
    """Points at distances from 1e-9 to 1e-2 of both poles."""
    angle = np.random.default_rng(1).random(count) * 2 * np.pi
    r = np.geomspace(1e-9, 1e-2, count)
    z = np.sqrt(1 - r**2) * np.where(np.arange(count) % 2, 1, -1)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), z])


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("points", [random_points(), near_poles()], ids=["all", "poles"])
def test_every_projection_and_its_inverse_cancel(projection, points):
    uv = to_plane(points, projection)
    assert uv.min() >= 0 and uv.max() <= 1
    # Near a pole the height of a cylinder is flat: half of the digits are lost, as for any arc of a cosine.
    tolerance = 1e-12 if points.shape[0] > 1000 else 2e-8
    assert np.abs(to_sphere(uv, projection) - points).max() < tolerance


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_the_inverse_is_onto_and_injective(projection):
    uv = np.random.default_rng(2).random((4000, 2))
    points = to_sphere(uv, projection)
    assert np.allclose(np.linalg.norm(points, axis=1), 1, atol=1e-14)
    assert np.abs(to_plane(points, projection) - uv).max() < 1e-9


@pytest.mark.parametrize("projection", [LAMBERT, OCTAHEDRAL])
def test_equal_area_projections_have_one_jacobian(projection):
    rng = np.random.default_rng(3)
    uv, h = 0.02 + 0.96 * rng.random((3000, 2)), 1e-6
    if projection == OCTAHEDRAL:  # away from the creases, where it has no derivative
        a, b = np.abs(2 * uv - 1).T
        uv = uv[(np.abs(a + b - 1) > 0.01) & (a > 0.01) & (b > 0.01)]
    du = (to_sphere(uv + [h, 0], projection) - to_sphere(uv - [h, 0], projection)) / (2 * h)
    dv = (to_sphere(uv + [0, h], projection) - to_sphere(uv - [0, h], projection)) / (2 * h)
    jacobian = (np.cross(du, dv) * to_sphere(uv, projection)).sum(axis=1)
    assert np.allclose(jacobian, 4 * np.pi, rtol=1e-6)


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_north_is_up_the_front_in_the_middle_and_east_right_of_it(projection):
    front, east, north = to_plane(np.array([[0.0, -1, 0], [0.1, -1, 0], [0, -1, 0.1]]), projection)
    if projection == OCTAHEDRAL:
        assert np.allclose(to_plane(np.array([0.0, 0, 1]), projection), 0.5)
        assert np.allclose(front, [0.5, 0])
        assert east[0] > 0.5 and north[1] > 0
    else:
        assert np.allclose(front, 0.5)
        assert east[0] > 0.5 and north[1] > 0.5
    assert to_plane(np.array([0.0, 0, 1]), EQUIRECT)[1] == 1


def test_the_octahedral_layout_goes_on_beyond_its_sides():
    x = np.random.default_rng(4).uniform(-1, 1, (500, 2))
    for centre in ([1, 0], [0, 1], [-1, 0], [0, -1]):
        assert np.allclose(wrap_octahedral(2 * np.array(centre) - x), x, atol=1e-12)
    # Both images of a point of a side are one point of the sphere, and so is the south pole in all four corners.
    side = np.column_stack([np.ones(50), np.linspace(-0.99, 0.99, 50)])
    assert np.allclose(to_sphere(0.5 * (side + 1), OCTAHEDRAL), to_sphere(0.5 * (side * [1, -1] + 1), OCTAHEDRAL))
    assert np.allclose(np.abs(octahedral_to_plane(np.array([[0.0, 0, -1]]))), 1)
