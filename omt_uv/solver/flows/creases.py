"""Keep faces of a mesh that flowed from passing through one another where it is creased more finely than it is divided.

A flow takes no two points to one, but flat faces between vertices may meet where the surface nearly touches itself
within an edge. Pairs of faces are taken apart again along the planes that were between them (`separation`). Where that
does not suffice, the flow is replaced by its best affine map, which takes faces apart to faces apart, and blended with
the flow over a few rings of vertices.

On a coarse mesh, or where handles shear what is around them, finer steps of time change nothing about that. What the
whole way folds over is taken apart on the way (`march`): within a piece of it, planes between two faces hardly turn,
and vertices that have been put back behind them flow on from there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..contact.barrier import brought
from ..contact.new_crossings import NewCrossings, touched
from ..contact.self_intersections import FaceCrossings
from ..contact.separation import separated
from ..mesh.geometry import affine_images
from ..mesh.topology import graph_components, halfedges
from ..progress import Progress, Steps
from .domain import FlowDomain
from .integration import FlowStep, carried

# Pieces of the way, of which each is followed in its single steps where its faces do not come apart at once.
PIECES = 12
# A region reaches so many edges around what meets, before the flow and after it.
REACH = 5
# Vertices of a region at most for which distances of all that is close are kept.
MOST_HELD = 20_000
# What lengths are divided by where they are nothing.
TINY = float(np.finfo(float).tiny)
# Rings of vertices around faces that intersect, in the rounds of mending; beyond them the blend takes as many again.
RINGS = (1, 2, 3, 4, 6, 8)
# Times that pairs which others have been moved into are taken apart with those.
SEPARATIONS = 8
# Mending moves nothing farther than this share of the diagonal or, on a coarse mesh, than an edge is long; and is for
# creases, not for more than this share of all faces, unless they are so few that it costs nothing to try.
FARTHEST = 0.02
MOST_FACES = 0.05
FEW_FACES = 1000


def without_new_intersections(
    before: np.ndarray, after: np.ndarray, faces: FaceCrossings, free: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) close to `after` (n,3), and the pairs (k,2) of triangles (m,3) that still intersect and did not
    at `before` (n,3). Only vertices `free` (n,) bool move."""
    crossings = NewCrossings(before, faces)
    farthest = farthest_mended(before, faces.triangles)
    concerned = touched(before, after, faces.triangles)
    best, fewest = taken_apart((before, after), crossings, free, farthest, concerned)
    if len(fewest) and not _too_many(fewest, faces.triangles):
        best, fewest = _blended_all(after, crossings, free, (best, fewest))
    return best, fewest


def taken_apart(
    move: tuple[np.ndarray, np.ndarray],
    crossings: NewCrossings,
    free: np.ndarray,
    farthest: float = np.inf,
    concerned: np.ndarray | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) close to those after a move (before and after it, (n,3) each), and the pairs (k,2) that still
    newly intersect and were apart, with those that do behind planes that were between them before the move, and those
    that come to intersect by that, too. Only vertices `free` (n,) bool move, no farther than `farthest`; pairs without
    a triangle that is `concerned` (m,) bool are known not to intersect."""
    before, after = move
    triangles = crossings.faces.triangles
    pairs = crossings.pairs(after, concerned)
    best, fewest = after, crossings.apart(pairs)
    if not len(pairs) or _too_many(pairs, triangles):
        return best, fewest
    left, rest = pairs, len(pairs)
    for _ in range(SEPARATIONS):
        position = separated(before, after, triangles, pairs, free)
        if np.abs(position - after).max() > farthest:
            break
        near = touched(after, position, triangles)
        near[left] = True
        left = crossings.pairs(position, near)
        apart = crossings.apart(left)
        if (len(apart), len(left)) < (len(fewest), rest):
            best, fewest, rest = position, apart, len(left)
        both = np.unique(np.concatenate([pairs, left]), axis=0)
        if not len(left) or len(both) == len(pairs):
            break
        pairs = both
    return best, fewest


def neighbours(triangles: np.ndarray, n: int) -> sp.csr_matrix:
    """Which of n vertices an edge of the triangles (m,3) joins: (n,n), entries positive."""
    tail, head = halfedges(triangles)
    return sp.csr_matrix((np.ones(2 * len(tail)), (np.r_[tail, head], np.r_[head, tail])), shape=(n, n))


def _too_many(pairs: np.ndarray, triangles: np.ndarray) -> bool:
    """Whether pairs (k,2) have more of the triangles (m,3) than are mended."""
    return len(np.unique(pairs)) > max(MOST_FACES * len(triangles), FEW_FACES)


def farthest_mended(before: np.ndarray, triangles: np.ndarray) -> float:
    """How far mending may move a vertex of triangles (m,3)."""
    tail, head = halfedges(triangles)
    edge = float(np.linalg.norm(before[tail] - before[head], axis=1).mean())
    return max(FARTHEST * float(np.linalg.norm(np.ptp(before, axis=0))), edge)


def _blended_all(after, crossings: NewCrossings, free, found) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,3) and pairs that are left, of those `found`, with affine maps of more and more rings around."""
    before, triangles = crossings.before, crossings.faces.triangles
    n = len(before)
    best, fewest = found
    position, pairs = found
    farthest = farthest_mended(before, triangles)
    graph = neighbours(triangles, n) + sp.identity(n, format="csr")
    for rings in RINGS:
        if not len(pairs) or _too_many(pairs, triangles):
            break
        position = _blended(before, after, position, graph, triangles[pairs].reshape(len(pairs), -1), free, rings)
        if np.abs(position - after).max() > farthest:
            break
        near = touched(best, position, triangles)
        near[fewest] = True
        pairs = crossings.apart(crossings.pairs(position, near))
        if len(pairs) < len(fewest):
            best, fewest = position, pairs
    return best, fewest


def _blended(before, after, position, graph, seeds: np.ndarray, free, rings: int) -> np.ndarray:
    """Positions (n,3) with every cluster of vertices `seeds` (k,6) and of rings around them moved by an affine map."""
    n = len(before)
    weight = np.zeros(n)
    weight[seeds] = 1.0
    for _ in range(rings):
        weight = np.minimum(graph @ weight, 1.0)
    core = weight > 0
    tail, head = seeds[:, :1].repeat(5, 1).ravel(), seeds[:, 1:].ravel()
    inner = sp.csr_matrix(graph[core][:, core])
    place = np.cumsum(core) - 1
    rows, columns = inner.nonzero()
    _, label = graph_components(np.r_[rows, place[tail]], np.r_[columns, place[head]], int(core.sum()))
    fade = core.astype(float)
    reach = core.copy()
    owner = np.full(n, -1)
    owner[core] = label
    for k in range(rings):
        ring = (graph @ reach > 0) & ~reach
        near = sp.csr_matrix(graph[ring].multiply(reach.astype(float)))
        near.eliminate_zeros()
        owner[ring] = owner[near.indices[near.indptr[:-1]]]
        fade[ring] = 1 - (k + 1) / (rings + 1)
        reach |= ring
    moved = position.copy()
    used = np.flatnonzero(reach)
    target = affine_images(before[used], after[used], owner[used], fade[used])
    share = (fade[used] * free[used])[:, None]
    moved[used] = (1 - share) * after[used] + share * target
    return moved


@dataclass(frozen=True)
class FlowRegion:
    """What is looked at on the way: rows (r,) of vertices, which of them (r,) bool may move, and their triangles, with
    what intersects of these before the flow."""

    rows: np.ndarray
    free: np.ndarray
    crossings: NewCrossings


def regions_around(
    move: tuple[np.ndarray, np.ndarray], triangles: np.ndarray, pairs: np.ndarray, mended: np.ndarray, free: np.ndarray
) -> list[FlowRegion]:
    """Regions around pairs (k,2) of triangles (m,3) and what was `mended` (n,) bool near them, each by itself;
    positions before and after the move (n,3), `free` (n,) bool."""
    seeds = np.zeros(len(free), bool)
    seeds[triangles[pairs]] = True
    seeds |= mended & _near(move, triangles, seeds)
    inside = _near(move, triangles, seeds)
    faces = triangles[inside[triangles].all(axis=1)]
    # What is neither connected nor meets has ways of its own.
    joined = np.concatenate([faces[:, :2], faces[:, 1:], triangles[pairs].reshape(-1, 6)[:, [0, 3]]])
    count, part = graph_components(joined[:, 0], joined[:, 1], len(free))
    alone = np.bincount(part[triangles[pairs]].ravel(), minlength=count) > 0
    found = []
    for k in np.flatnonzero(alone):
        mine = part == k
        rows, number = np.flatnonzero(mine), np.cumsum(mine) - 1
        crossings = NewCrossings(move[0][rows], FaceCrossings(number[faces[mine[faces[:, 0]]]]))
        found.append(FlowRegion(rows, free[rows], crossings))
    return found


def _near(move: tuple[np.ndarray, np.ndarray], triangles: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Which vertices (n,) bool are near to `seeds` (n,) bool before or after the move, by edges around each seed."""
    from scipy.spatial import cKDTree

    around = triangles[seeds[triangles].any(axis=1)]
    corner, vertex = move[0][around], around.ravel()
    sides = np.linalg.norm(corner - corner[:, [1, 2, 0]], axis=2)
    uses = np.bincount(vertex, minlength=len(seeds))[seeds]
    edge = np.bincount(vertex, (sides + sides[:, [2, 0, 1]]).ravel() / 2, len(seeds))[seeds] / np.maximum(uses, 1)
    near = seeds.copy()
    near[around] = True
    # Few classes of lengths instead of one length: around an eye of many small faces, boots have large ones.
    level = np.round(np.log2(np.maximum(edge / max(float(edge.max()), TINY), TINY))).astype(int)
    for at in move:
        for k in np.unique(level):
            mine = level == k
            reach = REACH * float(edge[mine].mean())
            distance, _ = cKDTree(at[seeds][mine]).query(at, distance_upper_bound=reach)
            near |= np.isfinite(distance)
    return near


def march(region: FlowRegion, plan: list[list[FlowStep]], domain: FlowDomain | None) -> Steps[list[np.ndarray]]:
    """Positions (r,3) of the vertices of a region after every entry of a plan, faces apart as they were before."""
    position, found = region.crossings.before, []
    left = np.zeros((0, 2), np.int64)
    for k, steps in enumerate(plan):
        yield Progress("Flow", k / len(plan))
        position, left = _advanced(region, (position, left), steps, domain)
        found.append(position)
    return found


def _advanced(region: FlowRegion, state, steps: list[FlowStep], domain) -> tuple[np.ndarray, np.ndarray]:
    """Positions (r,3) and pairs (k,2) of triangles that newly intersect after steps; `state`: those before."""
    target = carried(state[0], steps)
    if domain is not None:
        target = domain.held(target)
    best, left = taken_apart((state[0], target), region.crossings, region.free)
    if len(left) <= len(state[1]):
        return best, left
    if len(steps) == 1:
        # From where faces meet, no barrier leads to where they do not.
        nearer = best if len(state[1]) else closer(region, state[0], target)
        nearer, meeting = taken_apart((state[0], nearer), region.crossings, region.free)
        return (nearer, meeting) if len(meeting) < len(left) else (best, left)
    single = state
    for step in steps:
        single = _advanced(region, single, [step], domain)
    return single if len(single[1]) < len(left) else (best, left)


def closer(region: FlowRegion, start: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Positions (r,3) of a region as near to a target (r,3) as faces let them come from a start (r,3) in which none
    newly intersect; the target itself where the region is too large for that."""
    return target if len(region.rows) > MOST_HELD else brought(start, target, region.crossings, region.free)
