"""Slide samples on boundaries that need not be kept until they are evenly apart, on a curve without frays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.topology import boundary_loops
from ..components.components import Component
from .arc_network import ArcNetwork, ArcSamples

# A sample is the mean of its part of the boundary, at these shares of it: frays that the new edges are too long to show
# vanish, and what they can show stays.
PLACES = (np.arange(16) + 0.5) / 16
# Weights of these, a hat: those near to the sample weigh more.
PLACE_WEIGHT = 1 - np.abs(2 * PLACES - 1)
# Rounds of sliding.
ROUNDS = 8


def slide_boundaries(component: Component, network: ArcNetwork, samples: ArcSamples, size: np.ndarray) -> ArcSamples:
    """Move the samples of a component's boundaries along these, about `size` (n,) at every vertex apart.

    What a feature ends in stays where it is.
    """
    on = network.along(component.boundary_edges)
    ends = [samples.along[k][[0, -1]] for k, arc in enumerate(network.arcs) if arc.kept and k not in on]
    pinned = np.zeros(len(samples.points), dtype=bool)
    pinned[np.concatenate([np.zeros(0, np.int64), *ends])] = True
    if not on:
        return samples
    # Every arc without its end, which the next one begins with.
    mine = np.concatenate([samples.along[k][:-1] for k in on])
    vertex = np.concatenate([network.arcs[k].vertices[samples.edge[k][:-1]] for k in on])
    share = np.concatenate([samples.share[k][:-1] for k in on])
    points = samples.points.copy()
    for loop in boundary_loops(component.triangles):
        place = np.full(len(component.vertices), -1)
        place[loop] = np.arange(len(loop))
        here = np.flatnonzero(place[vertex] >= 0)
        where = place[vertex[here]] + share[here]
        order = np.argsort(where, kind="stable")
        chosen = mine[here[order]]
        closed = np.append(loop, loop[0])
        curve = _Curve(component.vertices[closed], size[closed])
        points[chosen] = _settled(curve, where[order], pinned[chosen])
    return replace(samples, points=points)


class _Curve:
    """A closed polyline (k,3), first point again at the end, by arc length; size (k,)."""

    def __init__(self, points: np.ndarray, size: np.ndarray):
        self.points, self.size = points, size
        self.length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])

    def at(self, s: np.ndarray) -> np.ndarray:
        """Positions (..., 3) at lengths (...)."""
        s = s % self.length[-1]
        return np.stack([np.interp(s, self.length, self.points[:, k]) for k in range(3)], axis=-1)

    def means(self, s: np.ndarray) -> np.ndarray:
        """Means (k,3) of the curve around lengths (k,) in ascending order."""
        around = np.concatenate([[s[-1] - self.length[-1]], s, [s[0] + self.length[-1]]])
        middle = (around[1:] + around[:-1]) / 2
        low, high = middle[:-1, None], middle[1:, None]
        return np.einsum("p,kpi->ki", PLACE_WEIGHT / PLACE_WEIGHT.sum(), self.at(low + (high - low) * PLACES))


def _settled(curve: _Curve, where: np.ndarray, pinned: np.ndarray) -> np.ndarray:
    """Points (k,3) from vertices and shares of the edges after them, (k,) ascending, as evenly apart as can be."""
    s = np.interp(where, np.arange(len(curve.length)), curve.length)
    first = int(np.argmax(pinned))
    pinned = np.roll(pinned, -first)[:, None]
    s = np.concatenate([s[first:], s[:first] + curve.length[-1]])
    # Evenly from one sample that stays to the next, or once around.
    anchors = np.unique(np.concatenate([[0], np.flatnonzero(pinned), [len(s)]]))
    for _ in range(ROUNDS):
        points = np.where(pinned, curve.at(s), curve.means(s))
        size = np.interp(s % curve.length[-1], curve.length, curve.size)
        step = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1) / (size + np.roll(size, -1))
        total = np.concatenate([[0.0], np.cumsum(step)])
        even = np.interp(np.arange(len(s)), anchors, total[anchors])
        s = np.interp(even, total, np.append(s, s[0] + curve.length[-1]))
    points = np.where(pinned, curve.at(s), curve.means(s))
    return np.roll(points, first, axis=0)
