"""Cut a component with a mirror plane so that it becomes a disk and stays its own mirror image.

Arcs come in mirrored pairs, or run in the plane. Without handles they form a tree with the boundaries: the first pair
meets in the plane, and no other that leaves the plane comes back to it. With handles, one half is cut into a disk, and
is joined to its image along one piece of the plane alone: the Euler characteristic of both is 2 less the number of
such pieces.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..cutting.component import CutComponent, boundary_vertices
from ..cutting.cut_graph import greedy_arcs, is_disk, shorten, stretches
from ..mesh.topology import graph_components, pair_keys
from .coarse_surface import in_half
from .fine_paths import FineGraph, FineMirror, edges_along
from .path_graph import path_to

# How far from the images of its vertices the image of an arc may run, over the size, where these are not exact.
AROUND_IMAGES = 0.01


@dataclass(frozen=True)
class _ArcPlace:
    """Where an arc may run: from `start` over `allowed` to `end`, all (n,) bool; pairs of arcs count twice."""

    start: np.ndarray
    allowed: np.ndarray
    end: np.ndarray
    count: int


def symmetric_base(component: CutComponent, mirror: FineMirror) -> np.ndarray | None:
    """Edges (e,) bool that cut a component into a disk, symmetrically; None where there are none."""
    loops = boundary_vertices(component)
    edges = len(component.pair) + len(component.boundary)
    flat = component.vertex_count - edges + len(component.triangles) + len(loops) == 2
    found = _by_arcs(component, mirror, loops) if flat else None
    return _by_halves(component, mirror) if found is None else found


def _by_arcs(component: CutComponent, mirror: FineMirror, loops: list[np.ndarray]) -> np.ndarray | None:
    """What `symmetric_base` finds for a component without handles, whose boundaries have these vertices (k,)."""
    loop = np.full(component.vertex_count, -1)
    for k, vertices in enumerate(loops):
        loop[vertices] = k
    # Where a face was mapped apart, the rest of its boundary need not be quite its own image.
    votes = [np.bincount(loop[mirror.image[vertices]] + 1, minlength=len(loops) + 1)[1:] for vertices in loops]
    own = np.array([vote.argmax() == k for k, vote in enumerate(votes)], dtype=bool)
    size = np.array(
        [len(vertices) if own[k] and mirror.plane[vertices].any() else 0 for k, vertices in enumerate(loops)]
    )
    joined, left = np.zeros(component.vertex_count, dtype=bool), np.ones(len(loops), dtype=bool)
    if size.any():
        joined[loops[int(size.argmax())]] = True
        left[size.argmax()] = False
    graph = FineGraph.of(component, mirror.image).cost
    paths: list[np.ndarray] = []
    while left.any():
        target = (loop >= 0) & left[loop]
        path = _cheapest(graph, _ways(mirror, joined, target, target & own[loop]))
        ends = np.zeros(0, np.int64) if path is None else np.unique(loop[[path[-1], mirror.image[path[-1]]]])
        if path is None or (ends < 0).any() or not left[ends].all():
            return None
        for end in ends:
            joined[loops[int(end)]] = True
        left[ends] = False
        joined[path] = joined[mirror.image[path]] = True
        paths += [path, mirror.image[path]]
    cut = edges_along(component, paths)
    # Where the mesh is not quite its own image, an arc may meet another one's image.
    return cut if is_disk(component, cut) else None


def _ways(mirror: FineMirror, joined: np.ndarray, target: np.ndarray, crossing: np.ndarray) -> list[_ArcPlace]:
    """The ways to boundaries that are left, `target`, from what is joined, both (n,) bool; crossing: in the plane."""
    off = mirror.side & ~mirror.plane
    if not joined.any():
        return [_ArcPlace(mirror.plane, off | mirror.plane, off & target, 2)]
    beside = _ArcPlace(joined & (mirror.side | mirror.plane), (off & ~crossing) | joined, off & target & ~crossing, 2)
    return [beside, _ArcPlace(joined & mirror.plane, mirror.plane, mirror.plane & crossing, 1)]


def _cheapest(graph: csr_matrix, ways: list[_ArcPlace]) -> np.ndarray | None:
    """Vertices (k,) of the cheapest arc that one of the ways allows; None if there is no arc."""
    best, least = None, np.inf
    for way in ways:
        inner = np.flatnonzero(way.start | way.allowed | way.end)
        begin, goal = np.flatnonzero(way.start[inner]), np.flatnonzero(way.end[inner])
        if len(begin) == 0 or len(goal) == 0:
            continue
        cost, before, _ = dijkstra(graph[inner][:, inner], indices=begin, min_only=True, return_predecessors=True)
        last = int(goal[np.argmin(cost[goal])])
        if way.count * cost[last] < least:
            least = way.count * cost[last]
            best = inner[path_to(before, last)[::-1]]
    return best


def _by_halves(component: CutComponent, mirror: FineMirror) -> np.ndarray | None:
    """What `symmetric_base` finds, handles or not: a cut of one half, its image, and all of the plane but
    the dearest piece between these."""
    within = mirror.side | mirror.plane
    chosen = in_half(component.triangles, within, mirror.plane)
    sides = chosen[component.pair // 3]
    border = sides.any(axis=1) & ~sides.all(axis=1)
    half, vertices = _part(component, chosen)
    one, other = half.pair.T // 3
    parts = graph_components(one, other, len(half.triangles))[0]
    if parts != 1 or not border.any() or not mirror.plane[component.ends[border]].all():
        return None
    graph = FineGraph.of(component, mirror.image if mirror.exact else None)
    ends = vertices[half.ends]
    dear = np.asarray(graph.cost[ends[:, 0], ends[:, 1]]).ravel() == 0
    half = replace(half, cost=np.where(dear, np.inf, half.cost))
    none = np.zeros(0, np.int64)
    found = shorten(half, greedy_arcs(half, none), none)
    arcs = [vertices[path] for path in _paths(half, found)]
    images = [image for image in (_image(graph, mirror, path) for path in arcs) if image is not None]
    if len(images) < len(arcs):
        return None
    cut = edges_along(component, [*arcs, *images])
    kept = stretches(component, border, np.unique(vertices[half.ends[found]]))[0]
    cut |= border
    cut[kept] = False
    return cut if np.isfinite(component.cost[cut]).all() and is_disk(component, cut) else None


def _part(component: CutComponent, chosen: np.ndarray) -> tuple[CutComponent, np.ndarray]:
    """The triangles (m,) bool of a component as one of their own, and the vertices (k,) that these have there."""
    vertices, triangles = np.unique(component.triangles[chosen], return_inverse=True)
    place = np.cumsum(chosen) - 1
    inner = chosen[component.pair // 3].all(axis=1)
    pair = component.pair[inner]
    pair = 3 * place[pair // 3] + pair % 3
    outside = np.ones(3 * int(chosen.sum()), dtype=bool)
    outside[pair] = False
    part = CutComponent(
        positions=component.positions[vertices],
        triangles=triangles.reshape(-1, 3),
        pair=pair,
        gluing_pair=component.gluing_pair[inner],
        ends=np.searchsorted(vertices, component.ends[inner]),
        length=component.length[inner],
        cost=component.cost[inner],
        boundary=np.flatnonzero(outside),
        members=component.members[chosen],
        polygons=component.polygons[chosen],
        vertex_ids=component.vertex_ids[vertices],
        avoid=component.avoid[vertices],
    )
    return part, vertices


def _paths(component: CutComponent, cut: np.ndarray) -> list[np.ndarray]:
    """Vertices (k,) of every path of the cut (e,) bool between branchings and boundaries; two of one that closes."""
    n, found = component.vertex_count, []
    node = component.on_boundary() | (np.bincount(component.ends[cut].ravel(), minlength=n) > 2)
    for stretch in stretches(component, cut, np.zeros(0, np.int64)):
        ends = component.ends[stretch]
        vertices, count = np.unique(ends, return_counts=True)
        last = vertices[count == 1]
        begin = int(last[0] if len(last) else vertices[node[vertices]][0])
        found.append(_longest(ends, begin, n))
        if not len(last):
            half = pair_keys(found[-1][:-1], found[-1][1:])
            found.append(_longest(ends[~np.isin(pair_keys(*ends.T), half)], begin, n))
    return found


def _longest(ends: np.ndarray, begin: int, n: int) -> np.ndarray:
    """Vertices (k,) of the way along edges (e,2), of n vertices, from the farthest of them to `begin`."""
    graph = csr_matrix((np.ones(len(ends)), ends.T), shape=(n, n))
    far, before = dijkstra(graph, directed=False, indices=begin, return_predecessors=True)
    return path_to(before, int(np.argmax(np.where(np.isfinite(far), far, -1.0))))


def _image(graph: FineGraph, mirror: FineMirror, path: np.ndarray) -> np.ndarray | None:
    """The mirror image (k,) of a path (k,) along edges of a graph, from end to end; None if there is none."""
    image = mirror.image[path]
    if graph.joined(image):
        return image
    end, allowed = np.zeros(len(mirror.image), dtype=bool), ~(mirror.side | mirror.plane)
    end[image[-1]] = allowed[image[[0, -1]]] = True
    found = graph.path(end, int(image[0]), image, AROUND_IMAGES, allowed)
    return found if len(found) else None
