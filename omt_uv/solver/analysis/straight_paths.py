"""Straighten paths along edges: of all ways between the same ends, nearby, the one that is short and turns little.

A shortest path along edges is not straight: on even triangles many are as short as each other, and most of them zigzag.
Here a turn has a price, too. A state is an edge that a path runs along, so that a step from state to state knows by how
much it turns: the shortest path of states is the best path. What surrounds a path and is looked through is a disk, so
that a better path can be moved to from the given one, and a cut along it opens a surface in the same way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..mesh.geometry import cross3, unit, vertex_normals
from ..mesh.topology import expand, graph_components, halfedges, pair_keys, paired

# Rings of vertices beside a path in which a straighter one is looked for.
RINGS = 4
# Price of a turn by a right angle, over the mean of the edges that meet there.
TURN = 1.0


@dataclass(frozen=True)
class EdgeNetwork:
    """Edges of a surface that paths may run along, in both directions, by the vertex where they start.

    Attributes
    ----------
    triangles (m,3), sides (t,2) : the surface, and the edges of its triangles
    start (n+1,) : edges start[v]:start[v+1] leave vertex v; head (s,) : where each ends
    price (s,) : of each, its length times its cost
    leaving (s,3), arriving (s,3) : its direction in the tangent planes at its two ends
    """

    triangles: np.ndarray
    sides: np.ndarray
    start: np.ndarray
    head: np.ndarray
    price: np.ndarray
    leaving: np.ndarray
    arriving: np.ndarray


def edge_network(positions: np.ndarray, triangles: np.ndarray, edges: np.ndarray, cost: np.ndarray) -> EdgeNetwork:
    """The network of the edges (e,2) of a surface (n,3), (m,3), with costs (e,) > 0 per length; infinite: none."""
    keys = np.unique(pair_keys(*halfedges(triangles)))
    kept = np.isfinite(cost)
    (a, b), cost = edges[kept].T, cost[kept]
    tail, head, cost = np.concatenate([a, b]), np.concatenate([b, a]), np.tile(cost, 2)
    order = np.lexsort((head, tail))
    tail, head, cost = tail[order], head[order], cost[order]
    along = positions[head] - positions[tail]
    normal = vertex_normals(positions, triangles)
    leaving, arriving = (unit(along - (along * normal[v]).sum(axis=1)[:, None] * normal[v]) for v in (tail, head))
    return EdgeNetwork(
        triangles=triangles,
        sides=paired(keys),
        start=np.searchsorted(tail, np.arange(len(positions) + 1)),
        head=head,
        price=np.linalg.norm(along, axis=1) * cost,
        leaving=leaving,
        arriving=arriving,
    )


def straighten(
    network: EdgeNetwork, paths: Sequence[np.ndarray], blocked: np.ndarray | None = None, turn: float = TURN
) -> list[np.ndarray]:
    """Paths of vertices (k,) that start and end where the given ones (k,) do, and meet nowhere else if these do not.

    blocked (n,) bool: vertices that no path may touch but where it does already, such as those of a boundary. A path
    that ends where it starts is straightened but for that vertex. turn: price of a turn by a right angle.
    """
    used = np.zeros(len(network.start) - 1, np.int64) if blocked is None else blocked.astype(np.int64)
    for path in paths:
        used[path] += 1
    result = []
    for path in paths:
        used[path] -= 1
        better = _loop(network, path, used > 0, turn) if path[0] == path[-1] else _path(network, path, used > 0, turn)
        used[better] += 1
        result.append(better)
    return result


def turning_angles(positions: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Angles (k-2,) in [0, pi] by which a path (k,) of vertices (n,3) turns at each but its ends."""
    along = unit(np.diff(positions[path], axis=0))
    cross = np.linalg.norm(cross3(along[:-1], along[1:]), axis=1)
    return np.arctan2(cross, (along[:-1] * along[1:]).sum(axis=1))


def closed_price(positions: np.ndarray, loop: np.ndarray) -> float:
    """The price of a closed path (k,) of vertices (n,3): its length, and that of its turns."""
    along = np.roll(positions[loop], -1, axis=0) - positions[loop]
    length, direction = np.linalg.norm(along, axis=1), unit(along)
    cosine = (direction * np.roll(direction, -1, axis=0)).sum(axis=1)
    return float((length + _turns(cosine, length, np.roll(length, -1), TURN)).sum())


def _turns(cosine: np.ndarray, before: np.ndarray, after: np.ndarray, turn: float) -> np.ndarray:
    """Prices (k,) of turns with this cosine between edges of these prices (k,)."""
    return turn * (1 - cosine) * (before + after) / 2


def _loop(network: EdgeNetwork, path: np.ndarray, blocked: np.ndarray, turn: float) -> np.ndarray:
    """A path (k,) that ends where it starts, straightened by halves, and then across the middle."""
    if len(path) < 5:
        return path
    for low, high in ((0.0, 0.5), (0.5, 1.0), (0.25, 0.75)):
        i, j = round(low * (len(path) - 1)), round(high * (len(path) - 1))
        rest = blocked.copy()
        rest[np.concatenate([path[:i], path[j + 1 :]])] = True
        path = np.concatenate([path[:i], _path(network, path[i : j + 1], rest, turn), path[j + 1 :]])
    return path


def _path(network: EdgeNetwork, path: np.ndarray, blocked: np.ndarray, turn: float) -> np.ndarray:
    """The best path between the ends of one (k,) through vertices near it that are not blocked."""
    near = _disk_about(network, path, blocked) if len(path) > 2 else None
    if near is None:
        return path
    vertices = np.flatnonzero(near)
    row, place = expand(np.diff(network.start)[vertices])
    edge = network.start[vertices][row] + place
    inside = near[network.head[edge]]
    edge, tail = edge[inside], vertices[row[inside]]
    head = network.head[edge]
    # Steps from an edge to those that leave its end, but not back along itself.
    first = np.searchsorted(tail, vertices)
    count = np.diff(np.append(first, len(tail)))
    at = np.searchsorted(vertices, head)
    here, place = expand(count[at])
    there = first[at][here] + place
    onwards = head[there] != tail[here]
    here, there = here[onwards], there[onwards]
    a, b = edge[here], edge[there]
    cosine = (network.arriving[a] * network.leaving[b]).sum(axis=1)
    price = network.price[b] + _turns(cosine, network.price[a], network.price[b], turn)
    # One more state, from which the edges at the start of the path are entered.
    enter, states = np.flatnonzero(tail == path[0]), len(edge)
    rows, columns = np.append(here, np.full(len(enter), states)), np.append(there, enter)
    graph = csr_matrix((np.append(price, network.price[edge[enter]]), (rows, columns)), shape=(states + 1,) * 2)
    distance, before = dijkstra(graph, indices=states, return_predecessors=True)
    last = np.flatnonzero(head == path[-1])
    if not len(last):
        # Nothing near leads there: the given one goes across a face.
        return path
    return _walked(path, tail, before, int(last[distance[last].argmin()]))


def _walked(path: np.ndarray, tail: np.ndarray, before: np.ndarray, state: int) -> np.ndarray:
    """Vertices of the best path, from its last state back; the given path (k,) if that one would cross itself."""
    steps = [int(path[-1])]
    while 0 <= state < len(tail):
        steps.append(int(tail[state]))
        state = int(before[state])
    simple = steps[-1] == path[0] and len(set(steps)) == len(steps)
    return np.array(steps[::-1], dtype=np.int64) if simple else path


def _disk_about(network: EdgeNetwork, path: np.ndarray, blocked: np.ndarray) -> np.ndarray | None:
    """Vertices (n,) bool at most `RINGS` edges from a path (k,), fewer where those would surround a tube or a hole;
    None if there is no such disk."""
    ring = np.full(len(blocked), RINGS + 1)
    ring[path] = 0
    last = path
    for k in range(1, RINGS + 1):
        row, place = expand((network.start[1:] - network.start[:-1])[last])
        beside = network.head[network.start[last][row] + place]
        last = np.unique(beside[(ring[beside] > k) & ~blocked[beside]])
        ring[last] = k
    # The ring from which on each edge and triangle is there.
    sides, faces = (x[(ring[x[:, 0]] <= RINGS)] for x in (network.sides, network.triangles))
    of_sides, of_faces = ring[sides].max(axis=1), ring[faces].max(axis=1)
    for k in range(RINGS, 0, -1):
        near = ring <= k
        number = np.cumsum(near) - 1
        count, inside = int(number[-1]) + 1, sides[of_sides <= k]
        a, b = number[inside].T
        euler = count - len(inside) + int((of_faces <= k).sum())
        if euler == 1 and graph_components(a, b, count)[0] == 1:
            return near
    return None
