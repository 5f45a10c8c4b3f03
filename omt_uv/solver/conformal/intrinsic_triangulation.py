"""Make intrinsic triangulations Delaunay, by edge flips in parallel (Bobenko, Springborn 2007).

A flip keeps the metric (`euclidean_diagonal`) or the discrete conformal class (`ptolemy_diagonal`); see the picture in
`mesh/edge_flips.py`. A triangulation may become a Delta-complex: several edges between the same two vertices are fine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..errors import PrecisionError
from ..mesh.edge_flips import flip_in_place, flip_until_none
from ..mesh.geometry import halfedge_lengths
from ..mesh.topology import next_halfedge, previous_halfedge, twins

Diagonal = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], np.ndarray]


@dataclass(frozen=True)
class IntrinsicTriangulation:
    """Triangles (m,3), twin halfedges (3m,) with -1 on the boundary, log of the lengths (3m,)."""

    triangles: np.ndarray
    twin: np.ndarray
    log_length: np.ndarray

    def scaled(self, u: np.ndarray) -> np.ndarray:
        """Log lengths (3m,) under the conformal factors u (n,): log l + u_i + u_j."""
        factor = u[self.triangles]
        return self.log_length + (factor + factor[:, [1, 2, 0]]).ravel()


def from_mesh(positions: np.ndarray, triangles: np.ndarray) -> IntrinsicTriangulation:
    """The triangulation of a mesh (positions (n,3), triangles (m,3)) with its Euclidean edge lengths."""
    length = halfedge_lengths(positions, triangles)
    return IntrinsicTriangulation(triangles.copy(), twins(triangles), np.log(length))


def ptolemy_diagonal(jk, ki, il, lj, ij):
    """Log length (k,) of kl by Ptolemy's relation, from those of the other sides: l_kl l_ij = l_jk l_il + l_ki l_lj.

    Springborn et al. 2008, eq. 19; Gillespie et al. 2021, eq. 4.
    """
    return np.logaddexp(jk + il, ki + lj) - ij


def euclidean_diagonal(jk, ki, il, lj, ij):
    """Log length (k,) of kl, from those of the other sides, after unfolding both triangles into the plane."""
    jk, ki, il, lj = (np.exp(x - ij) for x in (jk, ki, il, lj))
    xk, xl = (ki**2 - jk**2 + 1) / 2, (il**2 - lj**2 + 1) / 2
    yk, yl = np.sqrt(np.maximum(ki**2 - xk**2, 0)), np.sqrt(np.maximum(il**2 - xl**2, 0))
    return np.log(np.hypot(xk - xl, yk + yl)) + ij


def opposite_cosines(log_length: np.ndarray) -> np.ndarray:
    """Law of cosines opposite to every halfedge, (3m,), of log lengths (3m,).

    Where the triangle inequality fails, the value leaves [-1, 1]; the Delaunay test still holds.
    """
    side = log_length.reshape(-1, 3)
    side = np.exp(side - side.max(axis=1)[:, None])
    a, b, c = side, side[:, [1, 2, 0]], side[:, [2, 0, 1]]
    # Written with (b - c)^2, so that a needle's small angle does not cancel.
    return (1 + ((b - c) ** 2 - a**2) / (2 * b * c)).ravel()


def flip(tri: IntrinsicTriangulation, h: np.ndarray, diagonal: Diagonal) -> IntrinsicTriangulation:
    """Flip the interior halfedges h (k,), no two of which may share a triangle; returns a new triangulation.

    `diagonal` gets the log lengths jk, ki, il, lj, ij. Ptolemy's rule commutes with conformal scaling;
    the Euclidean one must be applied to the unscaled metric.
    """
    triangles, twin, log_length = tri.triangles.copy(), tri.twin.copy(), tri.log_length.copy()
    flip_metric_in_place(triangles, twin, log_length, h, diagonal)
    return IntrinsicTriangulation(triangles, twin, log_length)


def flip_metric_in_place(triangles, twin, log_length, h, diagonal: Diagonal) -> None:
    """As `flip`, overwriting the arrays; the new edges are the halfedges 3t + 1 of the triangles t on both sides."""
    g = twin[h]
    around = (next_halfedge(h), previous_halfedge(h), next_halfedge(g), previous_halfedge(g), h)
    new_length = diagonal(*(log_length[e] for e in around))
    flip_in_place(triangles, twin, h, log_length)
    log_length[3 * (h // 3) + 1] = log_length[3 * (g // 3) + 1] = new_length


def make_delaunay(
    tri: IntrinsicTriangulation,
    diagonal: Diagonal,
    u: np.ndarray | None = None,
    tolerance: float = 1e-11,
    max_rounds: int = 1000,
) -> tuple[IntrinsicTriangulation, int]:
    """Flip until cos + cos >= 0 holds at every interior edge of the metric scaled by u (n,).

    Returns the triangulation and the number of flips. Raises PrecisionError if the rounds do not end.
    """
    triangles, twin, log_length = tri.triangles.copy(), tri.twin.copy(), tri.log_length.copy()
    if u is None:
        u = np.zeros(int(triangles.max()) + 1)
    flat = triangles.reshape(-1)

    def violation(edges):
        return edge_cosines(flat, log_length, u, edges) + edge_cosines(flat, log_length, u, twin[edges]) + tolerance

    def flip_edges(edges):
        flip_metric_in_place(triangles, twin, log_length, edges, diagonal)

    flips, settled = flip_until_none(twin, violation, flip_edges, max_rounds)
    if not settled:
        raise PrecisionError("The intrinsic Delaunay triangulation does not settle")
    return IntrinsicTriangulation(triangles, twin, log_length), flips


def edge_cosines(flat, log_length, u, h):
    """Cosines (k,) opposite to the halfedges h (k,) in the metric scaled by u (n,)."""
    n, p = next_halfedge(h), previous_halfedge(h)
    i, j, k = u[flat[h]], u[flat[n]], u[flat[p]]
    side = np.stack([log_length[h] + i + j, log_length[n] + j + k, log_length[p] + k + i], axis=1)
    return opposite_cosines(side.ravel())[::3]


def split_boundary_edge(tri: IntrinsicTriangulation, loop: np.ndarray, n: int):
    """Put vertex number n in the middle of the longest boundary edge; the triangulation and the new loop (b+1,)."""
    boundary = np.flatnonzero(tri.twin < 0)
    h = boundary[np.argmax(tri.log_length[boundary])]
    after, before = next_halfedge(h), previous_halfedge(h)
    i, j, k = tri.triangles.ravel()[[h, after, before]]
    ij, jk, ki = np.exp(tri.log_length[[h, after, before]])
    median = 0.5 * np.log(np.maximum(2 * jk**2 + 2 * ki**2 - ij**2, 0) / 4)
    m = len(tri.triangles)
    triangles = np.concatenate([tri.triangles, [[n, j, k]]])
    triangles.reshape(-1)[after] = n
    twin = np.concatenate([tri.twin, [-1, tri.twin[after], after]])
    if tri.twin[after] >= 0:
        twin[tri.twin[after]] = 3 * m + 1
    twin[after] = 3 * m + 2
    half = np.log(ij / 2)
    log_length = np.concatenate([tri.log_length, [half, np.log(jk), median]])
    log_length[h], log_length[after] = half, median
    place = int(np.flatnonzero(loop == i)[0])
    return IntrinsicTriangulation(triangles, twin, log_length), np.insert(loop, place + 1, n)
