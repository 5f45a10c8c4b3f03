"""Many charts take their steps together, and each its own decisions."""

import numpy as np
import pytest

from omt_uv.solver.refinement.batch_continuation import AreaErrors, BatchContinuation
from omt_uv.solver.refinement.continuation_rules import FIRST_PRESSURE, QUALITIES, SPARE, SQUEEZED

ENERGIES = np.array([1.0, 2 * SQUEEZED, np.inf, 3.0])


def batch(energies=ENERGIES, quality="standard", balance=0.0):
    return BatchContinuation(np.zeros(len(energies), bool), quality, balance, lambda weight: energies)


def errors(error, count=4):
    error = np.broadcast_to(error, count).astype(float)
    return AreaErrors(error, error, np.full(count, 0.5))


def promise(continuation, share, error, shares=None):
    """A full step that leaves the energies and promises this share of them."""
    value = np.where(np.isfinite(continuation.value), continuation.value, 1.0)
    taken = np.ones(len(value)) if shares is None else shares
    continuation.update(value, share * value, taken, errors(error, len(value)), lambda weight: value)


def test_the_squeezed_begin_with_shear_and_the_folded_not_at_all():
    continuation = batch()
    np.testing.assert_array_equal(continuation.live, [True, True, False, True])
    first = QUALITIES["standard"].area_weights[0]
    np.testing.assert_array_equal(continuation.area_weight, [first, 1.0, 1.0, first])


def test_charts_go_on_one_by_one():
    continuation = batch(np.array([1.0, 1.0]))
    value, weights = np.ones(2), QUALITIES["standard"].area_weights
    continuation.update(value, np.array([1e-9, 0.5]), np.ones(2), errors(0.5, 2), lambda weight: value)
    np.testing.assert_array_equal(continuation.area_weight, [weights[1], weights[0]])
    np.testing.assert_array_equal(continuation.steps, [1, 1])
    assert continuation.pressure[0] == FIRST_PRESSURE
    assert continuation.multiplier[0] == weights[0] * 0.5 and continuation.multiplier[1] == 0


def test_charts_of_polygons_are_spared_weight_and_those_of_triangles_are_not():
    first, planned = QUALITIES["standard"].area_weights
    polygons = np.array([True, False])
    continuation = BatchContinuation(polygons, "standard", 0.0, lambda weight: np.ones(2))
    promise(continuation, 1e-9, 2 * SPARE * QUALITIES["standard"].area_error)
    np.testing.assert_allclose(continuation.area_weight, [2 * first, planned])


def test_a_chart_that_has_its_areas_is_solved_and_stays():
    continuation = batch(np.ones(3))
    while continuation.live.any():
        promise(continuation, 1e-9, 0.001)
    assert continuation.solved.all()
    np.testing.assert_array_equal(continuation.steps, len(QUALITIES["standard"].area_weights))
    before = continuation.area_weight.copy()
    promise(continuation, 0.5, 0.5)
    np.testing.assert_array_equal(continuation.area_weight, before)


@pytest.mark.parametrize("gained, solved", [(True, False), (False, True)])
def test_greater_weights_are_of_use_while_stages_gain_whatever_their_last_steps_do(gained, solved):
    """A stage is compared with the one before it, not with its own last step."""
    continuation = batch(np.ones(1))
    stages = len(QUALITIES["standard"].area_weights)
    for stage in range(stages):
        error = 0.5**stage if gained or stage < stages - 1 else 0.5 ** (stage - 1)
        # All is gained by the first step, and the others converge.
        weight = continuation.area_weight[0]
        promise(continuation, 0.5, error)
        while continuation.live.all() and continuation.area_weight[0] == weight:
            promise(continuation, 1e-9, error)
    assert continuation.solved.all() == solved and continuation.live.all() != solved


def test_a_chart_that_no_step_helps_is_given_back():
    continuation = batch(np.ones(2))
    for _ in range(2):  # the first failure makes the Hessian definite
        promise(continuation, 0.5, 0.5, shares=np.array([0.0, 1.0]))
    np.testing.assert_array_equal(continuation.live, [False, True])
    assert not continuation.solved.any()


def test_steps_are_allowed_only_so_many():
    continuation = batch(np.ones(1), "draft")
    count = 0
    while continuation.live.any():
        promise(continuation, 0.5, 0.9 ** (count := count + 1))
    assert count == QUALITIES["draft"].max_steps and not continuation.solved.any()


def test_a_balance_needs_no_areas():
    continuation = batch(np.ones(2), balance=1.0)
    while continuation.live.any():
        promise(continuation, 1e-9, 0.7)
    assert continuation.solved.all() and not continuation.multiplier.any()
