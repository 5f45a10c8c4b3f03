"""Choose the diagonals that quads are cut along, whichever they came with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..mesh.geometry import bounds, cross3, lengths, part_by_part
from ..mesh.polygon_areas import quads
from ..mesh.surface import Surface
from ..mesh.topology import distinct, pair_keys

# Share of a quad's area that the triangle at each of its corners needs for the quad to be cut anew.
LEAST_CORNER = 1e-3
# Triangles from which on a surface that is cut anew numbers their corners in half of the memory.
MANY = 100_000


def shorter_diagonals(vertices: np.ndarray, quads: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Quads (q,4) turned so that the diagonal from the first to the third corner is the shorter one that may be cut.

    vertices (n,3) in units in which neither areas nor their squares under- or overflow; triangles (m,3): of the mesh
    """
    turned = longer_diagonals(vertices, quads, triangles)
    cut = np.where(turned[:, None], np.roll(quads, -1, axis=1), quads)
    # From the lower of the ends of the diagonal on, however the quad came.
    return np.where((cut[:, 2] < cut[:, 0])[:, None], np.roll(cut, 2, axis=1), cut)


def longer_diagonals(vertices: np.ndarray, quads: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Which quads (q,4), cut from the first to the third corner, shall be cut along their other diagonal, (q,) bool.

    A diagonal between vertices that an edge joins would double that edge, and so would one that two quads have, around
    a vertex that only they share: those take their other ones. vertices, triangles: see `shorter_diagonals`
    """
    # Between equal ones the first corner in space decides.
    first = np.lexsort(vertices.T[::-1])
    rank = np.empty(len(vertices), np.int64)
    rank[first] = np.arange(len(vertices))
    convex, longer = part_by_part(lambda some: _convex_and_longer(vertices, some, rank), quads).T
    return _undoubled(quads, convex & longer, convex, triangles)


def _convex_and_longer(vertices: np.ndarray, quads: np.ndarray, rank: np.ndarray) -> np.ndarray:
    """Which quads (q,4) are convex, and of which the diagonal from the first corner is the longer one, (q,2) bool; of
    equal ones a corner of the least rank (n,) decides."""
    p = vertices[quads]
    length = lengths(p[:, [0, 1]] - p[:, [2, 3]])
    normal = cross3(p[:, [1, 2, 3, 0]] - p, p[:, [3, 0, 1, 2]] - p)
    own = cross3(p[:, 2] - p[:, 0], p[:, 3] - p[:, 1])
    # A triangle next to a corner that is nearly straight is a sliver: if it was given, the map has to keep it open.
    convex = (np.einsum("qkd,qd->qk", normal, own) > LEAST_CORNER * (own**2).sum(axis=1)[:, None]).all(axis=1)
    equal = np.abs(length[:, 1] - length[:, 0]) <= 1e-9 * length.max(axis=1)
    turned = np.where(equal, rank[quads].argmin(axis=1) % 2 == 1, length[:, 1] < length[:, 0])
    return np.column_stack([convex, turned])


def cut_along_shorter(surface: Surface) -> Surface:
    """The surface with its convex quads cut along their shorter diagonals, in the rows of triangles that they had.

    Which way an importer, or a modeller, has cut them then plays no part.
    """
    triangles, owner = surface.corner_vertex[surface.triangles], surface.triangle_face
    if not len(triangles):
        return surface
    places = quads(triangles, distinct(owner)[1])
    used, given = distinct(triangles.ravel()[places])
    points = surface.positions[used]
    if not len(used) or not np.isfinite(points).all():
        return surface
    low, high = (corner / 2 for corner in bounds(points))
    points = (points / 2 - low) / max(float((high - low).max()), float(np.finfo(float).tiny))
    number = np.full(len(surface.positions), -1)
    number[used] = np.arange(len(used))
    # Vertices of no quad are as good as any that no diagonal joins.
    others = np.where(number[triangles] < 0, len(used) + triangles, number[triangles])
    turned = longer_diagonals(points, given.reshape(-1, 4), others)
    if not turned.any():
        return surface
    # It is kept beside the one that was given.
    kept = np.int32 if len(owner) > MANY else np.int64
    corners, cut = surface.triangles.ravel()[places[turned]], surface.triangles.astype(kept)
    cut[places[turned, 0] // 3], cut[places[turned, 1] // 3] = corners[:, [0, 1, 3]], corners[:, [1, 2, 3]]
    return replace(surface, triangles=cut)


def _undoubled(quads: np.ndarray, turned: np.ndarray, free: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Which quads (q,4) to turn, (q,) bool, those that would rather be turned, but for diagonals that double an edge.

    free (q,) bool: those that may be turned. The choice does not depend on the diagonals that they came with, where
    these double no edge.
    """
    keys = np.column_stack([pair_keys(quads[:, 0], quads[:, 2]), pair_keys(quads[:, 1], quads[:, 3])])
    edges, count = np.unique(pair_keys(triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()), return_counts=True)
    # What is left of the edges without the diagonals that may go.
    np.subtract.at(count, np.searchsorted(edges, keys[free, 0]), 2)
    taken, every = edges[count > 0], np.arange(len(quads))
    wish = keys[every, turned.astype(int)]
    # One that two quads could have, around a vertex that only they share, is for neither: one of them is reflex there.
    shared, count = np.unique(keys, return_counts=True)
    doubled = np.isin(wish, taken) | np.isin(wish, shared[count > 1])
    turned = np.where(free & doubled, ~turned, turned)
    found = keys[every, turned.astype(int)]
    # Who draws two quads with the same diagonal sees one of them folded: they are mapped apart.
    drawn = np.isin(keys[:, 0], taken) | _several(keys[:, 0])
    return turned & ~drawn & ~(np.isin(found, taken) | _several(found))


def _several(keys: np.ndarray) -> np.ndarray:
    """Which of the keys (k,) are there more than once, (k,) bool."""
    _, label, count = np.unique(keys, return_inverse=True, return_counts=True)
    return count[label.ravel()] > 1
