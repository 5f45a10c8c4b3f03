"""Cut a triangle mesh open along seams, and walk on it to nearest points without crossing them.

Values such as UVs jump across seams, also where both sides belong to one island. A point on a seam has a value for
every side, and which one is meant is answered by walking to the point from a place that is on one side for certain.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from .closest_point import closest_on_triangles
from .topology import expand, graph_components, halfedges, next_halfedge, pair_keys, pair_up, twins

# Steps of a walk at most, from one triangle to the next.
MOST_ROUNDS = 200
# Entries of the distances that are searched at a time, for memory.
MOST_CELLS = 5_000_000
# A way without a seam that is longer by this leads round the end of one.
DETOUR = 1.2
# Coordinates below this count as zero: the point is on an edge, or in a corner.
ON_EDGE = 1e-7


@dataclass(frozen=True)
class CutMesh:
    """Positions (n,3), triangles (m,3) of a mesh, and the same triangles `sides` (m,3) with seam vertices apart.

    seam (3m,): which halfedges are seams; star (s,m): the triangles around every vertex of `sides`.
    """

    positions: np.ndarray
    triangles: np.ndarray
    sides: np.ndarray
    seam: np.ndarray
    star: csr_matrix


def cut_open(positions: np.ndarray, triangles: np.ndarray, seams: np.ndarray) -> CutMesh:
    """Cut a mesh (n,3), (m,3) along seams (k,2), pairs of vertices."""
    tail, head = halfedges(triangles)
    key = pair_keys(tail, head)
    seam = np.isin(key, pair_keys(seams[:, 0], seams[:, 1]))
    joined = np.flatnonzero(~seam)
    first, second = pair_up(key[joined])
    f, s = joined[first], joined[second]
    # Neighbours that look to opposite sides run along their edge in the same direction.
    same = tail[f] == tail[s]
    rows = np.concatenate([f, next_halfedge(f)])
    columns = np.concatenate([np.where(same, s, next_halfedge(s)), np.where(same, next_halfedge(s), s)])
    c = len(tail)
    count, label = graph_components(rows, columns, c)
    owner = np.arange(c) // 3
    star = csr_matrix((np.ones(c), (label, owner)), shape=(count, len(triangles)))
    sides = label.reshape(-1, 3).astype(np.int64)
    return CutMesh(positions=positions, triangles=triangles, sides=sides, seam=seam, star=star)


def seam_points(mesh: CutMesh, spacing: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (s,3) along the seams, no farther apart than `spacing`, and the halfedge (s,) of each."""
    tail, head = halfedges(mesh.triangles)
    h = np.flatnonzero(mesh.seam)
    a, b = mesh.positions[tail[h]], mesh.positions[head[h]]
    count = np.clip(np.ceil(np.linalg.norm(b - a, axis=1) / spacing), 1, 1000).astype(np.int64)
    which, place = expand(count)
    t = (place + 0.5) / count[which]
    return a[which] + t[:, None] * (b - a)[which], h[which]


def on_seam(mesh: CutMesh, faces: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
    """Whether points (k,) given by triangle and barycentric coordinates (k,3) lie on a seam, (k,) bool."""
    zero = barycentric <= ON_EDGE
    # Halfedge j is where the coordinate of the corner j + 2 is zero.
    edge = (zero[:, [2, 0, 1]] & mesh.seam.reshape(-1, 3)[faces]).any(axis=1)
    tail, head = halfedges(mesh.triangles)
    seam_vertex = np.zeros(len(mesh.positions), dtype=bool)
    seam_vertex[tail[mesh.seam]] = seam_vertex[head[mesh.seam]] = True
    corner = barycentric.argmax(axis=1)
    at_vertex = (zero.sum(axis=1) == 2) & seam_vertex[mesh.triangles[faces, corner]]
    return edge | at_vertex


def descend(mesh: CutMesh, points: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From triangles (k,) as near to points (k,3) as one comes without crossing a seam: triangle (k,), distance (k,).

    A step goes to the nearest of all triangles that share a vertex, for as long as that is nearer.
    """
    faces = start.astype(np.int64)
    distance = _distance(mesh, points, faces)
    active = np.arange(len(points))
    for _ in range(MOST_ROUNDS):
        if len(active) == 0:
            break
        query, around = _stars(mesh, faces[active])
        d = _distance(mesh, points[active[query]], around)
        order = np.lexsort([d, query])
        best = order[np.r_[True, np.diff(query[order]) > 0]]
        better = d[best] < distance[active] * (1 - 1e-9)
        active, best = active[better], best[better]
        faces[active], distance[active] = around[best], d[best]
    return faces, distance


def are_across_seams(
    mesh: CutMesh, start: np.ndarray, end: np.ndarray, limit: np.ndarray, slack: np.ndarray
) -> np.ndarray:
    """Whether seams lie between triangles (k,) and (k,): a way over the faces without a seam is longer than one with.

    For descents that stopped in a valley: on a curved surface the way may first lead away. limit (k,): longest way
    that counts; slack (k,): how much longer a way without a seam may be
    """
    free, any_way = _dual(mesh, mesh.sides), _dual(mesh, mesh.triangles)
    result = np.ones(len(start), dtype=bool)
    # A search has a row as long as the mesh; only so many at a time.
    for part in np.array_split(np.arange(len(start)), len(start) * len(mesh.triangles) // MOST_CELLS + 1):
        if len(part):
            reach, rows = float(limit[part].max()), np.arange(len(part))
            without = dijkstra(free, indices=start[part], limit=reach)[rows, end[part]]
            across = dijkstra(any_way, indices=start[part], limit=reach)[rows, end[part]]
            result[part] = ~(without <= DETOUR * across + slack[part]) | ~np.isfinite(without)
    return result


def _dual(mesh: CutMesh, triangles: np.ndarray) -> csr_matrix:
    """Distances (m,m) between the centres of triangles that share an edge."""
    twin = twins(triangles)
    inner = np.flatnonzero(twin >= 0)
    rows, columns = inner // 3, twin[inner] // 3
    centre = mesh.positions[mesh.triangles].mean(axis=1)
    length = np.linalg.norm(centre[rows] - centre[columns], axis=1)
    return csr_matrix((length, (rows, columns)), shape=(len(triangles),) * 2)


def _stars(mesh: CutMesh, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All triangles that share a vertex with each of `faces` (k,): pairs of index into `faces` and triangle."""
    rows = mesh.sides[faces].ravel()
    begin, size = mesh.star.indptr[rows].astype(np.int64), np.diff(mesh.star.indptr)[rows].astype(np.int64)
    row, place = expand(size)
    return row // 3, mesh.star.indices[begin[row] + place].astype(np.int64)


def _distance(mesh: CutMesh, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Distance (k,) of points (k,3) from triangles (k,)."""
    corners = mesh.positions[mesh.triangles[faces]]
    b = closest_on_triangles(points, corners[:, 0], corners[:, 1], corners[:, 2])
    return np.linalg.norm(np.einsum("kc,kcj->kj", b, corners) - points, axis=1)
