"""Take faces apart that a flow has brought into one another though nothing flows through anything: flat faces do not
follow what is between their vertices.

Two triangles that did not intersect had a plane between them. The flow takes that plane along, nearly to the plane that
the best affine map of the six corners makes of it. The corners that are beyond it go back, and the plane turns towards
where they are, just so far; again and again, for all pairs at once, until none is beyond. Planes have to turn where
corners are held: two handles that pass one another are on both sides of none that keeps its direction.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import cross3, nearest_rotations

# Rounds of moving corners back behind the planes.
ROUNDS = 60
# Triangles are held apart by this share of the size of a pair, or by what was between them, if that was less.
GAP = 0.02
# How easily planes turn, beside corners that move.
TURNING = 0.5
# Weight of the rotation beside what six corners say of the affine map, for what is flat.
SOFT = 1e-3


def separated(
    before: np.ndarray, after: np.ndarray, triangles: np.ndarray, pairs: np.ndarray, free: np.ndarray
) -> np.ndarray:
    """Positions (n,3) near `after` (n,3) in which pairs (k,2) of triangles (m,3), apart at `before` (n,3), are apart.
    Only vertices `free` (n,) bool move."""
    one, other = triangles[pairs[:, 0]], triangles[pairs[:, 1]]
    normal, gap = _planes(before, one, other)
    normal, scale = _carried(before, after, np.concatenate([one, other], axis=1), normal)
    gap = gap * scale
    corner = np.concatenate([one, other], axis=1)
    movable = free[corner]
    position = after.copy()
    for _ in range(ROUNDS):
        place = position[corner]
        height = np.einsum("kci,ki->kc", place, normal)
        top, low = height[:, :3].max(axis=1), height[:, 3:].min(axis=1)
        beyond = top + gap > low
        if not beyond.any():
            break
        middle = _middles(height, movable, gap)
        back = np.minimum((middle - gap / 2)[:, None] - height[:, :3], 0.0)
        ahead = np.maximum((middle + gap / 2)[:, None] - height[:, 3:], 0.0)
        missing = np.concatenate([back, ahead], axis=1) * beyond[:, None]
        shift, turn = _shared(missing, place, normal, movable)
        moved = shift[:, :, None] * normal[:, None, :]
        # Corners of several pairs go by the mean of what those ask for that ask for something.
        flat = corner.ravel()
        asked = np.bincount(flat, (shift != 0).ravel(), len(position))
        total = np.stack([np.bincount(flat, moved[..., i].ravel(), len(position)) for i in range(3)], axis=1)
        position += total / np.maximum(asked, 1)[:, None]
        normal = normal + turn
        normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    return position


def _shared(missing, place, normal, movable) -> tuple[np.ndarray, np.ndarray]:
    """Of what corners at `place` (k,6,3) are beyond their planes (k,6): what they go back along the normals (k,3), and
    how these turn instead (k,3); all of it where corners cannot move (k,6) bool."""
    arm = place - place.mean(axis=1, keepdims=True)
    arm = arm - np.einsum("kci,ki->kc", arm, normal)[:, :, None] * normal[:, None]
    square = np.square(arm).sum(axis=2)
    size = np.maximum(square.max(axis=1), np.finfo(float).tiny)
    ease = TURNING * square / size[:, None]
    part = missing / np.where(movable | (ease > 0), movable + ease, 1.0)
    asked = np.maximum((missing != 0).sum(axis=1), 1)
    return part * movable, np.einsum("kc,kci->ki", part, arm) * (TURNING / size / asked)[:, None]


def _middles(height: np.ndarray, movable: np.ndarray, gap: np.ndarray) -> np.ndarray:
    """Where (k,) the plane of each pair lies along its normal: half way between the corners (k,6) that are too far, or
    beside those that cannot move."""
    top, low = height[:, :3].max(axis=1), height[:, 3:].min(axis=1)
    middle = (top + low) / 2
    held_top = np.where(movable[:, :3], -np.inf, height[:, :3]).max(axis=1) + gap / 2
    held_low = np.where(movable[:, 3:], np.inf, height[:, 3:]).min(axis=1) - gap / 2
    return np.where(held_low >= held_top, np.clip(middle, held_top, held_low), middle)


def _planes(points: np.ndarray, one: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (k,3) of planes between triangles (k,3) of points (n,3), from one to the other, and what is between
    them along these (k,), at most a share of their size; 0 with a common vertex, which then lies on the plane."""
    a, b = points[one], points[other]
    size = np.ptp(np.concatenate([a, b], axis=1), axis=1).max(axis=1)
    sides_a, sides_b = a[:, [1, 2, 0]] - a, b[:, [1, 2, 0]] - b
    axes = [cross3(sides_a[:, 0], sides_a[:, 1])[:, None], cross3(sides_b[:, 0], sides_b[:, 1])[:, None]]
    axes.append(cross3(sides_a[:, :, None], sides_b[:, None]).reshape(-1, 9, 3))
    # Planes across faces that lie in one plane, along their sides.
    axes += [cross3(axes[0], sides_a), cross3(axes[1], sides_b)]
    axis = np.concatenate(axes, axis=1)
    length = np.linalg.norm(axis, axis=2)
    axis = axis / np.maximum(length, np.finfo(float).tiny)[:, :, None]
    same = one[:, :, None] == other[:, None, :]
    shared_a, shared_b = same.any(axis=2)[:, None], same.any(axis=1)[:, None]
    origin = np.where(shared_a[:, 0, :, None], a, 0.0).sum(axis=1)
    touching = shared_a.any(axis=2)
    start = np.where(touching, origin, a.mean(axis=1))
    p = np.einsum("kci,kxi->kxc", a - start[:, None], axis)
    q = np.einsum("kci,kxi->kxc", b - start[:, None], axis)
    found = []
    for turn in (1.0, -1.0):
        top = np.where(shared_a, -np.inf, turn * p).max(axis=2)
        low = np.where(shared_b, np.inf, turn * q).min(axis=2)
        # With a common vertex the plane goes through it, and both have to be on their side.
        found.append(np.where(touching, np.minimum(low, -top), low - top))
    gaps = np.where(length[:, :, None] > 0, np.stack(found, axis=2), -np.inf).reshape(len(one), -1)
    best = gaps.argmax(axis=1)
    rows = np.arange(len(one))
    normal = axis[rows, best // 2] * np.where(best % 2, -1.0, 1.0)[:, None]
    gap = np.where(touching[:, 0], 0.0, np.clip(gaps[rows, best], 0.0, GAP * size))
    return normal, gap


def _carried(before: np.ndarray, after: np.ndarray, corner: np.ndarray, normal: np.ndarray):
    """Normals (k,3) of planes after the best affine map of corners (k,6) from `before` to `after` (n,3), and by how
    much (k,) lengths along them change."""
    x, y = before[corner], after[corner]
    x, y = x - x.mean(axis=1, keepdims=True), y - y.mean(axis=1, keepdims=True)
    square, cross = np.einsum("kci,kcj->kij", x, x), np.einsum("kci,kcj->kij", y, x)
    size = np.trace(square, axis1=1, axis2=2)[:, None, None]
    stretch = np.sqrt(np.square(y).sum(axis=(1, 2)) / np.maximum(np.square(x).sum(axis=(1, 2)), np.finfo(float).tiny))
    soft = SOFT * size * np.eye(3)
    matrix = (cross + soft @ (stretch[:, None, None] * nearest_rotations(cross))) @ np.linalg.inv(square + soft)
    # A plane's normal goes by the inverse transpose, which has the direction of the cofactors.
    turned = np.stack([cross3(matrix[:, :, (k + 1) % 3], matrix[:, :, (k + 2) % 3]) for k in range(3)], axis=2)
    turned = np.einsum("kij,kj->ki", turned, normal)
    length = np.linalg.norm(turned, axis=1)
    sound = length > 0
    turned = np.where(sound[:, None], turned / np.where(sound, length, 1.0)[:, None], normal)
    return turned, np.clip(np.linalg.det(matrix) / np.where(sound, length, 1.0), 0.0, 1.0)
