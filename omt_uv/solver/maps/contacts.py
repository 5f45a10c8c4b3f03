"""Tell where an outline crosses itself, and where it touches itself and covers what is there, which needs no crossing.

Maps of bodies of equal cubes lie on a grid: two of their squares may coincide to the last digit, with edges on edges
and corners on corners. What tells them from neighbours is the angle that the map takes up on each side of a contact.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.geometry import as_points, complex_cross, lengths, signed_areas
from ..mesh.topology import boundary_loops
from .boxes import box_pairs

# Angles in radians by which two sectors have to overlap: the two sides of a slit meet in less, for rounding.
OVERLAPPING = 1e-3
# Edges that reach past each other by less than this share of the map only touch: the two sides of a cut through a flat
# surface lie on one another, and rounding shall not decide whether they cross.
TOUCH = 1e-9
# Vertices of a boundary touch one another that are nearer than this share of the mean of its edges.
TOUCHING = 1e-6


def loop_edges(loop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tails and heads (b,) of the edges of a boundary: a loop (b,) of vertices, or edges (b,2) of several loops."""
    return (loop[:, 0], loop[:, 1]) if loop.ndim == 2 else (loop, np.roll(loop, -1))


def touches_itself(uv: np.ndarray, loop: np.ndarray) -> bool:
    """Whether vertices of a boundary (b,) lie on one another in a map uv (n,2), as those along a slit do."""
    points = uv[loop]
    least = TOUCHING * lengths(points - np.roll(points, -1, axis=0)).mean()
    # Most have no two vertices above one another, and need no tree.
    if not (np.diff(np.sort(points[:, 0])) < least).any():
        return False
    return bool((cKDTree(points).query(points, k=2)[0][:, 1] < least).any())


def crossings(w: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Pairs (k,2) of edges of a boundary that cross: edge i goes from loop[i] to the next; see `loop_edges`.

    Touching at a common vertex is no crossing, and neither are edges that only touch, unless the map covers itself
    there: see `covering_contacts`.
    """
    tail, head = loop_edges(loop)
    low, high = box_of(np.stack([w[tail], w[head]]))
    depth = _touch(low, high)
    i, j = box_pairs(low - depth, high + depth, low, high)
    apart = (j > i) & (tail[i] != head[j]) & (head[i] != tail[j])
    i, j = i[apart], j[apart]
    hit = _cross_at(w, tail, head, i, j, depth)
    return np.column_stack([i[hit], j[hit]])


def crossings_on_the_way(w: np.ndarray, step: np.ndarray, loop: np.ndarray, shares: tuple[float, ...]) -> np.ndarray:
    """Pairs (k,2) of edges of a boundary that cross where vertices have gone these shares of a step (n,) complex.

    Of a map w (n,) complex in which none do: pairs of edges that stay are not looked at.
    """
    tail, head = loop_edges(loop)
    moves = np.flatnonzero((step[tail] != 0) | (step[head] != 0))
    if not len(moves):
        return np.zeros((0, 2), np.int64)
    maps = [w + share * step for share in shares]
    low, high = box_of(np.stack([x for moved in maps for x in (moved[tail], moved[head])]))
    depth = _touch(low, high)
    i, j = box_pairs(low[moves] - depth, high[moves] + depth, low, high)
    i = moves[i]
    apart = (i != j) & (tail[i] != head[j]) & (head[i] != tail[j])
    i, j = i[apart], j[apart]
    hit = np.zeros(len(i), bool)
    for moved in maps:
        hit |= _cross_at(moved, tail, head, i, j, depth)
    return np.column_stack([i[hit], j[hit]])


def _touch(low: np.ndarray, high: np.ndarray) -> float:
    """How far edges with boxes (b,2) may reach past each other and only touch."""
    return TOUCH * float((high.max(0) - low.min(0)).max())


def _cross_at(w, tail, head, i, j, depth: float) -> np.ndarray:
    """Which pairs i, j (k,) of the edges from tail to head cross in a map w (n,)."""
    a, b = w[tail], w[head]
    hit = _passes(a[i], b[i], a[j], b[j], depth) & _passes(a[j], b[j], a[i], b[i], depth)
    return hit | covering_contacts(w, tail, head, i, j, depth) | covering_contacts(w, tail, head, j, i, depth)


def covers_itself(w: np.ndarray, loop: np.ndarray) -> bool:
    """Whether a map w (n,) without folds of a disk with the boundary loop (b,) covers any place twice."""
    return int(turns(w, *loop_edges(loop))[0]) > 1 or len(crossings(w, loop)) > 0


def lies_apart(w: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether triangles (m,3) with places w (n,) complex cover no place twice for certain: all are the same way up, and
    their one outline does not cross itself.

    Of long polygons, whose slivers all lie side by side, every sample of `overlap` would be compared with thousands.
    """
    if not (signed_areas(as_points(w), triangles) > 0).all():
        return False
    loops = boundary_loops(triangles)
    return len(loops) == 1 and not covers_itself(w, loops[0])


def _passes(a, b, p, q, depth: float) -> np.ndarray:
    """Whether p and q (k,) lie on either side of the lines from a to b (k,), both farther than `depth` from them."""
    along = b - a
    left, right = complex_cross(along, p - a), complex_cross(along, q - a)
    return (left * right < 0) & (np.minimum(np.abs(left), np.abs(right)) > depth * np.abs(along))


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
    before = edges_before(tail, head)
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
    before = along[edges_before(tail, head)]
    owner = np.zeros(len(tail), np.int64) if owner is None else owner
    return np.rint(np.bincount(owner, np.pi - _turn(-before, along)) / (2 * np.pi)).astype(np.int64)


def edges_before(tail: np.ndarray, head: np.ndarray) -> np.ndarray:
    """The edge (b,) that ends where each begins."""
    before = np.empty(len(tail), np.int64)
    before[np.argsort(tail)] = np.argsort(head)
    return before


def box_of(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and greatest coordinates (b,2) of the boxes around points (k,b) complex, k in each."""
    return (
        np.column_stack([points.real.min(0), points.imag.min(0)]),
        np.column_stack([points.real.max(0), points.imag.max(0)]),
    )
