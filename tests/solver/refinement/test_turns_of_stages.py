"""What the stages of a refinement and the steps of a stage decide, with steps and stages written in advance."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.solver.progress import Progress
from omt_uv.solver.refinement import continuation
from omt_uv.solver.refinement.continuation import MapProblem, StageLimits, StageResult, minimise, minimise_in_stages
from omt_uv.solver.refinement.continuation_rules import QUALITIES, Quality, stage_tolerances
from omt_uv.solver.refinement.projected_newton import NewtonStep

# ---- the steps of a stage -----------------------------------------------------------------------------------


@dataclass
class Written:
    """Steps that are known in advance: share, energy after, decrement, area error; and the pressures asked with."""

    steps: list

    def __post_init__(self):
        self.asked = []

    def energy(self, w):
        return 10.0

    def area_error(self, w):
        return self.steps[int(w[0]) - 1][3]

    def step(self, w, value, pressure):
        self.asked.append(pressure)
        share, energy, decrement, _ = self.steps[int(w[0])]
        return NewtonStep(w + 1, energy, decrement, share)


def end_of(steps, **limits):
    """How a stage ends, after how many steps, and the pressures of these."""
    problem = Written(steps)
    told, running = [], minimise(problem, np.zeros(1), StageLimits(**{"area_error": 0.1, "max_steps": 9} | limits))
    try:
        while True:
            told.append(next(running).fraction)
    except StopIteration as stop:
        return stop.value, problem.asked, told


# Full steps that gain half of what they promise keep all figures as they are.
SLOW = (1.0, 9.0, 2.0, 0.5)


@pytest.mark.parametrize("most", [0, 1, 3])
def test_a_stage_ends_with_its_steps_of_which_it_takes_one(most):
    found, _, told = end_of([SLOW] * 9, max_steps=most, pressure=1.0)
    assert (found.status, found.steps, len(told)) == ("steps", max(most, 1), max(most, 1))
    assert found.residual == pytest.approx(2 / 9) and found.energy == 9.0 and found.w.tolist() == [max(most, 1)]
    # Every step covers half of what is left of the first half.
    assert told == pytest.approx([1 - 0.5 ** (1 - 0.5 ** (k + 1)) for k in range(max(most, 1))])


@pytest.mark.parametrize(("residual", "error", "ends"), [(0.02, 0.09, 1), (0.02, 0.11, 9), (0.04, 0.09, 9)])
def test_it_ends_where_the_goal_is_met_and_little_is_promised(residual, error, ends):
    steps = [(1.0, 9.0, 9 * residual, error)] * 9
    found, _, _ = end_of(steps, loose_tolerance=0.03, tolerance=0.001)
    assert found.steps == ends and found.status == ("converged" if ends == 1 else "steps")


@pytest.mark.parametrize(("energy", "ends"), [(0.29, 1), (0.31, 9)])
def test_it_ends_where_the_energy_is_low_enough(energy, ends):
    assert end_of([(1.0, energy, 2.0, 0.5)] * 9, relaxed=0.3)[0].steps == ends


@pytest.mark.parametrize(
    ("share", "gain", "decrement", "passing", "ends"),
    [
        (1.0, 1.5, 2.0, True, True),
        (1.0, 1.5, 2.0, False, False),
        (0.5, 1.5, 2.0, True, False),
        (1.0, 1.3, 2.0, True, False),
        (1.0, 27.0, 36.1, True, False),
        (1.0, 26.0, 35.9, True, True),
    ],
)
def test_a_stage_that_passes_ends_with_a_full_step_that_keeps_a_promise_of_no_more_than_is_left(
    share, gain, decrement, passing, ends, monkeypatch
):
    problem = Written([(share, 9.0, decrement, 0.5)] * 9)
    monkeypatch.setattr(Written, "energy", lambda self, w: 9.0 + gain)
    running = minimise(problem, np.zeros(1), StageLimits(area_error=0.1, max_steps=1, passing=passing))
    try:
        while True:
            next(running)
    except StopIteration as stop:
        assert (stop.value.status == "converged") == ends


@pytest.mark.parametrize(("share", "pressure", "stalls"), [(0.0, 1.0, True), (0.0, 0.3, False), (0.1, 1.0, False)])
def test_a_stage_stalls_where_the_stiffest_step_helps_nothing(share, pressure, stalls):
    found, _, _ = end_of([(share, 10.0, 2.0, 0.5)] * 9, max_steps=1, pressure=pressure)
    assert (found.status == "stalled") == stalls


def test_pressure_follows_what_steps_kept_and_is_dropped_for_a_last_proof():
    # Kept, kept and true, poor, none taken, and one that promises little.
    steps = [(1.0, 8.5, 2.0, 0.5), (1.0, 7.5, 1.0, 0.5), (0.4, 7.4, 0.5, 0.5), (0.0, 7.4, 0.5, 0.5)]
    steps += [(1.0, 7.39, 0.1, 0.5), (1.0, 7.3, 0.05, 0.5), (1.0, 7.3, 0.01, 0.5)]
    found, asked, _ = end_of(steps, pressure=0.3, tolerance=0.02)
    assert asked == pytest.approx([0.3, 0.1, 0.01, 0.03, 1.0, 0.0])
    assert (found.status, found.steps) == ("converged", 6)


@pytest.mark.parametrize("stage", [0, 2])
def test_progress_of_later_stages_begins_where_that_of_earlier_ones_ends(stage):
    problem = Written([SLOW] * 3)
    first = next(minimise(problem, np.zeros(1), StageLimits(area_error=0.1, max_steps=3), stage))
    assert isinstance(first, Progress) and first.fraction == pytest.approx(1 - 0.5 ** (stage + 0.5))


@pytest.mark.parametrize(("crosses_at", "steps"), [(1, 1), (3, 3)])
def test_a_step_that_is_forbidden_ends_the_stage_before_it(crosses_at, steps):
    problem = Written([SLOW] * 9)
    limits = StageLimits(area_error=0.1, max_steps=9, pressure=1.0)
    running = minimise(problem, np.zeros(1), limits, forbidden=lambda w: w[0] == crosses_at)
    try:
        while True:
            next(running)
    except StopIteration as stop:
        found = stop.value
    assert (found.status, found.steps, found.w[0], found.ahead[0]) == ("crossed", steps, steps - 1, crosses_at)


@pytest.mark.parametrize(
    ("errors", "foreseeing", "ends"),
    # A step took off less than what is left: the goal is out of reach. More: it is not.
    [((0.5, 0.45), True, 2), ((0.5, 0.45), False, 9), ((0.5, 0.25), True, 9), ((0.5, 0.104), True, 9)],
)
def test_what_is_out_of_reach_is_foreseen(errors, foreseeing, ends):
    steps = [(1.0, 9.0, 0.4, errors[0])] + [(1.0, 9.0, 0.4, errors[1])] + [(1.0, 9.0, 0.4, 0.05)] * 8
    found, _, _ = end_of(steps, foreseeing=foreseeing, foreseen=0.05, loose_tolerance=0.001, tolerance=1e-6)
    assert found.steps == ends


@pytest.mark.parametrize(
    ("shears", "errors", "share", "brisk", "ends"),
    # What changes less than 2 % of the shear, and less than a tenth of the goal of the areas, nobody sees.
    [
        ((1.0, 0.981), (0.05, 0.05), 1.0, False, 2),
        ((1.0, 0.979), (0.05, 0.05), 1.0, False, 9),
        ((1.0, 1.019), (0.05, 0.05), 1.0, False, 2),
        ((1.0, 1.0), (0.05, 0.0609), 1.0, False, 9),
        ((1.0, 1.0), (0.05, 0.0591), 1.0, False, 2),
        ((1.0, 1.0), (0.1001, 0.1001), 1.0, False, 9),
        ((1.0, 1.0), (0.05, 0.05), 0.9, False, 9),
        # Two steps that kept what they promised, the last of which promised less than half, may change 8 %.
        ((1.0, 0.93), (0.05, 0.09), 1.0, True, 2),
        ((1.0, 0.92), (0.05, 0.09), 1.0, True, 9),
        ((1.0, 0.93), (0.05, 0.1001), 1.0, True, 9),
    ],
)
def test_a_stage_ends_where_shear_and_areas_settle(shears, errors, share, brisk, ends):
    energies = [9.0, 8.0] + [8.0 - 1e-3 * k for k in range(8)]
    later = [10.0 + k**2 for k in range(8)]
    steps = [(share, energy, 1.0, error) for energy, error in zip(energies, [*errors, *[0.5] * 8], strict=True)]
    limits = {"brisk": brisk, "tolerance": 1e-6, "loose_tolerance": 1e-6}
    found, _, _ = end_of(steps, shear=lambda w: [*shears, *later][int(w[0]) - 1], **limits)
    assert found.steps == ends


@pytest.mark.parametrize("brisk", [True, False])
@pytest.mark.parametrize("pattern", range(16))
def test_two_steps_in_a_row_that_keep_what_they_promise_end_a_brisk_stage(pattern, brisk):
    """One alone, however nearly things have settled, ends none."""
    kept = [bool(pattern >> k & 1) for k in range(4)]
    energy, steps = 10.0, []
    for each in [*kept, False, False]:
        energy -= 0.1 if each else 0.001
        steps.append((1.0, energy, 0.1, 0.05))
    limits = {"brisk": brisk, "tolerance": 1e-6, "loose_tolerance": 1e-6, "max_steps": 6}
    found, _, _ = end_of(steps, shear=lambda w: 0.95 ** w[0], **limits)
    pairs = [k + 1 for k in range(1, 4) if kept[k - 1] and kept[k]]
    assert found.steps == (pairs[0] if brisk and pairs else 6)


# ---- stages -------------------------------------------------------------------------------------------------

QUALITY = Quality(area_error=0.01, area_weights=(30.0, 500.0), greatest_weight=1e4, max_steps=50, tolerance=3e-2)


@pytest.fixture
def staged(monkeypatch):
    """Stages that end as they are written: status, steps, area error; what was asked for is kept."""

    def run(ends, *, balance=0.0, polygon=False, warm=False, quality=QUALITY, crossing=(), barrier=False, **given):
        ends, asked, crossed = list(ends), [], list(crossing)
        faces = SimpleNamespace(polygon=np.zeros(1) if polygon else None, region=None)
        problem = MapProblem(faces, None, None, "loop", barrier)

        def stage(newton, w, limits, k, forbidden):
            asked.append(SimpleNamespace(newton=newton, w=w, limits=limits, k=k, forbidden=forbidden))
            yield Progress("Refinement", 0.5)
            status, steps, error, *rest = ends[len(asked) - 1]
            return StageResult(w + 1, steps, rest[0] if rest else 0.5, 7.0, status, ahead=w + 2)

        def error(faces, w):
            return ends[min(len(asked), len(ends)) - 1][2]

        module = continuation
        monkeypatch.setattr(module, "minimise", stage)
        monkeypatch.setattr(module, "target_error", error)
        monkeypatch.setattr(module, "target_error_but_share", lambda faces, w: 0.5 * error(faces, w))
        monkeypatch.setattr(module, "missing_tilt", lambda faces, w: 0.125)
        monkeypatch.setattr(module, "with_convex_quads", lambda faces, w: faces)
        monkeypatch.setattr(module, "set_apart", lambda problem, newton, stage: (problem, stage.w + 100))
        monkeypatch.setattr(module, "_first_weights", lambda *_: (list(quality.area_weights), warm))
        monkeypatch.setattr(module, "_limits", lambda *words: StageLimits(0.01, words[4], float(words[3])))
        monkeypatch.setattr(MapProblem, "boundary_crosses", lambda self, w: crossed.pop(0) if crossed else False)
        monkeypatch.setattr(
            MapProblem, "newton_problem", lambda self, w, weight, barrier, tilt: (weight, barrier, tilt)
        )
        running = minimise_in_stages(problem, np.zeros(1), balance, quality, **given)
        try:
            while True:
                next(running)
        except StopIteration as stop:
            return stop.value, asked

    return run


def weights_of(asked):
    return [a.newton[0] for a in asked]


def test_stages_have_the_planned_weights_until_areas_are_right(staged):
    found, asked = staged([("converged", 3, 0.5), ("converged", 4, 0.01)])
    assert weights_of(asked) == [30, 500] and [a.k for a in asked] == [0, 1] and found.status == "converged"
    assert (found.steps, found.area_weight, found.w[0], found.energy, found.overlap) == (7, 500, 2, 7.0, False)
    assert [a.limits.max_steps for a in asked] == [50, 47] and [a.limits.tolerance for a in asked] == [-1, 0]
    # Areas that are right early do not spare the stages that are planned.
    assert weights_of(staged([("converged", 3, 0.005), ("converged", 4, 0.005)])[1]) == [30, 500]


def test_weights_grow_with_what_is_left_until_it_is_little_or_helps_no_more(staged):
    ends = [("converged", 3, 0.5), ("converged", 3, 0.04), ("converged", 3, 0.03), ("converged", 3, 0.01)]
    _, asked = staged(ends)
    grown = [30, 500, 500 * (1.05 * 0.02 / 0.01) ** 2]
    assert weights_of(asked) == pytest.approx([*grown, grown[2] * (1.05 * 0.015 / 0.01) ** 2])
    assert [a.limits.tolerance for a in asked] == [-1, 0, 0, 0]
    # What leaves 98 % is of no use; a stage that did not converge may find a way later.
    ends[2:] = [("converged", 3, 0.0393), ("converged", 3, 0.01)]
    assert len(staged(ends)[1]) == 3
    ends[2] = ("steps", 3, 0.0393)
    assert len(staged(ends)[1]) == 4


@pytest.mark.parametrize(("steps", "stages"), [(24, 3), (25, 2), (50, 1)])
def test_stages_end_with_their_steps(staged, steps, stages):
    found, asked = staged([("steps", steps, 0.5)] * 9)
    assert len(asked) == stages and found.steps == steps * stages


def test_a_stage_that_stalls_is_the_last(staged):
    found, asked = staged([("stalled", 3, 0.5), ("converged", 3, 0.01)])
    assert len(asked) == 1 and found.status == "stalled"


def test_the_greatest_weight_is_the_last(staged):
    _, asked = staged([("steps", 1, 0.5)] * 9, quality=replace(QUALITY, greatest_weight=5000.0))
    assert weights_of(asked) == [30, 500, 5000]


def test_multipliers_add_up_what_is_missing_but_for_balances(staged):
    ends = [("converged", 1, 0.5), ("converged", 1, 0.01)]
    found, asked = staged(ends, multiplier=2.0)
    assert [a.newton[0] * a.newton[2] for a in asked] == pytest.approx([2.0, 2 + 30 / 8])
    assert found.multiplier == pytest.approx(2 + 530 / 8)
    found, asked = staged(ends, multiplier=2.0, balance=0.5)
    assert found.multiplier == 2.0 and len(asked) == 2


@pytest.mark.parametrize("overlapping", [False, True])
def test_what_would_cross_goes_on_from_short_of_there_with_a_barrier(staged, overlapping):
    ends = [("crossed", 2, 0.5), ("converged", 3, 0.5), ("converged", 3, 0.01)]
    found, asked = staged(ends, crossing=[overlapping])
    assert weights_of(asked) == [30, 30, 500] and [a.k for a in asked] == [0, 0, 1]
    assert [a.newton[1] for a in asked] == [False, True, True] and asked[1].w[0] == 101 and found.steps == 8
    assert [a.forbidden is None for a in asked] == [overlapping, True, True]
    assert len(found.warnings) == overlapping


def test_a_barrier_from_the_beginning_forbids_nothing(staged):
    _, asked = staged([("converged", 3, 0.5), ("converged", 3, 0.01)], barrier=True)
    assert all(a.forbidden is None and a.newton[1] for a in asked)
    found, _ = staged([("converged", 3, 0.5), ("converged", 3, 0.01)], crossing=[False, True])
    assert found.overlap and found.warnings == ()


@pytest.mark.parametrize(("error", "weight"), [(0.1, 500.0), (0.01, 120.0), (0.0001, 30.0)])
def test_polygons_get_no_more_weight_than_leaves_them_what_may_be_off(staged, error, weight):
    _, asked = staged([("converged", 3, error), ("converged", 3, 0.01)], polygon=True)
    assert weights_of(asked) == pytest.approx([30, weight])


@pytest.mark.parametrize(("residual", "stages"), [(0.029, 1), (0.031, 2)])
def test_a_last_stage_at_the_same_weight_is_left_out_where_nothing_is_left(staged, residual, stages):
    ends = [("converged", 3, 0.001, residual), ("converged", 3, 0.001, residual)]
    assert len(staged(ends, polygon=True)[1]) == stages
    # With areas that are not right it is not.
    ends = [("converged", 3, 0.011, residual), ("converged", 3, 0.001, residual)]
    assert len(staged(ends, polygon=True)[1]) == 2


@pytest.mark.parametrize(("warm", "prolonged"), [(True, False), (False, True), (False, False)])
def test_starts_from_afar_do_not_pass(staged, warm, prolonged, monkeypatch):
    seen = []
    monkeypatch.setattr(continuation, "_limits_after", lambda limits, relaxing: (seen.append(relaxing), limits)[1])
    staged([("converged", 3, 0.5), ("converged", 3, 0.01)], warm=warm, prolonged=prolonged)
    assert seen == ([] if not (warm or prolonged) else [warm, False])


@pytest.mark.parametrize("relaxing", [False, True])
def test_limits_after_a_squeezed_start(relaxing):
    limits = StageLimits(0.1, 9, passing=True, shear=len, relaxed=0.0)
    found = continuation._limits_after(limits, relaxing)
    assert not found.passing and (found.relaxed, found.shear) == ((0.3, None) if relaxing else (0.0, len))


@pytest.mark.parametrize("region", [False, True])
@pytest.mark.parametrize("swept", [False, True])
@pytest.mark.parametrize("free", [False, True])
@pytest.mark.parametrize("balance", [0.0, 0.4])
@pytest.mark.parametrize("ahead", [-1, 0, 1])
@pytest.mark.parametrize("name", ["standard", "draft", "exact"])
def test_limits_of_stages(name, ahead, balance, free, swept, region):
    faces = SimpleNamespace(region=np.ones(1) if region else None)
    several = {"scale_free": not free, "smoother": "sweeps" if swept else None, "loose": swept}
    problem = MapProblem(faces, None, None, None, False, **several)
    quality = QUALITIES[name]
    found = continuation._limits(problem, balance, quality, ahead, 70)
    way, exact = ahead < 0, balance == 0
    assert found.area_error == (np.inf if way else quality.area_error)
    assert found.max_steps == (40 if exact else 70)
    assert (found.tolerance, found.loose_tolerance) == stage_tolerances(quality, balance, way, free, swept)
    assert found.foreseeing == (exact and not way and not region) and found.foreseen == 0.05
    assert found.expecting == (exact and free and not swept and name != "draft")
    assert found.brisk == (found.expecting and name == "standard")
    assert found.passing == (found.brisk and way and not region)
    assert found.pressure == (0.05 if exact and free and not region and name != "exact" else 0.3)
    assert (found.shear is not None) == (exact and not way)
    assert continuation._limits(problem, balance, quality, ahead, 7).max_steps == 7
