"""Tell where an outline that touches itself covers itself there, which no two of its edges need to cross for.

Maps of bodies of equal cubes lie on a grid: two of their squares may coincide to the last digit, with edges on edges
and corners on corners. What tells them from neighbours is the angle that the map takes up on each side of a contact.
"""

from __future__ import annotations

import numpy as np

# Angles in radians by which two sectors have to overlap: the two sides of a slit meet in less, for rounding.
OVERLAPPING = 1e-3


def covering_contacts(
    w: np.ndarray, tail: np.ndarray, head: np.ndarray, i: np.ndarray, j: np.ndarray, depth: float
) -> np.ndarray:
    """Which vertices tail[i] (k,) of a map w (n,) complex lie on the edge j, within `depth`, and cover what is there.

    tail, head : (b,) of the edges of an outline, with the map to their left; each vertex is the tail of one
    """
    along = w[head] - w[tail]
    length = np.abs(along[j])
    near = length > depth
    i, j, length = i[near], j[near], length[near]
    to = w[tail[i]] - w[tail[j]]
    across = (to * along[j].conj()) / length
    at_tail = np.abs(to) <= depth
    on = at_tail | ((np.abs(across.imag) <= depth) & (across.real > depth) & (across.real < length - depth))
    found = np.zeros(len(near), bool)
    if not on.any():
        return found
    i, j, at_tail = i[on], j[on], at_tail[on]
    before = _before(tail, head)
    begin, other = np.angle(along[i]), np.angle(along[j])
    angle = _turn(-along[before[i]], along[i])
    opposite = np.where(at_tail, _turn(-along[before[j]], along[j]), np.pi)
    # Either sector begins within the other one.
    covers = np.minimum(angle - (other - begin) % (2 * np.pi), angle) > OVERLAPPING
    covers |= np.minimum(opposite - (begin - other) % (2 * np.pi), opposite) > OVERLAPPING
    found[np.flatnonzero(near)[np.flatnonzero(on)[covers]]] = True
    return found


def _turn(to: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Angle (k,) in (0, 2 pi] from the directions `along` counter-clockwise to the directions `to`, complex."""
    angle = np.angle(to * along.conj()) % (2 * np.pi)
    # Next to nothing is a full turn: the tip of a slit.
    return np.where(angle < OVERLAPPING, 2 * np.pi, angle)


def turns(w: np.ndarray, tail: np.ndarray, head: np.ndarray, owner: np.ndarray | None = None) -> np.ndarray:
    """How often the direction of outlines turns around, once if they are simple, of a map w (n,) complex: (c,).

    Every vertex around which the map goes more than once adds a turn, though its edges cross no others.
    tail, head : (b,) of the edges; owner (b,) : the outline from 0 to c - 1 that each belongs to, one by default
    """
    along = w[head] - w[tail]
    before = along[_before(tail, head)]
    owner = np.zeros(len(tail), np.int64) if owner is None else owner
    return np.rint(np.bincount(owner, np.pi - _turn(-before, along)) / (2 * np.pi)).astype(np.int64)


def _before(tail: np.ndarray, head: np.ndarray) -> np.ndarray:
    """The edge (b,) that ends where each begins."""
    before = np.empty(len(tail), np.int64)
    before[np.argsort(tail)] = np.argsort(head)
    return before
