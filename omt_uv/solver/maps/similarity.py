"""Fit a similarity of the plane, by weighted least squares (Umeyama 1991, section III; a Procrustes problem)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .energy import squared

# A fit whose scale is so much smaller than the ratio of the extents has no direction: the points are spread evenly
# about what they are fitted to, or mirrored.
NO_DIRECTION = 1e-6


@dataclass(frozen=True)
class Similarity:
    """Turn, scale and shift in one: w -> (w - centre) factor + goal, in complex numbers.

    Kept about a centre, so that a shift to far away costs the map no digits.
    """

    factor: complex
    centre: complex
    goal: complex

    def __call__(self, w: np.ndarray) -> np.ndarray:
        """The images (n,) of points w (n,) complex."""
        return (w - self.centre) * self.factor + self.goal

    def in_quarter_turns(self) -> Similarity:
        """The same with the turn rounded to a multiple of a right angle."""
        return replace(self, factor=abs(self.factor) * 1j ** np.round(2 * np.angle(self.factor) / np.pi))


def fit_similarity(
    w: np.ndarray,
    aim: np.ndarray,
    mass: np.ndarray | None = None,
    *,
    rigid: bool = False,
    about: tuple[complex, complex] | None = None,
) -> Similarity:
    """Fit the similarity that brings points w (k,) complex nearest to others, aim (k,).

    Parameters
    ----------
    mass : (k,) >= 0 that sum to 1, how much each point counts; all alike by default
    rigid : turn and shift alone
    about : a centre and where it goes; the means by default, which is the best
    """
    if about is not None:
        centre, goal = about
    else:
        centre, goal = (x.mean() if mass is None else mass @ x for x in (w, aim))
    centred, toward = w - centre, aim - goal
    weighted = centred.conj() if mass is None else mass * centred.conj()
    factor = weighted @ toward
    if rigid:
        factor = factor / abs(factor) if abs(factor) > 0 else 1.0
    else:
        spread, wide = (x.sum() if mass is None else mass @ x for x in (squared(centred), squared(toward)))
        factor /= max(spread, 1e-300)
        if abs(factor) < NO_DIRECTION * np.sqrt(wide / max(spread, 1e-300)):
            factor = np.sqrt(wide / spread)
    return Similarity(factor=factor, centre=centre, goal=goal)
