"""Intrinsic triangulations as flat arrays, made Delaunay by vectorised edge flips.

            k                            k
          /   \\                        / | \\
        /   t   \\                    /   |   \\
       i --h---> j      flip h      i  t  |  s  j
        \\   s   /     --------->     \\   |   /
          \\   /                        \\ | /
            l                            l

A flip keeps the metric (`euclidean_diagonal`) or the discrete conformal class (`ptolemy_diagonal`).
A triangulation may become a Delta-complex: several edges between the same two vertices are fine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .errors import PrecisionError
from .geometry import halfedge_lengths
from .topology import next_halfedge, previous_halfedge, twins

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
    """Log length of kl by Ptolemy's relation (Springborn et al. 2008, eq. 19; Gillespie et al. 2021, eq. 4)."""
    return np.logaddexp(jk + il, ki + lj) - ij


def euclidean_diagonal(jk, ki, il, lj, ij):
    """Log length of kl after unfolding both triangles into the plane."""
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
    flip_in_place(triangles, twin, log_length, h, diagonal)
    return IntrinsicTriangulation(triangles, twin, log_length)


def flip_in_place(triangles, twin, log_length, h, diagonal: Diagonal) -> None:
    """As `flip`, overwriting the three arrays."""
    flat = triangles.reshape(-1)
    g = twin[h]
    jk, ki, il, lj = next_halfedge(h), previous_halfedge(h), next_halfedge(g), previous_halfedge(g)
    i, j, k, opposite = flat[h], flat[g], flat[ki], flat[lj]
    new_length = diagonal(log_length[jk], log_length[ki], log_length[il], log_length[lj], log_length[h])
    t, s = h // 3, g // 3

    old = np.concatenate([il, ki, jk, lj])
    new = np.concatenate([3 * t, 3 * t + 2, 3 * s, 3 * s + 2])
    moved_twin, moved_length = twin[old], log_length[old]
    # An outer twin may itself lie in a triangle that is rebuilt in this round.
    lookup = np.concatenate([new, [-1]])
    order = np.argsort(old)
    place = order[np.minimum(np.searchsorted(old[order], moved_twin), len(old) - 1)]
    moved_twin = np.where(old[place] == moved_twin, lookup[place], moved_twin)

    triangles[t] = np.stack([i, opposite, k], axis=1)
    triangles[s] = np.stack([j, k, opposite], axis=1)
    twin[new], log_length[new] = moved_twin, moved_length
    inner = moved_twin >= 0
    twin[moved_twin[inner]] = new[inner]
    twin[3 * t + 1], twin[3 * s + 1] = 3 * s + 1, 3 * t + 1
    log_length[3 * t + 1] = log_length[3 * s + 1] = new_length


def make_delaunay(
    tri: IntrinsicTriangulation,
    diagonal: Diagonal,
    u: np.ndarray | None = None,
    tolerance: float = 1e-11,
    max_rounds: int = 1000,
) -> tuple[IntrinsicTriangulation, int]:
    """Flip until cos + cos >= 0 holds at every interior edge of the metric scaled by u (n,).

    A round flips an independent set: an edge is taken when it is the worst in both of its triangles;
    the next round looks only at edges of touched triangles. Returns the triangulation and the number
    of flips. Raises PrecisionError if the rounds do not end.
    """
    triangles, twin, log_length = tri.triangles.copy(), tri.twin.copy(), tri.log_length.copy()
    if u is None:
        u = np.zeros(int(triangles.max()) + 1)
    edges = np.flatnonzero(twin > np.arange(len(twin)))
    flips = 0
    for _ in range(max_rounds):
        chosen, waiting = _worst_independent(triangles, twin, log_length, u, edges, tolerance)
        if len(chosen) == 0:
            return IntrinsicTriangulation(triangles, twin, log_length), flips
        touched = np.concatenate([chosen // 3, twin[chosen] // 3])
        flip_in_place(triangles, twin, log_length, chosen, diagonal)
        flips += len(chosen)
        # Halfedges of touched triangles have new meanings; those that lost their turn elsewhere keep theirs.
        again = np.concatenate([(3 * touched[:, None] + np.arange(3)).ravel(), waiting])
        again = again[twin[again] >= 0]
        edges = np.unique(np.minimum(again, twin[again]))
    raise PrecisionError("The intrinsic Delaunay triangulation does not settle")


def _worst_independent(triangles, twin, log_length, u, edges, tolerance):
    """Edges that violate the Delaunay condition and are the worst in both their triangles, and the other bad ones."""
    flat = triangles.reshape(-1)
    t, s = edges // 3, twin[edges] // 3
    cosine = _edge_cosine(flat, log_length, u, edges) + _edge_cosine(flat, log_length, u, twin[edges])
    bad = (cosine < -tolerance) & (t != s)
    edges, t, s = edges[bad], t[bad], s[bad]
    rank = np.empty(len(edges), dtype=np.int64)
    rank[np.argsort(cosine[bad], kind="stable")] = np.arange(len(edges))
    worst = np.full(len(triangles), len(edges), dtype=np.int64)
    np.minimum.at(worst, t, rank)
    np.minimum.at(worst, s, rank)
    first = (worst[t] == rank) & (worst[s] == rank)
    return edges[first], edges[~first]


def _edge_cosine(flat, log_length, u, h):
    """Cosine opposite to the halfedges h in the scaled metric."""
    n, p = next_halfedge(h), previous_halfedge(h)
    i, j, k = u[flat[h]], u[flat[n]], u[flat[p]]
    side = np.stack([log_length[h] + i + j, log_length[n] + j + k, log_length[p] + k + i], axis=1)
    return opposite_cosines(side.ravel())[::3]


def split_boundary_edge(tri: IntrinsicTriangulation, loop: np.ndarray, n: int):
    """Put a vertex n in the middle of the longest boundary edge; returns the triangulation and the new loop."""
    rim = np.flatnonzero(tri.twin < 0)
    h = rim[np.argmax(tri.log_length[rim])]
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
