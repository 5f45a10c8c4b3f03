"""What an outline in the plane is, so that it can be kept while everything inside moves: a circle, straight sides, or
neither."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..refinement.projected_newton import CircleMotion, FreeMotion, LineMotion, Motion

# Distances of the outline from a circle, relative to its radius, and fewest vertices that make one.
ROUND, FEWEST = 2e-3, 12
# A vertex where the outline turns by less than this, in radians, lies on a side; of the outline's vertices at least
# this share has to.
STRAIGHT, MOSTLY = 0.02, 0.6


@dataclass(frozen=True)
class Outline:
    """How a map's vertices may move; kind "circle", "sides" or "free"; w (n,) complex, the map with its outline exactly
    on the circle, about 0, or the sides; centre: what has to be added to w."""

    kind: str
    motion: Motion
    w: np.ndarray
    centre: complex


def recognise_outline(w: np.ndarray, loop: np.ndarray) -> Outline:
    """The outline of a map w (n,) complex with the boundary loop (b,), counter-clockwise."""
    rim = w[loop]
    centre, area = centroid(rim)
    radius = np.abs(rim - centre).mean()
    if len(loop) >= FEWEST and np.ptp(np.abs(rim - centre)) < ROUND * radius:
        moved = w - centre
        moved[loop] *= radius / np.abs(moved[loop])
        return Outline("circle", CircleMotion(loop, radius, len(w)), moved, centre)
    corner = np.abs(_turns(rim)) >= STRAIGHT
    if corner.sum() >= 3 and (corner.sum() <= 4 or corner.mean() <= 1 - MOSTLY):
        return _on_sides(w, loop, corner)
    return Outline("free", free(len(w)), w, 0j)


def free(n: int) -> FreeMotion:
    """Every one of n vertices may go anywhere."""
    return FreeMotion(np.zeros(n, bool))


def centroid(rim: np.ndarray) -> tuple[complex, float]:
    """Centroid and area of a polygon (b,) complex. Raises nothing: without area it is the mean, and 0."""
    a, b = rim - rim[0], np.roll(rim, -1) - rim[0]
    twice = a.real * b.imag - a.imag * b.real
    total = twice.sum()
    if total == 0:
        return complex(rim.mean()), 0.0
    return complex(rim[0] + (twice @ (a + b)) / (3 * total)), float(total / 2)


def _turns(rim: np.ndarray) -> np.ndarray:
    """Turning angle (b,) of a closed polygon at its vertices."""
    ahead, behind = np.roll(rim, -1) - rim, rim - np.roll(rim, 1)
    return np.angle(ahead * behind.conj())


def _on_sides(w: np.ndarray, loop: np.ndarray, corner: np.ndarray) -> Outline:
    """Vertices between two corners slide along the straight line between them, and are moved onto it."""
    start = int(np.flatnonzero(corner)[0])
    loop, corner = np.roll(loop, -start), np.roll(corner, -start)
    at = np.flatnonzero(corner)
    first = at[np.cumsum(corner) - 1]
    following = np.append(at[1:], 0)[np.cumsum(corner) - 1]
    rim = w[loop]
    direction = rim[following] - rim[first]
    direction = direction / np.abs(direction)
    along = ((rim - rim[first]) * direction.conj()).real
    moved = w.copy()
    moved[loop] = np.where(corner, rim, rim[first] + along * direction)
    motion = LineMotion(loop[~corner], direction[~corner], loop[corner], len(w))
    return Outline("sides", motion, moved, 0j)
