"""Solve systems that change little from one to the next by the factors of an earlier one.

Newton's matrices of one step and the next are alike but for the few faces that change most. Conjugate gradients
preconditioned by the factors of a matrix before find a step that is nearly right in a few iterations (Nocedal, Wright
2006, section 7.1), each of which takes a twentieth of the time of new factors. Where they take more, there are new
ones.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import islice

import numpy as np
import scipy.sparse as sp

from .sparse import Factor, gradient_steps

# Iterations in which the quadratic model must fall
WINDOW = 3
# by more than this share of its fall so far, or they end: a step that is not the last needs no more.
ENOUGH = 0.03
# The same by factors that were kept, where the next step comes at once,
KEPT_ENOUGH = 0.1
# and iterations at most: so many take as long as new factors.
MOST_KEPT = 25


class KeptFactor:
    """Factors of the last matrix for which there were none that would do; unknowns are eliminated as they come."""

    def __init__(self) -> None:
        self._factor: Factor | None = None
        self._last: np.ndarray | None = None

    def solve(self, matrix: sp.spmatrix, b: np.ndarray, w: np.ndarray, axes: Callable[[], np.ndarray]) -> np.ndarray:
        """About the solution x (n,) of matrix x = b (n,), symmetric positive definite; b.x > 0.

        The decrease b.x / 2 that x promises as a Newton step is within some percent of the most there is. w, axes: as
        in `AdditiveSchwarz.solve`; they play no part. Raises PrecisionError.

        >>> solver, b = KeptFactor(), np.ones(3)
        >>> solver.solve(sp.identity(3, format="csc"), b, b, lambda: b)
        array([1., 1., 1.])
        >>> solver.solve(sp.identity(3, format="csc") * 2, b, b, lambda: b)
        array([0.5, 0.5, 0.5])
        """
        if self._factor is not None:
            x = by_gradients(matrix, b, self._factor.solve, MOST_KEPT, KEPT_ENOUGH, self._last)
            if x is not None:
                self._last = x
                return x
        self._factor = Factor(matrix, "natural")
        self._last = self._factor.solve(b)
        return self._last


def by_gradients(
    matrix: sp.spmatrix,
    b: np.ndarray,
    precondition: Callable[[np.ndarray], np.ndarray],
    most: int,
    enough: float = ENOUGH,
    guess: np.ndarray | None = None,
    overwrite: bool = False,
) -> np.ndarray | None:
    """Conjugate gradients for matrix x = b (n,) until x.matrix.x / 2 - b.x hardly falls any more; None where that takes
    more than `most` iterations. guess, overwrite : see `nearly`
    """
    x, done = nearly(matrix, b, precondition, most, enough, guess, overwrite)
    return x if done else None


def nearly(
    matrix: sp.spmatrix,
    b: np.ndarray,
    precondition: Callable[[np.ndarray], np.ndarray],
    most: int,
    enough: float = ENOUGH,
    guess: np.ndarray | None = None,
    overwrite: bool = False,
) -> tuple[np.ndarray, bool]:
    """What conjugate gradients for matrix x = b (n,) have come to when x.matrix.x / 2 - b.x hardly falls any more or
    `most` iterations are over, and whether these were enough; b.x > 0 in any case.

    guess (n,): a direction in which they look before: a slider goes on as it went; overwrite: b may be
    """
    begin: np.ndarray | float = 0.0
    won, left = 0.0, b
    if guess is not None and guess.any():
        image = matrix @ guess
        share = (guess @ b) / (guess @ image)
        begin, won, left = share * guess, float(share * (guess @ b)), b - share * image
    falls: list[float] = []
    for step in islice(gradient_steps(matrix, left, precondition, overwrite or left is not b), most + 1):
        falls.append(won + step[2])
        done = len(falls) > WINDOW and falls[-1] - falls[-1 - WINDOW] <= enough * falls[-1]
        if done:
            break
    x = step[0]
    x += begin
    return x, done or len(falls) <= most
