"""Close holes by membranes: places that are harmonic over the disk whose circle is the boundary loop, by length.

A fan about the middle spans a hole as well, but its slivers are as long as the hole is wide, and maps are linear on
them: an outline that one fan closed was 2.2 to 4.4 floors away from itself with other triangles.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from ..linalg.sparse import solve_spd
from ..mesh.geometry import cotangent_laplacian

# Triangles grow by so much of their distance from the boundary, so that a membrane has about as many as its loop.
GROWTH = 0.25
# Loops of so few edges have no room for a ring, but for a centre alone.
FEWEST = 3
# No edge of a loop is taken to be shorter, over the mean.
SHORTEST = 0.01


def with_membranes(
    vertices: np.ndarray, triangles: np.ndarray, loops: list[np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n,3) and triangles (m,3) with these boundary loops (k,) closed, each by a membrane as fine as it is.

    >>> import numpy as np
    >>> from omt_uv.solver.signatures.membrane import with_membranes
    >>> corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    >>> with_membranes(corners, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3]]), [np.array([1, 3, 2])])[1].shape
    (6, 3)
    """
    points, faces, count = [vertices], [triangles], len(vertices)
    for loop in loops:
        inner, membrane = _membrane(vertices[loop])
        # The surface has these edges the other way round.
        faces.append(np.concatenate([loop, count + np.arange(len(inner))])[membrane[:, ::-1]])
        points.append(inner)
        count += len(inner)
    return np.concatenate(points), np.concatenate(faces)


def _membrane(outline: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n,3) within an outline (k,3), and triangles (m,3) of both, its vertices first."""
    k = len(outline)
    length = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
    share = np.maximum(length, SHORTEST * length.mean()) if length.any() else np.ones(k)
    if k <= FEWEST:
        middle = (share + np.roll(share, 1)) @ outline / (2 * share.sum())
        return middle[None], _strip(np.zeros(k), np.zeros(1))
    radius, angle = _rings(np.cumsum(share[:-1]) / share.sum() * 2 * np.pi)
    first = np.cumsum([0, *map(len, angle)])
    strips = [start + _strip(*pair) for start, pair in zip(first, pairwise(angle), strict=False)]
    faces = np.concatenate(strips)
    places = np.concatenate([r * np.stack([np.cos(a), np.sin(a)], axis=1) for r, a in zip(radius, angle, strict=True)])
    stiffness = cotangent_laplacian(np.column_stack([places, np.zeros(len(places))]), faces).tocsr()
    return solve_spd(stiffness[k:, k:].tocsc(), -(stiffness[k:, :k] @ outline)), faces


def _rings(outer: np.ndarray) -> tuple[list[float], list[np.ndarray]]:
    """Radii and increasing angles of rings of the unit disk: its circle, with one angle more than these (k-1,), ever
    fewer inwards, and one for the centre."""
    radii, angles = [1.0], [np.concatenate([[0.0], outer])]
    edge = 2 * np.pi / len(angles[0])
    while True:
        step = edge + GROWTH * (1 - radii[-1])
        radius = radii[-1] - np.sqrt(3) / 2 * step
        if radius < step / 2:
            return [*radii, 0.0], [*angles, np.zeros(1)]
        sectors = max(int(np.ceil(2 * np.pi * radius / step)), 3)
        radii.append(radius)
        angles.append(2 * np.pi * (np.arange(sectors) + 0.5 * (len(angles) % 2)) / sectors)


def _strip(outer: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """Triangles (m,3) between two rings of increasing angles (a,) and (b,), the outer vertices first; one angle is the
    centre."""
    a, b = len(outer), len(inner)
    i, j = np.arange(a), a + np.arange(b)
    if b == 1:
        return np.column_stack([i, np.roll(i, -1), np.full(a, a)])
    ends, order = _middles(outer)
    other, turn = _middles(inner)
    # What lies opposite to the middle of an edge: the vertex after the last middle before it.
    tip = a + (turn[np.searchsorted(other, ends) - 1] + 1) % b
    base = (order[np.searchsorted(ends, other, side="right") - 1] + 1) % a
    first = np.column_stack([i, np.roll(i, -1), np.empty(a, np.int64)])
    first[order, 2] = tip
    second = np.column_stack([np.roll(j, -1), j, np.empty(b, np.int64)])
    second[turn, 2] = base
    return np.concatenate([first, second])


def _middles(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Angles (k,) of the middles of the edges of a ring, increasing, and which edge each is of."""
    middle = (angles + np.append(angles[1:], angles[0] + 2 * np.pi)) / 2 % (2 * np.pi)
    order = np.argsort(middle, kind="stable")
    return middle[order], order
