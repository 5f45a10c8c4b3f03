"""Authalic refinement: every face gets its area, none folds, and the shear is the least that this allows.

Minimises the energy of `energy.py` by projected Newton in stages of growing weight of the area term. The weight
ends where the area error is small enough for the quality asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix

from .contact import contact, crossings
from .energy import Elements, area_error, elements, squared
from .errors import DensityError
from .geometry import face_areas, signed_areas
from .linear import minimum_degree
from .newton import Assembly, Motion, Problem, newton_step
from .progress import Progress, Steps
from .starts import check_start, disk_start, free_start, square_start
from .topology import boundary_loops

STARTS = {"free": free_start, "disk": disk_start, "square": square_start}
BOUNDARIES = tuple(STARTS)


@dataclass(frozen=True)
class Quality:
    """Area error to reach (share of area in the wrong place), weights of the area term on the way, steps allowed."""

    area_error: float
    weights: tuple[float, ...]
    greatest_weight: float
    max_steps: int


QUALITIES = {
    "draft": Quality(0.05, (10.0, 100.0), 1e3, 40),
    "standard": Quality(0.005, (10.0, 100.0, 500.0), 1e6, 150),
    "exact": Quality(0.0005, (10.0, 100.0, 1000.0, 1e4), 1e8, 300),
}
# A stage ends when Newton promises less than this share of the energy; the last stage is held to the second.
LOOSE, TIGHT = 1e-2, 1e-3
# The energy is a mean over the surface: below this it is rounding.
NO_ENERGY = 1e-12
# Of the barrier between boundary vertices and edges, in mean face areas.
CONTACT_STRENGTH = 1.0


@dataclass(frozen=True)
class Refinement:
    """uv (n,2) without folds; iterations: Newton steps; residual: last predicted decrease over energy.

    area_error: share of the UV area in the wrong place; weight: that of the area term; energy at the end;
    status: "converged", "stalled" (no decrease could be found) or "steps" (allowance used up); warnings: what was
    replaced and why; overlap: the free boundary crosses itself.
    """

    uv: np.ndarray
    iterations: int
    residual: float
    area_error: float
    weight: float
    energy: float
    status: str
    overlap: bool
    warnings: tuple[str, ...]


def refine(
    vertices: np.ndarray,
    triangles: np.ndarray,
    uv: np.ndarray,
    *,
    boundary: str = "free",
    target: np.ndarray | None = None,
    balance: float = 0.0,
    quality: str = "standard",
) -> Steps[Refinement]:
    """Refine a map uv (n,2) of a disk (n,3), (m,3) until every face has its area.

    Parameters
    ----------
    boundary : "free"; "disk", sliding on the circle about 0 of the target's area; "square", sliding on the sides of
        the square about 0 of the target's area, corners fixed
    target : (m,) area that every face shall have relative to the others; the surface's areas by default. They are
        scaled to sum to the area of the surface.
    balance : 0 for exact areas to 1 for the least shear
    quality : "draft", "standard" or "exact"

    Raises
    ------
    DensityError : a target that is not positive and finite
    FoldedUVError : a start without area, or a fold that no embedding could remove

    References
    ----------
    Hormann, Greiner 2000 (shear); Degener, Meseth, Klein 2003 (area); Smith, de Goes, Kim 2019 (eigensystem);
    Smith, Schaefer 2015 (barrier against folds).
    """
    if boundary not in BOUNDARIES:
        raise ValueError(f"boundary must be one of {', '.join(BOUNDARIES)}, not {boundary!r}")
    if not 0 <= balance <= 1:
        raise ValueError(f"balance must lie in [0, 1], not {balance}")
    settings = QUALITIES[quality]
    yield Progress("Refinement", 0.0)
    target = _targets(face_areas(vertices, triangles), target)
    uv = np.asarray(uv, float)
    check_start(uv, triangles)
    mirror = [np.sign(signed_areas(uv, triangles).sum()), 1]
    uv = uv * mirror
    # Neighbours in the elimination order are neighbours in memory: everything is renumbered once.
    order = minimum_degree(_graph(triangles, len(vertices)))
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    vertices, triangles, uv = vertices[order], place[triangles], uv[order]
    loop = boundary_loops(triangles)[0]
    start = STARTS[boundary](vertices, triangles, uv, loop)
    faces = elements(vertices, triangles, target)
    task = _Task(faces, Assembly(triangles, len(vertices)), start.motion, loop if start.may_cross else None, start.guarded)
    found = yield from _stages(task, start.uv[:, 0] + 1j * start.uv[:, 1], balance, settings)
    w = _placed(found.w, uv[:, 0] + 1j * uv[:, 1], faces) if boundary == "free" else found.w
    return Refinement(
        np.column_stack([w.real, w.imag])[place] * mirror,
        found.steps,
        found.residual,
        area_error(faces, w),
        found.weight,
        found.energy,
        found.status,
        found.overlap,
        (*start.warnings, *found.warnings),
    )


def _targets(area: np.ndarray, target: np.ndarray | None) -> np.ndarray:
    if target is None:
        return area
    target = np.asarray(target, float)
    wrong = np.flatnonzero(~(np.isfinite(target) & (target > 0)))
    if len(wrong):
        raise DensityError("A face has no positive, finite target area", kind="face", elements=wrong)
    return target * (area.sum() / target.sum())


def _graph(triangles: np.ndarray, n: int):
    pairs = np.repeat(triangles, 3, axis=1).ravel(), np.tile(triangles, (1, 3)).ravel()
    return coo_matrix((np.ones(len(pairs[0])), pairs), shape=(n, n))


@dataclass(frozen=True)
class _Task:
    """faces, assembly and motion for Newton; loop: a boundary (b,) that may not cross itself, or None;
    guarded: from the beginning."""

    faces: Elements
    assembly: Assembly
    motion: Motion
    loop: np.ndarray | None
    guarded: bool

    def problem(self, w: np.ndarray, weight: float, guarded: bool) -> Problem:
        extras = (contact(w, self.loop, CONTACT_STRENGTH / len(self.faces.area)),) if guarded else ()
        return Problem(self.faces, self.assembly, self.motion, weight, extras)

    def crosses(self, w: np.ndarray) -> bool:
        return self.loop is not None and len(crossings(w, self.loop)) > 0


@dataclass(frozen=True)
class _Found:
    w: np.ndarray
    steps: int
    residual: float
    weight: float
    energy: float
    status: str
    overlap: bool
    warnings: tuple[str, ...]


def _stages(task: _Task, w: np.ndarray, balance: float, settings: Quality) -> Steps[_Found]:
    """Newton in stages of growing weight, until the area error is small enough.

    When a stage ends with a boundary that crosses itself it is done again with a barrier, from where it began.
    """
    weights = list(settings.weights)
    softening = (balance / (1 - balance)) ** 2 if balance < 1 else np.inf
    overlap, guarded, steps, k = task.crosses(w), task.guarded, 0, 0
    warnings = ("The boundary of the start crosses itself; it is not kept apart",) if overlap else ()
    while True:
        weight = 1 / (1 / weights[k] + softening)
        problem = task.problem(w, weight, guarded)
        last = k >= len(weights) - 1
        tolerance, allowed = TIGHT if last else LOOSE, settings.max_steps - steps
        stage = yield from _minimise(problem, w, tolerance, allowed, (k, len(weights)))
        steps += stage.steps
        if not (guarded or overlap) and task.crosses(stage.w):
            guarded = True
            continue
        w, k = stage.w, k + 1
        error = area_error(task.faces, w)
        enough = balance > 0 or error <= settings.area_error or weights[-1] >= settings.greatest_weight
        if steps >= settings.max_steps or stage.status == "stalled" or (enough and k >= len(weights)):
            break
        if k >= len(weights):
            weights.append(weights[-1] * min(max(2.0, (error / settings.area_error) ** 2), 10.0))
    return _Found(w, steps, stage.residual, weight, stage.energy, stage.status, task.crosses(w), warnings)


@dataclass(frozen=True)
class _Stage:
    w: np.ndarray
    steps: int
    residual: float
    energy: float
    status: str


def _minimise(problem: Problem, w: np.ndarray, tolerance: float, allowed: int, place: tuple[int, int]) -> Steps[_Stage]:
    """Newton until it promises less than `tolerance` of the energy; place is the stage's number and their count."""
    value = problem.energy(w)
    steps, residual, status = 0, np.inf, "steps"
    while steps < max(allowed, 1):
        step = newton_step(problem, w, value)
        w, value, steps = step.w, step.energy, steps + 1
        residual = step.decrement / max(value, NO_ENERGY)
        yield Progress("Refinement", min(1.0, (place[0] + 1 - 0.5**steps) / place[1]))
        if residual < tolerance:
            status = "converged"
            break
        if step.share == 0:
            status = "stalled"
            break
    return _Stage(w, steps, residual, value, status)


def _placed(w: np.ndarray, start: np.ndarray, faces: Elements) -> np.ndarray:
    """The map with the UV area of its targets, turned and moved to lie as the start did."""
    a, b = faces.derivatives(w)
    w = w * np.sqrt((faces.area @ faces.ratio) / (faces.area @ (squared(a) - squared(b))))
    mass = np.bincount(faces.triangles.ravel(), np.repeat(faces.area, 3) / 3, len(w))
    centred, aim = w - mass @ w, start - mass @ start
    turn = (mass * centred.conj()) @ aim
    return centred * (turn / abs(turn) if abs(turn) > 0 else 1) + mass @ start
