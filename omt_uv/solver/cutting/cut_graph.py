"""Cut a component into a disk along shortest paths, by tree-cotree (Erickson, Whittlesey 2005) and local search.

`greedy_arcs` finds the shortest system of arcs between given roots and boundaries (tree-cotree with geodesic
lengths); `shorten` then replaces one stretch of the cut at a time by the shortest that does its work, which also lets
three cuts meet where that saves length.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra, minimum_spanning_tree

from ..mesh.topology import graph_components, halfedges, next_halfedge
from .component import CutComponent

# Times that all stretches of a cut are tried again.
SWEEPS = 3
# Where there are many holes only so many of the most expensive stretches are tried again.
MOST_STRETCHES = 64


def greedy_arcs(component: CutComponent, roots: np.ndarray) -> np.ndarray:
    """Edges (e,) bool whose cut leaves a disk, with all of the boundary and the vertices `roots` (k,) on its boundary.

    A shortest-path forest grows from the roots and the boundary, and a spanning tree of the faces avoids it and crosses
    first what would be long cuts; each edge in neither closes an arc (Eppstein 2003; Erickson, Whittlesey 2005,
    "Greedy optimal homotopy and homology generators", section 3).
    """
    start = component.on_boundary()
    start[roots] = True
    roots = np.flatnonzero(start)
    distance, before, _ = dijkstra(component.graph, indices=roots, min_only=True, return_predecessors=True)
    above = _edge_above(component, before)
    forest = np.zeros(len(component.pair), dtype=bool)
    forest[above[above >= 0]] = True
    arc = distance[component.ends].sum(axis=1) + component.cost
    crossed = _spanning_cotree(component, ~forest, arc)
    closing = ~forest & ~crossed
    chosen = _ancestors(before, component.ends[closing].ravel())
    cut = closing
    used = above[chosen]
    cut[used[used >= 0]] = True
    return cut


def _edge_above(component: CutComponent, before: np.ndarray) -> np.ndarray:
    """Edge (n,) to the predecessor of every vertex, -1 where it has none."""
    child = np.flatnonzero(before >= 0)
    above = np.full(component.vertex_count, -1, dtype=np.int64)
    above[child] = _edges_between(component.ends, child, before[child].astype(np.int64), component.vertex_count)
    return above


def _spanning_cotree(component: CutComponent, allowed: np.ndarray, arc: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of the spanning tree of the faces that crosses the allowed edges of the longest arcs."""
    edges = np.flatnonzero(allowed)
    edges = edges[np.argsort(-arc[edges], kind="stable")]
    t, s = component.pair[edges].T // 3
    m = len(component.triangles)
    # Of several edges between two faces, the first in order stands for all.
    _, first = np.unique(np.minimum(t, s) * m + np.maximum(t, s), return_index=True)
    first = first[t[first] != s[first]]
    rank = first + 1.0
    tree = minimum_spanning_tree(coo_matrix((rank, (t[first], s[first])), shape=(m, m)).tocsr())
    crossed = np.zeros(len(component.pair), dtype=bool)
    crossed[edges[tree.data.astype(np.int64) - 1]] = True
    return crossed


def _ancestors(before: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """The vertices (k,) and all their predecessors, by pointer doubling."""
    jump = np.where(before >= 0, before, np.arange(len(before)))
    found = np.zeros(len(before), dtype=bool)
    found[vertices] = True
    while True:
        more = found.copy()
        more[jump[found]] = True
        if (more == found).all() and (jump[jump] == jump).all():
            return np.flatnonzero(found)
        found, jump = more, jump[jump]


def shorten(
    component: CutComponent,
    cut: np.ndarray,
    tips: np.ndarray,
    around: np.ndarray | None = None,
    tried: set[bytes] | None = None,
) -> np.ndarray:
    """The cut (e,) bool with each stretch replaced by the shortest path that does the same; `tips` (k,) stay on it.

    Without one stretch the open component is an annulus. The shortest path between its two boundaries may take off
    anywhere along them, so stretches branch off one another where that is shorter. `around` (e,) bool confines this
    to stretches that touch these edges, once. tried : stretches of this cut, with these tips, that nothing shorter
    replaces, and in the end those of the cut that is returned
    """
    tried = set() if tried is None else tried
    for _ in range(SWEEPS if around is None else 1):
        before = float(component.cost[cut].sum())
        for stretch in stretches(component, cut, tips)[:MOST_STRETCHES]:
            if stretch.tobytes() in tried:
                continue
            if not _is_stretch(component, cut, stretch) or not _touches(component, stretch, around):
                continue
            rest = cut.copy()
            rest[stretch] = False
            length = component.cost[stretch].sum()
            path = _shortest_bridge(component, rest, tips, length)
            if path is not None and component.cost[path].sum() < length * (1 - 1e-9):
                cut = rest
                cut[path] = True
                tried.clear()
            else:
                tried.add(stretch.tobytes())
        if component.cost[cut].sum() >= before * (1 - 1e-3):
            break
    return cut


def _touches(component: CutComponent, stretch: np.ndarray, around: np.ndarray | None) -> bool:
    return around is None or bool(np.isin(component.ends[stretch], component.ends[around]).any())


def stretches(component: CutComponent, cut: np.ndarray, tips: np.ndarray) -> list[np.ndarray]:
    """The cut in paths of edges between tips, branchings and the boundary, the most expensive first."""
    edges = np.flatnonzero(cut)
    if len(edges) == 0:
        return []
    ends = component.ends[edges]
    node = np.bincount(ends.ravel(), minlength=component.vertex_count) != 2
    node |= component.on_boundary()
    node[tips] = True
    # Edges are joined through vertices that are no nodes; every edge has a place of its own for its ends at nodes.
    k = len(edges)
    place = np.where(node[ends], component.vertex_count + np.arange(2 * k).reshape(k, 2), ends)
    size = component.vertex_count + 2 * k
    graph = coo_matrix((np.ones(k), place.T), shape=(size, size))
    label = connected_components(graph, directed=False)[1][place[:, 0]]
    total = np.bincount(label, component.cost[edges])
    return [edges[label == c] for c in np.argsort(-total, kind="stable")[: len(np.unique(label))]]


def _is_stretch(component: CutComponent, cut: np.ndarray, stretch: np.ndarray) -> bool:
    """Whether the edges (k,) are still in the cut and nothing has come to branch off between them."""
    vertices, uses = np.unique(component.ends[stretch], return_counts=True)
    degree = np.bincount(component.ends[cut].ravel(), minlength=component.vertex_count)
    return bool(cut[stretch].all() and (degree[vertices[uses == 2]] == 2).all())


def cut_classes(component: CutComponent, cut: np.ndarray) -> np.ndarray:
    """Vertex (m,3) of every triangle corner in the component cut open along the cut (e,) bool, numbered from 0 as they
    first occur."""
    flat, n = component.triangles.ravel(), component.vertex_count
    on_cut = np.zeros(n, dtype=bool)
    on_cut[component.ends[cut].ravel()] = True
    # A vertex off the cut stays one: only the corners of the others are joined anew.
    corner = np.flatnonzero(on_cut[flat])
    place = np.empty(len(flat), dtype=np.int64)
    place[corner] = np.arange(len(corner))
    rows, columns = _joined_corners(flat, *component.pair[~cut & on_cut[component.ends].any(axis=1)].T)
    joined = on_cut[flat[rows]]
    count, part = graph_components(place[rows[joined]], place[columns[joined]], len(corner))
    found = flat.astype(np.int64)
    found[corner] = n + part
    first = np.full(n + count, len(flat))
    first[found[::-1]] = np.arange(len(flat))[::-1]
    is_first = np.zeros(len(flat) + 1, dtype=bool)
    is_first[first] = True
    return (np.cumsum(is_first)[first] - 1)[found].reshape(-1, 3)


def _joined_corners(flat: np.ndarray, f: np.ndarray, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of corners, (2k,) each, of the vertices flat (c,), that two halfedges f, s (k,) of an edge each join."""
    next_f, next_s = next_halfedge(f), next_halfedge(s)
    same = flat[f] == flat[s]
    rows = np.concatenate([f, next_f])
    return rows, np.concatenate([np.where(same, s, next_s), np.where(same, next_s, s)])


def cut_boundary(component: CutComponent, cut: np.ndarray) -> np.ndarray:
    """Boundary halfedges of the component cut open along the cut (e,) bool."""
    return np.concatenate([component.boundary, component.pair[cut].ravel()])


def is_disk(component: CutComponent, cut: np.ndarray) -> bool:
    """Whether the component, open along the cut (e,) bool, is a disk."""
    corners = cut_classes(component, cut)
    border = cut_boundary(component, cut)
    tail, head = (ends[border] for ends in halfedges(corners))
    used, ends = np.unique(np.stack([tail, head]), return_inverse=True)
    one, other = ends.reshape(2, -1)
    loops = graph_components(one, other, len(used))[0]
    edges = (3 * len(corners) + len(border)) // 2
    return loops == 1 and int(corners.max()) + 1 - edges + len(corners) == 1


def _shortest_bridge(component: CutComponent, cut: np.ndarray, tips: np.ndarray, longest: float) -> np.ndarray | None:
    """Edges of the shortest path between the two boundaries of the component cut open along `cut`.

    None if there are not two, or if it is longer than `longest`: what is farther away is not looked at.
    """
    two = _two_boundaries(component, cut, tips)
    if two is None:
        return None
    apart = (two.side >= 0).all(axis=1) & (two.side[:, 0] != two.side[:, 1])
    # From the shorter one less is looked at.
    begun, ended = sorted((_spokes(component, two, side) for side in (0, 1)), key=lambda spokes: len(spokes[0]))
    found = _between(component, two.on, begun, ended, longest)
    best = longest if found is None else found[1]
    lone = two.edges[apart]
    if len(lone) and component.cost[lone].min() <= best:
        return lone[[component.cost[lone].argmin()]]
    return None if found is None else found[0]


class _TwoBoundaries(NamedTuple):
    """The boundaries of a cut component.

    on (n,) bool : its vertices upon them, before they were cut; edges (k,) : others than cut ones that have an end
    there; side (k,2) : the boundary, 0 or 1, at which an end of these is, -1 for none
    """

    on: np.ndarray
    edges: np.ndarray
    side: np.ndarray


def _two_boundaries(component: CutComponent, cut: np.ndarray, tips: np.ndarray) -> _TwoBoundaries | None:
    """The two boundaries of the component cut open along the cut (e,) bool; None where there are not two.

    A tip (t,) that the cut does not touch is a boundary of one point.
    """
    flat = component.triangles.ravel()
    border = cut_boundary(component, cut)
    on = np.zeros(component.vertex_count, dtype=bool)
    on[flat[border]] = on[flat[next_halfedge(border)]] = on[tips] = True
    # Only what is on a boundary comes apart: the corners of all other vertices stay together.
    corner = np.flatnonzero(on[flat])
    place = np.zeros(len(flat), dtype=np.int64)
    place[corner] = np.arange(len(corner))
    edges = np.flatnonzero(~cut & (on[component.ends[:, 0]] | on[component.ends[:, 1]]))
    f, s = component.pair[edges].T
    rows, columns = _joined_corners(flat, f, s)
    joined = on[flat[rows]]
    count, copy = graph_components(place[rows[joined]], place[columns[joined]], len(corner))
    sides, label = graph_components(copy[place[border]], copy[place[next_halfedge(border)]], count)
    if sides != 2:
        return None
    ends = np.stack([f, next_halfedge(f)], axis=1)
    return _TwoBoundaries(on, edges, np.where(on[flat[ends]], label[copy[place[ends]]], -1))


def _spokes(component: CutComponent, two: _TwoBoundaries, side: int) -> tuple[np.ndarray, np.ndarray]:
    """Edges (k,) from one boundary to the inside, the cheapest for every vertex there, and these vertices (k,)."""
    row, at = np.nonzero((two.side == side) & (two.side[:, ::-1] < 0))
    edge = two.edges[row]
    # The halfedges of an edge begin at its first end.
    inside = component.ends[edge, 1 - at]
    order = np.lexsort((component.cost[edge], inside))
    vertex, first = np.unique(inside[order], return_index=True)
    edge = edge[order[first]]
    finite = np.isfinite(component.cost[edge])
    return edge[finite], vertex[finite]


def _between(
    component: CutComponent,
    closed: np.ndarray,
    begun: tuple[np.ndarray, np.ndarray],
    ended: tuple[np.ndarray, np.ndarray],
    longest: float,
) -> tuple[np.ndarray, float] | None:
    """Edges (k,) of the shortest path that begins and ends with one of these edges each, from and to these vertices,
    and through none that is closed (n,) bool, and its cost; None where it costs more than `longest`."""
    n, graph = component.vertex_count, component.graph
    if not len(begun[0]) or not len(ended[0]):
        return None
    row = np.repeat(np.arange(n, dtype=np.int32), np.diff(graph.indptr))
    inner = np.where(closed[row] | closed[graph.indices], np.inf, graph.data)
    # One more vertex begins all paths.
    data = np.concatenate([inner, component.cost[begun[0]]])
    indices = np.concatenate([graph.indices, begun[1].astype(np.int32)])
    indptr = np.append(graph.indptr, np.int32(len(data)))
    distance, before = dijkstra(
        csr_matrix((data, indices, indptr), shape=(n + 1, n + 1)), indices=n, return_predecessors=True, limit=longest
    )
    total = distance[ended[1]] + component.cost[ended[0]]
    last = int(total.argmin())
    # What is barred all around has no way, whatever it may cost.
    if not (np.isfinite(total[last]) and total[last] <= longest):
        return None
    on_path = _ancestors(np.where(before[:n] < n, before[:n], -1), ended[1][[last]])
    first = on_path[before[on_path] == n]
    on_path = on_path[before[on_path] < n]
    path = _edges_between(component.ends, on_path, before[on_path].astype(np.int64), n)
    return np.concatenate([begun[0][np.searchsorted(begun[1], first)], path, ended[0][[last]]]), float(total[last])


def _edges_between(ends: np.ndarray, a: np.ndarray, b: np.ndarray, n: int) -> np.ndarray:
    """Number (k,) of the edges, of those with the given ends (e,2), between vertices a and b (k,)."""
    touched = np.zeros(n, dtype=bool)
    touched[a] = touched[b] = True
    near = np.flatnonzero(touched[ends[:, 0]] & touched[ends[:, 1]])
    key = ends[near].min(axis=1) * n + ends[near].max(axis=1)
    order = np.argsort(key)
    return near[order[np.searchsorted(key[order], np.minimum(a, b) * n + np.maximum(a, b))]]


def path_to(component: CutComponent, start: np.ndarray, end: int) -> np.ndarray:
    """Edges (e,) bool of the shortest path from any of the vertices `start` (k,) to the vertex `end`."""
    n = component.vertex_count
    _, before, _ = dijkstra(component.graph, indices=start, min_only=True, return_predecessors=True)
    on_path = _ancestors(before, np.array([end]))
    on_path = on_path[before[on_path] >= 0]
    path = np.zeros(len(component.pair), dtype=bool)
    path[_edges_between(component.ends, on_path, before[on_path].astype(np.int64), n)] = True
    return path


def distance_from(start: np.ndarray, ends: np.ndarray, length: np.ndarray) -> np.ndarray:
    """How far the nodes (n,) of a graph with edges `ends` (e,2) of these lengths (e,) are from the nearest of those
    that it starts from (n,) bool; infinite where there is none."""
    n, begins = len(start), np.flatnonzero(start)
    if not len(begins):
        return np.full(n, np.inf)
    # An edge without a length would be none.
    graph = csr_matrix((np.maximum(length, 1e-300), ends.T), shape=(n, n))
    return dijkstra(graph, directed=False, indices=begins, min_only=True)
