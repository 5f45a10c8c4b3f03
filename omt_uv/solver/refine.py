"""Authalic refinement: every face gets its area, none folds, and the shear is the least that this allows.

Minimises the energy of `energy.py` by projected Newton in stages of growing weight of the area term. The weight
ends where the area error is small enough for the quality asked for.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix

from .energy import Elements, area_error, elements, energy
from .errors import DensityError, FoldedUVError
from .geometry import face_areas, signed_areas
from .linear import minimum_degree
from .newton import Assembly, Free, Motion, OnCircle, OnLines, newton_step
from .progress import Progress, Steps
from .topology import boundary_loops
from .untangle import arc_length_rim, circle_rim, count_folds, untangle

BOUNDARIES = ("free", "disk", "square")


@dataclass(frozen=True)
class Quality:
    """Area error (share of the area in the wrong place) to reach, weights of the area term on the way, steps allowed."""

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


@dataclass(frozen=True)
class Refinement:
    """uv (n,2) without folds; iterations: Newton steps; residual: last predicted decrease over energy.

    area_error: share of the UV area in the wrong place; weight: that of the area term; energy at the end;
    status: "converged", "stalled" (no decrease could be found) or "steps" (allowance used up); warnings: what was
    replaced and why.
    """

    uv: np.ndarray
    iterations: int
    residual: float
    area_error: float
    weight: float
    energy: float
    status: str
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
    settings = QUALITIES[quality]
    yield Progress("Refinement", 0.0)
    area = face_areas(vertices, triangles)
    target = _targets(area, target)
    loop = boundary_loops(triangles)[0]
    warnings: list[str] = []
    start, motion_of = _start(vertices, triangles, uv, loop, boundary, area.sum(), warnings)
    order = minimum_degree(_graph(triangles, len(vertices)))
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    faces = elements(vertices[order], place[triangles], target)
    motion = motion_of(place)
    w = start[order, 0] + 1j * start[order, 1]
    result = yield from _stages(faces, motion, w, balance, settings)
    w, *figures = result
    if boundary == "free":
        w = _placed(w, start[order, 0] + 1j * start[order, 1], faces, area.sum())
    refined = np.column_stack([w.real, w.imag])[place]
    return Refinement(refined, *figures, tuple(warnings))


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


def _start(vertices, triangles, uv, loop, boundary, area, warnings):
    """A start without folds (n,2), and the motion of its vertices once these are renumbered."""
    n = len(vertices)
    signed = signed_areas(uv, triangles)
    if not np.isfinite(uv).all() or not np.abs(signed).sum() > 1e-12 * np.ptp(uv, axis=0).max() ** 2 > 0:
        raise FoldedUVError("The UVs to refine have no area")
    uv = (uv - uv.mean(0)) if boundary == "free" else uv
    if boundary == "square":
        return _square_start(vertices, triangles, uv, loop, np.sqrt(area), warnings)
    uv = uv * np.sqrt(area / np.abs(signed).sum())
    radius = np.sqrt(area / np.pi)
    if boundary == "free" and not (signed > 0).all() or boundary == "disk":
        rim = circle_rim(uv, loop, radius)
        if rim is None:
            warnings.append("The boundary of the start is not in order; it was spread over the circle by its length")
            rim = arc_length_rim(vertices, loop, radius)
        pushed = uv.copy()
        pushed[loop] = rim
        if count_folds(pushed, triangles):
            pushed, warning = untangle(uv, vertices, triangles, loop, rim)
            warnings.extend([warning] if warning else [])
        uv = pushed
    left = np.flatnonzero(~(signed_areas(uv, triangles) > 0))
    if len(left):
        raise FoldedUVError("Faces stay folded in every start tried", kind="face", elements=left)
    if boundary == "disk":
        return uv, lambda place: OnCircle(place[loop], radius, n)
    return uv, lambda place: Free(np.zeros(n, bool))


def _square_start(vertices, triangles, uv, loop, side, warnings):
    n = len(vertices)
    low, high = uv[loop].min(0), uv[loop].max(0)
    uv = ((uv - low) / (high - low) - 0.5) * side
    rim = uv[loop]
    corners = np.array([np.abs(rim - c * side / 2).sum(1).argmin() for c in np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])])
    on_side = np.abs(np.abs(rim) - side / 2) < 1e-9 * side
    if not on_side.any(1).all() or not on_side[corners].all():
        raise FoldedUVError("The boundary of the start is not on a square")
    pushed = uv.copy()
    horizontal = on_side[:, 1]
    pushed[loop] = np.where(on_side, np.sign(rim) * side / 2, rim)
    if count_folds(pushed, triangles):
        pushed, warning = untangle(uv, vertices, triangles, loop, pushed[loop])
        warnings.extend([warning] if warning else [])
    left = np.flatnonzero(~(signed_areas(pushed, triangles) > 0))
    if len(left):
        raise FoldedUVError("Faces stay folded in every start tried", kind="face", elements=left)
    sliding = np.delete(np.arange(len(loop)), corners)
    direction = np.where(horizontal, 1.0, 1j)[sliding]
    return pushed, lambda place: OnLines(place[loop[sliding]], direction, place[loop[corners]], n)


def _stages(faces: Elements, motion: Motion, w, balance: float, settings: Quality):
    assembly = Assembly(faces.triangles, len(w))
    stages = list(settings.weights)
    softening = (balance / (1 - balance)) ** 2 if balance < 1 else np.inf
    steps, done, weight = 0, 0, 0.0
    status = "steps"
    while steps < settings.max_steps:
        last = done >= len(stages) - 1
        weight = 1 / (1 / stages[done] + softening)
        value = energy(faces, w, weight)
        while steps < settings.max_steps:
            step = newton_step(faces, assembly, motion, w, value, weight)
            w, value, steps = step.w, step.energy, steps + 1
            yield Progress("Refinement", min(1.0, (done + 0.5) / (len(stages) + 1)))
            if step.share == 0 or step.decrement < (TIGHT if last else LOOSE) * value + 1e-14:
                break
        status = "stalled" if step.share == 0 and step.decrement > TIGHT * value + 1e-14 else "converged"
        error = area_error(faces, w)
        done += 1
        if done >= len(stages):
            if balance > 0 or error <= settings.area_error or stages[-1] >= settings.greatest_weight or status == "stalled":
                break
            stages.append(stages[-1] * min(max(2.0, (error / settings.area_error) ** 2), 10.0))
    error = area_error(faces, w)
    return w, steps, step.decrement / max(value, 1e-300), error, weight, value, status


def _placed(w, start, faces: Elements, area: float):
    """The map with this UV area, turned and moved to lie as the start did."""
    a, b = faces.derivatives(w)
    share = faces.area * (np.abs(a) ** 2 - np.abs(b) ** 2)
    w = w * np.sqrt(1 / share.sum())
    mass = np.bincount(faces.triangles.ravel(), np.repeat(faces.area, 3) / 3, len(w))
    centred, aim = w - mass @ w, start - mass @ start
    turn = (mass * centred.conj()) @ aim
    return centred * (turn / abs(turn) if abs(turn) > 0 else 1) + mass @ start
