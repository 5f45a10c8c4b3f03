"""Curvature measures over bumps: hats of geodesic radius, and the curvature that two surfaces have under each.

Curvature of meshes converges as a measure, not point by point (Morvan 2008): `phi(B) = sum_v B(v) K(v)` with the angle
defects K, or the integrated mean curvature, under a bump B (B. Gu 2018, section 4). On the other surface B is taken at
the closest points of the first.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix, vstack
from scipy.sparse.csgraph import dijkstra

from ..mesh.geometry import face_areas
from ..mesh.topology import halfedges, pair_keys, paired
from ..progress import Progress, Steps

# Bumps over a surface, whose disks together have four times its area: everything is under some of them.
BUMPS = 200
# Radius of a bump, in those of disks that share the area evenly.
WIDTH = 2.0
# Centres between two looks at who waits.
ROUND = 20


@dataclass(frozen=True)
class Bumps:
    """Bumps (b,n) over the vertices of a surface, in [0, 1], sparse; their centres (b,), and their radius."""

    values: csr_matrix
    centres: np.ndarray
    radius: float


def bumps_of(V: np.ndarray, F: np.ndarray, count: int = BUMPS) -> Steps[Bumps]:
    """`count` bumps around vertices that are far from one another along the edges of V (n,3), F (m,3)."""
    edges = _edge_graph(V, F)
    radius = WIDTH * float(np.sqrt(face_areas(V, F).sum() / (count * np.pi)))
    first = int(np.nan_to_num(dijkstra(edges, indices=0), posinf=0).argmax())
    centres = [first]
    # Components that no path reaches come before everything else.
    near = np.nan_to_num(dijkstra(edges, indices=first), posinf=float(10 * np.linalg.norm(np.ptp(V, axis=0))))
    near[np.setdiff1d(np.arange(len(V)), F)] = -1
    while len(centres) < min(count, len(V)):
        if len(centres) % ROUND == 0:
            yield Progress("bumps", len(centres) / count)
        centres.append(int(near.argmax()))
        near = np.minimum(near, dijkstra(edges, indices=centres[-1], limit=float(near.max())))
    rows = []
    for part in _rounds(np.array(centres)):
        yield Progress("bumps", 1.0)
        distance = dijkstra(edges, indices=part, limit=radius)
        rows.append(csr_matrix(np.where(np.isfinite(distance), np.maximum(1 - distance / radius, 0), 0)))
    return Bumps(vstack(rows).tocsr(), np.array(centres), radius)


def curvature_error(of_first: np.ndarray, of_second: np.ndarray) -> float:
    """`sum |phi_A - phi_B| / sum |phi_A|` of the measures (b,) of two surfaces under the same bumps."""
    return float(np.abs(of_second - of_first).sum() / max(np.abs(of_first).sum(), 1e-300))


def _edge_graph(V: np.ndarray, F: np.ndarray) -> csr_matrix:
    """Lengths of the edges, both ways."""
    keys = np.unique(pair_keys(*halfedges(F)))
    a, b = paired(keys).T
    length = np.maximum(np.linalg.norm(V[a] - V[b], axis=1), 1e-300)
    n = len(V)
    return coo_matrix((np.tile(length, 2), (np.append(a, b), np.append(b, a))), shape=(n, n)).tocsr()


def _rounds(centres: np.ndarray) -> Iterator[np.ndarray]:
    """Centres, some at a time: distances to all vertices are dense for a moment."""
    yield from np.array_split(centres, max(len(centres) // ROUND, 1))
