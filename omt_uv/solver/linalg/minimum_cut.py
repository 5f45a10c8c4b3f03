"""Part a graph in two where that is cheapest."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import breadth_first_order, maximum_flow

# Capacities are whole numbers: that of an edge of mean price, and the greatest.
MEAN_CAPACITY = 10_000
MOST_CAPACITY = 10_000_000


def capacities(price: np.ndarray) -> np.ndarray:
    """Prices (e,) of edges in whole numbers."""
    mean = max(float(price.mean()), 1e-300) if len(price) else 1.0
    return np.clip(np.round(MEAN_CAPACITY * price / mean), 1, MOST_CAPACITY).astype(np.int32)


def least_cut(joined: np.ndarray, capacity: np.ndarray, count: int, one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Which of so many nodes (count,) bool are on the side of `one` (a,) of the cheapest cut between these and `other`
    (b,) of a graph with edges `joined` (e,2), each to be cut for a whole number `capacity` (e,) > 0.

    Source: Ford and Fulkerson 1956, theorem 1: it is what a maximum flow fills.

    >>> import numpy as np
    >>> path = np.array([[0, 1], [1, 2], [2, 3]])
    >>> least_cut(path, np.array([5, 1, 3]), 4, np.array([0]), np.array([3])).tolist()
    [True, True, False, False]
    """
    # What lies at either end is one: nothing is cut within, and it is most of the graph.
    source, sink = 0, 1
    inner = np.ones(count, dtype=bool)
    inner[one] = inner[other] = False
    number = np.full(count, sink)
    number[one], number[inner] = source, np.arange(2, 2 + np.count_nonzero(inner))
    tail, head = number[np.concatenate([joined, joined[:, ::-1]])].T
    onwards = (tail != head) & (head != source) & (tail != sink)
    # Between the ends everything is cut.
    onwards &= (tail != source) | (head != sink)
    nodes = 2 + int(np.count_nonzero(inner))
    room = np.tile(capacity, 2)[onwards]
    pipes = csr_matrix((room, (tail[onwards], head[onwards])), shape=(nodes, nodes), dtype=np.int32)
    left = pipes - maximum_flow(pipes, source, sink).flow
    left.data = np.maximum(left.data, 0)
    left.eliminate_zeros()
    side = np.zeros(nodes, dtype=bool)
    side[breadth_first_order(left, source, return_predecessors=False)] = True
    return side[number]
