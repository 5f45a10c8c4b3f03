"""The rings of edges along which a surface of revolution comes apart."""

from __future__ import annotations

import numpy as np

from ..linalg.minimum_cut import capacities, least_cut
from ..mesh.topology import halfedges
from .axis import axis_of_revolution
from .bands import cheapest_bands
from .closed_profile import ClosedProfile, cheapest_rings, closed_profile_of
from .profile import Profile, profile_of

# Where vertices are in no rows, a ring is the shortest within this share of the length of the profile, to either side.
NEAR = 0.02


def rings_of_edges(
    positions: np.ndarray,
    triangles: np.ndarray,
    polygon: np.ndarray,
    pair: np.ndarray,
    length: np.ndarray,
    cost: np.ndarray,
    asked: float,
) -> np.ndarray:
    """Edges (e,) bool around a surface (n,3), (m,3) of revolution, between bands and caps; none where it is no such
    surface.

    polygon (m,) : of every triangle; pair (e,2) : both halfedges of an edge, its length (e,) and its cost (e,), which
    is infinite within polygons; asked : see `bands.cheapest_bands`
    """
    found = np.zeros(len(pair), dtype=bool)
    _, polygon = np.unique(polygon, return_inverse=True)
    axis = axis_of_revolution(positions, triangles, polygon.ravel())
    if axis is None:
        return found
    turned = profile_of(positions, triangles, axis)
    if turned is None:
        closed = closed_profile_of(positions, triangles, axis)
        return found if closed is None else _around(closed, triangles, pair, length, cost, asked)
    at = np.bincount(polygon, turned.along[triangles].mean(axis=1)) / np.bincount(polygon)
    joined = polygon[pair // 3]
    between = np.isfinite(cost) & (joined[:, 0] != joined[:, 1])
    joined, length, cost = joined[between], length[between], cost[between]
    price = np.array([_price(at[joined] < level, length, cost) for level in turned.level])
    for k in cheapest_bands(turned, price, asked):
        side = _side(turned, k, at, joined, length)
        found[np.flatnonzero(between)[side[joined[:, 0]] != side[joined[:, 1]]]] = True
    return found


def _around(
    closed: ClosedProfile, triangles: np.ndarray, pair: np.ndarray, length: np.ndarray, cost: np.ndarray, asked: float
) -> np.ndarray:
    """Edges (e,) bool along the rows of a closed profile where a surface comes apart; see `rings_of_edges`."""
    tail, head = halfedges(triangles)
    row, other = closed.row[tail[pair[:, 0]]], closed.row[head[pair[:, 0]]]
    within, count = row == other, len(closed.radius)
    around = np.maximum(np.bincount(row[within], length[within], count), 1e-300)
    price = np.bincount(row[within], cost[within], count) / around
    # A row whose edges are not all there, or within polygons, closes no ring.
    whole = np.bincount(row[within], minlength=count) == np.bincount(closed.row, minlength=count)
    price = np.where(whole, price, np.inf)
    return within & np.isin(row, cheapest_rings(closed, price, asked))


def _price(before: np.ndarray, length: np.ndarray, cost: np.ndarray) -> float:
    """What cutting all edges costs, over their length, that have one of two sides (e,2) bool before a level."""
    here = before[:, 0] != before[:, 1]
    whole = length[here].sum()
    return float(cost[here].sum() / whole) if whole > 0 else 1.0


def _side(turned: Profile, k: int, at: np.ndarray, joined: np.ndarray, length: np.ndarray) -> np.ndarray:
    """The polygons (p,) bool before level k, of those that are so far (p,) along the profile."""
    if turned.in_rows:
        return at < turned.level[k]
    around = turned.length[k] + NEAR * turned.length[-1] * np.array([-1, 1])
    low, high = np.interp(around, turned.length, turned.level)
    one, other = np.flatnonzero(at <= low), np.flatnonzero(at >= high)
    if not len(one) or not len(other):
        return at < turned.level[k]
    return least_cut(joined, capacities(length), len(at), one, other)
