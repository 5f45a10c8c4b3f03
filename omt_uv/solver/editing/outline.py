"""Recognise an outline in the plane as a circle or as straight sides, so that it can be kept while all inside moves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..refinement.projected_newton import CircleMotion, FreeMotion, LineMotion, Motion

# Greatest difference between distances from the middle of a circle, relative to its radius.
ROUND = 2e-3
# Fewest vertices that make a circle, and the greatest angle, in radians, between two that follow each other on it.
FEWEST = 12
WIDEST = 2 * np.pi / 3
# A vertex where the outline turns by less than this, in radians, lies on a side.
STRAIGHT = 0.02
# Greatest distance of a vertex from the side it lies on, over the size of the outline.
BENT = 5e-3
# Of the outline's vertices at least this share has to lie on sides, where it has more than four corners.
MOSTLY = 0.6


@dataclass(frozen=True)
class Outline:
    """How a map's vertices may move.

    Attributes
    ----------
    kind : "circle", "sides" or "free"
    motion : of the vertices
    w (n,) complex : the map with its outline exactly on the circle, about 0, or the sides
    centre : what has to be added to w
    """

    kind: str
    motion: Motion
    w: np.ndarray
    centre: complex


def recognise_outline(w: np.ndarray, loop: np.ndarray) -> Outline:
    """Recognise the outline of a map w (n,) complex with the boundary loop (b,), counter-clockwise."""
    polygon = w[loop]
    centre, radius = fitted_circle(polygon)
    if len(loop) >= FEWEST and _goes_round(polygon - centre, radius):
        moved = w - centre
        moved[loop] *= radius / np.abs(moved[loop])
        return Outline(kind="circle", motion=CircleMotion(loop, radius, len(w)), w=moved, centre=centre)
    corner = np.abs(_turns(polygon)) >= STRAIGHT
    if corner.sum() >= 3 and (corner.sum() <= 4 or corner.mean() <= 1 - MOSTLY):
        found = _on_sides(w, loop, corner)
        # A long curve turns by little at each vertex, and is no side all the same.
        if np.abs(found.w - w)[loop].max() <= BENT * np.abs(polygon - polygon.mean()).max():
            return found
    return Outline(kind="free", motion=free_motion(len(w)), w=w, centre=0j)


def fitted_circle(points: np.ndarray) -> tuple[complex, float]:
    """Centre and radius of the circle next to points (k,) complex, however unevenly they lie on it (Kasa 1976).

    The centroid of the polygon is another point as soon as its vertices have slid along the circle.
    """
    middle = points.mean()
    z = points - middle
    size = max(float(np.abs(z).max(initial=0.0)), float(np.finfo(float).tiny))
    z = z / size
    rows = np.column_stack([2 * z.real, 2 * z.imag, np.ones(len(z))])
    x, y, rest = np.linalg.lstsq(rows, np.abs(z) ** 2, rcond=None)[0]
    return complex(middle + size * (x + 1j * y)), float(size * np.sqrt(max(rest + x**2 + y**2, 0.0)))


def _goes_round(spokes: np.ndarray, radius: float) -> bool:
    """Whether points (b,) about the middle of a circle lie on it and follow each other around it, in small steps."""
    if not np.ptp(np.abs(spokes)) < ROUND * radius:
        return False
    ahead = np.angle(np.roll(spokes, -1) * spokes.conj())
    return bool((ahead > 0).all() and ahead.max() < WIDEST and abs(ahead.sum() - 2 * np.pi) < 1)


def free_motion(n: int) -> FreeMotion:
    """Every one of n vertices may go anywhere."""
    return FreeMotion(np.zeros(n, bool))


def centroid(polygon: np.ndarray) -> tuple[complex, float]:
    """Centroid and area of a polygon (b,) complex. Without area it is the mean, and 0."""
    a, b = polygon - polygon[0], np.roll(polygon, -1) - polygon[0]
    twice = a.real * b.imag - a.imag * b.real
    total = twice.sum()
    if total == 0:
        return complex(polygon.mean()), 0.0
    return complex(polygon[0] + (twice @ (a + b)) / (3 * total)), float(total / 2)


def _turns(polygon: np.ndarray) -> np.ndarray:
    """Turning angle (b,) of a closed polygon at its vertices."""
    ahead, behind = np.roll(polygon, -1) - polygon, polygon - np.roll(polygon, 1)
    return np.angle(ahead * behind.conj())


def _on_sides(w: np.ndarray, loop: np.ndarray, corner: np.ndarray) -> Outline:
    """Vertices between two corners slide along the straight line between them, and are moved onto it."""
    start = int(np.flatnonzero(corner)[0])
    loop, corner = np.roll(loop, -start), np.roll(corner, -start)
    at = np.flatnonzero(corner)
    first = at[np.cumsum(corner) - 1]
    following = np.append(at[1:], 0)[np.cumsum(corner) - 1]
    polygon = w[loop]
    direction = polygon[following] - polygon[first]
    direction = direction / np.abs(direction)
    along = ((polygon - polygon[first]) * direction.conj()).real
    moved = w.copy()
    moved[loop] = np.where(corner, polygon, polygon[first] + along * direction)
    motion = LineMotion(loop[~corner], direction[~corner], loop[corner], len(w))
    return Outline(kind="sides", motion=motion, w=moved, centre=0j)
