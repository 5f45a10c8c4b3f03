"""Split the long edges of a component at their middles, for its maps: samples carried by large triangles fold.

What a surface is made of then does not matter: a cylinder of twelve sides is mapped as one of many triangles is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.geometry import lengths
from ...mesh.topology import halfedges, next_halfedge, pair_keys, paired, previous_halfedge, twins
from ..components.components import Component
from .split_collapse import independent_splits, split_edges
from .vertex_count import edge_length

# Vertices whose maps are fine enough.
MAP_VERTICES = 1000
# No edge is longer than so many times that of a mesh of equilateral triangles with as many vertices.
MAX_LENGTH = 2.5
# Needles may take many halvings: no more than so many new vertices next to MAP_VERTICES.
MAX_NEW = 4
# A needle is halved in each of these rounds.
MAX_ROUNDS = 60


def refine_for_maps(component: Component) -> Component:
    """Halve the long edges of a component, so that its maps are not too coarse; the surface is the same."""
    longest = MAX_LENGTH * edge_length(float(component.area.sum()), 0.0, MAP_VERTICES)
    return split_long_edges(component, np.full(len(component.vertices), longest), MAX_NEW * MAP_VERTICES)


def split_long_edges(component: Component, longest: np.ndarray, most: float = np.inf) -> Component:
    """Halve edges of a component, the longest first, until none is longer than `longest` (n,) at its ends.

    Or until there are `most` new vertices or more.
    """
    first, twin = len(component.vertices), twins(component.triangles)
    for _ in range(MAX_ROUNDS):
        tail, head = halfedges(component.triangles)
        length = lengths(component.vertices.take(tail, axis=0) - component.vertices.take(head, axis=0))
        length /= (longest[tail] + longest[head]) / 2
        long = np.flatnonzero((length > 1) & (twin < np.arange(len(twin))))
        if not len(long) or len(component.vertices) - first >= most:
            break
        order = np.argsort(-length[long], kind="stable")
        chosen = independent_splits(component.triangles, long[order], twin)
        longest = np.concatenate([longest, (longest[tail[chosen]] + longest[head[chosen]]) / 2])
        component, twin = split_component(component, chosen, twin)
    return component


def split_component(component: Component, h: np.ndarray, twin: np.ndarray) -> tuple[Component, np.ndarray]:
    """Put a vertex in the middle of the edges of halfedges h (k,) of a component with opposite halfedges (3m,); no two
    share a triangle. And the opposite halfedges then."""
    edit = split_edges(component.vertices, component.triangles, h, twin)
    both = np.concatenate([h, twin[h]])
    both = both[both >= 0]
    t = both // 3
    a, b, c = (component.input_barycentric[t, k % 3] for k in (both, next_halfedge(both), previous_halfedge(both)))
    middle = (a + b) / 2
    input_barycentric = np.concatenate([component.input_barycentric, np.stack([middle, b, c], axis=1)])
    input_barycentric[t] = np.stack([a, middle, c], axis=1)
    fine = replace(
        component,
        vertices=edit.points,
        triangles=edit.triangles,
        faces=np.concatenate([component.faces, component.faces[t]]),
        input_barycentric=input_barycentric,
        shift=np.concatenate([component.shift, component.shift[t]]),
        features=_halved(component.features, edit.split_ends, len(component.vertices)),
        to_reopen=np.sort(pair_keys(*_halved(paired(component.to_reopen), edit.split_ends, len(component.vertices)).T)),
    )
    return fine, edit.twin


def _halved(edges: np.ndarray, split_ends: np.ndarray, n: int) -> np.ndarray:
    """Edges (e,2) with both halves in the place of those in `split_ends` (k,2), whose middle is the vertex n + row."""
    keys, split = pair_keys(*edges.T), pair_keys(*split_ends.T)
    order = np.argsort(split)
    place = order[np.minimum(np.searchsorted(split, keys, sorter=order), len(split) - 1)]
    cut = split[place] == keys
    middle = n + place[cut]
    halves = [np.stack([end, middle], axis=1) for end in edges[cut].T]
    return np.concatenate([edges[~cut], *halves])
