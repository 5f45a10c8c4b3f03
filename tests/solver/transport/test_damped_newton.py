"""Damped Newton on a dual whose cells are known: areas that are exponentials of their weights."""

from dataclasses import dataclass

import numpy as np
import pytest

from omt_uv.solver.errors import TransportError
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.damped_newton import check_mass, largest_error, solve_dual


@dataclass(frozen=True)
class Areas:
    area: np.ndarray


class SoftMax:
    """Areas exp(h) / sum exp(h), a concave dual with one common weight as its kernel."""

    growth, small_step, good_residual = 4.0, 0.0, 0.0

    def __init__(self, blind_below=0.0):
        self.tried, self.blind_below = [], blind_below

    def near(self, site_weights, cells):
        area = np.exp(site_weights) / np.exp(site_weights).sum()
        self.tried.append(area.min())
        return None if area.min() < self.blind_below else Areas(area)

    def confirmed(self, site_weights, cells):
        return cells

    def direction(self, cells, mass):
        return (mass - cells.area) / cells.area

    def first_step(self, cells, direction):
        return 1.0


MASS = np.array([0.1, 0.2, 0.3, 0.4])


def run(dual, **options):
    start = np.zeros(4)
    return drain(solve_dual(dual, start, dual.near(start, None), MASS, **options))


def test_the_areas_become_the_masses():
    found = run(SoftMax())
    np.testing.assert_allclose(found.cells.area, MASS, rtol=5e-7)
    np.testing.assert_allclose(np.diff(found.site_weights), np.diff(np.log(MASS)), atol=1e-6)
    assert found.residual == largest_error(found.cells, MASS)


def test_cells_keep_half_of_the_least_area_on_the_way():
    """Algorithm 1 takes no step to where a cell is smaller."""
    dual = SoftMax()
    kept = run(dual)
    assert kept.cells.area.min() >= 0.5 * MASS.min()


def test_steps_to_where_a_cell_has_vanished_are_halved():
    found = run(SoftMax(blind_below=0.09))
    np.testing.assert_allclose(found.cells.area, MASS, rtol=5e-7)


def test_a_search_that_is_stuck_or_too_short_is_an_error():
    with pytest.raises(TransportError, match="stuck"):
        run(SoftMax(blind_below=0.25))
    with pytest.raises(TransportError, match="did not converge in 1 steps"):
        run(SoftMax(), max_steps=1)


def test_a_good_residual_is_enough_where_only_small_steps_are_left():
    dual = SoftMax(blind_below=0.2)
    dual.small_step, dual.good_residual = 0.05, 2.0
    assert run(dual).iterations < 100


class Rounded(SoftMax):
    """First steps change the error by less than it is rounded by, and by that it grows each time."""

    growth, small_step = 16.0, 0.05

    def near(self, site_weights, cells):
        exact = super().near(site_weights, cells).area
        return Areas(MASS + (exact - MASS) * (1 + 1e-15 * len(self.tried)))

    def first_step(self, cells, direction):
        return 1e-20


def test_rounding_of_the_error_holds_up_no_step():
    found = run(Rounded())
    assert found.residual <= 5e-7 and found.iterations < 50


class Stalled(SoftMax):
    """Areas that hardly come nearer to the masses, whatever the weights are."""

    growth, small_step = 16.0, 0.05

    def near(self, site_weights, cells):
        super().near(site_weights, cells)
        off = 0.3 * (1 - 1e-4) ** len(self.tried)
        return Areas(MASS * (1 + off * np.array([1, -1, 1, -1])))


def test_a_search_that_rounding_has_ended_says_so_at_once_or_will_do():
    dual = Stalled()
    with pytest.raises(TransportError, match=r"stuck at a residual of 3\.0e-01"):
        run(dual)
    assert len(dual.tried) < 100
    with pytest.raises(TransportError, match="stuck"):
        run(Stalled(), tolerated=0.25)
    found = run(Stalled(), tolerated=0.35)
    assert 0.25 < found.residual == largest_error(found.cells, MASS) < 0.35


def test_masses_are_positive_and_finite():
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(TransportError) as caught:
            check_mass(np.array([1, wrong, 1]))
        np.testing.assert_array_equal(caught.value.elements, [1])


@pytest.mark.parametrize("small_step, steps", [(0.0, [1, 0.5, 0.25, 0.125]), (0.3, [1, 0.5, 0.25, 0.0625])])
def test_steps_are_halves_and_below_the_small_one_quarters(small_step, steps):
    dual, found = SoftMax(), []
    dual.small_step = small_step
    first = dual.near(np.zeros(4), None)
    direction = dual.direction(first, MASS)

    def near(site_weights, cells):
        found.append(float((site_weights / direction).mean()))

    dual.near = near
    with pytest.raises(TransportError, match="stuck"):
        drain(solve_dual(dual, np.zeros(4), first, MASS))
    np.testing.assert_allclose(found[:4], steps)


class Rough(SoftMax):
    """Cells that are near others are off by so much, until they have been looked at closely."""

    def __init__(self, off, exact_from=1):
        super().__init__()
        self.off, self.exact_from, self.looks = off, exact_from, 0

    def near(self, site_weights, cells):
        exact = super().near(site_weights, cells).area
        wrong = self.off * np.array([1, -1, 2, -2.0]) * (self.looks < self.exact_from)
        return Areas(exact * (1 + wrong))

    def confirmed(self, site_weights, cells):
        self.looks += 1
        return Areas(np.exp(site_weights) / np.exp(site_weights).sum())


@pytest.mark.parametrize("off", [0.0, 1e-8, 2e-7, 1e-6])
@pytest.mark.parametrize("exact_from", [1, 2, 3])
@pytest.mark.parametrize("tolerance", [5e-7, 1e-5])
def test_what_is_told_of_a_solution_is_what_a_closer_look_says(off, exact_from, tolerance):
    dual = Rough(off, exact_from)
    found = run(dual, tolerance=tolerance)
    area = np.exp(found.site_weights) / np.exp(found.site_weights).sum()
    np.testing.assert_allclose(found.cells.area, area, rtol=1e-14)
    assert found.residual == pytest.approx(np.max(np.abs(area - MASS) / MASS), rel=1e-6, abs=1e-15)
    assert found.residual <= tolerance and dual.looks >= 1


@pytest.mark.parametrize("growth", [1.0, 2.0, 64.0])
@pytest.mark.parametrize("first", [1.0, 0.25, 0.01])
def test_no_step_goes_beyond_the_whole_of_the_direction(growth, first):
    """Newton's direction is right to first order; what a step grows by is for those that were shortened."""
    dual, shares, at = SoftMax(), [], [np.zeros(4), np.zeros(4)]
    dual.growth, dual.first_step = growth, lambda *_: first
    own_near, own_direction = dual.near, dual.direction

    def direction(cells, mass):
        at[:] = [np.log(cells.area), own_direction(cells, mass)]
        return at[1]

    def near(site_weights, cells):
        moved, whole = (x - x.mean() for x in (site_weights - at[0], at[1]))
        if (size := float(whole @ whole)) > 0:
            shares.append(float(moved @ whole) / size)
        return own_near(site_weights, cells)

    dual.near, dual.direction = near, direction
    if growth == 1.0 and first < 1:
        with pytest.raises(TransportError):
            run(dual, max_steps=30)
    else:
        np.testing.assert_allclose(run(dual).cells.area, MASS, rtol=5e-7)
    assert shares and min(shares) > 0 and max(shares) <= 1 + 1e-6
