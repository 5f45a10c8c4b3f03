"""Rehearse a cut: open the coarse surface along it, map that, and take what it shears as what the fine map will.

What a plate predicts (`predicted_scale`) does not know that parts of a map need room, nor what little is left to gain
where much is cut. The square of log(shear) of a coarse map is that of the fine one times a factor that is, for heads,
animals and figures, the same within a tenth, and for two cuts of one body within a twentieth.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from hashlib import sha256

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from ..cutting.component import CutComponent
from ..errors import MeshError
from ..mesh.edge_flips import flip_in_place
from ..mesh.geometry import edge_lengths, face_areas
from ..mesh.surface import Surface, triangle_surface
from ..mesh.topology import across_edges, halfedges, pair_keys, paired, twins
from ..progress import Steps, part_of
from .coarse_cut import CoarseCut, best_of
from .coarse_surface import CoarseSurface, in_half, is_half
from .cut_tree import Cut, Task
from .growth import EVEN, grow, grown_by_one
from .improvement import MOST_REGROWN, rerouted, trimmed
from .options import SPREAD_BY_SHEAR
from .path_graph import path_to

# The least share that one of two triangles may have of both when the edge between them is flipped.
THIN = 0.05
# What a rehearsal makes more of a bound of the spread, at most: squared.
MOST_CHANGE = 4.0
# How often a cut is made longer by what rehearsals tell, at most, and for which share of the bound before what is not
# needed is taken off.
LONGER = 2
FURTHER = 0.6
# How often it is tried to make one shorter, and the share of what is asked for that is short enough; one that is made
# longer aims for a little less.
SHORTER = 4
SHORT_ENOUGH = 0.94
NEAR_ENOUGH = 0.88
# What the search is doing meanwhile.
STAGE = "Seams"
# Cuts cost so much more where the square of log(shear) is to be less, as a power.
DEARER_BY = 0.9
# A longer cut has this price of a shorter one at most: else coarse triangles shear, and not what is cut. What is cut
# later, where the map misses its bound, is dearer by as much, and goes across faces.
WORTH = 1.2


@dataclass(frozen=True)
class Rehearsal:
    """Maps of the coarse surfaces of a component.

    Attributes
    ----------
    component : whose coarse surfaces they are
    log_density : half the logarithm of the density (c,) at the vertices of a coarse surface, or None
    sheared : gives the square of log(shear) of a small surface along its seams for such a density (n,), None where it
        has no map of its own; itself None where predictions have to do
    known : what was rehearsed, by a digest of what the small surface is
    """

    component: CutComponent
    log_density: Callable[[CoarseSurface], np.ndarray | None]
    sheared: Callable[[Surface, np.ndarray | None], Steps[float | None]] | None
    known: dict[bytes, float | None]

    def of(self, found: CoarseCut) -> Steps[float | None]:
        """The square of log(shear) of a map of the coarse surface that is cut so; None where there is no such map."""
        coarse = found.setting.coarse
        if self.sheared is None or not (len(found.cut.steps) or coarse.boundary.any()):
            return None
        ends = self.component.ends[found.base]
        near_base = cKDTree(coarse.positions).query(self.component.positions[ends])[1].reshape(-1, 2)
        opening = opened(found, near_base)
        density = self.log_density(coarse)
        density = None if density is None else density[opening.vertex]
        parts = opening.positions, opening.triangles, opening.seams
        # Ways to make a cut longer often come to the same.
        name = sha256(b"".join(part.tobytes() for part in (*parts, density) if part is not None)).digest()
        if name not in self.known:
            try:
                self.known[name] = yield from self.sheared(triangle_surface(*parts), density)
            except MeshError:
                # A coarse surface can be worse than the fine one that it stands for.
                self.known[name] = None
        return self.known[name]

    def best_of(self, cuts: list[CoarseCut], asked: float) -> Steps[CoarseCut]:
        """The cut that costs least for what it shears, where a square of log(shear) is asked for."""
        if len(cuts) == 1:
            return cuts[0]
        tried = yield from self._worth_trying(cuts, asked)
        prices = [np.inf if sheared is None else _price(found, sheared, asked) for found, sheared in tried]
        if not np.isfinite(prices).all():
            return best_of(cuts)
        good = [found for (found, _), price in zip(tried, prices, strict=True) if price <= min(prices) * (1 + EVEN)]
        return next(found for found in cuts if any(found is one for one in good))

    def _worth_trying(self, cuts: list[CoarseCut], asked: float) -> Steps[list[tuple[CoarseCut, float | None]]]:
        """Cuts, the cheapest first, and the square of log(shear) of each, None where it has no map; without those that
        would be too dear if they kept what is asked for."""
        tried, least = list[tuple[CoarseCut, float | None]](), np.inf
        for k, found in enumerate(sorted(cuts, key=lambda one: one.cut.cost)):
            if _price(found, asked, asked) > least * (1 + EVEN):
                break
            sheared = yield from part_of(self.of(found), k / len(cuts), 1 / len(cuts), STAGE)
            tried.append((found, sheared))
            least = min(least, np.inf if sheared is None else _price(found, sheared, asked))
        return tried

    def kept(self, found: CoarseCut, asked: float) -> Steps[tuple[CoarseCut, float | None]]:
        """A cut made longer or shorter until it keeps the square of log(shear) asked for, and that of its map; None
        where there are no such maps."""
        sheared = yield from part_of(self.of(found), 0.0, 0.1, STAGE)
        for k in range(LONGER):
            if sheared is None or sheared <= asked:
                break
            bound = found.cut.spread * (asked * NEAR_ENOUGH / sheared) ** SPREAD_BY_SHEAR
            longer = yield from part_of(self._longer(found, bound, asked), 0.1 + 0.6 * k / LONGER, 0.6 / LONGER)
            if not longer:
                # None has a map: then predictions have to do.
                return replace(found, cut=grow(replace(found.task, bound=bound), found.cut, MOST_REGROWN)), None
            best = min(longer, key=lambda one: _price(one[0], one[1], asked))
            if best[1] >= sheared or _price(best[0], best[1], asked) > WORTH * _price(found, sheared, asked):
                break
            found, sheared = best
        return (yield from part_of(self._shorter(found, sheared, asked), 0.7, 0.3))

    def _longer(self, found: CoarseCut, bound: float, asked: float) -> Steps[list[tuple[CoarseCut, float]]]:
        """Longer cuts that have a map, and the square of log(shear) of each."""
        cuts = [replace(found, cut=cut) for cut in _longer(replace(found.task, bound=bound), found.cut)]
        tried = yield from self._worth_trying(cuts, asked)
        return [(other, sheared) for other, sheared in tried if sheared is not None]

    def _shorter(self, found: CoarseCut, sheared: float | None, asked: float) -> Steps[tuple[CoarseCut, float | None]]:
        """A cut without what it does not need, and the square of log(shear) of its map."""
        above = found.cut.spread * MOST_CHANGE
        for k in range(SHORTER):
            if sheared is None or sheared >= SHORT_ENOUGH * asked:
                break
            # Halfway to where it was too short, at most: what is flat has no spread to go by.
            bound = float(np.sqrt(found.cut.spread * above))
            if sheared > 0:
                bound = min(bound, found.cut.spread * (asked / sheared) ** SPREAD_BY_SHEAR)
            other = replace(found, cut=trimmed(replace(found.task, bound=bound), found.cut))
            value = yield from part_of(self.of(other), k / SHORTER, 1 / SHORTER, STAGE)
            if value is None or value > asked:
                above = bound
            else:
                found, sheared = other, value
        return found, sheared


def _price(found: CoarseCut, sheared: float, asked: float) -> float:
    """What a cut would cost that kept a square of log(shear) where this one has another, with what is cut beside it;
    less is better."""
    return (found.setting.base_cost + found.cut.cost) * max(sheared, asked) ** DEARER_BY


def _longer(task: Task, cut: Cut) -> list[Cut]:
    """Cuts within a bound that take a cut further: by what is worth most, by what is worth second most and others, and
    by more than is needed, less what others make needless."""
    others = [grow(task, other, MOST_REGROWN) for other in (cut, *grown_by_one(task, cut, 2)[1:])]
    further = grow(replace(task, bound=FURTHER * task.bound), cut, MOST_REGROWN)
    return [*others, trimmed(task, rerouted(task, further))]


@dataclass(frozen=True)
class OpenSurface:
    """A coarse surface whose edges run along a cut: positions (c,3), triangles (t,3), the edges (k,2) to be cut, and
    the coarse vertex (c,) that every vertex is or is the image of."""

    positions: np.ndarray
    triangles: np.ndarray
    seams: np.ndarray
    vertex: np.ndarray


def opened(found: CoarseCut, near_base: np.ndarray) -> OpenSurface:
    """The coarse surface of a cut with its edges along it; of a symmetric one, one half and its image if that is alike.

    near_base (b,2) : the coarse vertices nearest to the ends of what was cut before
    """
    coarse, graph = found.setting.coarse, found.task.graph
    steps = np.concatenate([graph.ends[found.cut.steps], near_base])
    if found.mirror is not None:
        plane, side = found.mirror.plane[coarse.kept], found.mirror.side[coarse.kept]
        if coarse.images is not None:
            plane, side = graph.in_plane, coarse.images.side
        half = coarse.triangles[in_half(coarse.triangles, plane | side, plane)]
        if is_half(coarse.positions, coarse.triangles, half, plane):
            here = np.zeros(len(plane), dtype=bool)
            here[half] = True
            half, seams = _along(coarse.positions, half, steps[here[steps].all(axis=1)])
            return _doubled(coarse.positions, half, seams, plane, found.mirror.height[coarse.kept], found.mirror.normal)
    triangles, seams = _along(coarse.positions, coarse.triangles, steps)
    if found.mirror is not None:
        _, images = _along(coarse.positions, triangles, graph.image[steps])
        seams = _without_loops(seams, images, coarse.boundary)
    return OpenSurface(coarse.positions, triangles, seams, np.arange(len(coarse.positions)))


def _without_loops(seams: np.ndarray, more: np.ndarray, boundary: np.ndarray) -> np.ndarray:
    """Seams (k,2) and those of more (m,2) that close no loop with them, as `fine_paths.carried` leaves them out."""
    n = len(boundary)
    edges = np.unique(np.concatenate([np.sort(seams, axis=1), np.sort(more, axis=1)]), axis=0)
    first = np.isin(pair_keys(*edges.T), pair_keys(*seams.T))
    ends = np.where(boundary[edges], n, edges)
    weight = np.where(first, 1.0, 2.0)
    tree = minimum_spanning_tree(coo_matrix((weight, tuple(np.sort(ends, axis=1).T)), shape=(n + 1, n + 1)).tocsr())
    kept = pair_keys(*(x.astype(np.int64) for x in tree.nonzero()))
    return edges[first | np.isin(pair_keys(*ends.T), kept)]


def _doubled(positions, half, seams, plane, height, normal) -> OpenSurface:
    """A half (t,3) and its mirror image, joined at the vertices in the plane (c,) bool; seams (k,2) on both."""
    n = len(positions)
    image = np.where(plane, np.arange(n), n + np.arange(n))
    there = positions - 2 * height[:, None] * normal
    triangles = np.concatenate([half, image[half][:, ::-1]])
    used, triangles = np.unique(triangles, return_inverse=True)
    seams = np.concatenate([seams, image[seams]])
    seams = seams[np.isin(seams, used).all(axis=1)]
    return OpenSurface(
        positions=np.concatenate([positions, there])[used],
        triangles=triangles.reshape(-1, 3),
        seams=np.unique(np.sort(np.searchsorted(used, seams), axis=1), axis=0),
        vertex=used % n,
    )


def _along(positions: np.ndarray, triangles: np.ndarray, steps: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (t,3) with edges flipped that steps (k,2) cross, and the edges (k,2) that these are now."""
    tail, head = halfedges(triangles)
    twin = twins(triangles)
    h, corners = across_edges(triangles, twin)
    apex, other = corners.T
    asked = np.unique(pair_keys(*steps[steps[:, 0] != steps[:, 1]].T))
    along = np.isin(asked, pair_keys(tail, head))
    crossed, first = np.unique(pair_keys(apex, other), return_index=True)
    across = np.isin(asked, crossed) & ~along
    chosen = first[np.isin(crossed, asked[across])]
    h, apex, other = h[chosen], apex[chosen], other[chosen]
    owners = np.stack([h // 3, twin[h] // 3], axis=1)
    count = np.bincount(owners.ravel(), minlength=len(triangles))
    one, two = np.stack([apex, tail[h], other], axis=1), np.stack([other, head[h], apex], axis=1)
    area = np.stack([face_areas(positions, one), face_areas(positions, two)])
    free = (count[owners] == 1).all(axis=1) & (area.min(axis=0) > THIN * area.sum(axis=0))
    flipped = triangles.copy()
    flip_in_place(flipped, twin, h[free])
    # Two that meet in a triangle cannot both be flipped, nor such as become slivers: around a corner, then.
    around = [np.stack([apex, tail[h]], axis=1)[~free], np.stack([tail[h], other], axis=1)[~free]]
    far = asked[~along & ~across]
    ways = _ways(positions, flipped, paired(far))
    seams = np.concatenate([asked[along], pair_keys(apex, other)[free], *(pair_keys(*e.T) for e in (*around, ways))])
    seams = np.intersect1d(seams, pair_keys(*halfedges(flipped)))
    return flipped, paired(seams)


def _ways(positions: np.ndarray, triangles: np.ndarray, pairs: np.ndarray) -> np.ndarray:
    """Edges (e,2) of the shortest ways between pairs (k,2) of vertices that are not beside each other."""
    n, ends = len(positions), np.stack(halfedges(triangles), axis=1)
    length = np.maximum(edge_lengths(positions, ends), 1e-300)
    graph = csr_matrix((length, tuple(ends.T)), shape=(n, n))
    found = [np.zeros((0, 2), np.int64)]
    for one, other in pairs:
        before = dijkstra(graph, directed=False, indices=one, return_predecessors=True)[1]
        path = path_to(before, int(other))
        found.append(np.stack([path[:-1], path[1:]], axis=1))
    return np.concatenate(found)
