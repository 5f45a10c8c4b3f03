"""Convex domains: their integrals, their boundary, and where lines cross it."""

import numpy as np
import pytest

from omt_uv.solver.transport.convex_domain import ConvexPolygon, Disk, Rectangle, segment_integrals

DOMAINS = {
    "disk": Disk(2.0),
    "rectangle": Rectangle(3.0, 0.5),
    "pentagon": ConvexPolygon(np.array([[0, 0], [2, 0], [3, 1], [1, 3], [-1, 1.0]])),
}


@pytest.fixture(params=DOMAINS, ids=str)
def domain(request):
    return DOMAINS[request.param]


def test_the_integrals_once_around_are_area_and_moments(domain):
    twice, x, y, _ = domain.total_integrals()
    assert twice == pytest.approx(2 * domain.area)
    np.testing.assert_allclose([x, y], 0, atol=1e-12)


def test_integrals_along_arcs_add_up(domain):
    s = np.linspace(0, domain.period, 37)
    np.testing.assert_allclose(domain.boundary_integrals(s[-1:])[:, 0], domain.total_integrals(), atol=1e-12)
    np.testing.assert_allclose(domain.boundary_integrals(np.zeros(1)), 0, atol=1e-12)


def test_many_chords_approach_the_arc(domain):
    s = np.linspace(0, domain.period, 200_001)
    points = domain.boundary_point(s)
    np.testing.assert_allclose(
        segment_integrals(points[:-1], points[1:]).sum(axis=1), domain.total_integrals(), atol=1e-8
    )


def test_parameters_and_points_of_the_boundary_are_inverse(domain):
    s = np.random.default_rng(0).uniform(0, domain.period, 100)
    points = domain.boundary_point(s)
    np.testing.assert_allclose(domain.boundary_parameter(points), s, atol=1e-12)
    assert domain.contains(points * (1 - 1e-9)).all()
    assert not domain.contains(points * (1 + 1e-9)).any()


def test_lines_enter_and_leave_at_the_boundary(domain):
    random = np.random.default_rng(1)
    origin, turn = random.normal(size=(50, 2)), random.uniform(0, 2 * np.pi, 50)
    direction = np.column_stack([np.cos(turn), np.sin(turn)])
    enter, leave = domain.clip(origin, direction)
    hit = enter < leave
    assert hit.any()
    for t in (enter, leave):
        points = (origin + t[:, None] * direction)[hit]
        np.testing.assert_allclose(domain.boundary_point(domain.boundary_parameter(points)), points, atol=1e-9)
    samples = origin + np.linspace(-9, 9, 400)[:, None, None] * direction
    assert not domain.contains(samples[:, ~hit].reshape(-1, 2)).any()


def test_shares_of_the_boundary_are_of_its_length(domain):
    points = domain.map_boundary(np.arange(4000) / 4000)
    step = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    assert step.max() == pytest.approx(np.median(step), rel=1e-6)


def test_a_polygon_has_its_centroid_at_0_wherever_it_was():
    corners = np.array([[0, 0], [2, 0], [3, 1], [1, 3], [-1, 1.0]])
    a, b = ConvexPolygon(corners), ConvexPolygon(corners + [5, -3])
    np.testing.assert_allclose(a.corners, b.corners, atol=1e-12)


def test_the_parameter_of_any_point_is_that_of_the_nearest_one_of_the_boundary(domain):
    points = np.random.default_rng(2).normal(size=(60, 2)) * np.sqrt(domain.area)
    found = domain.boundary_parameter(points)
    assert ((found >= 0) & (found < domain.period)).all()
    many = domain.boundary_point(np.linspace(0, domain.period, 4000, endpoint=False))
    nearest = np.linalg.norm(points[:, None] - many, axis=2).min(axis=1)
    assert (np.linalg.norm(points - domain.boundary_point(found), axis=1) <= nearest + 1e-12).all()


@pytest.mark.parametrize("name", ["rectangle", "pentagon"])
def test_lines_along_a_side_are_in_the_polygon_for_its_length(name):
    """Both ends are inside or on a side, as are all points between them."""
    polygon = DOMAINS[name]
    if name == "rectangle":
        origin, direction = (
            np.array([[0.0, -0.25], [1.5, 0.0], [0.0, 0.2500001]]),
            np.array([[1.0, 0], [0, -1.0], [1, 0]]),
        )
        enter, leave = polygon.clip(origin, direction)
        np.testing.assert_allclose(leave[:2] - enter[:2], [3.0, 0.5])
        assert enter[2] > leave[2]
    else:
        enter, leave = polygon.clip(polygon.corners, polygon.tangent)
        off = np.abs(polygon.tangent @ polygon.normal.T) == 0
        assert off.any(axis=1).any()
        np.testing.assert_allclose((leave - enter)[off.any(axis=1)], polygon.length[off.any(axis=1)])


@pytest.mark.parametrize("seed", range(4))
def test_parameters_of_points_beside_a_corner_are_those_of_the_corner(seed):
    """Where a polygon ends it begins, whichever of both sides rounding finds nearer."""
    rng = np.random.default_rng(seed)
    turn = np.sort(rng.uniform(0, 2 * np.pi, 5))
    polygon = ConvexPolygon(np.column_stack([np.cos(turn), np.sin(turn)]))
    for k, corner in enumerate(polygon.corners):
        beyond = polygon.normal[k] + polygon.normal[k - 1]
        s = polygon.boundary_parameter(corner + rng.random((200, 1)) * beyond)
        assert (s >= 0).all() and (s < polygon.period).all()
        np.testing.assert_allclose(s, polygon.start[k], atol=1e-12)


def test_points_of_the_boundary_come_again_after_once_around(domain):
    s = np.append(np.random.default_rng(3).uniform(0, domain.period, 50), 0.0)
    for times in (-2, -1, 1, 3):
        np.testing.assert_allclose(
            domain.boundary_point(s + times * domain.period), domain.boundary_point(s), atol=1e-12
        )
