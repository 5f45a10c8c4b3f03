"""The profile of a surface of revolution: how far it is from its axis, from one end to the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..linalg.sparse import solve_spd
from ..mesh.geometry import LEAST_STIFFNESS, face_normals, halfedge_lengths, laplacian_from_lengths
from ..mesh.topology import graph_components, halfedges, on_boundary
from .axis import EVEN, Axis

# Vertices are in rows if there are at least so many in each in the mean: edges join them, and they are at one place of
# the profile but for this share of its size. With fewer in most of them than the second number a body is a prism. Where
# there are no rows, means of so many parts of the vertices are taken, of a few each.
IN_A_ROW = 3
LEAST_SIDES = 11
SAME_ROW = 1e-4
SAMPLES = 400
FEW = 5
# A face in the middle of an end is so far before all else; it has this share of the length of the profile at least.
FACE = 1e-9
LEAST_FACE = 0.01
# Levels of a profile at most.
MOST_LEVELS = 160
# Vertices may be so far from the profile, in the root mean square and next to its size.
OFF = 0.02
# A face around the axis looks along it, but for a cosine. Vertices are around it if they are as far from the axis as
# the nearest, but for this factor.
FLAT = float(np.cos(np.radians(1)))
ROUND = 1.05
# A triangle that the axis goes through has it inside but for this share.
INSIDE = 1e-6


@dataclass(frozen=True)
class Profile:
    """Levels of a surface of revolution, from one end to the other.

    Attributes
    ----------
    level (k,) : between 0 and 1; along (n,) : the same at every vertex
    radius (k,), length (k,) : distance from the axis, and along the profile
    in_rows : whether the levels are those of rows of vertices
    poles (2,) bool : which ends are points on the axis, and no boundary
    """

    level: np.ndarray
    along: np.ndarray
    radius: np.ndarray
    length: np.ndarray
    in_rows: bool
    poles: np.ndarray


def harmonic_between(positions: np.ndarray, triangles: np.ndarray, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """How far every vertex (n,) of a surface (n,3), (m,3) is from one of two sets of vertices, 0, to the other, 1, as a
    harmonic function: the same all around a body that turns about an axis, if its ends are, and all across a band."""
    length = halfedge_lengths(positions, triangles).reshape(-1, 3)
    laplacian = laplacian_from_lengths(length, triangles, len(positions), LEAST_STIFFNESS)
    along = np.zeros(len(positions))
    along[other] = 1.0
    inner = np.ones(len(along), dtype=bool)
    inner[one] = inner[other] = False
    inner = np.flatnonzero(inner)
    if len(inner):
        along[inner] = solve_spd(laplacian[inner][:, inner].tocsc(), -(laplacian[inner] @ along))
    return along


def profile_of(positions: np.ndarray, triangles: np.ndarray, axis: Axis) -> Profile | None:
    """The profile of a surface (n,3), (m,3) without handles that turns about an axis; None if it does not, or has fewer
    sides than what is smooth."""
    ends = _ends(positions, triangles, axis)
    if ends is None:
        return None
    along = harmonic_between(positions, triangles, *ends[0])
    radius, height = axis.radius(positions), axis.height(positions)
    rows, row = rows_of_vertices(triangles, radius, height)
    in_rows = IN_A_ROW * rows <= len(row)
    if in_rows:
        if np.median(np.bincount(row)) < LEAST_SIDES:
            return None
        # Diagonals of quads that go this way and that leave no row quite at one level.
        along = (np.bincount(row, along) / np.bincount(row))[row]
    row = np.unique(along, return_inverse=True)[1].ravel() if in_rows else _parts(along)
    level, r, z = (np.bincount(row, x) / np.bincount(row) for x in (along, radius, height))
    off = np.hypot(radius - np.interp(along, level, r), height - np.interp(along, level, z))
    s = np.append(0.0, np.cumsum(np.hypot(np.diff(r), np.diff(z))))
    if len(level) < 3 or np.sqrt(np.mean(off**2)) > OFF * s[-1]:
        return None
    count = min(len(level), MOST_LEVELS)
    at = (
        np.linspace(0, len(level) - 1, count).round()
        if in_rows
        else np.interp(np.linspace(0, s[-1], count), s, range(len(s)))
    )
    level, r, s = (np.interp(at, range(len(s)), x) for x in (level, r, s))
    for end in np.flatnonzero(ends[1]):
        if r[-end] > LEAST_FACE * s[-1]:
            # What is around the axis there is a face, whose middle is no vertex.
            level[-end] += FACE * (1 - 2 * end)
            level, r = np.insert(level, [0, len(level)][end], float(end)), np.insert(r, [0, len(r)][end], 0.0)
            s = np.append(s, s[-1] + r[-2]) if end else np.append(0.0, s + r[1])
    return Profile(level, along, r, s, in_rows, ends[1])


def _parts(along: np.ndarray) -> np.ndarray:
    """A part (n,) for vertices that are so far (n,) from one end to the other: about as many in each, in order, but
    both ends by themselves."""
    n = len(along)
    part = np.empty(n, np.int64)
    part[np.argsort(along, kind="stable")] = 1 + np.arange(n) * min(SAMPLES, max(n // FEW, 1)) // n
    part[along <= 0] = 0
    part[along >= 1] = n
    return np.unique(part, return_inverse=True)[1].ravel()


def rows_of_vertices(triangles: np.ndarray, radius: np.ndarray, height: np.ndarray) -> tuple[int, np.ndarray]:
    """The number of rows of vertices, and the row (n,) of each: edges join those at one place of the profile."""
    tail, head = halfedges(triangles)
    size = max(float(np.ptp(radius)), float(np.ptp(height)))
    same = np.hypot(radius[tail] - radius[head], height[tail] - height[head]) <= SAME_ROW * size
    return graph_components(tail[same], head[same], len(radius))


def _ends(positions: np.ndarray, triangles: np.ndarray, axis: Axis) -> tuple[list[np.ndarray], np.ndarray] | None:
    """The vertices of both ends of a surface, and which of these are poles; None if it has not two, or handles."""
    n = len(positions)
    tail, head = halfedges(triangles)
    edges = np.unique(np.sort(np.stack([tail, head], axis=1), axis=1), axis=0)
    border = on_boundary(triangles, n)
    inside = border[edges].all(axis=1)
    loops, loop = graph_components(edges[inside, 0], edges[inside, 1], n)
    loop = np.where(border, loop, -1)
    names = np.unique(loop[border])
    if n - len(edges) + len(triangles) != 2 - len(names) or len(names) > 2:
        return None
    poles = _poles(positions, triangles, axis)
    if len(names) + len(poles) != 2:
        return None
    found, are_poles = [*(np.flatnonzero(loop == k) for k in names), *poles], np.arange(2) >= len(names)
    # The numbers of vertices choose no end to begin at.
    height, radius = (np.array([f(positions[end]).mean() for end in found]) for f in (axis.height, axis.radius))
    level = abs(height[1] - height[0]) <= EVEN * np.ptp(axis.height(positions))
    if (radius[0] < radius[1]) if level else (height[0] > height[1]):
        found, are_poles = found[::-1], are_poles[::-1]
    return found, are_poles


def _poles(positions: np.ndarray, triangles: np.ndarray, axis: Axis) -> list[np.ndarray]:
    """Vertices around each place where the axis goes through a surface: one, or those around a face."""
    flat, radius = axis.plane(positions), axis.radius(positions)
    a, b, c = flat[triangles].transpose(1, 0, 2)
    turn = np.stack([p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0] for p, q in ((a, b), (b, c), (c, a))], axis=1)
    small = INSIDE * float(radius.max()) ** 2
    through = ((turn >= -small).all(axis=1) | (turn <= small).all(axis=1)) & (np.abs(turn).sum(axis=1) > 0)
    # Of what stands upright beside it the axis is at the border at most.
    through &= radius[triangles].min(axis=1) <= np.sqrt(small) + np.ptp(flat[triangles], axis=1).max(axis=1)
    if not through.any():
        return []
    # A face around the axis may have been cut into triangles, which look to the same side.
    normal = face_normals(positions, triangles)
    flat = np.abs(normal @ axis.direction) >= FLAT
    faces = triangles[flat | through]
    part = graph_components(faces[:, [0, 1]].ravel(), faces[:, [1, 2]].ravel(), len(positions))[1]
    found = []
    for k in np.unique(part[triangles[through, 0]]):
        near = np.unique(faces[part[faces[:, 0]] == k])
        found.append(near[radius[near] <= ROUND * radius[near].min() + np.sqrt(small)])
    return found
