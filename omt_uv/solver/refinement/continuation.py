"""Newton in stages of growing weight of the area term, until every face has its area."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from ..analysis.density import INEXACT
from ..maps.energy import Elements, missing_tilt, target_error, target_error_but_share, tilted
from ..progress import Progress, Steps
from .boundary_barrier import BoundaryBarrier, crossings, make_barrier
from .projected_newton import Assembly, Motion, NewtonProblem, NewtonStep
from .vertex_sweeps import Smoother

# A stage that reaches the goal ends when Newton promises less than this share of the energy. One on the way ends sooner
# where the boundary is free; vertices on a circle or on sides do not make up for it later.
LOOSE, ON_THE_WAY = 3e-2, 0.05


@dataclass(frozen=True)
class Quality:
    """Area error to reach (share of area in the wrong place), weights of the area term on the way, steps allowed.

    tolerance: where the error is not reached, a weight is left for a greater one when Newton promises less than this
    share of the energy. A small one costs steps and saves shear. loose: the same where it is reached, at the end.
    """

    area_error: float
    weights: tuple[float, ...]
    greatest_weight: float
    max_steps: int
    tolerance: float
    loose: float = LOOSE


QUALITIES = {
    # For the start of a finer mesh: little shear alone, or areas about right, too.
    "relaxed": Quality(0.1, (30.0,), 1e4, 80, 3e-2, 1e-2),
    "rough": Quality(0.03, (30.0, 500.0), 1e4, 80, 1e-2),
    "draft": Quality(0.05, (10.0, 100.0), 1e3, 40, 1e-2),
    "standard": Quality(0.008, (30.0, 500.0), 1e6, 150, 3e-2),
    "exact": Quality(0.0003, (30.0, 1000.0, 3e4), 1e8, 300, 1e-2),
}
# The same where sweeps follow every step: what Newton promises then is in few faces, and sweeps do it for less.
SWEPT_TOLERANCE, SWEPT_LOOSE, SWEPT_ON_THE_WAY = 0.1, 0.15, 0.1
# Sweeps before the first step of a stage.
FIRST_SWEEPS = 8
# With a balance the weight alone decides, and neighbouring balances must not differ by chance.
STRICT = 1e-4
# Weight of the area term at balance 1. Without it the map of least shear has no scale; and much below this the mean
# shear, which is not quite the energy's, no longer falls.
LEAST_WEIGHT = 1e-2
# Mean energy above which a start is so squeezed that its shear must relax before its areas.
SQUEEZED = 50.0
# Where the error is not reached, the weight grows by at least and at most so much.
LEAST_GROWTH, MOST_GROWTH = 1.3, 10.0
# The same for weights of a start that has nearly its areas, of a target that will need more than the first ones.
NEAR = 2.0
# Where a greater weight leaves more than this share of the error, some faces have no room on the outline, and still
# greater ones would only shear the rest.
STUCK = 0.98
# The same for magnified regions that are still far from the goal, by the power of the weight's growth that the error is
# to fall with, where it has grown by so much: a density that varies more from face to face than the mesh can show has
# no exact areas, only shear.
SLUGGISH, GROWN = 0.25, 3.0
# A stage that takes longer gives way to the next, which may find a way around.
STAGE_STEPS = 40
# Share of the area term's indefinite Hessian kept: at the start of a stage, and the least before it is dropped.
FIRST_PRESSURE, LEAST_PRESSURE = 0.3, 0.01
# The energy is a mean over the surface: below this it is rounding.
NO_ENERGY = 1e-12
# Of the barrier between boundary vertices and edges, in mean face areas.
CONTACT_STRENGTH = 0.3


@dataclass(frozen=True)
class MapProblem:
    """A map to be found: its energy, and what no step may do.

    Attributes
    ----------
    faces, assembly, motion, smoother : see `NewtonProblem`
    loop : a boundary, see `boundary_barrier.loop_edges`, that may not cross itself, or None
    with_barrier : from the beginning
    scale_free : the scale of the targets follows the map
    """

    faces: Elements
    assembly: Assembly
    motion: Motion
    loop: np.ndarray | None
    with_barrier: bool
    scale_free: bool = False
    smoother: Smoother | None = None

    def problem(self, w: np.ndarray, weight: float, with_barrier: bool, tilt: float = 0.0) -> NewtonProblem:
        """What Newton minimises at a weight of the area term; guarded: with the barrier `guard` of the map w (n,).

        tilt: of the targets, see `energy.tilted`.

        Raises ValueError where guarded without a loop.
        """
        terms = (self.barrier(w),) if with_barrier else ()
        faces = tilted(self.faces, tilt)
        return NewtonProblem(faces, self.assembly, self.motion, weight, terms, self.faces, self.smoother)

    def barrier(self, w: np.ndarray) -> BoundaryBarrier:
        """The barrier that keeps the boundary of the map w (n,) from crossing itself."""
        if self.loop is None:
            raise ValueError("a boundary that may not move has nothing to be kept from")
        return make_barrier(w, self.loop, CONTACT_STRENGTH / len(self.faces.area))

    def boundary_crosses(self, w: np.ndarray) -> bool:
        """Whether the boundary of the map w (n,) crosses itself; never without a loop."""
        return self.loop is not None and len(crossings(w, self.loop)) > 0


def rescaled(task: MapProblem, w: np.ndarray) -> MapProblem:
    """The task with its targets scaled to sum to the area of the map w (n,).

    Only then can every face have its target: under any other scale what is missing is taken from the faces that have
    most, and a magnified region never gets its share.
    """
    scale = task.faces.areas(w).sum() / (task.faces.area @ task.faces.ratio)
    return replace(task, faces=replace(task.faces, ratio=task.faces.ratio * scale))


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


def planned_weights(balance: float, settings: Quality) -> list[float]:
    """The preset's weights; with a balance, those on the way to one between the preset's last and LEAST_WEIGHT."""
    if balance == 0:
        return list(settings.weights)
    last = final_weight(balance, settings)
    return [*(weight for weight in settings.weights if weight < last), last]


def final_weight(balance: float, settings: Quality) -> float:
    """Weight of the area term at a balance from 0 to 1."""
    return settings.weights[-1] ** (1 - balance) * LEAST_WEIGHT**balance


def weight_growth(excess: np.ndarray | float) -> np.ndarray | float:
    """Factors for weights that leave area errors so many times (any shape) as large as they are to be."""
    return np.clip(np.square(excess), LEAST_GROWTH, MOST_GROWTH)


def minimise_in_stages(
    task: MapProblem,
    w: np.ndarray,
    balance: float,
    settings: Quality,
    warm_start: bool = False,
    multiplier: float = 0.0,
) -> Steps[ContinuationResult]:
    """Newton in stages of growing weight, until the area error is small enough.

    warm_start: the map w (n,) is nearly the one that is looked for; the least weight would lead away from it.
    multiplier: that of a coarser map, see `ContinuationResult`. The shear pulls all faces of a region one way, and a
        weight at which its share came out all the same would take many more steps. So its targets lead: a method of
        multipliers (Hestenes 1969), with one for the share.
    As soon as a step would let the boundary cross itself, it goes on with a barrier from where it was.
    """
    weights = planned_weights(balance, settings)
    if warm_start and len(weights) > 1:
        weights = [NEAR * weight for weight in weights[1:]]
    elif task.problem(w, weights[0], False).energy(w) > SQUEEZED and weights[0] > 1:
        weights = [1.0, *weights]
    overlap, with_barrier = task.boundary_crosses(w), task.with_barrier
    steps, k, before, last = 0, 0, np.inf, weights[0]
    warnings = ("The boundary of the start crosses itself; it is not kept apart",) if overlap else ()
    while True:
        weight = weights[k]
        task = rescaled(task, w) if task.scale_free else task
        problem = task.problem(w, weight, with_barrier, multiplier / weight)
        if task.smoother is not None:
            w = task.smoother.smoothed(problem.faces, w, weight, FIRST_SWEEPS)
        goal = settings.area_error if k >= len(weights) - 1 else np.inf
        left = settings.max_steps - steps
        allowed = min(left, STAGE_STEPS) if balance == 0 else left
        watch = None if with_barrier or overlap else task.boundary_crosses
        tolerance, loose = _ends(task, balance, settings, k < len(weights) - 1)
        stage = yield from minimise(problem, w, goal, allowed, k, watch, tolerance, loose)
        w, steps = stage.w, steps + stage.steps
        if stage.status == "crossed":
            with_barrier = True
            continue
        k += 1
        error, rest = target_error(task.faces, w), target_error_but_share(task.faces, w)
        multiplier += weight * missing_tilt(task.faces, w) if balance == 0 else 0.0
        enough = balance > 0 or error <= settings.area_error or weights[-1] >= settings.greatest_weight
        enough |= (
            stage.status == "converged" and error > _stuck(task, weight / last, error / settings.area_error) * before
        )
        before, last = error, weight
        if steps >= settings.max_steps or stage.status == "stalled" or (enough and k >= len(weights)):
            break
        if k >= len(weights):
            weights.append(weights[-1] * float(weight_growth(rest / settings.area_error)))
    return ContinuationResult(
        w=w,
        steps=steps,
        residual=stage.residual,
        area_weight=weight,
        energy=stage.energy,
        status=stage.status,
        overlap=task.boundary_crosses(w),
        warnings=warnings,
        multiplier=multiplier,
    )


def _stuck(task: MapProblem, grown: float, excess: float) -> float:
    """Share of the error before above which a weight so many times greater was of no use; excess: error over goal."""
    far = task.faces.region is not None and grown >= GROWN and excess > INEXACT
    return min(STUCK, grown**-SLUGGISH) if far else STUCK


def _ends(task: MapProblem, balance: float, settings: Quality, on_the_way: bool) -> tuple[float, float]:
    """Tolerance and looseness of a stage, see `minimise`."""
    if balance > 0:
        return STRICT, LOOSE
    if task.smoother is not None:
        return max(settings.tolerance, SWEPT_TOLERANCE), SWEPT_ON_THE_WAY if on_the_way else SWEPT_LOOSE
    return settings.tolerance, ON_THE_WAY if on_the_way and not task.scale_free else settings.loose


@dataclass(frozen=True)
class StageResult:
    """What one stage found, as in `ContinuationResult`.

    status "crossed": the next step would let the boundary cross itself.
    """

    w: np.ndarray
    steps: int
    residual: float
    energy: float
    status: str


class Minimisable(Protocol):
    """An energy of maps w, arrays of any shape, with a Newton step that never folds a face."""

    def energy(self, w: np.ndarray) -> float:
        """The energy of a map; infinity where a face is folded."""

    def area_error(self, w: np.ndarray) -> float:
        """What a map lacks of its areas: 0 where every face has its own."""

    def step(self, w: np.ndarray, value: float, pressure: float) -> NewtonStep:
        """A line-searched step from a map of energy `value`; pressure: see `energy.face_derivatives`."""


def minimise(
    problem: Minimisable,
    w: np.ndarray,
    goal: float,
    allowed: int,
    place: int,
    watch: Callable[[np.ndarray], bool] | None = None,
    tolerance: float = LOOSE,
    loose: float = LOOSE,
) -> Steps[StageResult]:
    """Newton until it promises less than `loose`; where that leaves the area error above the goal, than `tolerance`.

    place: the number of this stage, for the progress; watch: a step to where this is true is not taken, and the
    stage ends "crossed".
    """
    value = problem.energy(w)
    steps, residual, status, pressure = 0, np.inf, "steps", FIRST_PRESSURE
    while steps < max(allowed, 1):
        step, used = problem.step(w, value, pressure), pressure
        pressure = _next_pressure(pressure, step, value)
        if watch is not None and watch(step.w):
            return StageResult(w, steps + 1, residual, value, "crossed")
        w, value, steps = step.w, step.energy, steps + 1
        residual = step.decrement / max(value, NO_ENERGY)
        # How many stages and steps there will be is not known: every stage covers half of what is left.
        yield Progress("Refinement", 1 - 0.5 ** (place + 1 - 0.5**steps))
        if step.share == 0 and used == 1.0:
            status = "stalled"
            break
        if residual < loose and problem.area_error(w) <= goal:
            status = "converged"
            break
        if residual < tolerance:
            # A Hessian stiffer than the true one promises too little.
            if used <= LEAST_PRESSURE:
                status = "converged"
                break
            pressure = 0.0
    return StageResult(w, steps, residual, value, status)


def _next_pressure(pressure: float, step: NewtonStep, value: float) -> float:
    """Less of the indefinite part of the Hessian while full steps keep their promise, more when they do not."""
    if step.share == 1 and value - step.energy > 0.7 * step.decrement:
        return pressure / 3 if pressure > LEAST_PRESSURE else 0.0
    if step.share == 0:
        return 1.0
    if step.share < 0.5 or value - step.energy < 0.3 * step.decrement:
        return min(1.0, max(3 * pressure, 3 * LEAST_PRESSURE))
    return pressure
