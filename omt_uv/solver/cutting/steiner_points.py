"""Find where the branches of a short tree should meet, by Zelikovsky's relative greedy algorithm (1993, "An
11/6-approximation algorithm for the network Steiner problem", section 2).

A tree of direct paths between its ends may be a third too long. Three of them joined at the best vertex between them
often take less than the paths they make superfluous.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np

from .component import CutComponent, boundary_vertices
from .cut_graph import greedy_arcs, shorten
from .protrusions import edge_distance

# Of k ends there are k^3 / 6 threes to try.
MOST_ENDS = 16
# Of the length of the tree, what three ends joined at a vertex have to save: where two parts are each other's mirror
# image, the vertex is on one side, and symmetric seams are worth a tenth.
WORTH = 0.1


def meeting_points(distance: np.ndarray, between: np.ndarray) -> np.ndarray:
    """Vertices (s,) at which to join three ends each, greedily by what it saves.

    Parameters
    ----------
    distance : (k,n) of every vertex from every end, 3 <= k <= MOST_ENDS; between : (k,k) of the ends from each other
    """
    k = len(distance)
    threes = np.array(list(combinations(range(k), 3)))
    sums = [distance[t].sum(axis=0) for t in threes]
    vertex = np.array([int(np.argmin(s)) for s in sums])
    cost = np.array([float(s.min()) for s in sums])
    points: list[int] = []
    while True:
        total = _tree_costs(between[None])[0]
        joined = _joined(between, threes)
        saved = total - _tree_costs(joined) - cost
        best = int(np.argmax(saved))
        if saved[best] <= WORTH * total:
            return np.unique(np.array(points, dtype=np.int64))
        points.append(int(vertex[best]))
        between = joined[best]


def _joined(between: np.ndarray, threes: np.ndarray) -> np.ndarray:
    """Distances (t,k,k) of ends of which three (t,3) are in one place."""
    joined = np.tile(between, (len(threes), 1, 1))
    joined[np.arange(len(threes))[:, None, None], threes[:, :, None], threes[:, None]] = 0
    return joined


def _tree_costs(between: np.ndarray) -> np.ndarray:
    """Length (t,) of the shortest tree of each of several sets of ends, from their distances (t,k,k), all at once: the
    end next to those that are joined is joined next (Prim, Shortest connection networks, Bell System Technical Journal
    36, 1957)."""
    every, total = np.arange(len(between)), np.zeros(len(between))
    near, left = between[:, 0].copy(), np.ones(between.shape[:2], dtype=bool)
    left[:, 0] = False
    for _ in range(between.shape[1] - 1):
        found = np.where(left, near, np.inf).argmin(axis=1)
        total += near[every, found]
        left[every, found] = False
        near = np.minimum(near, between[every, found])
    return total


def branching_tree(component: CutComponent, tips: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of a short tree that joins the tips (k,) and all boundaries of a component without handles."""
    ends = [np.array([tip]) for tip in tips] + boundary_vertices(component)
    distance = np.array([edge_distance(component, end) for end in ends])
    between = np.array([distance[:, end].min(axis=1) for end in ends])
    points = meeting_points(distance, between)
    return shorten(component, greedy_arcs(component, np.union1d(tips, points)), tips)
