"""Vertices carried across a mesh, from where there are too many for the measure of the surface to where they lack.

Relaxation evens out neighbours, but takes long to carry vertices far.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from ...linalg.sparse import solve_conjugate_gradients
from ...mesh.geometry import laplacian_from_weights, vertex_normals
from ...mesh.topology import halfedges, previous_halfedge, twins
from ..edits.split_collapse import Edit, collapse_edges, independent_splits, interior_edges, split_edges
from ..edits.vertex_count import Size, adjust_count, settled
from ..edits.working_mesh import Draft
from .surface_carrier import Carrier

# Surpluses are evened out over this many edges: a few cells are too few to count on.
REACH = 8.0
# Relative residual of these means.
EVEN_ENOUGH = 0.01
# So often, each time what the last passes have left: together they blur less than one.
PASSES = 3
# Where edges shall be twice as long there are this many halvings between neighbours.
APART = 4
# Rounds, and the share of all vertices below which a surplus stays; where the density varies, a dense region may have
# few of all vertices, and shall have its own.
ROUNDS = 3
SETTLED, SETTLED_UNEVEN = 0.004, 0.001
# Claims change by so many times the surplus, and by this share at the most.
GAIN, MOST = 1.5, 0.1
# What an edge's length counts next to squares of missing neighbours.
LENGTH = 3.0
NONE = np.zeros(0, np.int64)


@dataclass(frozen=True)
class Balanced:
    """A mesh, what the samples of its carrier claim (s,), and whether it had been in balance before."""

    draft: Draft
    claim: np.ndarray
    settled: bool


def balance(draft: Draft, carrier: Carrier, size: Size, claim: np.ndarray | None) -> Balanced:
    """The mesh with its vertices where the measure of the surface that is nearest to each asks for them.

    claim (s,): what the samples asked for the last time. Where relaxation takes vertices away again, as it does along
    jumps of the density, they ask for more each time.
    """
    n = len(draft.points)
    near = carrier.nearest(draft.points, vertex_normals(draft.points, draft.triangles), size(draft.points))
    surplus = _surplus(draft, np.bincount(near, carrier.measure, n), size)
    even = np.ptp(carrier.density) == 0
    share = SETTLED if even else SETTLED_UNEVEN
    settled = _is_settled(surplus, share)
    known = claim is None or even
    claim = carrier.measure if known else claim * (1 - np.clip(GAIN * surplus, -MOST, MOST)[near])
    measure = np.bincount(near, claim, n)
    for k in range(0 if settled else ROUNDS):
        if k or not known:
            surplus = _surplus(draft, measure, size)
        if _is_settled(surplus, share):
            break
        draft, measure = _carried(draft, measure, surplus)
    return Balanced(adjust_count(draft, n, size), claim, settled)


def _is_settled(surplus: np.ndarray, share: float) -> bool:
    return np.maximum(surplus, 0).sum() < share * len(surplus)


def _surplus(draft: Draft, measure: np.ndarray, size: Size) -> np.ndarray:
    """How many vertices there are too many at every vertex, (n,), a mean over its surroundings of about the same size.

    Around a dense region there are more than there should be, as sizes cannot jump; what lies next to these, and not
    the region, has to do with less.
    """
    n = len(measure)
    tail, head = halfedges(draft.triangles)
    rim = np.zeros(n, dtype=bool)
    rim[tail[twins(draft.triangles) < 0]] = True
    # The cell of a boundary vertex is half on the surface.
    cells = np.where(rim, 0.5, 1.0)
    surplus = cells - measure * (cells.sum() / measure.sum())
    h = interior_edges(draft.triangles, NONE)
    wanted = size(draft.points)
    a, b = wanted[tail[h]], wanted[head[h]]
    alike = (np.minimum(a, b) / np.maximum(a, b)) ** APART
    # The graph Laplacian of a regular mesh with edges of length one is 3 / 2 of the Laplacian.
    smoother = laplacian_from_weights(tail[h], head[h], REACH**2 / 1.5 * alike, n)
    system = (smoother + sp.identity(n)).tocsr()
    left = surplus
    for _ in range(PASSES):
        left = left - solve_conjugate_gradients(system, left, EVEN_ENOUGH)
    return surplus - left


def _carried(draft: Draft, measure: np.ndarray, surplus: np.ndarray) -> tuple[Draft, np.ndarray]:
    """As many vertices put where surplus (n,) is less than nothing as can be taken where it is more; their measure."""
    n = len(surplus)
    spare = np.maximum(surplus, 0)
    wanted = _best_edges(draft, spare, collapse=True)
    edit = collapse_edges(draft.points, draft.triangles, wanted, draft.fixed, int(np.ceil(spare.sum())))
    taken = n - len(edit.points)
    if taken == 0:
        return draft, measure
    measure, lack = _inherited(draft, edit, measure), np.maximum(-surplus[edit.origin], 0)
    draft = settled(draft, edit)
    wanted = _best_edges(draft, lack * (taken / max(lack.sum(), 1e-300)), collapse=False)
    edit = split_edges(draft.points, draft.triangles, independent_splits(draft.triangles, wanted)[:taken])
    # Vertices between others have no measure yet; averaging gives it to them.
    return settled(draft, edit), np.append(measure, np.zeros(len(edit.points) - len(measure)))


def _inherited(draft: Draft, edit: Edit, measure: np.ndarray) -> np.ndarray:
    """The measure (n,) of the vertices after a collapse, that of those gone shared by their neighbours."""
    n = len(measure)
    gone = np.ones(n, dtype=bool)
    gone[edit.origin] = False
    tail, head = halfedges(draft.triangles)
    tail, head = tail[gone[tail]], head[gone[tail]]
    shared = measure[tail] / np.bincount(tail, minlength=n)[tail]
    return (measure + np.bincount(head, shared, n))[edit.origin]


def _best_edges(draft: Draft, amount: np.ndarray, collapse: bool) -> np.ndarray:
    """Halfedges (k,) in groups of neighbouring vertices whose amounts (n,) sum to one, first the best of every group.

    These are the edges with the best valences afterwards, six everywhere if possible, and the length that comes next
    to it.
    """
    order = cKDTree(draft.points).indices
    group = np.zeros(len(amount), np.int64)
    group[order] = np.floor(np.cumsum(amount[order]))
    h = interior_edges(draft.triangles, draft.locked)
    twin = twins(draft.triangles)
    tail, head = halfedges(draft.triangles)
    h = h[amount[tail[h]] > 0]
    if len(h) == 0:
        return h
    excess = np.bincount(tail, minlength=len(amount)) - 6
    excess[tail[twin < 0]] += 3
    across = excess[tail[previous_halfedge(h)]] + excess[tail[previous_halfedge(twin[h])]]
    a, b = excess[tail[h]], excess[head[h]]
    length = np.linalg.norm(draft.points[tail[h]] - draft.points[head[h]], axis=1)
    length *= LENGTH / length.mean()
    # Squares of missing neighbours afterwards, less those before.
    cost = (a + b + 2) ** 2 - a**2 - b**2 - 2 * across + length if collapse else 2 * across - length
    mine = group[tail[h]]
    best = np.lexsort((cost, mine))
    first = np.flatnonzero(np.diff(mine[best], prepend=-1))
    rank = np.arange(len(h)) - np.repeat(first, np.diff(np.append(first, len(h))))
    return h[best[np.argsort(rank, kind="stable")]]
