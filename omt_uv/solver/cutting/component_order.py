"""Put a component in an order that the places of its vertices alone decide.

Ties between cuts are broken by numbers; so the order in which a file has its vertices and faces moves no seam.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.order_of_places import lowest_first, order_of_places
from ..mesh.topology import are_among, halfedges, pair_keys


@dataclass(frozen=True)
class ComponentOrder:
    """A component in its order.

    Attributes
    ----------
    vertices (n,), rows (m,), pairs (e,) : which of the given vertices, triangles and pairs comes at each place
    triangles (m,3) : of the vertices in their order
    pair (e,2) : the two halfedges of every inner edge
    """

    vertices: np.ndarray
    rows: np.ndarray
    pairs: np.ndarray
    triangles: np.ndarray
    pair: np.ndarray


def in_order(points: np.ndarray, triangles: np.ndarray, pair: np.ndarray) -> ComponentOrder:
    """The order of a component (n,3), (m,3) with inner edges between halfedges (e,2), which no two pairs share."""
    tail, head = halfedges(triangles)
    order = order_of_places(points, triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    keys = pair_keys(place[tail[pair[:, 0]]], place[head[pair[:, 0]]])
    triangles = lowest_first(place[triangles])[0]
    rows = np.lexsort(triangles.T[::-1])
    triangles = triangles[rows]
    every = pair_keys(*halfedges(triangles))
    inner = np.flatnonzero(are_among(every, keys))
    return ComponentOrder(
        vertices=order,
        rows=rows,
        pairs=np.argsort(keys),
        triangles=triangles,
        pair=inner[np.argsort(every[inner], kind="stable")].reshape(-1, 2),
    )
