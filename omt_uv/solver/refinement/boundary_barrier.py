"""Keep a boundary from crossing itself, by a barrier between its vertices and edges (Smith, Schaefer 2015).

A map without folds whose boundary does not cross itself is one to one. The barrier strength * (reach / distance - 1)^2
acts where a boundary vertex is nearer to a boundary edge than a small reach, is infinite at contact, and a step is
never taken past the first contact. Its Hessian knows that an edge turns while a vertex slides past it: where they
nearly touch that is most of what a step changes, and without it one such pair holds up the whole map.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..maps.boxes import box_pairs
from ..maps.contacts import covering_contacts, turns

# Reach of the barrier, relative to the shorter of the boundary edges involved.
REACH = 0.5
# A step goes at most this share of the way to the first contact.
CONTACT_SHARE = 0.8
# Edges that reach past each other by less than this share of the map only touch: the two sides of a cut through a flat
# surface lie on one another, and rounding shall not decide whether they cross.
TOUCH = 1e-9


def loop_edges(loop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tails and heads (b,) of the edges of a boundary: a loop (b,) of vertices, or edges (b,2) of several loops."""
    return (loop[:, 0], loop[:, 1]) if loop.ndim == 2 else (loop, np.roll(loop, -1))


def crossings(w: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Pairs (k,2) of edges of a boundary that cross: edge i goes from loop[i] to the next; see `loop_edges`.

    Touching at a common vertex is no crossing, and neither are edges that only touch, unless the map covers itself
    there: see `contacts.covering_contacts`.
    """
    tail, head = loop_edges(loop)
    low, high = _box(np.stack([w[tail], w[head]]))
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
    low, high = _box(np.stack([x for moved in maps for x in (moved[tail], moved[head])]))
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


def _passes(a, b, p, q, depth: float) -> np.ndarray:
    """Whether p and q (k,) lie on either side of the lines from a to b (k,), both farther than `depth` from them."""
    along = b - a
    left, right = _cross(along, p - a), _cross(along, q - a)
    return (left * right < 0) & (np.minimum(np.abs(left), np.abs(right)) > depth * np.abs(along))


@dataclass(frozen=True)
class BoundaryBarrier:
    """The energy of boundary vertices that are near to boundary edges.

    Attributes
    ----------
    tail, head : (b,) vertices of the boundary edges
    vertex_reach, edge_reach : (b,) of the vertex `tail` and of the edge; of a pair, the smaller one counts
    strength : see `energy`
    """

    tail: np.ndarray
    head: np.ndarray
    vertex_reach: np.ndarray
    edge_reach: np.ndarray
    strength: float
    # The last map that was asked about, and what is near there: a step begins where the one before has ended.
    _found: dict[str, Any] = field(default_factory=dict, repr=False, compare=False)

    def energy(self, w: np.ndarray) -> float:
        """Sum over near pairs of strength * (reach / distance - 1)^2."""
        near = self._near(w)
        return float(self.strength * ((near.reach / near.distance - 1) ** 2).sum()) if len(near.point) else 0.0

    def derivatives(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gradient (n,) complex; vertices and rows (k,3) of linear forms whose squares are the Hessian, made convex."""
        near = self._near(w)
        d, reach = near.distance, near.reach
        slope = -2 * self.strength * (reach / d - 1) * reach / d**2
        bend = 2 * self.strength * (reach / d**2) ** 2 + 4 * self.strength * (reach / d - 1) * reach / d**3
        vertices = np.column_stack([near.point, near.tail, near.head])
        forms = near.normal[:, None] * np.column_stack([np.ones(len(d)), near.share - 1, -near.share])
        flat, values = vertices.ravel(), (slope[:, None] * forms).ravel()
        gradient = np.bincount(flat, values.real, len(w)) + 1j * np.bincount(flat, values.imag, len(w))
        on = (near.share > 0) & (near.share < 1)
        bending = np.sqrt(-slope[on] / 2)[:, None] * near.bending(w, on)
        forms = np.sqrt(bend)[:, None] * forms.conj()
        return gradient, np.concatenate([vertices, vertices[on]]), np.concatenate([forms, bending])

    def limit(self, w: np.ndarray, step: np.ndarray) -> float:
        """Share of a step (n,) that may be taken before a vertex touches an edge."""
        tail, head = self.tail, self.head
        p, a, b = w[tail], w[tail], w[head]
        dp, da, db = step[tail], step[tail], step[head]
        i, j = box_pairs(*_box(np.stack([p, p + dp])), *_box(np.stack([a, b, a + da, b + db])))
        apart = (tail[i] != tail[j]) & (tail[i] != head[j])
        i, j = i[apart], j[apart]
        times = _contact_times(p[i] - a[j], dp[i] - da[j], b[j] - a[j], db[j] - da[j])
        return CONTACT_SHARE * float(times.min(initial=np.inf))

    def _near(self, w: np.ndarray) -> _Near:
        if self._found.get("map") is not w:
            self._found.update(map=w, near=self._near_in(w))
        return self._found["near"]

    def _near_in(self, w: np.ndarray) -> _Near:
        tail, head = self.tail, self.head
        p, a, b = w[tail], w[tail], w[head]
        low, high = _box(p[None])
        grown = self.vertex_reach[:, None]
        i, j = box_pairs(low - grown, high + grown, *_box(np.stack([a, b])))
        apart = (tail[i] != tail[j]) & (tail[i] != head[j])
        i, j = i[apart], j[apart]
        along, to = b[j] - a[j], p[i] - a[j]
        share = np.clip((to * along.conj()).real / np.maximum(np.abs(along) ** 2, 1e-300), 0, 1)
        gap = to - share * along
        distance = np.maximum(np.abs(gap), 1e-300)
        reach = np.minimum(self.vertex_reach[i], self.edge_reach[j])
        on = distance < reach
        i, j = i[on], j[on]
        return _Near(
            point=tail[i],
            tail=tail[j],
            head=head[j],
            share=share[on],
            distance=distance[on],
            reach=reach[on],
            normal=gap[on] / distance[on],
        )


@dataclass(frozen=True)
class _Near:
    point: np.ndarray
    tail: np.ndarray
    head: np.ndarray
    share: np.ndarray
    distance: np.ndarray
    reach: np.ndarray
    normal: np.ndarray

    def bending(self, w: np.ndarray, on: np.ndarray) -> np.ndarray:
        """Rows (k,3) of linear forms y for the pairs `on`, whose vertices lie beside an edge.

        The distance d of a vertex that slides along an edge by u while the edge turns by r shrinks by u r + d r^2 / 2
        to second order: this is (y^2 - z^2) / 4. A barrier that does not know y lets vertices slide until they touch.
        """
        edge = w[self.head[on]] - w[self.tail[on]]
        length, share, normal = np.abs(edge), self.share[on], self.normal[on].conj()
        zero, one = np.zeros(len(share)), np.ones(len(share))
        slide = (edge.conj() / length)[:, None] * np.column_stack([one, share - 1, -share])
        turn = normal[:, None] * np.column_stack([zero, -one, one]) / length[:, None]
        slide += 0.5 * self.distance[on][:, None] * turn
        size, rate = (np.linalg.norm(x, axis=1)[:, None] for x in (slide, turn))
        return np.sqrt(size * rate) * (slide / size + turn / rate)


def make_barrier(w: np.ndarray, loop: np.ndarray, strength: float) -> BoundaryBarrier:
    """A barrier for a boundary, see `loop_edges`, whose reach follows the edge lengths of the map w (n,)."""
    tail, head = loop_edges(loop)
    edge = np.abs(w[head] - w[tail])
    edge = np.minimum(edge, edge.mean())
    before = np.empty_like(edge)
    before[np.argsort(tail)] = edge[np.argsort(head)]
    return BoundaryBarrier(
        tail=tail, head=head, vertex_reach=REACH * np.minimum(edge, before), edge_reach=REACH * edge, strength=strength
    )


def _contact_times(p, dp, e, de):
    """Smallest t in (0, 1] at which p + t dp lies on the segment from 0 to e + t de; infinity where it never does."""
    q2, q1, q0 = _cross(de, dp), _cross(e, dp) + _cross(de, p), _cross(e, p)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = np.sqrt(q1 * q1 - 4 * q2 * q0)
        half = -0.5 * (q1 + np.where(q1 >= 0, root, -root))
        times = np.stack([half / q2, q0 / half])
        at, edge = p + times * dp, e + times * de
        share = (at * edge.conj()).real / np.abs(edge) ** 2
    # A little more than the segment, lest rounding lets a vertex slip past an end.
    hit = (times > 0) & (times <= 1 / CONTACT_SHARE) & (share > -1e-9) & (share < 1 + 1e-9)
    return np.where(hit, times, np.inf).min(0, initial=np.inf) if len(p) else np.zeros(0)


def _box(points):
    return (
        np.column_stack([points.real.min(0), points.imag.min(0)]),
        np.column_stack([points.real.max(0), points.imag.max(0)]),
    )


def _cross(a, b):
    return a.real * b.imag - a.imag * b.real
