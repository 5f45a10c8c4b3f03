"""Tell a sheet with a thickness by its faces, which have others a little beneath them that look the other way, and find
where its two sides come apart.

A shirt, a helmet or a vase that was solidified is one body, with a border as narrow as it is thin. An artist cuts it
along that border: what is within and what is without are two islands, and neither has to be turned inside out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..linalg.minimum_cut import capacities, least_cut
from ..mesh.geometry import dot3, face_areas, face_normals, lengths
from ..mesh.topology import graph_components

# What is opposite is beneath a face by less than this share of the side of a square with the area of the body, looks
# the other way by that cosine at least, and is no farther aside than it is beneath, but for so many sides of a face.
THIN = 0.1
AGAINST = 0.8
ASIDE = 1.5
# Either is so many times as far as the other one at most.
EVEN = 2.0
# Of places that are as near, those whose normals differ by 1 are farther by this share of the same side.
TURNED = 0.5
# A wall has so much of its area opposite to one another, in two parts of that share of it at least.
MOSTLY = 0.8
PART = 0.2
# Of so many faces nearly as many are, or no others are looked at; these are sought among so many.
SAMPLES = 64
LIKELY = 0.6
SOUGHT = 20_000
# The border is no longer than so many times the side: around a square sheet it is 2.8 of these.
LONGEST = 4.0
# A side goes on across a fold whose normals have more than that cosine.
SMOOTH = 0.5
# Edges of the larger side count so many times, which keeps all of a border with it, and those within polygons.
BESIDE = 1.25
WITHIN = 1e3


def wall_edges(
    positions: np.ndarray, triangles: np.ndarray, pair: np.ndarray, length: np.ndarray, within: np.ndarray
) -> np.ndarray | None:
    """Edges (e,) bool along which a body (n,3), (m,3) that is a thin wall comes apart into its two sides, beside its
    border or across it where that is shorter; None of any other body.

    pair (e,2) : both halfedges of its inner edges, their lengths (e,), and which lie within polygons (e,) bool

    >>> import numpy as np
    >>> V = np.array([[x, y, z] for z in (0.0, 0.1) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    >>> quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    >>> F = np.array([[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)])
    >>> from omt_uv.solver.mesh.topology import halfedges, twins
    >>> pair = np.array([[h, t] for h, t in enumerate(twins(F)) if h < t])
    >>> ends = np.stack(halfedges(F), axis=1)[pair[:, 0]]
    >>> length = np.linalg.norm(V[ends[:, 0]] - V[ends[:, 1]], axis=1)
    >>> float(length[wall_edges(V, F, pair, length, length > 1.2)].sum())
    4.0
    """
    faces = _Faces.of(positions, triangles)
    if not faces.are_likely():
        return None
    beneath, is_opposite = faces.opposite(np.arange(len(triangles)), np.arange(len(triangles)))
    # Beneath the border there may be a bend of the wall, whose other side is nearer to it than the border is.
    far = lengths(faces.middle[beneath] - faces.middle)
    is_opposite &= far <= EVEN * far[beneath]
    joined, total = pair // 3, float(faces.area.sum())
    smooth = dot3(faces.normal[joined[:, 0]], faces.normal[joined[:, 1]]) > SMOOTH
    both = joined[is_opposite[joined].all(axis=1) & smooth]
    part = graph_components(both[:, 0], both[:, 1], len(triangles))[1]
    share = np.bincount(part, faces.area * is_opposite) / total
    sides = np.flatnonzero(share >= PART)
    if len(sides) != 2 or share[sides].sum() < MOSTLY:
        return None
    one, other = (np.flatnonzero(is_opposite & (part == k)) for k in sides[np.argsort(share[sides], kind="stable")])
    price = np.where(within, WITHIN * length.max(), length)
    price[np.isin(joined, other).any(axis=1)] *= BESIDE
    here = least_cut(joined, capacities(price), len(triangles), one, other)[joined]
    edges = here[:, 0] != here[:, 1]
    return edges if length[edges].sum() <= LONGEST * np.sqrt(total) else None


@dataclass(frozen=True)
class _Faces:
    """Middles (m,3), unit normals (m,3), areas (m,) and sides (m,) of the faces of a body."""

    middle: np.ndarray
    normal: np.ndarray
    area: np.ndarray
    size: np.ndarray

    @staticmethod
    def of(positions: np.ndarray, triangles: np.ndarray) -> _Faces:
        area = face_areas(positions, triangles)
        return _Faces(positions[triangles].mean(axis=1), face_normals(positions, triangles), area, np.sqrt(area))

    def are_likely(self) -> bool:
        """Whether most of a few faces, each for as much of the area, have others opposite."""
        count = min(SAMPLES, len(self.area))
        reached = np.cumsum(self.area)
        chosen = np.searchsorted(reached, (np.arange(count) + 0.5) / count * reached[-1])
        step = -(-len(self.area) // SOUGHT)
        among = np.arange(0, len(self.area), step)
        return bool(self.opposite(np.minimum(chosen, len(self.area) - 1), among, step)[1].mean() >= LIKELY)

    def opposite(self, rows: np.ndarray, among: np.ndarray, step: int = 1) -> tuple[np.ndarray, np.ndarray]:
        """For faces rows (k,) the one of `among` (a,), every so many of them, that is nearest to being opposite (k,),
        and whether it is (k,) bool."""
        side = float(np.sqrt(self.area.sum()))
        tree = cKDTree(np.hstack([self.middle[among], TURNED * side * self.normal[among]]))
        found = among[tree.query(np.hstack([self.middle[rows], -TURNED * side * self.normal[rows]]))[1]]
        way, normal = self.middle[found] - self.middle[rows], self.normal[rows]
        beneath = -dot3(way, normal)
        aside = lengths(way + beneath[:, None] * normal)
        room = ASIDE * np.sqrt(step) * np.maximum(self.size[rows], self.size[found])
        is_beneath = (beneath > 0) & (beneath < THIN * side) & (aside <= beneath + room)
        return found, is_beneath & (dot3(normal, self.normal[found]) < -AGAINST)
