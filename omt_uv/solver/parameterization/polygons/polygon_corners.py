"""Find the corners of polygons, triangles of a vertex and its two neighbours, and bar their areas from 0."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ...maps.polygon_elements import OPEN
from ...mesh.geometry import cross3, part_by_part
from ...mesh.surface import Surface

# A corner counts where it has this share of its polygon's area on the surface.
SHARP = 1e-3
# It is convex in the map where it has more than this share of its target area, as the energy of quads takes it.
CONVEX = OPEN
# Straight ones, and slightly reflex ones, of less than this share of the polygon, shall be convex as if they had it.
STRAIGHT = 0.02
# Corners of polygons with many sides have less than that, and are straight below this part of what those of a regular
# one have.
FLATTER = 0.3
# Straight ones are reflex only where they have lost this share of the area: straight lines may stay so.
DENTED = 0.01
# Polygons whose corners are looked at together, so few that what is computed of them stays in the cache.
POLYGONS = 1 << 13
# Maps (n,) whose corners were forced open, by what they were found from.
Forced = dict[tuple[bytes, ...], np.ndarray]


def areas_in_map(triangles: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Signed areas (k,) of triangles (k,3) in a map w (n,) complex."""

    def areas(some):
        a, b, c = w[some].T
        return 0.5 * ((b - a).conj() * (c - a)).imag

    return part_by_part(areas, triangles)


@dataclass(frozen=True)
class PolygonCorners:
    """Corners of polygons.

    Attributes
    ----------
    triangles (k,3) : of vertices
    polygon (k,) : whose corner each is
    target (k,) : areas they shall have
    whole (k,) : areas of their polygons
    least (k,) : areas below which they are reflex
    """

    triangles: np.ndarray
    polygon: np.ndarray
    target: np.ndarray
    whole: np.ndarray
    least: np.ndarray

    def areas(self, w: np.ndarray) -> np.ndarray:
        """Signed areas (k,) in a map w (n,) complex."""
        return areas_in_map(self.triangles, w)

    def reflex(self, w: np.ndarray) -> np.ndarray:
        """Which corners (k,) are reflex in a map w (n,) complex."""
        return ~(self.areas(w) > self.least)

    def convex(self, w: np.ndarray) -> np.ndarray:
        """Which corners (k,) are convex in a map w (n,) complex; straight ones may be neither convex nor reflex."""
        return self.areas(w) > CONVEX * self.target

    def of(self, chosen: np.ndarray, place: np.ndarray) -> PolygonCorners:
        """Some of the corners, (k,) bool, with the vertices renumbered, vertex v as place[v]."""
        return PolygonCorners(
            triangles=place[self.triangles[chosen]],
            polygon=self.polygon[chosen],
            target=self.target[chosen],
            whole=self.whole[chosen],
            least=self.least[chosen],
        )


@dataclass(frozen=True)
class CornerBarrier:
    """The energy of corners with slack (k,) and strength (k,); an extra of `projected_newton.NewtonProblem`."""

    corners: PolygonCorners
    slack: np.ndarray
    strength: np.ndarray

    def energies(self, w: np.ndarray) -> np.ndarray:
        """The energy (k,) of every corner in a map w (n,) complex, infinite where r is not positive."""
        r = self._ratio(w)
        safe = np.where(r > 0, r, 1)
        return np.where(r > 0, self.strength * ((safe + 1 / safe) / 2 - 1), np.inf)

    def energy(self, w: np.ndarray) -> float:
        """The sum of the energies."""
        return float(self.energies(w).sum())

    def derivatives(self, w: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gradient (n,) complex; vertices and rows (k,3) of linear forms whose squares are the Gauss-Newton Hessian."""
        r, unit, t = self._ratio(w), self.corners.target + self.slack, self.corners.triangles
        q = w[t]
        across = 0.5j * (q[:, [2, 0, 1]] - q[:, [1, 2, 0]])
        slope = self.strength * (1 - 1 / r**2) / 2 / unit
        values = (slope[:, None] * across).ravel()
        sums = np.bincount(t.ravel(), values.real, len(w)) + 1j * np.bincount(t.ravel(), values.imag, len(w))
        return sums, t, np.sqrt(self.strength / r**3 / unit**2)[:, None] * across.conj()

    def limit(self, w: np.ndarray, step: np.ndarray) -> float:
        """Infinity: the line search sees to it."""
        return np.inf

    def _ratio(self, w):
        return (self.corners.areas(w) + self.slack) / (self.corners.target + self.slack)


def straight_share(sides: np.ndarray) -> np.ndarray:
    """The share (k,) of its polygon's area below which a corner is straight, by the number of sides (k,)."""
    return np.minimum(STRAIGHT, FLATTER * 4 * np.sin(np.pi / sides) ** 2 / sides)


def convex_corners(surface: Surface, straight: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """PolygonCorners of the polygons, of four and more, that have no reflex corner; the straight ones left out.

    straight : these, too, and those of polygons whose reflex corners are nearly straight.
    Triangles (k,3) of a corner of the surface, the next and the one before it; their polygons (k,), and their shares
    (k,) of the polygons' areas.
    """
    corner, polygon, share = zip(*corners_in_turn(surface, straight), strict=True)
    return np.concatenate(corner), np.concatenate(polygon), np.concatenate(share)


def corners_in_turn(surface: Surface, straight: bool) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """`convex_corners` of some polygons after the others: those of all take several times the memory of a mesh."""
    size = np.diff(surface.face_start)
    used = np.zeros(len(surface.positions), bool)
    used[surface.corner_vertex[np.repeat(size > 3, size)]] = True
    # Differences over an extent, so that neither place nor unit costs digits.
    extent = np.ptp(surface.positions[used] / 2, axis=0).max() if used.any() else 0.0
    unit = max(float(extent), float(np.finfo(float).tiny))
    for begin in range(0, max(len(size), 1), POLYGONS):
        yield _corners_of(surface, begin + np.arange(len(size[begin : begin + POLYGONS])), unit, straight)


def _corners_of(
    surface: Surface, faces: np.ndarray, unit: float, straight: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """`convex_corners` of some polygons (f,) that follow each other, in a unit."""
    size = surface.face_start[faces + 1] - surface.face_start[faces]
    polygon = np.repeat(np.arange(len(size)), size)
    here = np.flatnonzero(size[polygon] > 3)
    polygon = polygon[here]
    here += surface.face_start[faces[0]] if len(faces) else 0
    first, last = surface.face_start[faces[polygon]], surface.face_start[faces[polygon] + 1] - 1
    corner = np.column_stack([here, np.where(here == last, first, here + 1), np.where(here == first, last, here - 1)])

    def between(some, others):
        p, q = (surface.positions[surface.corner_vertex[x]] for x in (some, others))
        return (p / 2 - q / 2) / unit

    twice = cross3(between(corner[:, 0], first), between(corner[:, 1], corner[:, 0]))
    sums = np.column_stack([np.bincount(polygon, twice[:, k], len(size)) for k in range(3)])
    normal = sums[polygon]
    ear = cross3(between(corner[:, 1], corner[:, 0]), between(corner[:, 2], corner[:, 0]))
    share = (ear * normal).sum(1) / np.maximum((normal**2).sum(1), np.finfo(float).tiny)
    reflex = np.bincount(polygon, share < (-straight_share(size[polygon]) if straight else -SHARP), len(size)) > 0
    kept = ~reflex[polygon] & (straight | (share > SHARP))
    return corner[kept], faces[polygon[kept]], share[kept]
