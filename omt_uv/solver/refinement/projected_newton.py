"""Minimise energies of piecewise linear maps, by projected Newton (Teran, Sifakis, Irving, Fedkiw 2005).

Vertices are free, slide on a curve, or stay. No step folds a face (Smith, Schaefer 2015).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from ..errors import PrecisionError
from ..linalg.sparse import FillOrder
from ..linalg.vertex_rows import VertexRows
from ..maps.energy import Elements, squared, target_error
from ..maps.mirror_symmetry import MirrorSymmetry
from ..maps.polygon_elements import energy_in_turn
from .hessian_blocks import Assembly, Matrix, RowAssembly, Solver
from .vertex_sweeps import Smoother

ARMIJO = 1e-4  # least share of the promised decrease that a step must gain
MAX_HALVINGS = 40  # of one step
# A step goes at most this share of the way to the first fold.
FOLD_SHARE = 0.9
# Added to the diagonal, relative to its mean: a free map has no place and no direction of its own.
SHIFT = 1e-10
# So many times as much where that is not enough.
SHIFT_GROWTH = 1e3
# Area weight above which equations are factored at once: steps that are nearly right are too short there.
STIFF = 5e3


class Motion(Protocol):
    """How vertices may move: each has a frame of two axes, and either axis may be blocked."""

    free: np.ndarray  # (n,2) bool

    def frame(self, w: np.ndarray) -> np.ndarray:
        """First axis (n,) as unit complex numbers; the second is i times the first."""

    def bend(self, w: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """Second derivative (n,) of the energy that the first axis gains from the curve's bending."""

    def move(self, w: np.ndarray, step: np.ndarray) -> np.ndarray:
        """The map after a step (n,) complex in the frame's axes."""


class FreeMotion:
    """Every vertex may go anywhere, except the pinned ones (n,) bool."""

    def __init__(self, pinned: np.ndarray):
        self.free = np.repeat(~pinned[:, None], 2, axis=1)

    def frame(self, w):
        """1 for every vertex, (n,) complex: the axes are those of the plane."""
        return np.broadcast_to(np.ones((), complex), len(w))

    def bend(self, w, gradient):
        """0 for every vertex, (n,): the axes are straight."""
        return np.zeros(len(w))

    def move(self, w, step):
        """The map w (n,) plus a step (n,), complex."""
        return w + step


class CircleMotion:
    """Vertices of `loop` slide on the circle of this radius about 0, the others are free."""

    def __init__(self, loop: np.ndarray, radius: float, n: int):
        self.loop, self.radius = loop, radius
        self.free = np.ones((n, 2), bool)
        self.free[loop, 1] = False

    def frame(self, w):
        """First axis (n,) as unit complex numbers: along the circle for the loop, 1 for the others."""
        axis = np.ones(len(w), complex)
        axis[self.loop] = 1j * w[self.loop] / np.abs(w[self.loop])
        return axis

    def bend(self, w, gradient):
        """Second derivative (n,) by arc length: -Re(conj(gradient) w) / radius^2 on the loop, 0 elsewhere."""
        second = np.zeros(len(w))
        at = w[self.loop]
        second[self.loop] = -(gradient[self.loop].conj() * at).real / self.radius**2
        return second

    def move(self, w, step):
        """The map (n,) complex after a step (n,); the loop goes by arc lengths Re(step) and stays on the circle."""
        moved = w + self.frame(w) * step
        turn = np.angle(w[self.loop]) + step[self.loop].real / self.radius
        moved[self.loop] = self.radius * np.exp(1j * turn)
        return moved


class LineMotion:
    """Vertices (k,) slide along the directions (k,) complex; `fixed` (c,) stay; the others are free."""

    def __init__(self, sliding: np.ndarray, direction: np.ndarray, fixed: np.ndarray, n: int):
        self.axis = np.ones(n, complex)
        self.axis[sliding] = direction
        self.free = np.ones((n, 2), bool)
        self.free[sliding, 1] = False
        self.free[fixed] = False

    def frame(self, w):
        """First axis (n,) as complex numbers: the direction of the line where a vertex slides, 1 for the others."""
        return self.axis

    def bend(self, w, gradient):
        """0 for every vertex, (n,): lines are straight."""
        return np.zeros(len(w))

    def move(self, w, step):
        """The map (n,) complex after a step (n,) in the frame's axes."""
        return w + self.axis * step


class EnergyTerm(Protocol):
    """An energy beside that of the faces, for example a barrier."""

    def energy(self, w: np.ndarray) -> float:
        """The energy of a map w (n,) complex, to be added to that of the faces."""

    def derivatives(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gradient (n,) complex; vertices (k,q) and rows (k,q) of linear forms whose squares are the Hessian."""

    def limit(self, w: np.ndarray, step: np.ndarray) -> float:
        """Largest share of a step that is allowed."""


@dataclass(frozen=True)
class NewtonProblem:
    """What Newton minimises.

    Attributes
    ----------
    faces, area_weight : see `maps.energy`; one weight, or (m,)
    assembly : of the Hessian
    motion : how vertices may move
    terms : further energies
    aim : faces with the targets that count, where those minimised lead to them
    smoother : what follows every step
    """

    faces: Elements
    assembly: Assembly | RowAssembly
    motion: Motion
    area_weight: float | np.ndarray
    terms: tuple[EnergyTerm, ...] = ()
    aim: Elements | None = None
    smoother: Smoother | None = None
    symmetry: MirrorSymmetry | None = None

    def energy(self, w: np.ndarray) -> float:
        """Energy of the faces and of all extras at a map w (n,) complex; infinity where a face is folded."""
        value = energy_in_turn(self.faces, w, self.area_weight)
        return value + sum(e.energy(w) for e in self.terms) if np.isfinite(value) else value

    def area_error(self, w: np.ndarray) -> float:
        """What a map w (n,) complex lacks of its areas, see `energy.target_error`."""
        return target_error(self.faces if self.aim is None else self.aim, w)

    def step(self, w: np.ndarray, value: float, pressure: float) -> NewtonStep:
        """A Newton step from a map w (n,) complex of energy `value`, see `newton_step`. Raises PrecisionError."""
        step = newton_step(self, w, value, pressure)
        if self.smoother is None:
            return step
        smooth = self.smoother.smoothed(self.faces, step.w, float(self.area_weight))
        return NewtonStep(w=smooth, energy=self.energy(smooth), decrement=step.decrement, share=step.share)


@dataclass(frozen=True)
class NewtonStep:
    """A step: map and energy after it, decrease promised by the full step, share of it taken (0: none helps)."""

    w: np.ndarray
    energy: float
    decrement: float
    share: float


def newton_direction(
    problem: NewtonProblem, w: np.ndarray, pressure: float | np.ndarray = 1.0
) -> tuple[np.ndarray, float]:
    """Step (n,) complex in the axes of the motion's frame, and the slope of the energy along it (negative)."""
    step, slopes = newton_steps(problem, w, pressure)
    return step, float(step.view(float) @ slopes.view(float))


def newton_steps(
    problem: NewtonProblem, w: np.ndarray, pressure: float | np.ndarray = 1.0
) -> tuple[np.ndarray, np.ndarray]:
    """Step (n,) complex in the axes of the motion's frame, and the slopes (n,) complex of the energy along these."""
    frame, free = problem.motion.frame(w), problem.motion.free
    matrix, slopes, scale = _equations(problem, w, pressure, frame, free)
    parts = problem.assembly.parts if np.max(problem.area_weight) <= STIFF else None
    # Frames take as much memory as a map, and are made in no time.
    del frame
    if isinstance(matrix, VertexRows):
        problem.faces.let_go()
    axes = partial(_axes, problem.motion, w)
    step = -_solution(matrix, slopes, scale, parts, w, axes, problem.assembly.order)
    return step.view(complex), slopes.view(complex)


def _axes(motion: Motion, w: np.ndarray) -> np.ndarray:
    """The directions (n,2) complex that the unknowns of the vertices stand for, 0 for those that stay."""
    return motion.frame(w)[:, None] * [1, 1j] * motion.free


def _equations(problem: NewtonProblem, w: np.ndarray, pressure, frame, free) -> tuple[Matrix, np.ndarray, float]:
    """Hessian (2n,2n) and slopes (2n,) along the axes of the frame, and the mean of the Hessian's diagonal."""
    n = len(w)
    found = problem.assembly.hessian(problem.faces, w, problem.area_weight, pressure, (frame, free), problem.symmetry)
    gradient, more, scale = found.gradient, found.rest, found.scale
    for part in problem.terms:
        slope, vertices, forms = part.derivatives(w)
        if problem.symmetry is not None:
            slope = problem.symmetry.folded(slope)
            vertices, forms = problem.symmetry.carried(vertices, forms)
        gradient = gradient + slope
        linear = linear_forms(vertices, forms * frame[vertices], n, free)
        square = linear.T @ linear
        more = square if more is None else more + square
    axes = (gradient * frame.conj()).view(float).reshape(n, 2) * free
    diagonal = 1.0 - free
    diagonal[:, 0] += np.maximum(problem.motion.bend(w, gradient), 0) * free[:, 0]
    return found.matrix(diagonal.ravel() + SHIFT * scale, more), axes.ravel(), scale


def _solution(matrix: Matrix, b, scale: float, parts: Solver | None, w, axes, order: FillOrder) -> np.ndarray:
    """Solution x (n,) of matrix x = b, shifted where rounding makes it singular: the step is shorter, and goes down."""
    shift = SHIFT
    if parts is None and isinstance(matrix, VertexRows):
        matrix = matrix.plain()
    while True:
        try:
            return order.factor(matrix).solve(b) if parts is None else parts.solve(matrix, b, w, axes)
        except PrecisionError:
            if shift > 1:
                raise
            shift *= SHIFT_GROWTH
            more = shift * scale
            matrix = matrix.shifted(more) if isinstance(matrix, VertexRows) else matrix + more * sp.identity(len(b))


def newton_step(problem: NewtonProblem, w: np.ndarray, value: float, pressure: float = 1.0) -> NewtonStep:
    """One line-searched Newton step from a map w (n,) complex of energy `value`; pressure: see `face_derivatives`."""
    step, slope = newton_direction(problem, w, pressure)
    # The whole change of the map: where some vertices follow others, these move, too.
    moved = problem.motion.frame(w) * step
    if problem.symmetry is not None:
        moved = problem.symmetry.spread(moved)
    share = min(1.0, FOLD_SHARE * first_fold(problem.faces, w, moved))
    for extra in problem.terms:
        # Of what is left of the step: how far a whole one would reach is a large search, and of no use.
        share *= min(1.0, extra.limit(w, share * moved))
    for _ in range(MAX_HALVINGS):
        trial = problem.motion.move(w, share * step)
        trial_value = problem.energy(trial)
        if trial_value <= value + ARMIJO * share * slope:
            return NewtonStep(w=trial, energy=trial_value, decrement=-slope / 2, share=share)
        share *= 0.5
    return NewtonStep(w=w, energy=value, decrement=-slope / 2, share=0.0)


def first_fold(faces: Elements, w: np.ndarray, step: np.ndarray) -> float:
    """The smallest t > 0 at which a face of w + t step has no area; infinity if there is none."""
    first, part = np.inf, faces.part
    for here, a, b in faces.some_derivatives(w):
        far = fold_shares(a, b, *faces.derivatives_at(step, here))
        first = (far if part is None else far[part[here] > 0]).min(initial=first)
    return float(first)


def fold_shares(a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray) -> np.ndarray:
    """The smallest t > 0 at which each face (m,) with the derivatives a + t da, b + t db (m,) complex has no area;
    infinity where there is none."""
    c = squared(a) - squared(b)
    h = (a.conj() * da).real - (b.conj() * db).real
    q = squared(da) - squared(db)
    # q t^2 + 2 h t + c = 0 with c > 0: the smallest positive root in the form that does not cancel.
    root = h * h - q * c
    denominator = -h + np.sqrt(np.maximum(root, 0))
    hit = (root >= 0) & (denominator > 0)
    return np.where(hit, c / np.where(hit, denominator, 1), np.inf)


def linear_forms(vertices: np.ndarray, rows: np.ndarray, n: int, free: np.ndarray | None = None) -> sp.csr_matrix:
    """Sparse (k, 2n) of the forms dw -> Re(sum rows dw[vertices]), vertices and rows (k,q).

    free (n,2) : factors of the columns
    """
    k, q = vertices.shape
    columns = np.stack([2 * vertices, 2 * vertices + 1], axis=2).reshape(k, 2 * q)
    data = np.stack([rows.real, -rows.imag], axis=2)
    data = data if free is None else data * free[vertices]
    return sp.csr_matrix((data.ravel(), columns.ravel(), np.arange(k + 1) * 2 * q), shape=(k, 2 * n))
