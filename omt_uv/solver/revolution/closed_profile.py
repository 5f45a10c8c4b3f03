"""Choose the rings of surfaces of revolution whose profile is closed: those of tori, tyres and pipes with a wall."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import depth_first_order

from ..mesh.topology import halfedges, pair_keys, paired
from .axis import EVEN, Axis
from .bands import bands_and_cost, ring_lengths
from .profile import IN_A_ROW, LEAST_SIDES, Profile, rows_of_vertices

# So many rings are tried to be the one where a profile is opened: every one, or as many in between.
STARTS = 48


@dataclass(frozen=True)
class ClosedProfile:
    """Rows of vertices of a surface of revolution that closes up as a torus does, in order around the profile.

    Attributes
    ----------
    row (n,) : of every vertex, from 0
    radius (k,), height (k,) : of the rows: distance from the axis, and along it
    """

    row: np.ndarray
    radius: np.ndarray
    height: np.ndarray

    def opened(self, start: int) -> tuple[Profile, np.ndarray]:
        """The profile from one row all around to the same, and the rows (k+1,) at its levels."""
        rows = np.append(np.roll(np.arange(len(self.radius)), -start), start)
        r, z = self.radius[rows], self.height[rows]
        s = np.append(0.0, np.cumsum(np.hypot(np.diff(r), np.diff(z))))
        return Profile(s / s[-1], self.row, r, s, True, np.zeros(2, dtype=bool)), rows

    def turns(self) -> np.ndarray:
        """The angles (k,) by which the profile turns at its rows."""
        way = self.radius + 1j * self.height
        return np.abs(np.angle((np.roll(way, -1) - way) * np.conj(way - np.roll(way, 1))))


def closed_profile_of(positions: np.ndarray, triangles: np.ndarray, axis: Axis) -> ClosedProfile | None:
    """The closed profile of a surface (n,3), (m,3) that turns about an axis; None if it has boundaries, its vertices
    are in no rows that close up, or in rows of fewer than what is smooth."""
    n, (tail, head) = len(positions), halfedges(triangles)
    keys, sides = np.unique(pair_keys(tail, head), return_counts=True)
    if n - len(keys) + len(triangles) != 0 or (sides != 2).any():
        return None
    radius, height = axis.radius(positions), axis.height(positions)
    rows, row = rows_of_vertices(triangles, radius, height)
    size = np.bincount(row)
    joined = np.unique(pair_keys(*row[paired(keys)].T))
    joined = paired(joined)[np.diff(paired(joined))[:, 0] > 0]
    if IN_A_ROW * rows > n or np.median(size) < LEAST_SIDES or len(joined) != rows:
        return None
    radius, height = (np.bincount(row, x) / size for x in (radius, height))
    # From the row that is nearest to the axis, or the lowest of these, outwards below: numbers of vertices choose none.
    near = np.flatnonzero(radius <= radius.min() + EVEN * np.ptp(radius))
    first = near[np.argmin(height[near])]
    graph = coo_array((np.ones(len(joined)), joined.T), shape=(rows, rows)).tocsr()
    order = depth_first_order(graph, first, directed=False, return_predecessors=False)
    if len(order) != rows or (np.bincount(joined.ravel(), minlength=rows) != 2).any():
        return None
    r, z = radius[order], height[order]
    if np.sum(r * np.roll(z, -1) - z * np.roll(r, -1)) < 0:
        order = np.append(order[0], order[:0:-1])
    place = np.empty(rows, np.int64)
    place[order] = np.arange(rows)
    return ClosedProfile(place[row], radius[order], height[order])


def cheapest_rings(profile: ClosedProfile, price: np.ndarray, asked: float) -> np.ndarray:
    """The rows (b,) along which a surface is cut, see `bands.cheapest_bands`: at least one, or none where no rings
    leave bands that keep what is asked.

    price (k,) : of a cut along every row, over its length
    """
    count = len(profile.radius)
    alone = ring_lengths(profile.radius, price, profile.turns())
    best, found = np.inf, np.zeros(0, np.int64)
    for start in np.unique(np.linspace(0, count - 1, min(count, STARTS)).round().astype(np.int64)):
        opened, rows = profile.opened(start)
        if not np.isfinite(alone[start]):
            continue
        bands, cost = bands_and_cost(opened, price[rows], asked)
        side = np.sqrt(np.pi * np.sum((opened.radius[1:] + opened.radius[:-1]) * np.diff(opened.length)))
        cost += alone[start] / side
        # Of two that cost the same rounding chooses none.
        if cost < (1 - EVEN) * best:
            best, found = cost, np.sort(np.append(rows[bands], start))
    return found
