"""Power diagrams: exact sums, and what they do not depend on."""

import contextlib

import numpy as np
import pytest

from omt_uv.solver.errors import TransportError
from omt_uv.solver.transport.convex_domain import Disk, Rectangle
from omt_uv.solver.transport.power_diagram import power_diagram
from omt_uv.solver.transport.regular_triangulation import by_hull


@pytest.fixture
def sites():
    return np.random.default_rng(0).uniform(-0.45, 0.45, (60, 2))


@pytest.fixture
def site_weights():
    return 5e-4 * np.random.default_rng(1).normal(size=60)


def test_two_sites_share_a_square_at_their_bisector():
    sites = np.array([[-0.25, 0.0], [0.25, 0], [0, 9]])
    cells = power_diagram(sites, np.array([0.0, 0.1, 0]), Rectangle())
    # The bisector |x - a|^2 = |x - b|^2 - 0.1 lies at x = -0.1.
    np.testing.assert_allclose(cells.area, [0.4, 0.6, 0], atol=1e-14)
    np.testing.assert_allclose(cells.moment, [[-0.12, 0], [0.12, 0], [0, 0]], atol=1e-14)


def test_a_common_weight_changes_nothing(sites, site_weights):
    a, b = (power_diagram(sites, site_weights + c, Disk()).area for c in (0, 0.7))
    np.testing.assert_allclose(a, b, atol=1e-14)


def test_cells_follow_turn_and_mirror(sites, site_weights):
    plain = power_diagram(sites, site_weights, Disk())
    for matrix in (np.array([[0.6, -0.8], [0.8, 0.6]]), np.diag([1.0, -1])):
        moved = power_diagram(sites @ matrix.T, site_weights, Disk())
        np.testing.assert_allclose(moved.area, plain.area, atol=1e-14)
        np.testing.assert_allclose(moved.moment, plain.moment @ matrix.T, atol=1e-14)


def test_the_order_of_sites_does_not_matter(sites, site_weights):
    order = np.random.default_rng(2).permutation(60)
    plain, shuffled = (power_diagram(sites[k], site_weights[k], Disk()) for k in (np.arange(60), order))
    back = shuffled.renumbered(order)
    np.testing.assert_allclose(back.area, plain.area, atol=1e-14)
    assert {tuple(sorted(e)) for e in back.edges.tolist()} == {tuple(sorted(e)) for e in plain.edges.tolist()}


def test_lengths_of_sides_are_derivatives_of_areas(sites, site_weights):
    """d area_i / d weight_j = -|side ij| / (2 |y_i - y_j|)."""
    j, step = 7, 1e-6
    up = np.where(np.arange(60) == j, step, 0)
    more, less, cells = (power_diagram(sites, site_weights + s * up, Disk()) for s in (1, -1, 0))
    expected = np.zeros(60)
    for (a, b), length in zip(cells.edges, cells.length, strict=True):
        if j in (a, b):
            rate = length / (2 * np.linalg.norm(sites[a] - sites[b]))
            expected[[a, b]] += np.where(np.array([a, b]) == j, rate, -rate)
    np.testing.assert_allclose((more.area - less.area) / (2 * step), expected, atol=1e-6)


def test_the_cost_is_that_of_the_moments(sites, site_weights):
    """Within a cell of area A and centroid c the cost of a site y exceeds that of c by A |y - c|^2."""
    cells = power_diagram(sites, site_weights, Disk())
    at_centroids = cells.cost(cells.centroid)
    apart = ((sites - cells.centroid) ** 2).sum(axis=1)
    assert cells.cost(sites) - at_centroids == pytest.approx(cells.area @ apart, rel=1e-10)


def test_a_known_triangulation_gives_the_same_cells(sites, site_weights):
    known = power_diagram(sites, site_weights, Disk(), by_hull(sites, site_weights))
    np.testing.assert_array_equal(known.area, power_diagram(sites, site_weights, Disk()).area)


@pytest.mark.parametrize("domain", [Disk(), Rectangle(2.0, 1.0)], ids=["disk", "rectangle"])
@pytest.mark.parametrize("heavy", [0, 3])
def test_a_cell_that_weighs_more_than_all_has_the_whole_domain(domain, heavy):
    """No side of a cell then crosses the boundary."""
    sites = np.array([[0.1, 0.2], [0.3, -0.1], [-0.2, 0.15], [0.05, -0.3]])
    weights = np.where(np.arange(4) == heavy, 50.0, 0.0)
    even = power_diagram(sites, np.zeros(4), domain)
    found = power_diagram(sites, weights, domain)
    assert found.area[heavy] == pytest.approx(even.area.sum()) and np.delete(found.area, heavy) == pytest.approx(0)
    assert found.moment[heavy] == pytest.approx(even.moment.sum(axis=0), abs=1e-12)
    assert found.second[heavy] == pytest.approx(even.second.sum())


@pytest.mark.parametrize("seed", range(20, 60))
def test_sites_that_nearly_coincide_have_areas_or_are_told(seed):
    """By rounding their triangles may be turned over; the areas of cells were no numbers then."""
    rng = np.random.default_rng(seed)
    apart, near = rng.uniform(-0.6, 0.6, (40, 2)), [0.5, 0.3] + 1e-6 * rng.normal(size=(60, 2))
    with np.errstate(all="raise"), contextlib.suppress(TransportError):
        cells = power_diagram(np.concatenate([apart, near]), np.zeros(100), Disk())
        assert np.isfinite(cells.area).all() and cells.area.sum() == pytest.approx(np.pi)


def test_an_edge_from_a_site_to_itself_is_told():
    """As rounding leaves it of two that nearly coincide."""
    sites = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [-0.4, -0.3], [0.3, -0.4]])
    known = by_hull(sites, np.zeros(5))
    sites[1] = sites[0]
    with pytest.raises(TransportError, match=r"^Sites coincide\."):
        power_diagram(sites, np.zeros(5), Disk(), known)
