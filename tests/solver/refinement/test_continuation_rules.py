"""The table of rules: the same for one chart as for many, and monotone where that is the point."""

import numpy as np
import pytest

from omt_uv.solver.refinement import continuation_rules as rules
from omt_uv.solver.refinement.continuation_rules import QUALITIES

RANDOM = np.random.default_rng(0)
PRESSURE = RANDOM.choice([0, 0.005, 0.01, 0.03, 0.3, 1.0], 300)
SHARE = RANDOM.choice([0, 0.1, 0.5, 0.9, 1.0], 300)
GAIN, DECREMENT = RANDOM.random((2, 300))
GAIN[SHARE == 0] = 0
ENERGY = 2 * RANDOM.random(300)


def each(rule, *columns):
    return np.array([rule(*(x.item() for x in row)) for row in zip(*columns, strict=True)])


def test_one_chart_is_a_batch_of_one():
    pressure = rules.next_pressure(PRESSURE, SHARE, GAIN, DECREMENT)
    np.testing.assert_array_equal(pressure, each(rules.next_pressure, PRESSURE, SHARE, GAIN, DECREMENT))
    met = GAIN < 0.2
    verdict = rules.judge_step(SHARE, PRESSURE, DECREMENT, met, 0.3)
    single = each(lambda *x: rules.judge_step(*x, 0.3), SHARE, PRESSURE, DECREMENT, met)
    np.testing.assert_array_equal(np.column_stack(verdict), single)
    np.testing.assert_array_equal(rules.promised(GAIN, DECREMENT), each(rules.promised, GAIN, DECREMENT))
    left = rules.left_over(ENERGY, SHARE, GAIN, DECREMENT)
    np.testing.assert_array_equal(left, each(rules.left_over, ENERGY, SHARE, GAIN, DECREMENT))
    quality = QUALITIES["standard"]
    enough = rules.is_enough(quality, 0.0, 0.02 * GAIN, 1e7 * DECREMENT)
    np.testing.assert_array_equal(
        enough, each(lambda e, w: rules.is_enough(quality, 0.0, e, w), 0.02 * GAIN, 1e7 * DECREMENT)
    )


def test_pressure_stays_a_share_and_follows_the_promise():
    after = rules.next_pressure(PRESSURE, SHARE, GAIN, DECREMENT)
    assert ((after >= 0) & (after <= 1)).all()
    kept = (SHARE == 1) & (GAIN > 0.7 * DECREMENT)
    assert (after[kept] <= PRESSURE[kept]).all() and (after[~kept] >= PRESSURE[~kept]).all()
    assert (after[SHARE == 0] == 1).all()


def test_a_step_that_the_line_search_has_halved_asks_for_a_stiffer_hessian():
    assert rules.next_pressure(0.09, 0.5, 0.5, 1.0) == pytest.approx(0.27)
    assert rules.next_pressure(0.09, 0.6, 0.5, 1.0) == 0.09


def test_a_stage_ends_by_the_true_hessian_or_at_its_goal():
    verdict = rules.judge_step(SHARE, PRESSURE, DECREMENT, np.zeros(300, bool), 0.3)
    assert not (verdict.converged & verdict.sharpen).any()
    np.testing.assert_array_equal(verdict.converged | verdict.sharpen, DECREMENT < 0.3)
    assert rules.judge_step(1.0, 0.3, 0.9, True, 0.3).converged


@pytest.mark.parametrize("name", QUALITIES)
def test_weights_fall_with_the_balance(name):
    quality = QUALITIES[name]
    assert rules.planned_weights(0.0, quality) == list(quality.area_weights)
    last = [rules.planned_weights(t, quality)[-1] for t in np.linspace(0, 1, 11)]
    assert (np.diff(last) < 0).all() and last[-1] == pytest.approx(1e-2)
    for t in (0.0, 0.3, 1.0):
        assert (np.diff(rules.planned_weights(t, quality)) > 0).all()


def test_weights_grow_within_bounds_and_with_the_error():
    quality = QUALITIES["standard"]
    # What is missing, and a little more.
    error = quality.area_error * np.array([0.5, 1, 1.5, 2, 3, 100]) / 1.05
    grown = rules.next_weight(30.0, error, quality) / 30
    assert (np.diff(grown) >= 0).all()
    np.testing.assert_allclose(grown, [1.3, 1.3, 2.25, 4, 9, 10])


def test_polygons_are_pressed_no_further_than_a_part_of_what_they_may_be_off():
    quality = QUALITIES["standard"]
    weight, planned = quality.area_weights
    aim = 0.25 * quality.area_error
    error = np.array([0.1 * aim, 2 * aim, 1e3 * aim])
    # As the error falls with the weight: none less than the one before, none greater than what was planned.
    np.testing.assert_allclose(rules.spare_weight(planned, weight, error, quality), [weight, 2 * weight, planned])


def test_more_area_error_is_futile_only_where_it_hardly_falls():
    quality = QUALITIES["standard"]
    assert not rules.is_futile(quality, 0.5, np.inf)
    assert rules.is_futile(quality, 0.99, 1.0) and not rules.is_futile(quality, 0.97, 1.0)
    assert rules.is_futile(quality, 0.97, 1.0, 10.0, with_region=True)
    assert not rules.is_futile(quality, 0.5, 1.0, 10.0, with_region=True)
    near = 0.97 * quality.area_error
    assert not rules.is_futile(quality, near, quality.area_error, 10.0, with_region=True)


def test_a_start_is_ahead_where_its_second_weight_costs_little_more_than_its_first():
    """In any unit of energy; what is far from its areas costs as much more as the weight is greater."""
    shear, areas = 1.2, np.array([0.0, 0.004, 0.04, 0.4])
    first, second = (shear + weight * areas for weight in QUALITIES["standard"].area_weights)
    assert rules.is_ahead(first, second).tolist() == [True, True, False, False]
    assert (rules.is_ahead(7 * first, 7 * second) == rules.is_ahead(first, second)).all()


def test_stages_on_the_way_end_sooner():
    quality = QUALITIES["standard"]
    for loose in (False, True):
        there = rules.stage_tolerances(quality, 0.0, False, early=True, loose=loose)
        under_way = rules.stage_tolerances(quality, 0.0, True, early=True, loose=loose)
        assert there[0] == under_way[0]
    assert rules.stage_tolerances(quality, 0.0, True, early=True)[1] > quality.loose_tolerance
    assert rules.stage_tolerances(quality, 0.0, True, early=False)[1] == quality.loose_tolerance
    assert rules.stage_tolerances(quality, 0.5, True, early=True) == (1e-4, 3e-2)


def test_a_goal_is_out_of_reach_where_steps_gain_less_than_is_missing():
    assert rules.is_out_of_reach(0.010, 0.0105, 0.008) and not rules.is_out_of_reach(0.010, 0.013, 0.008)
    # Nearly there, there already, or after the first step that says anything: the stage goes on.
    assert not rules.is_out_of_reach(0.0082, 0.0083, 0.008) and not rules.is_out_of_reach(0.007, 0.0071, 0.008)
    assert not rules.is_out_of_reach(0.5, np.inf, 0.008)


def test_what_has_kept_its_promise_is_nearly_settled_with_any_areas_at_the_goal():
    goal, before = 0.008, (0.300, 0.02)
    for shear in (0.28, 0.32):
        assert rules.is_nearly_settled(True, (shear, 0.0079), before, goal)
        assert not rules.is_nearly_settled(False, (shear, 0.0079), before, goal)
        assert not rules.is_nearly_settled(True, (shear, 0.0081), before, goal)
    assert not rules.is_nearly_settled(True, (0.25, 0.001), before, goal)
    assert not rules.is_nearly_settled(True, (0.3, 0.001), (np.inf, np.inf), goal)


def test_a_full_step_alone_has_kept_its_promise():
    kept = each(rules.has_kept, SHARE, GAIN, DECREMENT)
    np.testing.assert_array_equal(rules.has_kept(SHARE, GAIN, DECREMENT), kept)
    assert not np.asarray(kept)[SHARE < 1].any()
    assert rules.has_kept(1.0, 0.8, 1.0) and not rules.has_kept(1.0, 0.6, 1.0) and not rules.has_kept(0.99, 1.0, 1.0)


def test_a_map_is_settled_where_a_whole_step_changes_neither_shear_nor_areas():
    goal = 0.008
    assert rules.is_settled(1.0, (0.300, 0.0051), (0.302, 0.0053), goal)
    for share, now in ((0.5, (0.300, 0.0051)), (1.0, (0.280, 0.0051)), (1.0, (0.300, 0.0030)), (1.0, (0.300, 0.0081))):
        assert not rules.is_settled(share, now, (0.302, 0.0053 if now[1] < goal else 0.0082), goal)
    assert not rules.is_settled(1.0, (0.300, 0.0051), (np.inf, np.inf), goal)


def test_only_a_whole_step_that_kept_its_promise_leaves_less_than_it_promised():
    residual, left = rules.promised(DECREMENT, ENERGY), rules.left_over(ENERGY, SHARE, GAIN, DECREMENT)
    assert (left <= residual).all() and (left >= 0.1 * residual).all()
    np.testing.assert_array_equal(left[SHARE < 1], residual[SHARE < 1])
    np.testing.assert_array_equal(left[ENERGY > 1.0], residual[ENERGY > 1.0])
    far = np.abs(GAIN - DECREMENT) > DECREMENT
    np.testing.assert_array_equal(left[far], residual[far])
    # Newton's method for the energy x^2 / 2 + c x^3: what is left to the next step is less than what is said.
    for c in (0.0, 0.01, -0.02, 0.03):
        x, energy = 1.0, lambda x, c=c: x * x / 2 + c * x**3
        decrement, y = (x + 3 * c) ** 2 / (2 + 12 * c), x - (x + 3 * c) / (1 + 6 * c)
        following = (y + 3 * c * y * y) ** 2 / (2 + 12 * c * y)
        said = rules.left_over(0.5, 1.0, energy(x) - energy(y), decrement)
        assert following <= 0.5 * said and said < 2 * decrement


def test_what_shrinks_by_the_same_share_with_every_step_leaves_that_share():
    # The step kept its promise, and promised `share` of what the one before had.
    for share in (0.2, 0.6, 1.0, 3.0):
        residual, left = 0.03 / 0.3, rules.left_over(0.3, 1.0, 0.03, 0.03, before=0.03 / 0.3 / share)
        assert left == pytest.approx(residual * min(share, 1.0))
    assert rules.left_over(0.3, 1.0, 0.03, 0.03) == pytest.approx(rules.LEFT * 0.1)


def test_only_free_boundaries_with_areas_about_right_begin_with_soft_areas():
    for name, soft in (("standard", True), ("draft", True), ("exact", False)):
        first = rules.first_pressure(QUALITIES[name], 0.0, True)
        assert first == (0.05 if soft else 0.3)
    assert rules.first_pressure(QUALITIES["standard"], 0.5, True) == 0.3
    assert rules.first_pressure(QUALITIES["standard"], 0.0, False) == 0.3


@pytest.mark.parametrize("quality", QUALITIES)
def test_a_stage_is_the_last_from_its_bounds_on(quality):
    of = QUALITIES[quality]
    error, weight = of.area_error, of.greatest_weight
    # Both bounds are within, and with shear in the balance every stage is enough.
    for given, asked in (((error, 0.0), True), ((np.nextafter(error, np.inf), 0.0), False), ((2 * error, weight), True),
                         ((2 * error, np.nextafter(weight, 0)), False), ((0.0, 0.0), True)):  # fmt: skip
        assert bool(rules.is_enough(of, 0.0, *given)) == asked
        assert rules.is_enough(of, 0.5, *given)
