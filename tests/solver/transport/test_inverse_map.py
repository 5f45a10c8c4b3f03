"""Centroids of cells go on to the boundary in their order, corners into corners, and what is tangled is said."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.transport.convex_domain import Disk, Rectangle
from omt_uv.solver.transport.inverse_map import centroid_map, corner_parameters

DOMAINS = {"disk": Disk(), "square": Rectangle(), "wide": Rectangle(2.0, 1.0)}


def around(domain, count, seed=0, start=0.3):
    """Centroids a little inside of the boundary, in order, one within, and the loop (count,) of the others."""
    rng = np.random.default_rng(seed)
    share = np.sort((start + (np.arange(count) + 0.3 * rng.random(count)) / count) % 1)
    on = domain.boundary_point(domain.period * share)
    return np.concatenate([0.97 * on, [[0.01, 0.02]]]), np.arange(count), domain.period * share


@pytest.mark.parametrize("name", DOMAINS)
def test_centroids_keep_their_order_and_move_to_the_boundary(name):
    domain, told = DOMAINS[name], []
    centroid, loop, _ = around(domain, 17)
    turned = np.roll(loop, 5)
    uv = centroid_map(centroid, domain, turned, None, told)
    assert not told and (uv[-1] == centroid[-1]).all()
    np.testing.assert_allclose(uv[loop], domain.boundary_point(domain.boundary_parameter(centroid[loop])), atol=1e-12)
    parameter = domain.boundary_parameter(uv[turned])
    step = (np.roll(parameter, -1) - parameter) % domain.period
    assert (step > 0).all() and step.sum() == pytest.approx(domain.period)


@pytest.mark.parametrize("name", ["square", "wide"])
@pytest.mark.parametrize("first", [0, 3, 11])
def test_corners_come_into_corners_and_what_is_between_stays_between_in_proportion(name, first):
    domain, told = DOMAINS[name], []
    centroid, loop, share = around(domain, 16)
    corners = np.roll(loop, -first)[[0, 4, 7, 12]]
    uv = centroid_map(centroid, domain, loop, corners, told)
    np.testing.assert_allclose(uv[corners], domain.boundary_point(corner_parameters(domain)[:4]), atol=1e-12)
    given = domain.boundary_parameter(centroid[loop])
    ordered = np.roll(loop, -first)
    along = (given[ordered] - given[ordered[0]]) % domain.period
    ends, goals = np.append(along[[0, 4, 7, 12]], domain.period), corner_parameters(domain)
    expected = domain.boundary_point(np.interp(along, ends, goals) % domain.period)
    np.testing.assert_allclose(uv[ordered], expected, atol=1e-9)


@pytest.mark.parametrize("name", DOMAINS)
def test_two_that_have_changed_places_come_one_after_the_other(name):
    domain, told = DOMAINS[name], []
    centroid, loop, _ = around(domain, 17)
    centroid[[4, 5]] = centroid[[5, 4]]
    uv = centroid_map(centroid, domain, loop, None, told)
    parameter = domain.boundary_parameter(uv[loop])
    step = (np.roll(parameter, -1) - parameter) % domain.period
    assert (step > 0).all() and step.sum() == pytest.approx(domain.period) and not told
    # Mostly where they were: the rest is hardly moved.
    others = np.delete(loop, [3, 4, 5, 6])
    assert np.linalg.norm(uv[others] - centroid[others] / 0.97, axis=1).max() < 0.3


def test_what_goes_around_the_wrong_way_is_spread_evenly_and_said():
    domain, told = Disk(), []
    centroid, loop, _ = around(domain, 12)
    uv = centroid_map(centroid, domain, loop[::-1], None, told)
    assert told == ["The transport tangles the boundary; it was spread evenly instead"]
    parameter = domain.boundary_parameter(uv[loop[::-1]])
    np.testing.assert_allclose((np.roll(parameter, -1) - parameter) % domain.period, domain.period / 12)
    with pytest.raises(ValueError, match="only polygons"):
        corner_parameters(domain)
