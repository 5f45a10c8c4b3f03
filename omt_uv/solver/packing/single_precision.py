"""Move vertices by a few units in the last place where rounding to single precision would fold triangles.

Blender and files keep UVs in single precision. The triangles that a cap of thousands of sides is cut into are lower
than its steps: of a cylinder of 10,000 sides 595 were folded as written, and none in double precision.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import signed_areas
from ..mesh.topology import expand

# Steps of single precision that a vertex may move along either axis, and rounds in which vertices do.
FARTHEST = 3
ROUNDS = 20


def without_rounded_folds(uv: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """UVs (n,2) whose triangles (m,3) keep their sides when they are rounded to single precision, as far as that goes.

    Vertices of triangles that would fold are moved to places near by that single precision has; others stay.

    >>> import numpy as np
    >>> uv = np.array([[0.5, 0.5], [0.75, 0.5], [0.625, 0.5 - 1e-8]])
    >>> triangle = np.array([[0, 2, 1]])
    >>> rounded = without_rounded_folds(uv, triangle).astype(np.float32)
    >>> bool(rounded[2, 1] < 0.5 or rounded[:2, 1].max() > 0.5)
    True
    """
    side = np.sign(signed_areas(uv, triangles))
    near = _rounded(uv)
    if not _folded(near, triangles, side).any():
        return uv
    order = np.argsort(triangles.ravel(), kind="stable")
    start = np.searchsorted(triangles.ravel()[order], np.arange(len(uv) + 1))
    given, rng = near.copy(), np.random.default_rng(0)
    for _ in range(ROUNDS):
        folded = _folded(near, triangles, side)
        if not folded.any():
            break
        moving = _apart(np.unique(triangles[folded]), triangles, len(uv), rng)
        row, place = expand(start[moving + 1] - start[moving])
        near[moving] = _bettered(near, triangles, side, moving, row, order[start[moving][row] + place])
    return np.where(near == given, uv, near)


def _bettered(near, triangles, side, moving, row, corners) -> np.ndarray:
    """The places (k,2) near those of the vertices `moving` (k,) where the fewest of their triangles are folded, and
    the others have most room; corners (c,): places in the m x 3 of the triangles, of the vertices moving[row]."""
    face, corner = corners // 3, corners % 3
    one, other = near[triangles[face, (corner + 1) % 3]], near[triangles[face, (corner + 2) % 3]]
    step = np.spacing(near[moving].astype(np.float32)).astype(float)
    best = near[moving].copy()

    def figures(places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a, b = one - places[row], other - places[row]
        area = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * side[face]
        # What has room has enough: only the narrow ones count.
        room = np.minimum(area, (step**2).sum(axis=1)[row])
        return np.bincount(row, area <= 0, len(moving)), np.bincount(row, room, len(moving))

    folds, room = figures(best)
    before = folds.copy()
    for x in range(-FARTHEST, FARTHEST + 1):
        for y in range(-FARTHEST, FARTHEST + 1):
            places = _rounded(near[moving] + step * [x, y])
            fewer, wider = figures(places)
            better = (fewer < folds) | ((fewer == folds) & (wider > room) & (fewer < before))
            folds, room = np.where(better, fewer, folds), np.where(better, wider, room)
            best[better] = places[better]
    return best


def _apart(vertices: np.ndarray, triangles: np.ndarray, n: int, rng: np.random.Generator) -> np.ndarray:
    """Some of the vertices (k,) of which no two share a triangle (m,3)."""
    turn = np.full(n, np.inf)
    turn[vertices] = rng.random(len(vertices))
    waits = (turn[triangles] > turn[triangles].min(axis=1)[:, None]).ravel()
    return vertices[np.bincount(triangles.ravel()[waits], minlength=n)[vertices] == 0]


def _folded(uv: np.ndarray, triangles: np.ndarray, side: np.ndarray) -> np.ndarray:
    # Of differences, which are exact between places of single precision.
    return signed_areas(uv, triangles) * side < np.where(side == 0, 0, np.finfo(float).tiny)


def _rounded(uv: np.ndarray) -> np.ndarray:
    return uv.astype(np.float32).astype(float)
