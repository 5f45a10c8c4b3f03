"""Double a disk: two mirrored copies glued along the boundary, a closed surface (Gu, Luo, Sun, Wu 2018).

A boundary edge cannot flip, so a flow on the disk alone breaks where such an edge grows too long. In the
double it flips like any other, and by symmetry the boundary stays the mirror line (Campen, Capouellez, Shen, Zhu,
Panozzo, Zorin 2021).
"""

from __future__ import annotations

import numpy as np

from ..mesh.topology import graph_components, halfedges
from .intrinsic_triangulation import IntrinsicTriangulation

# The mirrored triangle (b, a, c) of (a, b, c) runs through its halfedges in this order.
MIRRORED = np.array([0, 2, 1])


def double_disk(tri: IntrinsicTriangulation, loop: np.ndarray, n: int) -> tuple[IntrinsicTriangulation, np.ndarray]:
    """Double of a disk with n vertices and boundary loop (b,): the triangulation and the owner (2n-b,).

    Vertices 0 ... n-1 are the disk's; every inner vertex has a mirror image behind them. owner[v] is the
    vertex of the disk that v is, or mirrors.
    """
    m = len(tri.triangles)
    inside = np.ones(n, dtype=bool)
    inside[loop] = False
    mirror = np.where(inside, n - 1 + np.cumsum(inside), np.arange(n))
    owner = np.concatenate([np.arange(n), np.flatnonzero(inside)])
    h = np.arange(3 * m)
    image = 3 * m + 3 * (h // 3) + MIRRORED[h % 3]
    twin = np.where(tri.twin >= 0, tri.twin, image)
    mirrored_twin, mirrored_length = np.empty_like(twin), np.empty_like(tri.log_length)
    mirrored_twin[image - 3 * m] = np.where(tri.twin >= 0, image[tri.twin], h)
    mirrored_length[image - 3 * m] = tri.log_length
    doubled = IntrinsicTriangulation(
        np.concatenate([tri.triangles, mirror[tri.triangles][:, [1, 0, 2]]]),
        np.concatenate([twin, mirrored_twin]),
        np.concatenate([tri.log_length, mirrored_length]),
    )
    return doubled, owner


def crossed_segment(tri: IntrinsicTriangulation, loop: np.ndarray, n: int) -> np.ndarray:
    """Boundary segment that every halfedge of a doubled triangulation crosses, (3m,), -1 where none.

    Segment s runs from loop[s] to loop[s+1]. Edges that cross one segment pass through a strip of
    triangles, whose two ends have the segment's end points as vertices.
    """
    count = int(tri.triangles.max()) + 1
    side = np.ones(count)
    side[n:] = -1
    side[loop] = 0
    tail, head = halfedges(tri.triangles)
    crossing = side[tail] * side[head] < 0
    segment = np.full(len(tail), -1, dtype=np.int64)
    h = np.flatnonzero(crossing)
    if len(h) == 0:
        return segment
    m = len(tri.triangles)
    strip = graph_components(h // 3, tri.twin[h] // 3, m)[1]
    place = np.full(count, -1, dtype=np.int64)
    place[loop] = np.arange(len(loop))
    corner = place[tri.triangles[h // 3]]
    label = np.repeat(strip[h // 3], 3)[corner.ravel() >= 0]
    corner = corner.ravel()[corner.ravel() >= 0]
    low, high = np.full(m, len(loop), dtype=np.int64), np.full(m, -1, dtype=np.int64)
    np.minimum.at(low, label, corner)
    np.maximum.at(high, label, corner)
    # The last segment joins the end of the loop to its beginning.
    of_strip = np.where(high - low == 1, low, len(loop) - 1)
    segment[h] = of_strip[strip[h // 3]]
    return segment
