"""Lead handles from start to end: straight, rigidly, or around the middle (Hu, Zou, Hua 2014, section 5).

The paper's radius path turns directions evenly and changes distances from the middle evenly; its blend of both is
gamma = (1 - w) gamma_straight + w gamma_radius with w = (|p| + |p'|) / 2, distances over that of the wall. Its equation
for the direction half way lacks the normalisation of u1 + u2; repeated halving of unit vectors is what `_turned` has in
closed form.
"""

from __future__ import annotations

import numpy as np

from ..counts import BYTES_OF_NUMBER, check_memory, real
from ..mesh.geometry import nearest_rotations
from .options import BLEND, RADIUS, RIGID, STRAIGHT

# Radians below pi that directions may be apart; opposite ones have no shortest way.
OPPOSITE = 1e-6


def handle_paths(
    start: np.ndarray, end: np.ndarray, owner: np.ndarray, kind: str, samples: int, middle: np.ndarray, reach: float
) -> np.ndarray:
    """Places (samples + 1, p, d) of handle points (p,d) on their way to ends (p,d), in even steps of time.

    owner (p,): the handle of each; kind: one of `options.PATHS`; middle (d,) and reach: where radii are measured from,
    and the radius at which a blend is a radius path

    Raises
    ------
    ValueError : an unknown kind
    CountError : more samples than this machine has memory for
    """
    check_memory(real(samples) * max(len(start), 1), BYTES_OF_NUMBER * start.shape[1], "A path of {} places")
    times = np.linspace(0.0, 1.0, samples + 1)
    straight = start + times[:, None, None] * (end - start)
    path = straight.copy()
    if kind == RIGID:
        for k in np.unique(owner):
            mine = owner == k
            path[:, mine] = _rigid(start[mine], end[mine], times)
    elif kind in (RADIUS, BLEND):
        path = middle + _turned(start - middle, end - middle, times)
        if kind == BLEND:
            distance = (np.linalg.norm(start - middle, axis=1) + np.linalg.norm(end - middle, axis=1)) / 2
            weight = np.minimum(distance / reach, 1.0)[:, None]
            path = (1 - weight) * straight + weight * path
    elif kind != STRAIGHT:
        raise ValueError(f"path must be rigid, straight, radius or blend, not {kind!r}")
    # Ends are met to the last digit, and what stays stays.
    path[0], path[-1] = start, end
    still = (start == end).all(axis=1)
    path[:, still] = start[still]
    return path


def _turned(start: np.ndarray, end: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Vectors (t,p,d) whose directions turn evenly and whose lengths change evenly."""
    a, b = np.linalg.norm(start, axis=1), np.linalg.norm(end, axis=1)
    tiny = np.finfo(float).tiny
    u, v = start / np.maximum(a, tiny)[:, None], end / np.maximum(b, tiny)[:, None]
    angle = np.arccos(np.clip(np.einsum("pd,pd->p", u, v), -1.0, 1.0))
    side = v - np.einsum("pd,pd->p", u, v)[:, None] * u
    # Opposite directions: any way around is the shortest.
    flat = (np.pi - angle < OPPOSITE) & (a > 0) & (b > 0)
    axis = np.eye(start.shape[1])[np.abs(u).argmin(axis=1)]
    side[flat] = (axis - np.einsum("pd,pd->p", u, axis)[:, None] * u)[flat]
    side /= np.maximum(np.linalg.norm(side, axis=1), tiny)[:, None]
    t = times[:, None, None]
    direction = np.cos(t * angle[:, None]) * u + np.sin(t * angle[:, None]) * side
    radial = ((1 - t) * a[:, None] + t * b[:, None]) * direction
    # From the middle or to it there is no direction to turn.
    alone = (a == 0) | (b == 0)
    radial[:, alone] = (start + t * (end - start))[:, alone]
    return radial


def rotation_between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """The rotation R (d,d) that takes points (k,d) about their mean nearest to others (k,d) (Kabsch 1976)."""
    return nearest_rotations((end - end.mean(axis=0)).T @ (start - start.mean(axis=0)))


def _rigid(start: np.ndarray, end: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Points (t,k,d) that turn with their best rotation while they go; what no rotation explains comes evenly."""
    from scipy.linalg import expm, logm

    low, high = start.mean(axis=0), end.mean(axis=0)
    rotation = rotation_between(start, end)
    turning = np.real(logm(rotation))
    # The logarithm of half a turn is not unique, and scipy's may leave the rotations; then points go straight.
    if not np.allclose(expm(turning), rotation, atol=1e-8) or not np.allclose(turning, -turning.T, atol=1e-6):
        return start + times[:, None, None] * (end - start)
    rest = (end - high) @ rotation - (start - low)
    frames = np.stack([expm(t * turning) for t in times])
    body = (start - low)[None] + times[:, None, None] * rest[None]
    return np.einsum("tij,tkj->tki", frames, body) + ((1 - times)[:, None] * low + times[:, None] * high)[:, None]
