"""Boundaries and features of a mesh brought to given samples by splits and collapses, without a map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...mesh.topology import halfedges, pair_keys
from ..components.components import Part
from ..edits.long_edges import split_part
from ..edits.split_collapse import ANY_COSINE, LEAST_COSINE, collapse_edges, independent_splits, interior_edges
from .arc_network import Arc, ArcSamples

# Samples nearer than this share of an edge to its end are there.
AT_END = 1e-9
MOST_ROUNDS = 200


@dataclass(frozen=True)
class _Waiting:
    """Samples (k,) that are to be vertices: on edges with the ends (k,2), and the share along these (k,)."""

    sample: np.ndarray
    ends: np.ndarray
    share: np.ndarray

    def only(self, rows: np.ndarray) -> _Waiting:
        return _Waiting(self.sample[rows], self.ends[rows], self.share[rows])


def with_samples(part: Part, arcs: list[Arc], samples: ArcSamples) -> tuple[Part, np.ndarray]:
    """The part with a vertex at every sample of its held arcs, and the vertex (s,) of each; -1 for samples on others.

    All held arcs become features.
    """
    held = [k for k, arc in enumerate(arcs) if arc.held]
    chains = [arcs[k].vertices for k in held]
    part = replace(part, features=np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in chains]))
    ends = np.concatenate([np.stack([arcs[k].vertices[samples.edge[k] + i] for i in (0, 1)], axis=1) for k in held])
    sample = np.concatenate([samples.along[k] for k in held])
    waiting = _Waiting(sample, ends, np.concatenate([samples.share[k] for k in held]))
    vertex = np.full(len(samples.points), -1)
    for _ in range(MOST_ROUNDS):
        for end, near in ((0, waiting.share <= AT_END), (1, waiting.share >= 1 - AT_END)):
            vertex[waiting.sample[near]] = waiting.ends[near, end]
        waiting = waiting.only((waiting.share > AT_END) & (waiting.share < 1 - AT_END))
        if not len(waiting.sample):
            break
        part, waiting = _split_at_middles(part, waiting)
    return part, vertex


def _split_at_middles(part: Part, waiting: _Waiting) -> tuple[Part, _Waiting]:
    """Edges with samples split at the middle one of each, as far as they have no triangle in common."""
    key = pair_keys(*waiting.ends.T)
    # Shares from the smaller end, so that samples from two arcs are in one order.
    turned = waiting.ends[:, 0] > waiting.ends[:, 1]
    share = np.where(turned, 1 - waiting.share, waiting.share)
    order = np.lexsort((share, key))
    first, count = np.unique(key[order], return_index=True, return_counts=True)[1:]
    middle = order[first + count // 2]
    tail, head = halfedges(part.triangles)
    all_keys = pair_keys(tail, head)
    by_key = np.argsort(all_keys, kind="stable")
    h = by_key[np.searchsorted(all_keys[by_key], key[middle])]
    chosen = independent_splits(part.triangles, h)
    row = middle[np.searchsorted(key[middle], all_keys[chosen])]
    n = len(part.vertices)
    low, high = np.sort(waiting.ends[row], axis=1).T
    places = part.vertices[low] + share[row, None] * (part.vertices[high] - part.vertices[low])
    part = split_part(part, chosen)
    part = replace(part, vertices=np.concatenate([part.vertices[:n], places]))
    # Of every sample the edge that was split, if it was.
    found = np.argsort(key[row])
    at = found[np.minimum(np.searchsorted(key[row], key, sorter=found), len(row) - 1)]
    hit = key[row][at] == key
    new, t = n + at, share[row][at]
    before = share <= t
    ends, along = np.sort(waiting.ends, axis=1), share.copy()
    along[hit] = np.where(before, share / t, (share - t) / (1 - t))[hit]
    ends[hit & before, 1] = new[hit & before]
    ends[hit & ~before, 0] = new[hit & ~before]
    return part, _Waiting(waiting.sample, ends, along)


@dataclass(frozen=True)
class Lined:
    """A mesh (n,3), (m,3), its lines (l,2) and the slits (s,2) among these, and the vertices (v,) asked for."""

    points: np.ndarray
    triangles: np.ndarray
    lines: np.ndarray
    slits: np.ndarray
    vertices: np.ndarray


def only_between(part: Part, vertices: np.ndarray) -> Lined:
    """The part with all vertices of its features but `vertices` (v,) collapsed along these, as far as that goes."""
    slits = np.stack([part.slits >> 32, part.slits & 0xFFFFFFFF], axis=1)
    mesh = Lined(part.vertices, part.triangles, part.features, slits, vertices)
    least = LEAST_COSINE
    for _ in range(MOST_ROUNDS):
        kept = np.zeros(len(mesh.points), dtype=bool)
        kept[mesh.vertices] = True
        if kept[mesh.lines].all():
            break
        keys, index = np.unique(pair_keys(*halfedges(mesh.triangles)), return_index=True)
        on_lines = index[np.isin(keys, pair_keys(*mesh.lines.T))]
        fewer = _collapsed(mesh, on_lines, kept, least, True)
        if len(fewer.points) == len(mesh.points):
            if least == ANY_COSINE:
                break
            least = ANY_COSINE
        mesh = fewer
    return mesh


def without_short(mesh: Lined, shortest: Callable[[np.ndarray], np.ndarray]) -> Lined:
    """The mesh with edges between its lines collapsed that are shorter than (k,) what is told for places (k,3)."""
    for _ in range(MOST_ROUNDS):
        tail, head = halfedges(mesh.triangles)
        h = interior_edges(mesh.triangles, np.sort(pair_keys(*mesh.lines.T)))
        a, b = mesh.points[tail[h]], mesh.points[head[h]]
        short = np.linalg.norm(a - b, axis=1) < shortest((a + b) / 2)
        kept = np.zeros(len(mesh.points), dtype=bool)
        kept[mesh.lines] = kept[mesh.vertices] = True
        fewer = _collapsed(mesh, h[short], kept, LEAST_COSINE, False)
        if len(fewer.points) == len(mesh.points):
            break
        mesh = fewer
    return mesh


def _collapsed(mesh: Lined, h: np.ndarray, kept: np.ndarray, least: float, along: bool) -> Lined:
    """The mesh with edges of the halfedges h (k,) collapsed, the shortest first, but for vertices `kept` (n,) bool."""
    tail, head = halfedges(mesh.triangles)
    h = h[np.argsort(np.linalg.norm(mesh.points[tail[h]] - mesh.points[head[h]], axis=1), kind="stable")]
    edit = collapse_edges(mesh.points, mesh.triangles, h, kept, len(h), least, along)
    lines, slits = (np.unique(np.sort(edit.became[pairs], axis=1), axis=0) for pairs in (mesh.lines, mesh.slits))
    lines, slits = (pairs[pairs[:, 0] < pairs[:, 1]] for pairs in (lines, slits))
    return Lined(edit.points, edit.triangles, lines, slits, edit.became[mesh.vertices])
