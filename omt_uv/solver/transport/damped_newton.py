"""Solve the dual of semi-discrete transport, by damped Newton (Kitagawa, Merigot, Thibert 2019, algorithm 1).

The dual is concave in the site weights h; its gradient is mass - area(h), and area is differentiable as long as no cell
vanishes. Algorithm 1: with A = half of the least area or mass at the start, take the greatest step t of 1, 1/2, 1/4 ...
such that every cell keeps the area A and |area(h + t d) - mass| <= (1 - t / 2) |area(h) - mass|. Here t starts from
what the step before it came to. What is Newton's direction d, and what are the cells, the domain knows.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from ..errors import TransportError
from ..progress import Progress, Steps

TOLERANCE = 5e-7  # relative error of the area of a cell
MAX_STEPS = 100
MAX_HALVINGS = 30  # of one step
# What the error of all areas together is rounded by, relative to itself: among cells that start as 1e-26 of the sphere
# steps lower it by far less, and rounding would decide whether they may be taken.
ROUNDED = 1e-13
# So many steps one after the other that are small, no longer than the one before and leave more than this share of the
# residual, and rounding has ended the search.
STALLED = 8
LEFT = 0.99
STUCK = "is stuck at a residual of {:.1e}"


class Cells(Protocol):
    """Cells of sites, whatever they divide."""

    @property
    def area(self) -> np.ndarray:
        """Area of the cell of every site, (n,)."""


C = TypeVar("C", bound=Cells)


class Dual(Protocol[C]):
    """What a domain knows of the dual: its cells and Newton's direction."""

    growth: float  # of a step from one to the next, at most
    small_step: float  # below this, steps are quartered
    good_residual: float  # below this, the search may end where only small steps are left

    def near(self, site_weights: np.ndarray, cells: C) -> C | None:
        """The cells of site weights (n,) near those of other cells; None where one has vanished."""

    def confirmed(self, site_weights: np.ndarray, cells: C) -> C:
        """The cells of site weights (n,), beyond doubt."""

    def direction(self, cells: C, mass: np.ndarray) -> np.ndarray:
        """Newton's direction (n,): the change of the site weights that gives the areas mass (n,), to first order."""

    def first_step(self, cells: C, direction: np.ndarray) -> float:
        """The first share of a direction (n,) to try, in (0, 1]."""


@dataclass(frozen=True)
class DualSolution(Generic[C]):
    """site_weights (n,) and their cells; residual: largest |area - mass| / mass; iterations: Newton steps."""

    site_weights: np.ndarray
    cells: C
    residual: float
    iterations: int


def check_mass(mass: np.ndarray) -> np.ndarray:
    """Masses (n,) as floats. Raises TransportError with the sites whose mass is not positive and finite."""
    mass = np.asarray(mass, dtype=float)
    wrong = np.flatnonzero(~(np.isfinite(mass) & (mass > 0)))
    if len(wrong):
        raise TransportError("Transport needs positive, finite masses", "Give every vertex area", "vertex", wrong)
    return mass


def solve_dual(
    dual: Dual[C],
    site_weights: np.ndarray,
    cells: C,
    mass: np.ndarray,
    tolerance: float = TOLERANCE,
    max_steps: int = MAX_STEPS,
    tolerated: float = 0.0,
) -> Steps[DualSolution[C]]:
    """Change site weights (n,), whose cells have positive area, until these have the areas mass (n,).

    The residual of what is returned is above the tolerance, but at most `dual.good_residual`, or what is `tolerated`,
    where rounding ended the search.

    Raises
    ------
    TransportError : no step helps, or no convergence within `max_steps`
    """
    floor = 0.5 * min(cells.area.min(), mass.min())
    first = max(largest_error(cells, mass), tolerance)
    step, stalled, iteration, why = 0.0, 0, 0, f"did not converge in {max_steps} steps"
    for iteration in range(max_steps):
        residual = largest_error(cells, mass)
        done = 1 - np.log(max(residual, tolerance) / tolerance) / np.log(1 + first / tolerance)
        yield Progress("Optimal transport", float(np.clip(done, 0, 1)))
        if residual <= tolerance:
            cells = dual.confirmed(site_weights, cells)
            residual = largest_error(cells, mass)
            if residual <= tolerance:
                return DualSolution(site_weights=site_weights, cells=cells, residual=residual, iterations=iteration)
        direction = dual.direction(cells, mass)
        error, before = float(np.linalg.norm(cells.area - mass)), step
        step = min(1.0, dual.growth * step) if iteration else dual.first_step(cells, direction)
        for _ in range(MAX_HALVINGS):
            trial_weights = site_weights + step * direction
            trial = dual.near(trial_weights, cells)
            if trial is not None and _acceptable(trial, mass, floor, (1 - step / 2) * error):
                break
            step /= 2 if step > dual.small_step else 4
            if residual <= dual.good_residual and step <= dual.small_step:
                return DualSolution(site_weights=site_weights, cells=cells, residual=residual, iterations=iteration)
        else:
            why = STUCK
            break
        site_weights, cells = trial_weights, trial
        is_slow = step <= min(before, dual.small_step) and largest_error(cells, mass) > LEFT * residual
        stalled = stalled + 1 if is_slow else 0
        if stalled == STALLED:
            why = STUCK
            break
    residual = largest_error(cells, mass)
    if residual > tolerated:
        raise TransportError(f"The transport {why.format(residual)}")
    return DualSolution(site_weights=site_weights, cells=cells, residual=residual, iterations=iteration)


def largest_error(cells: Cells, mass: np.ndarray) -> float:
    """The largest |area - mass| / mass of cells with the masses (n,)."""
    return float(np.max(np.abs(cells.area - mass) / mass))


def _acceptable(cells: Cells, mass: np.ndarray, least_area: float, greatest_error: float) -> bool:
    error = np.linalg.norm(cells.area - mass)
    return bool(cells.area.min() >= least_area and error <= (1 + ROUNDED) * greatest_error)
