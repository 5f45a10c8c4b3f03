"""Carry a cut from the coarse surface to the fine one: along its edges, near where it ran."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, dijkstra, minimum_spanning_tree
from scipy.spatial import cKDTree

from ..analysis.straight_paths import EdgeNetwork, edge_network, straighten
from ..analysis.symmetry_plane import SymmetryPlane
from ..cutting.component import CutComponent
from ..mesh.geometry import below_one, edge_lengths, vertex_normals
from ..mesh.topology import graph_components, halfedges, pair_keys
from .coarse_surface import CoarseSurface
from .cut_tree import between_nodes, stretches
from .path_graph import PathGraph, path_to

# How far from the coarse path a fine one may run, in lengths of coarse edges.
REACH = 6.0
# Where one passes a vertex of the coarse path at more, it has taken a short cut, around a limb and not along it.
ASIDE = 3.0
# At one coarse edge from the coarse path, an edge counts so many times more.
ASTRAY = 0.5
# A line of edges by the plane of a mirror that is none of edges may be left by so many edges to be straight.
ALONG = 3.0
# And a way along the sides of polygons, to have fewer steps.
FEWER_STEPS = 2.0
# So many times as far where no path is found there, at first and then: costs say little of the lengths of needles.
WIDER = (8.0, 64.0, np.inf)


# Share of the vertices that have an image in a component with a mirror plane, in a scan with one, and in one whose half
# surely stands for both: a raised arm would have the seams of one that hangs.
MIRRORED_SHARE = (0.97, 0.9, 0.95)
# Distance of a vertex from where its image belongs, or from the plane, over the extent; and that of scans.
EXACT = 1e-4
NEARLY = 0.03


@dataclass(frozen=True)
class FineMirror:
    """The mirror image (n,) of every vertex of a component, its height (n,) over the plane, the normal (3,) of that,
    and which lie in it or on a line of edges along it, (n,) bool; exact: whether images are vertices, nearly all, and
    no such line is needed; alike: whether one half surely stands for both; halved: whether one is searched for both."""

    image: np.ndarray
    height: np.ndarray
    normal: np.ndarray
    plane: np.ndarray
    exact: bool
    alike: bool = True
    halved: bool = True

    @property
    def side(self) -> np.ndarray:
        """Vertices (n,) bool on the one side."""
        return self.height >= 0


def fine_mirror(component: CutComponent, plane: SymmetryPlane, own: np.ndarray, real: np.ndarray) -> FineMirror | None:
    """The mirror image of a component in itself, if its vertices have one, and some are in the plane.

    own (m,3) : where its vertices real (n,) bool are, in the units of the plane
    """
    points = component.positions
    own, exponent = below_one(own)
    offset = np.ldexp(plane.offset, -exponent)
    scale = np.ptp(points, axis=0).max() / max(np.ptp(own, axis=0).max(), 1e-300)
    height = points @ plane.normal
    height = height - np.mean(height[real] - scale * (own @ plane.normal - offset))
    distance, image = cKDTree(points).query(_reflected(points, height, plane.normal))
    in_plane = (image == np.arange(len(image))) & (np.abs(height) <= EXACT)
    if np.mean(distance <= EXACT) >= MIRRORED_SHARE[0] and in_plane.any():
        return FineMirror(image, height, plane.normal, in_plane, exact=True)
    near = float(np.mean(distance <= NEARLY))
    if near < MIRRORED_SHARE[1]:
        return None
    # The other side of what is thin may be nearer.
    normals = NEARLY * vertex_normals(points, component.triangles)
    there = _reflected(normals, normals @ plane.normal, plane.normal)
    places = np.concatenate([_reflected(points, height, plane.normal), there], axis=1)
    _, image = cKDTree(np.concatenate([points, normals], axis=1)).query(places)
    alike = near >= MIRRORED_SHARE[2]
    return with_line(component, FineMirror(image, height, plane.normal, in_plane, exact=False, alike=alike))


def _reflected(points: np.ndarray, height: np.ndarray, normal: np.ndarray) -> np.ndarray:
    return points - 2 * height[:, None] * normal


def with_line(component: CutComponent, mirror: FineMirror) -> FineMirror | None:
    """The mirror with a line along the plane, of every edge that crosses it the nearer end; None if none does."""
    height = mirror.height
    border = np.stack([ends[component.boundary] for ends in halfedges(component.triangles)], axis=1)
    ends = np.concatenate([component.ends, border])
    crossing = ends[height[ends].prod(axis=1) <= 0]
    plane, image = np.zeros(len(height), dtype=bool), mirror.image.copy()
    plane[crossing[np.arange(len(crossing)), np.abs(height[crossing]).argmin(axis=1)]] = True
    image[plane] = np.flatnonzero(plane)
    return replace(mirror, image=image, plane=plane, exact=False) if plane.any() else None


def carried(
    component: CutComponent,
    coarse: CoarseSurface,
    graph: PathGraph,
    steps: np.ndarray,
    start: np.ndarray,
    mirror: FineMirror | None,
    straighter: bool = False,
) -> np.ndarray:
    """Edges (e,) bool of a component along steps (k,) over its coarse surface.

    start (n,) bool: vertices that are on a boundary or cut already, from which paths set out; straighter: paths may
    leave those over the coarse surface where that is the fine one, too.
    """
    fine = FineGraph.of(component)
    # Diagonals need not be mirrored; paths run along edges that are, where there is such a way. Scans have none.
    half = FineGraph.of(component, mirror.image) if mirror is not None and mirror.exact else fine
    used = start.copy()
    spacing = coarse.size * float(np.median(graph.cost)) if len(graph.cost) else 0.0
    # What the coarse surface does not tell: where it is the fine one, paths are there already.
    unsure = spacing * max(1 - np.sqrt(len(coarse.kept) / component.vertex_count), 0.0)
    edge = float(np.median(component.length)) if len(component.length) else 0.0
    aside = max(unsure, FEWER_STEPS * edge * straighter)
    paths = []
    waiting = _outwards(graph, steps)
    while waiting:
        stretch = waiting.pop(0)
        along, end = coarse.kept[stretch], int(coarse.kept[stretch[-1]])
        in_plane = bool(graph.in_plane[stretch].all())
        allowed = np.ones(component.vertex_count, dtype=bool)
        if mirror is not None:
            # Off the plane nothing comes back to it: that would, with its mirror image, close a loop.
            allowed = mirror.plane if in_plane else (mirror.side & ~mirror.plane) | used
        graphs = [half] if mirror is None else [half, fine]
        path = _led(graphs, used, end, along, spacing, allowed, in_plane)
        missed = fine.missed(path, along[1:-1], ASIDE * spacing)
        if missed is not None:
            waiting = [stretch[: missed + 2], stretch[missed + 1 :], *waiting]
            continue
        if not in_plane:
            path = half.straightened(path, used | ~allowed, aside)
        elif mirror is not None and not mirror.exact:
            path = fine.straightened(path, used, ALONG * edge)
        used[path] = True
        paths.append(path)
        if mirror is not None and not in_plane and len(path):
            image = mirror.image[path]
            # Where the mesh is not quite its own image, the image is led along its own edges.
            if not (fine.joined(image) and used[image[-1]]):
                allowed = ~(mirror.side | mirror.plane) | used
                image = fine.path(used, int(image[0]), image, spacing / 2, allowed)
                image = fine.straightened(image, used | ~allowed, aside)
            used[image] = True
            paths.append(image)
    return _forest(component, edges_along(component, paths), start)


def edges_along(component: CutComponent, paths: Sequence[np.ndarray]) -> np.ndarray:
    """Edges (e,) bool of a component between the vertices (k,) of paths that follow each other."""
    keys = [np.zeros(0, np.int64), *(pair_keys(path[:-1], path[1:]) for path in paths)]
    return np.isin(pair_keys(*component.ends.T), np.concatenate(keys))


def led_along(component: CutComponent, coarse: CoarseSurface, edges: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of a component along those (k,2) of a coarse surface, which may branch and close loops, as many
    times as these do: between branchings, tips and boundaries each path is led by itself, and meets no other."""
    fine, spacing = FineGraph.of(component), float(np.median(edge_lengths(coarse.positions, edges)))
    chains = _chains(edges, coarse.boundary)
    used = component.on_boundary()
    used[coarse.kept[[end for chain in chains for end in (chain[0], chain[-1])]]] = True
    paths = []
    # What is short has least choice.
    for chain in sorted(chains, key=len):
        along, allowed, start = coarse.kept[chain], ~used, np.zeros_like(used)
        allowed[along[[0, -1]]] = start[along[0]] = True
        path = _led([fine], start, int(along[-1]), along, spacing, allowed, in_plane=False)
        path = fine.straightened(path, ~allowed, spacing)
        used[path] = True
        paths.append(path)
    return edges_along(component, paths)


def _chains(edges: np.ndarray, boundary: np.ndarray) -> list[np.ndarray]:
    """Vertices (k,) of the paths that edges (e,2) make between vertices where they branch, end, or meet a boundary
    (n,) bool; a loop with less than two such is two paths."""
    n = len(boundary)
    node = (np.bincount(edges.ravel(), minlength=n) != 2) | boundary
    chains, waiting = list[np.ndarray](), [edges]
    while waiting:
        part = waiting.pop()
        label = between_nodes(part, node)
        for k in np.unique(label):
            chain = part[label == k]
            ends = np.unique(chain[node[chain]])
            begin = int(ends[0] if len(ends) else chain.min())
            graph = csr_matrix((np.ones(len(chain)), tuple(chain.T)), shape=(n, n))
            order, before = breadth_first_order(graph, begin, directed=False)
            if len(ends) == 2:
                chains.append(path_to(before, int(ends[1]))[::-1])
            else:
                node[[begin, order[-1]]] = True
                waiting.append(chain)
    return chains


def _led(
    graphs: list[FineGraph],
    used: np.ndarray,
    end: int,
    along: np.ndarray,
    spacing: float,
    allowed: np.ndarray,
    in_plane: bool,
) -> np.ndarray:
    """Vertices (k,) of the cheapest path in the first of the graphs that has one, see `FineGraph.path`; from farther
    away where none has."""
    for graph in graphs:
        path = graph.path(used, end, along, spacing, allowed)
        if len(path):
            return path
    fine = graphs[-1]
    # A line along the plane may take diagonals of polygons, where there is none of edges: near to it, then.
    path = fine.path(used, end, along, spacing, np.ones_like(allowed)) if in_plane else np.zeros(0, np.int64)
    wider = (fine.path(used, end, along, spacing, allowed, reach=REACH * more) for more in WIDER)
    return path if len(path) else next((found for found in wider if len(found)), path)


def _forest(component: CutComponent, chosen: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Of the edges (e,) bool, those of a forest that hangs on the vertices `start` (n,) bool: a disk stays a disk."""
    edges = np.flatnonzero(chosen)
    # All of `start` is one vertex, number 0.
    number = np.where(start, 0, 1 + np.arange(len(start)))
    a, b = np.sort(number[component.ends[edges]], axis=1).T
    order = np.lexsort((component.cost[edges], b, a))
    first = order[np.unique(np.stack([a, b], axis=1)[order], axis=0, return_index=True)[1]]
    first = first[a[first] != b[first]]
    n = len(start) + 1
    tree = minimum_spanning_tree(csr_matrix((1.0 + np.arange(len(first)), (a[first], b[first])), shape=(n, n)))
    kept = first[tree.data.astype(np.int64) - 1]
    label = graph_components(a[kept], b[kept], n)[1]
    forest = np.zeros(len(chosen), dtype=bool)
    forest[edges[kept[label[a[kept]] == label[0]]]] = True
    return forest


def _outwards(graph: PathGraph, steps: np.ndarray) -> list[np.ndarray]:
    """Vertices (k,) of the stretches of a cut from near to far, each after those between it and the boundary."""
    if len(steps) == 0:
        return []
    depth = graph.depth(steps)
    found = []
    for stretch in stretches(graph, steps):
        vertices = np.unique(graph.ends[stretch])
        found.append(vertices[np.argsort(depth[vertices], kind="stable")])
    return sorted(found, key=lambda vertices: depth[vertices[0]])


@dataclass(frozen=True)
class FineGraph:
    """Edges (e,2) of a component that can be cut, and those of its boundary: their cost and their length, (n,n)."""

    component: CutComponent
    ends: np.ndarray
    cost: csr_matrix
    length: csr_matrix

    @staticmethod
    def of(component: CutComponent, image: np.ndarray | None = None) -> FineGraph:
        """The graph of a component; diagonals of polygons are no edges.

        image (n,): mirror image of every vertex; edges whose image is no edge stay away.
        """
        inner = np.isfinite(component.cost)
        if image is not None:
            keys = pair_keys(*component.ends[inner].T)
            inner[inner] = np.isin(pair_keys(*image[component.ends[inner]].T), keys)
        tail, head = halfedges(component.triangles)
        boundary = component.boundary
        ends = np.concatenate([component.ends[inner], np.column_stack([tail[boundary], head[boundary]])])
        length = edge_lengths(component.positions, ends)
        length = length + 1e-9 * max(float(length.mean()), 1e-30)
        cost = np.concatenate([component.cost[inner], length[inner.sum() :]])
        rows, columns = np.concatenate([ends, ends[:, ::-1]]).T
        shape = (component.vertex_count,) * 2
        return FineGraph(
            component,
            ends,
            csr_matrix((np.tile(cost, 2), (rows, columns)), shape=shape),
            csr_matrix((np.tile(length, 2), (rows, columns)), shape=shape),
        )

    @cached_property
    def network(self) -> EdgeNetwork:
        """The same for straightening; many graphs never ask for it."""
        a, b = self.ends.T
        rate = np.asarray(self.cost[a, b] / self.length[a, b]).ravel()
        return edge_network(self.component.positions, self.component.triangles, self.ends, rate)

    def straightened(self, path: np.ndarray, blocked: np.ndarray, limit: float) -> np.ndarray:
        """A path (k,) that turns less, past blocked vertices (n,) bool, if it passes all of the given one (k,) within a
        limit; the given one otherwise."""
        if len(path) < 3 or limit <= 0:
            return path
        (found,) = straighten(self.network, [path], blocked)
        return path if self.missed(found, path, limit) is not None else found

    def joined(self, path: np.ndarray) -> bool:
        """Whether there is an edge between all vertices (k,) that follow each other, or they are one."""
        a, b = path[:-1], path[1:]
        return bool((np.asarray(self.cost[a, b]).ravel() > 0)[a != b].all()) if len(a) else True

    def missed(self, path: np.ndarray, along: np.ndarray, reach: float) -> int | None:
        """The number of one of the vertices `along` (a,), amid those that are beyond reach of a path (k,); None if none
        is, or there is no path."""
        if not len(path) or not len(along):
            return None
        beyond = np.flatnonzero(np.isinf(dijkstra(self.length, indices=path, min_only=True, limit=reach)[along]))
        return int(beyond[len(beyond) // 2]) if len(beyond) else None

    def path(
        self,
        start: np.ndarray,
        end: int,
        along: np.ndarray,
        spacing: float,
        allowed: np.ndarray,
        reach: float = REACH,
    ) -> np.ndarray:
        """Vertices (k,) of the cheapest path from `end` to any of `start` (n,) bool, near the vertices `along` (a,).

        spacing: length of a coarse edge; allowed (n,) bool: vertices that it may run over; reach: how far from `along`,
        in lengths of coarse edges. Empty if there is none.
        """
        astray = dijkstra(self.length, indices=along, min_only=True, limit=reach * spacing)
        near = np.flatnonzero(np.isfinite(astray) & allowed)
        if not start[near].any() or not allowed[end]:
            return np.zeros(0, np.int64)
        far = astray[near] / max(spacing, 1e-300)
        graph = self.cost[near][:, near].tocoo()
        cost = graph.data * (1 + ASTRAY * (far[graph.row] + far[graph.col]) ** 2)
        graph = csr_matrix((cost, (graph.row, graph.col)), shape=graph.shape)
        begin = np.flatnonzero(start[near])
        _, before, _ = dijkstra(graph, indices=begin, min_only=True, return_predecessors=True)
        path = near[path_to(before, int(np.searchsorted(near, end)))]
        return path if start[path[-1]] else np.zeros(0, np.int64)
