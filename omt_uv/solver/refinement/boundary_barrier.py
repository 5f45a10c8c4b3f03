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
from ..maps.contacts import box_of, edges_before, loop_edges
from ..mesh.geometry import complex_cross

# Reach of the barrier, relative to the shorter of the boundary edges involved.
REACH = 0.5
# A step goes at most this share of the way to the first contact.
CONTACT_SHARE = 0.8
# What is nearer than this share of the reach is set apart by as much before a barrier stands between: nets lie edge to
# edge, where it is infinite, and what has no way to go is not held back either. Its reach is less there and there
# alone, lest slits through flat sides open: the less it reaches, the more steps go past it.
APART = 0.1
CLOSE_REACH = 0.05


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
        if not len(near.point):
            return 0.0
        # Infinite at contact: a step may end there.
        with np.errstate(over="ignore"):
            return float(self.strength * ((near.reach / near.distance - 1) ** 2).sum())

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
        i, j = box_pairs(*box_of(np.stack([p, p + dp])), *box_of(np.stack([a, b, a + da, b + db])))
        apart = (tail[i] != tail[j]) & (tail[i] != head[j])
        i, j = i[apart], j[apart]
        times = _contact_times(p[i] - a[j], dp[i] - da[j], b[j] - a[j], db[j] - da[j])
        return CONTACT_SHARE * float(times.min(initial=np.inf))

    def set_apart(self, w: np.ndarray) -> np.ndarray:
        """A step (n,) that draws what nearly touches into the map w (n,), along the bisectors of its corners."""
        near, step = self._near_in(w), np.zeros(len(w), complex)
        close = near.distance < APART * near.reach
        if not close.any():
            return step
        along = w[self.head] - w[self.tail]
        along /= np.maximum(np.abs(along), 1e-300)
        inward = 1j * (along + along[edges_before(self.tail, self.head)])
        size = np.abs(inward)
        # The tip of a slit has no such direction, and need not move.
        turns = size > APART
        step[self.tail[turns]] = APART * self.vertex_reach[turns] * inward[turns] / size[turns]
        touching = np.zeros(len(w), bool)
        for vertices, at in ((near.point, close), (near.tail, near.share < 1), (near.head, near.share > 0)):
            touching[vertices[close & at]] = True
        return np.where(touching, step, 0)

    def _near(self, w: np.ndarray) -> _Near:
        if self._found.get("map") is not w:
            self._found.update(map=w, near=self._near_in(w))
        return self._found["near"]

    def _near_in(self, w: np.ndarray) -> _Near:
        tail, head = self.tail, self.head
        p, a, b = w[tail], w[tail], w[head]
        low, high = box_of(p[None])
        grown = self.vertex_reach[:, None]
        i, j = box_pairs(low - grown, high + grown, *box_of(np.stack([a, b])))
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


def make_barrier(
    w: np.ndarray, loop: np.ndarray, strength: float, contact_reach: float | np.ndarray = REACH
) -> BoundaryBarrier:
    """A barrier for a boundary, see `loop_edges`, whose reach is that share, of all or of each vertex (n,), of the edge
    lengths of the map w (n,)."""
    tail, head = loop_edges(loop)
    reach = np.broadcast_to(contact_reach, len(w))
    edge = np.abs(w[head] - w[tail])
    edge = np.minimum(edge, edge.mean())
    before = edge[edges_before(tail, head)]
    return BoundaryBarrier(
        tail=tail,
        head=head,
        vertex_reach=reach[tail] * np.minimum(edge, before),
        edge_reach=np.minimum(reach[tail], reach[head]) * edge,
        strength=strength,
    )


def _contact_times(p, dp, e, de):
    """Smallest t in (0, 1] at which p + t dp lies on the segment from 0 to e + t de; infinity where it never does."""
    q2, q1, q0 = complex_cross(de, dp), complex_cross(e, dp) + complex_cross(de, p), complex_cross(e, p)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        root = np.sqrt(q1 * q1 - 4 * q2 * q0)
        half = -0.5 * (q1 + np.where(q1 >= 0, root, -root))
        times = np.stack([half / q2, q0 / half])
        at, edge = p + times * dp, e + times * de
        share = (at * edge.conj()).real / np.abs(edge) ** 2
    # A little more than the segment, lest rounding lets a vertex slip past an end.
    hit = (times > 0) & (times <= 1 / CONTACT_SHARE) & (share > -1e-9) & (share < 1 + 1e-9)
    return np.where(hit, times, np.inf).min(0, initial=np.inf) if len(p) else np.zeros(0)
