"""Flatten a sphere without one of its vertices, by dynamic Yamabe flow (Springborn, Schroeder, Pinkall 2008).

Scaled by u_v -> infinity, the triangles around the vertex v become half-strips: their sides at v must be equal, so the
neighbours j of v are held at u_j = -log l_vj, and the rest becomes a flat polygon (Springborn, Schroeder, Pinkall
2008; Springborn 2020; Gillespie, Springborn, Crane 2021). A side of the polygon is Delaunay while the triangle on it
satisfies the triangle inequality; where it does not, the edge flips like any other, and the vertex behind it joins
the boundary, at just the scale that it must have there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..errors import PrecisionError
from ..linalg.sparse import solve_spd
from ..mesh.edge_flips import flip_until_none
from ..mesh.geometry import angles_from_lengths, cotangents_from_lengths, laplacian_from_weights
from ..mesh.topology import boundary_loops, halfedges, next_halfedge, pair_keys, paired, previous_halfedge
from ..progress import Progress, Steps
from .intrinsic_triangulation import IntrinsicTriangulation, edge_cosines, flip_metric_in_place, ptolemy_diagonal

TOLERANCE = 1e-10  # largest error of an angle sum, radians
MAX_STEPS = 60
# Scales further apart than this put neighbours of the plane closer together than double precision resolves.
MAX_LOG_SCALE = 40.0
MAX_ROUNDS = 1000  # of edge flips
FLIP_TOLERANCE = 1e-11  # an edge flips where its two opposite cosines sum to less than minus this


@dataclass(frozen=True)
class FlatPolygon:
    """The plane without a neighbourhood of infinity.

    Attributes
    ----------
    triangulation : all triangles, those at the puncture included
    inner : (m,) bool, the triangles that are not at the puncture
    length : (m,3) sides of the triangles, of use for inner ones
    log_scale : (n,)
    boundary : (b,) neighbours of the puncture in counter-clockwise order
    side_length : (b,) of the polygon's side that begins at each of them
    angle : (b,) of the polygon there, in radians
    residual : largest error of an angle sum, in radians
    iterations, flips : Newton steps, and edges flipped
    """

    triangulation: IntrinsicTriangulation
    inner: np.ndarray
    length: np.ndarray
    log_scale: np.ndarray
    boundary: np.ndarray
    side_length: np.ndarray
    angle: np.ndarray
    residual: float
    iterations: int
    flips: int


def flatten_punctured_sphere(tri: IntrinsicTriangulation, puncture: int) -> Steps[FlatPolygon]:
    """Scale a sphere (n vertices, closed and Delaunay) conformally to a flat polygon, with one vertex at infinity.

    Newton's method on the convex energy whose gradient is the angle defect of the vertices that are not neighbours of
    the puncture.

    Raises
    ------
    PrecisionError : the scale leaves double precision, Newton's method does not converge, or the boundary touches
        itself
    """
    flow = _PuncturedMetric(tri, puncture)
    if flow.pinched:
        raise PrecisionError("The surface is too narrow around the vertex that was sent to infinity")
    first = None
    for iteration in range(MAX_STEPS):
        residual = float(np.abs(flow.gradient).max(initial=0.0))
        first = first or max(residual, TOLERANCE)
        done = 1 - np.log(max(residual, TOLERANCE) / TOLERANCE) / np.log(1 + first / TOLERANCE)
        yield Progress("Conformal map", float(np.clip(done, 0, 1)))
        if residual <= TOLERANCE:
            return flow.polygon(residual, iteration)
        flow = flow.step()
    raise PrecisionError(f"The conformal map did not converge in {MAX_STEPS} steps")


class _PuncturedMetric:
    """A triangulation and scales u (n,), flipped until Delaunay; gradient (n,): angle defect where u is free."""

    def __init__(self, tri: IntrinsicTriangulation, puncture: int, u: np.ndarray | None = None, flips: int = 0):
        self.puncture = puncture
        if u is None:
            u = _inversion(tri, puncture)
        self.tri, self.u, more = _delaunay(tri, u, puncture)
        self.flips = flips + more
        triangles = self.tri.triangles
        self.inner = (triangles != puncture).all(axis=1)
        tail, head = halfedges(triangles)
        spokes = np.flatnonzero(tail == puncture)
        link = head[spokes]
        # A boundary that touches itself: scales between this one and the last keep it open.
        self.pinched = len(np.unique(link)) < len(link) or puncture in link
        self.free = np.ones(len(self.u), dtype=bool)
        self.free[link] = self.free[puncture] = False
        self.length = np.exp(self.tri.scaled(self.u)).reshape(-1, 3)
        angle = angles_from_lengths(self.length[self.inner])
        corner = triangles[self.inner][:, [2, 0, 1]]
        self.angle_sum = np.bincount(corner.ravel(), angle.ravel(), len(self.u))
        self.gradient = np.where(self.free, 2 * np.pi - self.angle_sum, 0.0)

    def step(self) -> _PuncturedMetric:
        """The flow after a Newton step, halved while the energy's slope has changed sign."""
        direction = self._newton_direction()
        slope = float(self.gradient @ direction)
        share = 1.0
        while share > 1e-4:
            u = self.u + share * direction
            if np.ptp(u[self.free]) < MAX_LOG_SCALE:
                trial = _PuncturedMetric(self.tri, self.puncture, u, self.flips)
                if not trial.pinched and trial.gradient @ direction <= 0.1 * abs(slope):
                    return trial
            share /= 2
        raise PrecisionError("The conformal map leaves double precision: Newton's method is stuck")

    def _newton_direction(self) -> np.ndarray:
        """The Hessian is the cotangent Laplacian of the polygon."""
        n, free = len(self.u), self.free
        tail, head = halfedges(self.tri.triangles[self.inner])
        weight = cotangents_from_lengths(self.length[self.inner]).ravel()
        hessian = laplacian_from_weights(tail, head, weight, n)[free][:, free]
        direction = np.zeros(n)
        direction[free] = solve_spd(hessian.tocsc(), -self.gradient[free], order="mmd")
        return direction

    def polygon(self, residual: float, iterations: int) -> FlatPolygon:
        """The flat polygon at these scales; residual, in radians, and iterations are passed on."""
        tail, head = halfedges(self.tri.triangles)
        opposite = tail[previous_halfedge(np.arange(len(tail)))]
        # A side runs the other way round in the strip behind it.
        strip = np.flatnonzero(opposite == self.puncture)
        h = self.tri.twin[strip]
        (loop,) = boundary_loops(self.tri.triangles[self.inner])
        side = np.zeros(len(self.u))
        side[tail[h]] = self.length.ravel()[h]
        return FlatPolygon(
            triangulation=self.tri,
            inner=self.inner,
            length=self.length,
            log_scale=self.u,
            boundary=loop,
            side_length=side[loop],
            angle=self.angle_sum[loop],
            residual=residual,
            iterations=iterations,
            flips=self.flips,
        )


def _inversion(tri: IntrinsicTriangulation, puncture: int) -> np.ndarray:
    """Scales (n,) of the inversion in a unit sphere about a vertex: l_ij / (r_i r_j), r the distances from it.

    Along the edges these are nearly right, and on the neighbours exactly. In space this inversion is a Moebius map,
    the start of all Newton steps that are still to come.
    """
    tail, head = halfedges(tri.triangles)
    n = int(tri.triangles.max()) + 1
    shortest = np.full(n, np.inf)
    spokes = tail == puncture
    np.minimum.at(shortest, head[spokes], tri.log_length[spokes])
    # The least of several edges between the same two vertices: sums would be wrong.
    key, place = np.unique(pair_keys(tail, head), return_inverse=True)
    length = np.full(len(key), np.inf)
    np.minimum.at(length, place.ravel(), np.exp(tri.log_length))
    graph = csr_matrix((length, tuple(paired(key).T)), shape=(n, n))
    distance = dijkstra(graph, directed=False, indices=puncture)
    distance[puncture] = 1.0
    return np.where(np.isfinite(shortest), -shortest, -np.log(distance))


def _delaunay(tri: IntrinsicTriangulation, u: np.ndarray, puncture: int):
    """Flip until Delaunay with a vertex at infinity; the triangulation, the scales (n,), and the number of flips."""
    triangles, twin, log_length, u = tri.triangles.copy(), tri.twin.copy(), tri.log_length.copy(), u.copy()
    flat = triangles.reshape(-1)
    u[puncture] = 0.0

    def cosine(h):
        # Seen from infinity every side has the angle 0.
        far = flat[previous_halfedge(h)] == puncture
        return np.where(far, 1.0, edge_cosines(flat, log_length, u, h))

    def violation(edges):
        spoke = (flat[edges] == puncture) | (flat[next_halfedge(edges)] == puncture)
        return np.where(spoke, 1.0, cosine(edges) + cosine(twin[edges]) + FLIP_TOLERANCE)

    def flip(edges):
        g = twin[edges]
        flip_metric_in_place(triangles, twin, log_length, edges, ptolemy_diagonal)
        new = np.concatenate([3 * (edges // 3) + 1, 3 * (g // 3) + 1])
        spoke = new[flat[new] == puncture]
        u[flat[next_halfedge(spoke)]] = -log_length[spoke]

    flips, settled = flip_until_none(twin, violation, flip, MAX_ROUNDS)
    if not settled:
        raise PrecisionError("The intrinsic Delaunay triangulation does not settle")
    return IntrinsicTriangulation(triangles, twin, log_length), u, flips
