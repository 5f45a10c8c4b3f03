"""Parts with long edges cut up for their maps: large triangles are mapped coarsely, and samples carried by them fold.

What a surface is made of then does not matter: a cylinder of twelve sides is mapped as one of many triangles is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.topology import halfedges, next_halfedge, pair_keys, previous_halfedge, twins
from ..components.components import Part
from .split_collapse import independent_splits, split_edges
from .vertex_count import edge_size

# No edge is longer than so many times that of as many equilateral triangles as so many vertices have.
LONGEST, VERTICES = 2.5, 1000
# Needles may take many halvings: no more than so many times as many.
MOST = 4
# Rounds: a needle is halved in each of them.
MOST_ROUNDS = 60


def fine_enough(part: Part) -> Part:
    """The part with its long edges halved, so that its maps are not too coarse; the surface is the same."""
    longest = LONGEST * edge_size(float(part.area.sum()), 0.0, VERTICES)
    return bisected(part, np.full(len(part.vertices), longest), MOST * VERTICES)


def bisected(part: Part, longest: np.ndarray, most: float = np.inf) -> Part:
    """The part with edges halved, the longest first, until none is longer than `longest` (n,) at its ends, or there
    are `most` new vertices or more."""
    first = len(part.vertices)
    for _ in range(MOST_ROUNDS):
        tail, head = halfedges(part.triangles)
        length = np.linalg.norm(part.vertices[tail] - part.vertices[head], axis=1)
        length /= (longest[tail] + longest[head]) / 2
        twin = twins(part.triangles)
        long = np.flatnonzero((length > 1) & (twin < np.arange(len(twin))))
        if not len(long) or len(part.vertices) - first >= most:
            break
        order = np.argsort(-length[long], kind="stable")
        chosen = independent_splits(part.triangles, long[order])
        longest = np.concatenate([longest, (longest[tail[chosen]] + longest[head[chosen]]) / 2])
        part = split_part(part, chosen)
    return part


def split_part(part: Part, h: np.ndarray) -> Part:
    """The part with a vertex in the middle of the edges of halfedges h (k,), no two of which share a triangle."""
    edit = split_edges(part.vertices, part.triangles, h)
    both = np.concatenate([h, twins(part.triangles)[h]])
    both = both[both >= 0]
    t = both // 3
    a, b, c = (part.within[t, k % 3] for k in (both, next_halfedge(both), previous_halfedge(both)))
    middle = (a + b) / 2
    within = np.concatenate([part.within, np.stack([middle, b, c], axis=1)])
    within[t] = np.stack([a, middle, c], axis=1)
    return replace(
        part,
        vertices=edit.points,
        triangles=edit.triangles,
        faces=np.concatenate([part.faces, part.faces[t]]),
        within=within,
        shift=np.concatenate([part.shift, part.shift[t]]),
        features=_halved(part.features, edit.between, len(part.vertices)),
        slits=np.sort(pair_keys(*_halved(_ends(part.slits), edit.between, len(part.vertices)).T)),
    )


def _ends(keys: np.ndarray) -> np.ndarray:
    return np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1)


def _halved(edges: np.ndarray, between: np.ndarray, n: int) -> np.ndarray:
    """Edges (e,2) with both halves in the place of those `between` (k,2) whose middle is the vertex n + row."""
    keys, split = pair_keys(*edges.T), pair_keys(*between.T)
    order = np.argsort(split)
    place = order[np.minimum(np.searchsorted(split, keys, sorter=order), len(split) - 1)]
    cut = split[place] == keys
    middle = n + place[cut]
    halves = [np.stack([end, middle], axis=1) for end in edges[cut].T]
    return np.concatenate([edges[~cut], *halves])
