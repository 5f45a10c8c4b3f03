"""Cut a body along spheres of its ball map: shells of equal volume, as surfaces of their own; and along planes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..counts import BYTES_PER_ELEMENT, check_memory, quadrupled
from ..flows.enclosed_volume import corner_volumes
from .tet_mesh import EDGES, tet_volumes

# Halvings of the radius of a shell.
HALVINGS = 22

# Which edges of a tetrahedron a level set crosses, by the bits of the vertices below it; two triangles, or one.
_ONE = {1: (0, 1, 2), 2: (0, 4, 3), 4: (1, 3, 5), 8: (2, 5, 4)}
_TWO = {3: (1, 2, 4, 3), 5: (0, 3, 5, 2), 9: (0, 1, 5, 4)}


@dataclass(frozen=True)
class Shell:
    """A surface, vertices (n,3) and triangles (m,3), where a function has a value."""

    vertices: np.ndarray
    triangles: np.ndarray
    value: float


def shell_surfaces(points: np.ndarray, positions: np.ndarray, tets: np.ndarray, count: int) -> tuple[Shell, ...]:
    """Surfaces (count) in a body, spheres of its ball map, that divide it into count + 1 parts of equal volume.

    points (n,3), tetrahedra (m,4), and positions (n,3) in the ball. Radii are found by halving, so that volumes are
    equal however coarse the tetrahedra are. Raises CountError for more than this machine has memory for.
    """
    check_memory(count, BYTES_PER_ELEMENT, "A family of {} shells")
    radius = np.linalg.norm(positions, axis=1)
    whole = float(tet_volumes(points, tets).sum())
    return tuple(_enclosing(points, tets, radius, k / (count + 1) * whole) for k in range(1, count + 1))


def _enclosing(points: np.ndarray, tets: np.ndarray, radius: np.ndarray, volume: float) -> Shell:
    """The level surface of a function (n,) that encloses a volume."""
    low, high = float(radius.min()), float(radius.max())
    for _ in range(HALVINGS):
        found = level_surface(points, tets, radius, (low + high) / 2)
        low, high = (found.value, high) if _enclosed(found) < volume else (low, found.value)
    return found


def _enclosed(shell: Shell) -> float:
    """The volume that a closed surface encloses."""
    return float(corner_volumes(shell.vertices, shell.triangles).sum() / 6)


def level_surface(points: np.ndarray, tets: np.ndarray, function: np.ndarray, value: float) -> Shell:
    """The surface where a function (n,), linear in every tetrahedron (m,4) of points (n,3), has a value; marching
    tetrahedra (Doi, Koide 1991). It looks to where the function grows."""
    above = function > value
    crossed = tets[above[tets].any(axis=1) & ~above[tets].all(axis=1)]
    code = (~above[crossed]) @ np.array([1, 2, 4, 8])
    rows, edges = [], []
    for pattern in range(1, 15):
        mine = np.flatnonzero(code == pattern)
        for triangle in _triangles(pattern):
            rows.append(mine)
            edges.append(np.tile(np.array(triangle), (len(mine), 1)))
    row, edge = np.concatenate(rows), np.concatenate(edges)
    ends = np.sort(crossed[row[:, None, None], EDGES[edge]], axis=2)
    keys = ends[..., 0] * np.int64(len(points)) + ends[..., 1]
    used, inverse = np.unique(keys, return_inverse=True)
    a, b = used // len(points), used % len(points)
    share = ((value - function[a]) / (function[b] - function[a]))[:, None]
    return Shell((1 - share) * points[a] + share * points[b], inverse.ravel().reshape(-1, 3), value)


def _triangles(pattern: int) -> list[tuple[int, ...]]:
    """Edges of the triangles of a pattern of vertices below, wound so that they look to those above."""
    flipped = pattern not in _ONE and pattern not in _TWO
    known = 15 - pattern if flipped else pattern
    corners = _ONE.get(known) or _TWO[known]
    found: list[tuple[int, ...]] = (
        [corners] if len(corners) == 3 else [corners[:3], (corners[0], corners[2], corners[3])]
    )
    return [tuple(reversed(f)) for f in found] if flipped else found


def icosphere(levels: int) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (n,3) of the unit sphere and triangles (m,3), looking outwards: an icosahedron divided `levels`
    times. Raises CountError for more than this machine has memory for."""
    check_memory(20 * quadrupled(levels), BYTES_PER_ELEMENT, "A sphere of about {} faces")
    g = (1 + 5**0.5) / 2
    base = np.array([(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0)], float)
    points = np.concatenate([base, base[:, [2, 0, 1]], base[:, [1, 2, 0]]]) / np.hypot(1, g)
    square = np.square(points[:, None] - points[None]).sum(axis=2)
    near = np.isclose(square, np.sort(square, axis=1)[0, 1])
    faces = np.argwhere(near[:, :, None] & near[:, None, :] & near[None, :, :])
    faces = faces[(faces[:, 0] < faces[:, 1]) & (faces[:, 1] < faces[:, 2])]
    inwards = np.linalg.det(points[faces]) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    for _ in range(levels):
        edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].swapaxes(0, 1).reshape(-1, 2), axis=1)
        ends, inverse = np.unique(edges, axis=0, return_inverse=True)
        ab, bc, ca = len(points) + inverse.ravel().reshape(3, -1)
        a, b, c = faces.T
        middle = points[ends].sum(axis=1)
        points = np.concatenate([points, middle / np.linalg.norm(middle, axis=1)[:, None]])
        faces = np.concatenate([np.stack(f, axis=1) for f in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    return points, faces
