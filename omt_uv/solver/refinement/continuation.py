"""Minimise the energy of a map in stages of growing area weight, by Newton's method (a penalty method).

Every stage starts from the map of the one before. Which weights they have and when they end, `continuation_rules`
decides; the share of a region comes out exact by a multiplier (Hestenes 1969); and a boundary that would come to cross
itself is kept apart from there on by a barrier (Smith, Schaefer 2015).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..maps.contacts import crossings
from ..maps.energy import Elements, missing_tilt, target_error, target_error_but_share, tilted
from ..maps.mirror_symmetry import MirrorSymmetry
from ..maps.polygon_elements import energy_in_turn, with_convex_quads
from ..progress import Progress, Steps
from .boundary_barrier import CLOSE_REACH, REACH, BoundaryBarrier, make_barrier
from .continuation_rules import (
    FIRST_PRESSURE,
    FORESEEN,
    LOOSE,
    NEAR,
    NEAR_THE_END,
    PASSED,
    PROMISED,
    SQUEEZED_WEIGHT,
    STAGE_STEPS,
    UNSQUEEZED,
    Quality,
    first_pressure,
    has_kept,
    is_ahead,
    is_enough,
    is_futile,
    is_nearly_settled,
    is_out_of_reach,
    is_settled,
    is_squeezed,
    judge_step,
    left_over,
    next_pressure,
    next_weight,
    planned_weights,
    promised,
    spare_weight,
    stage_tolerances,
)
from .hessian_blocks import Assembly, RowAssembly
from .projected_newton import Motion, NewtonProblem, NewtonStep
from .vertex_sweeps import Smoother

FIRST_SWEEPS = 8  # before the first step of a stage
CONTACT_STRENGTH = 0.3  # of the barrier between boundary vertices and edges, in mean face areas
CROSSED = "The boundary of the start crosses itself; it is not kept apart"


@dataclass(frozen=True)
class MapProblem:
    """A map to be found: its energy, and what no step may do.

    Attributes
    ----------
    faces, assembly, motion, smoother : see `NewtonProblem`
    loop : a boundary, see `contacts.loop_edges`, that may not cross itself, or None
    with_barrier : from the beginning
    scale_free : the scale of the targets follows the map
    loose : stages end on a looser promise, see `continuation_rules.stage_tolerances`
    symmetry : of the maps, or None
    count : of the polygons, where `faces` are those of one half, see `mirrored_motion.halved`
    contact_reach : of the barrier, of all or of each vertex (n,), see `boundary_barrier.make_barrier`
    """

    faces: Elements
    assembly: Assembly | RowAssembly
    motion: Motion
    loop: np.ndarray | None
    with_barrier: bool
    scale_free: bool = False
    smoother: Smoother | None = None
    symmetry: MirrorSymmetry | None = None
    count: int | None = None
    loose: bool = False
    contact_reach: float | np.ndarray = REACH

    def newton_problem(self, w: np.ndarray, area_weight: float, with_barrier: bool, tilt: float = 0.0) -> NewtonProblem:
        """What Newton minimises at an area weight, starting from the map w (n,), with the `barrier` of that map or not.

        tilt: of the targets, see `energy.tilted`.

        Raises ValueError for a barrier without a loop.
        """
        return NewtonProblem(
            faces=tilted(self.faces, tilt),
            assembly=self.assembly,
            motion=self.motion,
            area_weight=area_weight,
            terms=(self.barrier(w),) if with_barrier else (),
            aim=self.faces,
            smoother=self.smoother,
            symmetry=self.symmetry,
        )

    def barrier(self, w: np.ndarray) -> BoundaryBarrier:
        """The barrier that keeps the boundary of the map w (n,) from crossing itself."""
        if self.loop is None:
            raise ValueError("a boundary that may not move has nothing to be kept from")
        count = len(self.faces.area) if self.count is None else self.count
        return make_barrier(w, self.loop, CONTACT_STRENGTH / count, self.contact_reach)

    def boundary_crosses(self, w: np.ndarray) -> bool:
        """Whether the boundary of the map w (n,) crosses itself; never without a loop."""
        return self.loop is not None and len(crossings(w, self.loop)) > 0


def rescaled(problem: MapProblem, w: np.ndarray) -> MapProblem:
    """The problem with its targets scaled to sum to the area of the map w (n,).

    Only then can every face have its target: under any other scale what is missing is taken from the faces that have
    most, and a magnified region never gets its share.
    """
    scale = problem.faces.areas(w).sum() / (problem.faces.area @ problem.faces.ratio)
    return replace(problem, faces=replace(problem.faces, ratio=problem.faces.ratio * scale))


@dataclass(frozen=True)
class ContinuationResult:
    """What all stages found.

    Attributes
    ----------
    w : (n,) complex map
    steps : Newton steps
    residual : last promised decrease over energy
    area_weight, energy : at the end
    status : as in `refine.Refinement`
    overlap : the boundary crosses itself
    multiplier : tilt of the targets times the area weight that gives the region its share
    """

    w: np.ndarray
    steps: int
    residual: float
    area_weight: float
    energy: float
    status: str
    overlap: bool
    warnings: tuple[str, ...]
    multiplier: float = 0.0


def minimise_in_stages(
    problem: MapProblem,
    w: np.ndarray,
    balance: float,
    quality: Quality,
    warm_start: bool = False,
    multiplier: float = 0.0,
    prolonged: bool = False,
) -> Steps[ContinuationResult]:
    """Newton in stages of growing area weight from a map w (n,) complex, until the area error is small enough.

    warm_start: w is nearly what is looked for; the least weight would lead away. prolonged: see `RefinementOptions`
    multiplier: that of a coarser map, see `ContinuationResult`. The shear pulls all faces of a region one way, and its
        share would take many more steps. So its targets lead: a method of multipliers (Hestenes 1969).
    As soon as a step would let the boundary cross itself, it goes on with a barrier from short of there.
    """
    weights, squeezed = _first_weights(problem, w, balance, quality, (warm_start, prolonged))
    overlap, with_barrier = problem.boundary_crosses(w), problem.with_barrier
    steps, k, before, last = 0, 0, np.inf, weights[0]
    while True:
        weight, problem = weights[k], rescaled(problem, w) if problem.scale_free else problem
        problem = replace(problem, faces=with_convex_quads(problem.faces, w))
        newton = problem.newton_problem(w, weight, with_barrier, multiplier / weight)
        if problem.smoother is not None:
            w = problem.smoother.smoothed(newton.faces, w, weight, FIRST_SWEEPS)
        limits = _limits(problem, balance, quality, k - len(weights) + 1, quality.max_steps - steps)
        if squeezed or prolonged:
            limits = _limits_after(limits, k == 0 and squeezed)
        forbidden = None if with_barrier or overlap else problem.boundary_crosses
        stage = yield from minimise(newton, w, limits, k, forbidden)
        w, steps = stage.w, steps + stage.steps
        if stage.status == "crossed":
            (problem, w), with_barrier = set_apart(problem, newton, stage), True
            continue
        k += 1
        error, rest = target_error(problem.faces, w), target_error_but_share(problem.faces, w)
        multiplier += weight * missing_tilt(problem.faces, w) if balance == 0 else 0.0
        enough = is_enough(quality, balance, error, weights[-1])
        if stage.status == "converged":
            enough |= is_futile(quality, error, before, weight / last, problem.faces.region is not None)
        before, last = error, weight
        if steps >= quality.max_steps or stage.status == "stalled" or (enough and k >= len(weights)):
            break
        if k >= len(weights):
            weights.append(float(next_weight(weights[-1], rest, quality)))
        elif problem.faces.polygon is not None:
            weights[k] = float(spare_weight(weights[k], weight, error, quality))
            if enough and weights[k:] == [weight] and is_through(stage, balance, quality):
                break
    return ContinuationResult(
        w=w,
        steps=steps,
        residual=stage.residual,
        area_weight=weight,
        energy=stage.energy,
        status=stage.status,
        overlap=problem.boundary_crosses(w),
        warnings=(CROSSED,) if overlap else (),
        multiplier=multiplier,
    )


def as_far_as_apart(problem: MapProblem, newton: NewtonProblem, stage: StageResult) -> np.ndarray:
    """The map (n,) complex before a stage that ended "crossed", moved by its last step most of the way to where the
    boundary touches itself: what was solved for once need not be solved for again. Unmoved where that lowers no energy.
    """
    step = np.zeros(len(stage.w)) if stage.ahead is None else stage.ahead - stage.w
    most = problem.barrier(stage.w).limit(stage.w, step)
    if not np.isfinite(most):
        return stage.w
    near = stage.w + most * step
    lower = np.isfinite(near).all() and newton.energy(near) < stage.energy
    return near if lower and not problem.boundary_crosses(near) else stage.w


def set_apart(problem: MapProblem, newton: NewtonProblem, stage: StageResult) -> tuple[MapProblem, np.ndarray]:
    """The problem for what goes on with a barrier after a stage that ended "crossed", and the map (n,) complex to go on
    from: `as_far_as_apart`, or where the boundary touches itself, as that of a net does, the map with these a little
    apart, and a barrier that reaches no farther than it has to there."""
    step, motion = problem.barrier(stage.w).set_apart(stage.w), problem.motion
    if step.any():
        moved = motion.move(stage.w, np.where(motion.free.all(axis=1), step / motion.frame(stage.w), 0))
        if np.isfinite(newton.energy(moved)) and not problem.boundary_crosses(moved):
            return replace(problem, contact_reach=np.where(step == 0, REACH, CLOSE_REACH)), moved
    return problem, as_far_as_apart(problem, newton, stage)


def _first_weights(
    problem: MapProblem, w: np.ndarray, balance: float, quality: Quality, start: tuple[bool, bool]
) -> tuple[list[float], bool]:
    """The first area weights, and whether the first of them is there for a squeezed start alone; start: whether that
    is warm, and prolonged."""
    weights, (warm, prolonged) = planned_weights(balance, quality), start
    if warm and len(weights) > 1:
        return [NEAR * weight for weight in weights[1:]], False
    least = weights[0]
    first = problem.newton_problem(w, least, False).energy(w)
    # What has little shear has nothing to relax.
    if is_squeezed(first, least) and problem.newton_problem(w, 0.0, False).energy(w) > UNSQUEEZED:
        return [SQUEEZED_WEIGHT, *weights], True
    if prolonged and balance == 0 and len(weights) > 1:
        second = problem.newton_problem(w, weights[1], False).energy(w)
        if is_ahead(first, second):
            weights = weights[1:]
            if problem.faces.polygon is not None:
                # As after a stage at the first weight, which it takes the place of.
                weights[0] = float(spare_weight(weights[0], least, target_error(problem.faces, w), quality))
    return weights, False


def _limits(problem: MapProblem, balance: float, quality: Quality, ahead: int, steps_left: int) -> StageLimits:
    """Limits of a stage; ahead: less than 0 while planned weights are still to come."""
    on_the_way, swept, region = ahead < 0, problem.smoother is not None, problem.faces.region is not None
    # Maps on the way to others say what those will be: they go as far as they promise.
    expecting = balance == 0 and not problem.scale_free and not swept and quality.area_error <= PROMISED
    tolerance, loose = stage_tolerances(quality, balance, on_the_way, not problem.scale_free, problem.loose)
    brisk = expecting and quality.tolerance >= LOOSE
    return StageLimits(
        area_error=np.inf if on_the_way else quality.area_error,
        max_steps=min(steps_left, STAGE_STEPS) if balance == 0 else steps_left,
        tolerance=tolerance,
        loose_tolerance=loose,
        # Its share is what a stage with a region is for.
        foreseeing=balance == 0 and not on_the_way and not region,
        foreseen=FORESEEN,
        expecting=expecting,
        passing=brisk and on_the_way and not region,
        brisk=brisk,
        pressure=first_pressure(quality, balance, not problem.scale_free and not region),
        shear=_shear_of(problem.faces) if balance == 0 and not on_the_way else None,
        settled=quality.settled,
    )


def _limits_after(limits: StageLimits, relaxing: bool) -> StageLimits:
    """Limits after a start that was squeezed, which has far to go, or came from a coarser mesh, which has the shear
    that stages on the way would bring; relaxing : in the first stage of the former."""
    limits = replace(limits, passing=False)
    return replace(limits, relaxed=UNSQUEEZED, shear=None) if relaxing else limits


def _shear_of(faces: Elements) -> Callable[[np.ndarray], float]:
    return lambda w: energy_in_turn(faces, w, 0.0)


@dataclass(frozen=True)
class StageLimits:
    """When a stage ends.

    area_error : to reach; max_steps : of Newton's method; tolerance, loose_tolerance : as in
    `continuation_rules.Quality`; relaxed : an energy that is low enough in any case; foreseeing : it ends, too, where
    the area error is out of reach, see `continuation_rules.is_out_of_reach`, once it promises less than foreseen;
    expecting : its promise is what the next step is expected to make, see `continuation_rules.left_over`; passing : it
    ends with a step that `continuation_rules.has_kept`; brisk : and with two that leave it nearly settled, see
    `continuation_rules.is_nearly_settled`, where areas need not be exact; shear : of a map, with which it ends where
    that settles, see `continuation_rules.is_settled`; pressure : of the first step, see
    `continuation_rules.FIRST_PRESSURE`; settled : see `continuation_rules.Quality`
    """

    area_error: float
    max_steps: int
    tolerance: float = LOOSE
    loose_tolerance: float = LOOSE
    relaxed: float = 0.0
    foreseeing: bool = False
    foreseen: float = 0.0
    expecting: bool = False
    passing: bool = False
    brisk: bool = False
    shear: Callable[[np.ndarray], float] | None = None
    pressure: float = FIRST_PRESSURE
    settled: float = 0.0


@dataclass(frozen=True)
class StageResult:
    """What one stage found, as in `ContinuationResult`.

    status "crossed": the next step would let the boundary cross itself, to the map `ahead` (n,).
    """

    w: np.ndarray
    steps: int
    residual: float
    energy: float
    status: str
    ahead: np.ndarray | None = None


class Minimisable(Protocol):
    """An energy of maps w, arrays of any shape, with a Newton step that never folds a face."""

    def energy(self, w: np.ndarray) -> float:
        """The energy of a map; infinity where a face is folded."""

    def area_error(self, w: np.ndarray) -> float:
        """What a map lacks of its areas: 0 where every face has its own."""

    def step(self, w: np.ndarray, value: float, pressure: float) -> NewtonStep:
        """A line-searched step from a map of energy `value`; pressure: see `energy.face_derivatives`."""


def is_through(stage: StageResult, balance: float, quality: Quality) -> bool:
    """Whether the last stage, at the same weight as this one on the way, would only see that nothing is left to do."""
    return balance == 0 and stage.status == "converged" and stage.residual < quality.loose_tolerance


def minimise(
    problem: Minimisable,
    w: np.ndarray,
    limits: StageLimits,
    stage: int = 0,
    forbidden: Callable[[np.ndarray], bool] | None = None,
) -> Steps[StageResult]:
    """Newton from a map w until it promises less than the limits say.

    stage: the number of this stage, for the progress; forbidden: a step to where this is true is not taken, and the
    stage ends "crossed".
    """
    value = problem.energy(w)
    steps, residual, status, pressure = 0, np.inf, "steps", limits.pressure
    error, figures, kept = np.inf, (np.inf, np.inf), False
    if limits.settled and limits.shear is not None:
        figures = (limits.shear(w), np.inf)
    while steps < max(limits.max_steps, 1):
        step, used = problem.step(w, value, pressure), pressure
        if forbidden is not None and forbidden(step.w):
            return StageResult(w, steps + 1, residual, value, "crossed", ahead=step.w)
        gained = step.share, value - step.energy, step.decrement
        pressure, twice, kept = float(next_pressure(used, *gained)), kept, bool(has_kept(*gained))
        w, value, steps = step.w, step.energy, steps + 1
        before, residual = residual, float(promised(step.decrement, value))
        left = float(left_over(value, *gained, before)) if limits.expecting else residual
        # How many stages and steps there will be is not known: every stage covers half of what is left.
        yield Progress("Refinement", 1 - 0.5 ** (stage + 1 - 0.5**steps))
        met = value < limits.relaxed or (limits.passing and kept and residual < PASSED)
        met = met or (left < limits.loose_tolerance and problem.area_error(w) <= limits.area_error)
        nearly = residual < max(limits.foreseen, limits.loose_tolerance) or left < limits.loose_tolerance
        # Limbs on a sphere trade their areas late: there only the last steps tell.
        if limits.foreseeing and not met and (nearly or limits.expecting or limits.settled):
            before, error = error, problem.area_error(w)
            met = nearly and bool(is_out_of_reach(error, before, limits.area_error))
        if limits.shear is not None and not met:
            last, figures = figures, (limits.shear(w), problem.area_error(w))
            met = bool(is_settled(step.share, figures, last, limits.area_error))
            near = kept and twice and limits.brisk and residual < NEAR_THE_END
            met = met or bool(is_nearly_settled(near, figures, last, limits.area_error))
            if limits.settled:
                met = met or bool(is_nearly_settled(kept, figures, last, limits.area_error, limits.settled))
        verdict = judge_step(step.share, used, residual, met, limits.tolerance)
        if verdict.stalled or verdict.converged:
            status = "stalled" if verdict.stalled else "converged"
            break
        if verdict.sharpen:
            pressure = 0.0
    return StageResult(w=w, steps=steps, residual=residual, energy=value, status=status)
