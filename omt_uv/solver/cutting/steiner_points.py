"""Find where the branches of a short tree should meet, by Zelikovsky's relative greedy algorithm (1993, "An
11/6-approximation algorithm for the network Steiner problem", section 2).

A tree of direct paths between its ends may be a third too long. Three of them joined at the best vertex between them
often take less than the paths they make superfluous.
"""

from __future__ import annotations

from itertools import combinations

import numpy as np
from scipy.sparse.csgraph import minimum_spanning_tree

# Of k ends there are k^3 / 6 threes to try.
MOST_ENDS = 16
# A path of no length: to scipy an edge of length 0 is no edge.
NOTHING = 1e-12


def meeting_points(distance: np.ndarray, between: np.ndarray) -> np.ndarray:
    """Vertices (s,) at which to join three ends each, greedily by what it saves.

    Parameters
    ----------
    distance : (k,n) of every vertex from every end, 3 <= k <= MOST_ENDS; between : (k,k) of the ends from each other
    """
    k = len(distance)
    threes = list(combinations(range(k), 3))
    sums = [distance[list(t)].sum(axis=0) for t in threes]
    vertex = np.array([int(np.argmin(s)) for s in sums])
    cost = np.array([float(s.min()) for s in sums])
    between = np.maximum(between, NOTHING)
    points: list[int] = []
    while True:
        total = _tree_cost(between)
        saved = [total - _tree_cost(_joined(between, t)) - c for t, c in zip(threes, cost, strict=True)]
        best = int(np.argmax(saved))
        if saved[best] <= 1e-6 * total:
            return np.unique(np.array(points, dtype=np.int64))
        points.append(int(vertex[best]))
        between = _joined(between, threes[best])


def _joined(between: np.ndarray, three: tuple[int, ...]) -> np.ndarray:
    joined = between.copy()
    joined[np.ix_(three, three)] = NOTHING
    return joined


def _tree_cost(between: np.ndarray) -> float:
    return float(minimum_spanning_tree(between).sum())
