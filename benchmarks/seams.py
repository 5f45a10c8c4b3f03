"""Cut one fixed seam per model, so that every unwrap is given the same chart.

A closed surface of genus 0 is cut along a tree of shortest edge paths through a few extremities, found by
farthest-point sampling on the edge graph; boundary loops are joined into the tree first. The result is one disk.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

EXTREMITIES = 4


def cut_seams(V, F, extremities=EXTREMITIES):
    """Seam edges that open a connected surface of genus 0 into a disk: (k,2) vertex pairs, none for a disk.

    V : (n,3) positions, F : (m,3) triangles.
    """
    graph, loops = _edge_graph(V, F)
    if len(loops) == 1:
        return np.empty((0, 2), np.int64)
    seams, tree = [], set(loops[0].tolist()) if loops else set()
    waiting = loops[1:]
    while waiting:  # nearest loop first, or a path could run along the boundary of another one and pinch it
        distance, before = _from_set(graph, tree)
        nearest = min(range(len(waiting)), key=lambda i: distance[waiting[i]].min())
        loop = waiting.pop(nearest)
        seams += _path(before, loop[np.argmin(distance[loop])], tree)
        tree |= set(loop.tolist())
    points = _farthest_points(graph, np.unique(F), extremities)
    if not tree:
        tree = {int(points[0])}
    for point in points:
        if int(point) not in tree:
            _, before = _from_set(graph, tree)
            seams += _path(before, int(point), tree)
    return np.array(sorted({(min(e), max(e)) for e in seams}), dtype=np.int64).reshape(-1, 2)


def _edge_graph(V, F):
    """The symmetric graph of edge lengths, and the boundary loops as vertex arrays."""
    sides = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(sides, axis=0, return_counts=True)
    i, j = edges.T
    length = np.linalg.norm(V[i] - V[j], axis=1)
    graph = csr_matrix((np.tile(length, 2), (np.concatenate([i, j]), np.concatenate([j, i]))), shape=(len(V),) * 2)
    boundary = edges[uses == 1]
    _, label = connected_components(
        csr_matrix((np.ones(len(boundary)), boundary.T), shape=(len(V),) * 2), directed=False
    )
    used = np.unique(boundary)
    return graph, [used[label[used] == k] for k in np.unique(label[used])]


def _farthest_points(graph, used, count):
    """Farthest-point sampling by edge-path distance, started at the farthest vertex from the first one."""
    distance = dijkstra(graph, indices=int(used[0]))
    points = [int(used[np.argmax(distance[used])])]
    while len(points) < count:
        distance = dijkstra(graph, indices=points, min_only=True)
        points.append(int(used[np.argmax(distance[used])]))
    return points


def _from_set(graph, sources):
    distance, before, _ = dijkstra(graph, indices=sorted(sources), min_only=True, return_predecessors=True)
    return distance, before


def _path(before, end, tree):
    """Edges of the shortest path from `end` back to the tree, whose vertices it adds to the tree."""
    edges, vertex = [], int(end)
    while before[vertex] >= 0:
        edges.append((vertex, int(before[vertex])))
        tree.add(vertex)
        vertex = int(before[vertex])
    return edges
