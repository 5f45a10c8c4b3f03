"""Find where the two sides of a thin wall come apart: a shirt, a helmet, a vase, once they have a thickness.

Each is one body, with a border as narrow as it is thin. An artist cuts it along that border: what is within and what is
without are two islands, and neither has to be turned inside out.
"""

from __future__ import annotations

import numpy as np

from ..linalg.minimum_cut import capacities, least_cut
from ..mesh.geometry import dot3
from ..mesh.topology import graph_components
from .opposite import Faces

# A wall has so much of its area opposite to one another, in two parts of that share of it at least.
MOSTLY = 0.8
PART = 0.2
# A side goes on across a fold whose normals have more than that cosine.
SMOOTH = 0.5
# The border is no longer than so many times the side of a square with the area: around a square wall it is 2.8 of
# these.
LONGEST = 4.0
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
    faces = Faces.of(positions, triangles)
    if not faces.are_likely():
        return None
    is_opposite, joined, total = faces.opposite(), pair // 3, float(faces.area.sum())
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
