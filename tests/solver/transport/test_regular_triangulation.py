"""Regular triangulations: the lower hull of lifted sites, by hull or by flips."""

import numpy as np
import pytest

from omt_uv.solver.errors import TransportError
from omt_uv.solver.transport.regular_triangulation import by_flips, by_hull, power_centres

SITES = np.random.default_rng(0).uniform(-1, 1, (80, 2))
SMALL = 1e-3 * np.random.default_rng(1).normal(size=80)


def sets(triangulation):
    return {tuple(sorted(t)) for t in triangulation.triangles.tolist()}


def area(sites, triangles):
    p = sites[triangles]
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    return (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


def test_triangles_are_counter_clockwise_and_fill_the_hull():
    regular = by_hull(SITES, SMALL)
    assert (area(SITES, regular.triangles) > 0).all() and regular.whole
    plain = by_hull(SITES, np.zeros(80))
    assert area(SITES, regular.triangles).sum() == pytest.approx(area(SITES, plain.triangles).sum())


def test_no_lifted_site_lies_below_a_triangle():
    """The power of every site with respect to a triangle's centre is at least that of its corners."""
    regular = by_hull(SITES, SMALL)
    z = SITES @ [1, 1j]
    centre = power_centres(z, SMALL, regular)
    power = np.abs(centre[:, None] - z) ** 2 - SMALL
    corners = np.take_along_axis(power, regular.triangles, axis=1)
    np.testing.assert_allclose(corners, corners[:, :1].repeat(3, axis=1), atol=1e-9)
    assert (power >= corners.min(axis=1)[:, None] - 1e-9).all()


def test_weights_linear_in_the_sites_change_nothing():
    """They tilt the lifted hull."""
    tilted = SMALL + SITES @ [0.3, -0.2] + 0.5
    assert sets(by_hull(SITES, tilted)) == sets(by_hull(SITES, SMALL))


def test_flips_and_hull_agree_and_flips_there_and_back_are_none():
    plain = by_hull(SITES, np.zeros(80))
    there, hidden = by_flips(plain, SITES, SMALL)
    assert not hidden and there.flips > 0 and sets(there) == sets(by_hull(SITES, SMALL))
    back, _ = by_flips(there, SITES, np.zeros(80))
    assert sets(back) == sets(plain)
    assert by_flips(plain, SITES, np.zeros(80))[0].flips == 0


def test_new_names_for_the_sites():
    order = np.random.default_rng(2).permutation(80)
    regular = by_hull(SITES[order], SMALL[order])
    assert sets(regular.renumbered(order)) == sets(by_hull(SITES, SMALL))


def test_sites_on_a_line_have_no_triangulation():
    with pytest.raises(TransportError, match="The sites of the transport lie on one line or"):
        by_hull(np.column_stack([np.arange(5.0), np.zeros(5)]), np.zeros(5))


@pytest.mark.parametrize("count", [6, 9, 14])
def test_a_site_is_called_hidden_only_where_the_hull_has_it_in_no_triangle(count):
    """And what flips reach is the hull's: of weights of all sizes, where sites on the border have three neighbours."""
    reached = told = 0
    for seed in range(150):
        rng = np.random.default_rng(seed)
        sites = rng.uniform(-1, 1, (count, 2))
        start, weights = by_hull(sites, np.zeros(count)), 10 ** rng.uniform(-3, 0.5) * rng.normal(size=count)
        found, hidden = by_flips(start, sites, weights)
        wished = by_hull(sites, weights)
        if found is not None:
            assert sets(found) == sets(wished) and not hidden
        assert not hidden or len(np.unique(wished.triangles)) < count
        reached, told = reached + (found is not None), told + hidden
    assert reached > 10 and told > 10
