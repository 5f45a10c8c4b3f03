"""Carry vertices across a mesh, from where the measure of the surface has too many of them to where it has too few.

Relaxation evens out neighbours, but takes long to carry vertices far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ...linalg.sparse import solve_conjugate_gradients
from ...mesh.geometry import laplacian_from_weights, vertex_normals
from ...mesh.topology import halfedges, previous_halfedge
from ..edits.split_collapse import Edit, collapse_edges, independent_splits, interior_edges, split_edges
from ..edits.vertex_count import SizeFunction, after_edit, reach_vertex_count
from ..edits.working_mesh import WorkingMesh
from .surface_carrier import SurfaceCarrier

# Edges over which surpluses are averaged: a few cells are too few to count on.
BLUR = 8.0
# Relative residual of these means.
TOLERANCE = 0.01
# Averages, each of what the last ones have left: together they blur less than one.
PASSES = 3
# Power of the ratio of target lengths by which averages do not cross from small cells to large ones.
CONTRAST = 4
# Rounds of carrying vertices.
ROUNDS = 3
# Share of all vertices below which a surplus stays, at an even density,
MAX_SURPLUS = 0.004
# and where it varies: a dense region may have few of all vertices, and shall have its own.
MAX_SURPLUS_UNEVEN = 0.001
# Demands change by so many times the surplus,
GAIN = 1.5
# and by this share at the most.
MAX_CHANGE = 0.1
# What an edge's length, in mean lengths, counts next to squares of missing neighbours.
LENGTH_WEIGHT = 3.0
# Valence of a vertex inside of a regular mesh.
REGULAR = 6
# Edges at a boundary vertex of a regular mesh that have a left face: so many fewer.
REGULAR_BOUNDARY = 3
NO_EDGES = np.zeros(0, np.int64)


@dataclass(frozen=True)
class BalancedMesh:
    """A mesh, what the samples of its carrier demand (s,), and whether every vertex had its share before."""

    mesh: WorkingMesh
    demand: np.ndarray
    was_balanced: bool


def balance_vertices(
    mesh: WorkingMesh, carrier: SurfaceCarrier, sizing: SizeFunction, demand: np.ndarray | None
) -> BalancedMesh:
    """Put as many vertices as there are to where the measure of the surface that is nearest to each asks for them.

    demand (s,): of the carrier's samples the last time. Where relaxation takes vertices away again, as it does along
    jumps of the density, they demand more each time.
    """
    n = len(mesh.points)
    near = carrier.nearest(mesh.points, vertex_normals(mesh.points, mesh.triangles), sizing(mesh.points))
    surplus = _surplus(mesh, np.bincount(near, carrier.measure, n), sizing)
    even = np.ptp(carrier.density) == 0
    share = MAX_SURPLUS if even else MAX_SURPLUS_UNEVEN
    balanced = _is_balanced(surplus, share)
    known = demand is None or even
    demand = carrier.measure if known else demand * (1 - np.clip(GAIN * surplus, -MAX_CHANGE, MAX_CHANGE)[near])
    measure = np.bincount(near, demand, n)
    for k in range(0 if balanced else ROUNDS):
        if k or not known:
            surplus = _surplus(mesh, measure, sizing)
        if _is_balanced(surplus, share):
            break
        mesh, measure = _carried(mesh, measure, surplus)
    return BalancedMesh(reach_vertex_count(mesh, n, sizing), demand, balanced)


def _is_balanced(surplus: np.ndarray, share: float) -> bool:
    return np.maximum(surplus, 0).sum() < share * len(surplus)


def _surplus(mesh: WorkingMesh, measure: np.ndarray, sizing: SizeFunction) -> np.ndarray:
    """How many vertices are too many at every vertex, (n,), a mean over its surroundings of about the same length.

    Around a dense region there are more than there should be, as sizes cannot jump; what lies next to these, and not
    the region, has to do with less.
    """
    n = len(measure)
    tail, head = halfedges(mesh.triangles)
    boundary = np.zeros(n, dtype=bool)
    boundary[tail[mesh.twin < 0]] = True
    # The cell of a boundary vertex is half on the surface.
    cells = np.where(boundary, 0.5, 1.0)
    surplus = cells - measure * (cells.sum() / measure.sum())
    h = interior_edges(mesh.triangles, NO_EDGES, mesh.twin)
    target = sizing(mesh.points)
    a, b = target[tail[h]], target[head[h]]
    alike = (np.minimum(a, b) / np.maximum(a, b)) ** CONTRAST
    # The graph Laplacian of a regular mesh with edges of length one is 3 / 2 of the Laplacian.
    smoother = laplacian_from_weights(tail[h], head[h], BLUR**2 / 1.5 * alike, n)
    system = (smoother + sp.identity(n)).tocsr()
    left = surplus
    for _ in range(PASSES):
        left = left - solve_conjugate_gradients(system, left, TOLERANCE)
    return surplus - left


def _carried(mesh: WorkingMesh, measure: np.ndarray, surplus: np.ndarray) -> tuple[WorkingMesh, np.ndarray]:
    """Carry as many vertices to where the surplus (n,) is negative as can be taken elsewhere; and their measure."""
    n = len(surplus)
    excess = np.maximum(surplus, 0)
    best = _best_edges(mesh, excess, collapse=True)
    edit = collapse_edges(mesh.points, mesh.triangles, best, mesh.fixed, int(np.ceil(excess.sum())), twin=mesh.twin)
    taken = n - len(edit.points)
    if taken == 0:
        return mesh, measure
    measure, deficit = _inherited(mesh, edit, measure), np.maximum(-surplus[edit.origin], 0)
    mesh = after_edit(mesh, edit)
    best = _best_edges(mesh, deficit * (taken / max(deficit.sum(), 1e-300)), collapse=False)
    edit = split_edges(
        mesh.points, mesh.triangles, independent_splits(mesh.triangles, best, mesh.twin)[:taken], mesh.twin
    )
    # Vertices between others have no measure yet; averaging gives it to them.
    return after_edit(mesh, edit), np.append(measure, np.zeros(len(edit.points) - len(measure)))


def _inherited(mesh: WorkingMesh, edit: Edit, measure: np.ndarray) -> np.ndarray:
    """The measure (n,) of the vertices after a collapse, that of those gone shared by their neighbours."""
    n = len(measure)
    gone = np.ones(n, dtype=bool)
    gone[edit.origin] = False
    tail, head = halfedges(mesh.triangles)
    tail, head = tail[gone[tail]], head[gone[tail]]
    shared = measure[tail] / np.bincount(tail, minlength=n)[tail]
    return (measure + np.bincount(head, shared, n))[edit.origin]


def _best_edges(mesh: WorkingMesh, amount: np.ndarray, collapse: bool) -> np.ndarray:
    """Order halfedges (k,) in groups of neighbouring vertices whose amounts (n,) sum to one, the best of each first.

    These are the edges with the best valences afterwards, six everywhere if possible, and the length that comes next
    to it.
    """
    order = cKDTree(mesh.points).indices
    group = np.zeros(len(amount), np.int64)
    group[order] = np.floor(np.cumsum(amount[order]))
    twin = mesh.twin
    h = interior_edges(mesh.triangles, mesh.locked, twin)
    tail, head = halfedges(mesh.triangles)
    h = h[amount[tail[h]] > 0]
    if len(h) == 0:
        return h
    excess = np.bincount(tail, minlength=len(amount)) - REGULAR
    excess[tail[twin < 0]] += REGULAR_BOUNDARY
    across = excess[tail[previous_halfedge(h)]] + excess[tail[previous_halfedge(twin[h])]]
    a, b = excess[tail[h]], excess[head[h]]
    length = np.linalg.norm(mesh.points[tail[h]] - mesh.points[head[h]], axis=1)
    length *= LENGTH_WEIGHT / length.mean()
    # Squares of missing neighbours afterwards, less those before.
    cost = (a + b + 2) ** 2 - a**2 - b**2 - 2 * across + length if collapse else 2 * across - length
    mine = group[tail[h]]
    best = np.lexsort((cost, mine))
    first = np.flatnonzero(np.diff(mine[best], prepend=-1))
    rank = np.arange(len(h)) - np.repeat(first, np.diff(np.append(first, len(h))))
    return h[best[np.argsort(rank, kind="stable")]]
