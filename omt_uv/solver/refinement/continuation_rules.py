"""Decide from step to step how a refinement goes on, by one table of rules for single charts and for batches.

A refinement minimises shear + area weight * area error, in stages of growing area weight (a penalty method: Nocedal,
Wright 2006, chapter 17). Every rule takes numbers, or arrays (c,) with one entry a chart:

    start a stage            `planned_weights`, `spare_weight`, `is_squeezed`, `is_ahead`, `next_weight`
    within a stage           `first_pressure`, `next_pressure`
    end a stage              `stage_tolerances`, `left_over`, `judge_step`, `has_kept`, `is_out_of_reach`,
                             `is_settled`, `is_nearly_settled`
    end the refinement       `is_enough`, `is_futile`

A batch differs from a chart by itself in five ways. It takes no `early` end of a stage, nor one by what it `has_kept`,
what is `left_over`, that `is_settled`, `is_nearly_settled` or `is_out_of_reach`, since its steps are those of all
charts. It does not tell `is_futile` of regions: a chart with a region that has no exact areas uses up its steps, is
given back, and says alone what it did not reach. It knows no barrier and no sweeps, and gives a chart back that would
need them. It relaxes a squeezed start to the end, not to UNSQUEEZED, whatever its shear. And it starts cold.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..analysis.density import INEXACT

# A number, or one for each chart of a batch.
Number = float | np.ndarray
Truth = bool | np.ndarray

# A stage that reaches the goal ends when Newton promises less than this share of the energy.
LOOSE = 3e-2
# One on the way ends sooner where the boundary is free; vertices on a circle or on sides do not make up for it later.
ON_THE_WAY = 0.1
# One that will miss its goal is told by its areas where a step promises less than this, or next to nothing is left over
# for another one: see `is_out_of_reach`.
FORESEEN = 0.05
# One that has reached it ends, too, where a whole step changes the shear by less than this share, and the area error by
# less than this share of the goal.
SETTLED = 0.02
SETTLED_AREAS = 0.1
# The same, whatever became of the areas, where it has kept its promise as well: what it changes by shrinks with the
# square then.
NEARLY_SETTLED = 0.08
# The same of drafts: the next step changes it by less.
DRAFTED = 0.2
# What a step promised, over the energy that it left, for a stage to be over with it: one on the way, and the last. What
# promised more has only begun, as on a closed body with a short slit.
PASSED = 4.0
NEAR_THE_END = 0.5
# The same of large meshes with a region: what Newton promises then is in few faces. Share of the energy where the goal
# is not reached, where it is, and on the way.
REGION_TOLERANCE = 0.1
REGION_LOOSE = 0.15
REGION_ON_THE_WAY = 0.1
# With a balance the weight alone decides, and neighbouring balances must not differ by chance.
STRICT = 1e-4
# Area weight at balance 1. Without it the map of least shear has no scale; and much below this the mean shear, which is
# not quite the energy's, no longer falls.
LEAST_WEIGHT = 1e-2
# Area weight for an initial map that is so squeezed that its shear must relax before its areas, and the mean energy
# that says so.
SQUEEZED_WEIGHT = 1.0
SQUEEZED = 50.0
# The mean energy at which it is squeezed no longer: what is left of the shear does not hold up the areas.
UNSQUEEZED = 0.3
# What comes from a coarser mesh has the little shear and about the areas that the first weight is for, where its energy
# at the second weight is less than so many times that at the first.
AHEAD = 3.0
# Where the error is not reached, the weight grows by a factor of at least and at most so much.
LEAST_GROWTH = 1.3
MOST_GROWTH = 10.0
# The factor for weights of a start that has nearly its areas, of a target that will need more than the first ones.
NEAR = 2.0
# Where a greater weight leaves more than this share of the error, some faces have no room in the domain, and still
# greater ones would only shear the rest.
STUCK = 0.98
# The same for magnified regions that are still far from the goal, by the power of the weight's growth that the error is
# to fall with, where it has grown by so much: a density that varies more from face to face than the mesh can show has
# no exact areas, only shear.
SLUGGISH = 0.25
GROWN = 3.0
# Newton steps: a stage that takes longer gives way to the next, which may find a way around.
STAGE_STEPS = 40
# Share of the area term's indefinite Hessian kept ("pressure"): at the start of a stage, and the least before it is
# dropped.
FIRST_PRESSURE = 0.3
LEAST_PRESSURE = 0.01
# The former where the boundary is free and areas need not be exact: faces that give way at once save every tenth step,
# while those in a circle would end their stages too soon.
FREE_PRESSURE = 0.05
# By how much it falls after a full step that has kept its promise, and after one that has gained what it promised.
PRESSURE_FALLS = 3.0
PRESSURE_DROPS = 10.0
# Share of what an area error may be that polygons are left with where less would cost shear: the triangles inside them
# are off by more, whatever the weight.
SPARE = 0.25
# By how much more an area error is made to fall than it has to: a last step more takes longer than it shears less.
MARGIN = 1.05
# A stage cannot reach an area error that is less than this share of its own and takes more than another step as good.
WITHIN_REACH = 0.95
# A full step that gained what it promised leaves little to the next one where the boundary is free. Along itself, where
# the energy is cubic, that is 9/4 of the square of what it missed of its promise, in all several times as much; and
# some share of it in any case.
BENT = 11.0
LEFT = 0.1
# Up to this energy: a map that is sheared more gains for many steps, each promising a little.
EASY = 1.0
# A full step keeps its promise where it gains more than this share of it, and a poor one gains less than that.
KEPT_PROMISE = 0.7
# One that gains this share of it to that has a Hessian that is true.
TRUE_PROMISE = (0.9, 1.2)
POOR_PROMISE = 0.3
# Of a step that is poor because a fold is near, or the energy bends before its end: the share of it that was taken.
POOR_SHARE = 0.5
# The energy is a mean over the surface: below this it is rounding.
NO_ENERGY = 1e-12


@dataclass(frozen=True)
class Quality:
    """How exact areas become.

    Attributes
    ----------
    area_error : share of the area in the wrong place that is to be reached
    area_weights : on the way
    greatest_weight : at which the refinement ends in any case
    max_steps : Newton steps in all
    tolerance : where the area error is not reached, a weight is left for a greater one when Newton promises less than
        this share of the energy. A small one costs steps and saves shear.
    loose_tolerance : the same where it is reached, at the end
    settled : share by which a full step that has kept its promise may change the shear to be the last one, where it has
        the areas; 0 for none but what is seen by nobody, see NEARLY_SETTLED
    """

    area_error: float
    area_weights: tuple[float, ...]
    greatest_weight: float
    max_steps: int
    tolerance: float
    loose_tolerance: float = LOOSE
    settled: float = 0.0


# What users are told of "standard", which aims lower. Triangles within it, from quads that were solved as one, stay:
# what would bring them closer shears them.
PROMISED = 0.01
QUALITIES = {
    # For the start of a finer mesh: little shear alone, or areas about right, too.
    "relaxed": Quality(
        area_error=0.1, area_weights=(30.0,), greatest_weight=1e4, max_steps=80, tolerance=3e-2, loose_tolerance=1e-2
    ),
    # For that of a mesh which is squeezed to nothing: room for every face. While more than half of the area is in the
    # wrong place, some faces have none.
    "freed": Quality(
        area_error=1.0,
        area_weights=(SQUEEZED_WEIGHT,),
        greatest_weight=30.0,
        max_steps=120,
        tolerance=1e-3,
        loose_tolerance=1e-3,
    ),
    "rough": Quality(area_error=0.03, area_weights=(30.0, 500.0), greatest_weight=1e4, max_steps=80, tolerance=1e-2),
    # For that of a draft. Sweeps of the fine mesh do what is left.
    "sketch": Quality(
        area_error=0.035,
        area_weights=(30.0,),
        greatest_weight=4e3,
        max_steps=30,
        tolerance=0.3,
        loose_tolerance=0.3,
        settled=DRAFTED,
    ),
    # Areas about right, whatever is left of the shear.
    "draft": Quality(
        area_error=0.05,
        area_weights=(100.0,),
        greatest_weight=1e3,
        max_steps=40,
        tolerance=0.1,
        loose_tolerance=0.5,
        settled=DRAFTED,
    ),
    "standard": Quality(
        area_error=0.008, area_weights=(30.0, 500.0), greatest_weight=1e6, max_steps=150, tolerance=3e-2
    ),
    # As standard, but with areas that are no more exact than is promised: what that saves in shear, seams need not.
    "promised": Quality(
        area_error=0.008, area_weights=(30.0, 150.0), greatest_weight=1e6, max_steps=150, tolerance=3e-2
    ),
    # From a standard map on, where faces have less of their areas than the polygons that were solved for.
    "closer": Quality(area_error=0.006, area_weights=(500.0, 600.0), greatest_weight=1e6, max_steps=60, tolerance=3e-2),
    "exact": Quality(
        area_error=0.0003, area_weights=(30.0, 1000.0, 3e4), greatest_weight=1e8, max_steps=300, tolerance=1e-2
    ),
}


def planned_weights(balance: float, quality: Quality) -> list[float]:
    """Area weights of a quality; with a balance, those on the way to one between the last of them and LEAST_WEIGHT."""
    if balance == 0:
        return list(quality.area_weights)
    last = final_weight(balance, quality)
    return [*(weight for weight in quality.area_weights if weight < last), last]


def final_weight(balance: float, quality: Quality) -> float:
    """Area weight at a balance from 0 to 1: a geometric mean of the quality's last one and of LEAST_WEIGHT."""
    return quality.area_weights[-1] ** (1 - balance) * LEAST_WEIGHT**balance


def is_squeezed(energy: Number, first_weight: Number) -> Truth:
    """Whether a start of this energy at the first area weight needs a stage at SQUEEZED_WEIGHT before it."""
    return (energy > SQUEEZED) & (first_weight > SQUEEZED_WEIGHT)


def is_ahead(first: Number, second: Number) -> Truth:
    """Whether a start with these energies at the first area weight and at the second needs no stage at the first."""
    return second < AHEAD * first


def weight_growth(excess: Number) -> Number:
    """Factors for area weights that leave area errors so many times as large as they are to be."""
    return np.clip(np.square(excess), LEAST_GROWTH, MOST_GROWTH)


def next_weight(weight: Number, error: Number, quality: Quality) -> Number:
    """The area weight after one that left this area error, the share of a region aside, beyond the planned ones."""
    return weight * weight_growth(MARGIN * error / quality.area_error)


def spare_weight(planned: Number, weight: Number, error: Number, quality: Quality) -> Number:
    """A planned area weight for polygons after one that left this area error: no more than leaves them SPARE, as the
    error falls with the weight, and never less than the one before."""
    return np.minimum(planned, np.maximum(weight, weight * error / (SPARE * quality.area_error)))


def promised(decrement: Number, energy: Number) -> Number:
    """Residual: the decrease that Newton's method promises, over the energy."""
    return decrement / np.maximum(energy, NO_ENERGY)


def left_over(energy: Number, share: Number, gain: Number, decrement: Number, before: Number = np.inf) -> np.ndarray:
    """Residual after a step to this energy: what the next one can be expected to promise, over the energy; see LEFT.

    share, gain, decrement: as in `next_pressure`; before: the residual of the step before. Where steps shrink by the
    same share each, as from a map that is sheared all over, the next one does, too.
    """
    missed, residual = 1 - gain / np.maximum(decrement, NO_ENERGY), promised(decrement, energy)
    expected = np.clip(np.maximum(BENT * np.square(missed), residual / np.maximum(before, NO_ENERGY)), LEFT, 1)
    return residual * np.where((share == 1) & (energy < EASY), expected, 1)


def first_pressure(quality: Quality, balance: float, free: bool) -> float:
    """Share of the Hessian's indefinite part to keep in the first step of a stage; free: see FREE_PRESSURE."""
    return FREE_PRESSURE if free and balance == 0 and quality.tolerance >= LOOSE else FIRST_PRESSURE


def next_pressure(pressure: Number, share: Number, gain: Number, decrement: Number) -> np.ndarray:
    """Share of the Hessian's indefinite part to keep after a step: less while full steps keep their promise.

    share: of the step that was taken; gain: by how much the energy fell; decrement: by how much it was to fall
    """
    full = has_kept(share, gain, decrement)
    poor = (share <= POOR_SHARE) | (gain < POOR_PROMISE * decrement)
    more = np.minimum(1.0, np.maximum(3 * pressure, 3 * LEAST_PRESSURE))
    true = (gain > TRUE_PROMISE[0] * decrement) & (gain < TRUE_PROMISE[1] * decrement)
    less = np.where(pressure > LEAST_PRESSURE, pressure / np.where(true, PRESSURE_DROPS, PRESSURE_FALLS), 0.0)
    return np.where(full, less, np.where(share == 0, 1.0, np.where(poor, more, pressure)))


def has_kept(share: Number, gain: Number, decrement: Number) -> Truth:
    """Whether a step was a full one and kept its promise; share, gain, decrement: as in `next_pressure`. With a free
    boundary a stage on the way ends there: the next one, which starts as near to its own end, takes no more steps."""
    return (share == 1) & (gain > KEPT_PROMISE * decrement)


def stage_tolerances(
    quality: Quality, balance: float, on_the_way: bool, early: bool, loose: bool = False
) -> tuple[float, float]:
    """Tolerance of a stage where its goal is not reached, and where it is; see `judge_step`.

    on_the_way: its weight is not the last of those planned; early: it may end sooner for that, see ON_THE_WAY;
    loose: of a large mesh with a region, see REGION_TOLERANCE
    """
    if balance > 0:
        return STRICT, LOOSE
    if loose:
        return max(quality.tolerance, REGION_TOLERANCE), REGION_ON_THE_WAY if on_the_way else REGION_LOOSE
    return quality.tolerance, ON_THE_WAY if on_the_way and early else quality.loose_tolerance


class Verdict(NamedTuple):
    """stalled: no step helps; converged: the stage is done; sharpen: only the true Hessian can tell."""

    stalled: Truth
    converged: Truth
    sharpen: Truth


def judge_step(share: Number, pressure: Number, residual: Number, met: Truth, tolerance: float) -> Verdict:
    """What follows from a step taken to this share, with a Hessian of this pressure and this residual after it.

    met: the residual is below the loose tolerance, and the goal reached. A Hessian stiffer than the true one promises
    too little, so that a stage which has not met its goal ends on a promise of the true one only.
    """
    low = residual < tolerance
    true_hessian = pressure <= LEAST_PRESSURE
    return Verdict(
        stalled=(share == 0) & (pressure == 1.0),
        converged=met | (low & true_hessian),
        sharpen=low & (pressure > LEAST_PRESSURE),
    )


def is_out_of_reach(error: Number, before: Number, goal: Number) -> Truth:
    """Whether a stage that is nearly through, with these area errors after its last step and before, will not reach
    its goal: a greater weight takes it on from here."""
    return (goal < WITHIN_REACH * error) & (before - error < error - goal)


def is_settled(share: Number, now: tuple[Number, Number], before: tuple[Number, Number], goal: Number) -> Truth:
    """Whether a step taken to this share left shear and area error about as they were, and the latter at its goal:
    what further ones change, nobody sees."""
    (shear, error), (last_shear, last_error) = now, before
    same = (np.abs(shear - last_shear) <= SETTLED * last_shear) & (np.abs(error - last_error) <= SETTLED_AREAS * goal)
    return (share == 1) & (error <= goal) & same


def is_nearly_settled(
    kept: Truth, now: tuple[Number, Number], before: tuple[Number, Number], goal: Number, share: Number = NEARLY_SETTLED
) -> Truth:
    """Whether a step that has kept its promise changed the shear by so little, this share, that the next one will not
    be seen, with an area error at its goal; now, before: shear and area error."""
    return kept & (now[1] <= goal) & (np.abs(now[0] - before[0]) <= share * now[0])


def is_enough(quality: Quality, balance: float, error: Number, weight: Number) -> Truth:
    """Whether a stage of this area weight may be the last: it left this area error."""
    return (balance > 0) | (error <= quality.area_error) | (weight >= quality.greatest_weight)


def is_futile(quality: Quality, error: Number, before: Number, grown: Number = 1.0, with_region: bool = False) -> Truth:
    """Whether a stage that converged left so much of the error before it that greater weights are of no use.

    before: the error before it; grown: by how many times its area weight exceeded the one before; with_region: see
    SLUGGISH
    """
    far = with_region & (grown >= GROWN) & (error / quality.area_error > INEXACT)
    return error > np.where(far, np.minimum(STUCK, grown**-SLUGGISH), STUCK) * before
