"""Measure how hidden the faces of a surface are from all around, by depth buffers of samples.

Seen from a direction, a sample is hidden if another one in the same pixel is nearer by more than the slope of its own
face explains. Each buffer is looked through from both of its ends, so that half as many serve for all directions.
"""

from __future__ import annotations

import numpy as np

from ..mesh.closest_point import spread_points
from ..mesh.geometry import cross3, face_areas, face_normals
from ..mesh.topology import triangle_parts
from .saliency import unit_size

# Buffers; each one is two directions.
VIEWS = 32
# Pixels across the sphere about the surface.
PIXELS = 192
# Samples are no farther apart than so many pixels.
SPACING = 1.5
# A plane that fills a pixel is no nearer than so many pixels times its slope; the rest is for rounding.
SLOPE = 1.5
LEVEL = 0.25
# Slopes of faces seen from their edges, as cosines, end here.
LEAST_COSINE = 1e-3
# By so much more of the directions are backs hidden than fronts of what clearly looks outwards.
CLEARLY = 0.3


def face_occlusion(positions: np.ndarray, triangles: np.ndarray, sides: np.ndarray | None = None) -> np.ndarray:
    """Share (m,) in [0, 1] of the directions, each as a face would be lit from it, in which something hides a triangle.

    positions (n,3), triangles (m,3): 0 on convex bodies, near 1 deep within a cave. The outside of a part that is open
    or turned inside out is the side from which more of it is seen. Independent of place, direction and size but for
    about 0.02 of noise. sides (2,m) : what `hidden_sides` gives, where it is known
    """
    sides = hidden_sides(positions, triangles) if sides is None else sides
    return _outer(sides, face_areas(unit_size(positions, triangles), triangles), triangles, len(positions))


def hidden_sides(positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Shares (2,m) in [0, 1] of the directions, as of `face_occlusion`, in which something hides the front of a
    triangle, and its back: 1 from inside of what is closed.

    positions (n,3), triangles (m,3): the front is where the corners run counterclockwise.
    """
    owner, samples, normal = _samples(positions, triangles)
    weight = np.zeros(len(triangles))
    # Of the front of every face, and of its back.
    seen = np.zeros((2, len(triangles)))
    first, count = _first_samples(owner)
    shares = np.zeros((2, len(triangles)))
    for frame in _frames(VIEWS):
        slant = normal @ frame[2]
        near, far = _visible(frame @ samples, slant, owner)
        lit = np.abs(slant)
        weight += lit
        for share, visible in zip(shares, (near, far), strict=True):
            share[owner[first]] = np.add.reduceat(visible, first, dtype=np.int64) / count
        towards = slant < 0
        seen[0] += lit * np.where(towards, *shares)
        seen[1] += lit * np.where(towards, *shares[::-1])
    hidden = np.where(weight > 0, 1 - seen / np.maximum(weight, np.finfo(float).tiny), 0)
    return np.clip(hidden, 0, 1)


def in_view(positions: np.ndarray, triangles: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """How much (d,m) of its area every triangle shows to whoever looks from these directions (d,3), unit vectors: the
    share that nothing hides times the cosine of its slant; 0 where it shows its back.

    positions (n,3), triangles (m,3)
    """
    owner, samples, normal = _samples(positions, triangles)
    first, count = _first_samples(owner)
    shown = np.zeros((len(directions), len(triangles)))
    for share, frame in zip(shown, _frames_along(-directions), strict=True):
        slant = normal @ frame[2]
        near, _ = _visible(frame @ samples, slant, owner)
        share[owner[first]] = np.add.reduceat(near, first, dtype=np.int64) / count
        share *= np.maximum(-slant, 0)
    return shown


def looks_out(hidden: np.ndarray, area: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Whether each part of a surface clearly looks outwards: of fronts and backs hidden (2,m), areas (m,) and the
    part (m,) of every triangle, counted from 0."""
    front, back = (np.bincount(part, area * side) for side in hidden)
    return back - front > CLEARLY * np.bincount(part, area)


def outside_out(positions: np.ndarray, triangles: np.ndarray, hidden: np.ndarray) -> np.ndarray:
    """Triangles (m,3), those of parts turned over that clearly look inwards; hidden (2,m) : see `hidden_sides`."""
    part = triangle_parts(triangles, len(positions))
    inward = looks_out(hidden[::-1], face_areas(unit_size(positions, triangles), triangles), part)[part]
    return np.where(inward[:, None], triangles[:, [0, 2, 1]], triangles)


def vertex_occlusion(positions: np.ndarray, triangles: np.ndarray, sides: np.ndarray | None = None) -> np.ndarray:
    """Mean (n,) of `face_occlusion` over the triangles (m,3) around every vertex (n,3), 0 for those of none."""
    hidden = face_occlusion(positions, triangles, sides)
    area = np.maximum(face_areas(unit_size(positions, triangles), triangles), np.finfo(float).tiny)
    around = np.bincount(triangles.ravel(), np.repeat(area, 3), len(positions))
    total = np.bincount(triangles.ravel(), np.repeat(area * hidden, 3), len(positions))
    return total / np.where(around > 0, around, 1)


def half_sphere(count: int) -> np.ndarray:
    """Directions (count,3) spread over half of the sphere (Fibonacci)."""
    k = np.arange(count) + 0.5
    z = 1 - k / count
    turn = np.pi * (1 + np.sqrt(5)) * k
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)


def _frames(count: int) -> np.ndarray:
    """Orthonormal frames (count,3,3) whose third rows are spread over half of the sphere."""
    return _frames_along(half_sphere(count))


def _frames_along(axis: np.ndarray) -> np.ndarray:
    """Orthonormal frames (d,3,3) whose third rows are unit vectors (d,3)."""
    across = cross3(axis, np.eye(3)[np.abs(axis).argmin(axis=1)])
    across /= np.linalg.norm(across, axis=1)[:, None]
    return np.stack([across, cross3(axis, across), axis], axis=1).astype(np.float32)


def _samples(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Samples (3,s) of a surface (n,3), (m,3) about the origin, in pixels of the buffers, the triangles (s,) they are
    on, one after the other, and the normals (m,3) of these."""
    points = unit_size(positions, triangles)
    used = points[triangles]
    centre = (used.min(axis=(0, 1)) + used.max(axis=(0, 1))) / 2
    radius = float(np.linalg.norm(used - centre, axis=2).max())
    # Pixels of the buffers are units, whose middle is their centre.
    points = (points - centre) * ((PIXELS / 2 - 1) / radius)
    owner, samples = spread_points(points, triangles, SPACING)
    return owner, np.ascontiguousarray(samples.T, np.float32), face_normals(points, triangles).astype(np.float32)


def _first_samples(owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first sample (k,) of every triangle that has any, and how many (k,) it has; owner (s,) : see `_samples`."""
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    return first, np.diff(first, append=len(owner))


def _visible(seen: np.ndarray, slant: np.ndarray, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which samples (3,s), of triangles `owner` (s,) with a cosine (m,) to the line of sight, are seen from below, and
    which from above, (s,) bool each."""
    half = PIXELS // 2
    pixel = (seen[1] + half).astype(np.int32) * PIXELS + (seen[0] + half).astype(np.int32)
    nearest = np.full(PIXELS**2, np.inf, np.float32)
    farthest = np.full(PIXELS**2, -np.inf, np.float32)
    np.minimum.at(nearest, pixel, seen[2])
    np.maximum.at(farthest, pixel, seen[2])
    cosine = np.clip(np.abs(slant), LEAST_COSINE, 1)
    room = (LEVEL + SLOPE * np.sqrt(1 - cosine**2) / cosine)[owner]
    return seen[2] - room <= nearest[pixel], seen[2] + room >= farthest[pixel]


def _outer(hidden: np.ndarray, area: np.ndarray, triangles: np.ndarray, n: int) -> np.ndarray:
    """Of (2,m) the row, by component, that is less hidden in the mean over the areas (m,)."""
    label = triangle_parts(triangles, n)
    mean = np.stack([np.bincount(label, area * h) for h in hidden])
    return hidden[(mean[1] < mean[0]).astype(int)[label], np.arange(len(area))]
