"""Bring boundaries and features of a mesh to given samples by splits and collapses, without a map."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...mesh.topology import halfedges, pair_keys, paired, twins
from ..components.components import Component
from ..edits.long_edges import split_component
from ..edits.split_collapse import (
    ANY_COSINE,
    MIN_COSINE,
    collapse_edges,
    independent_splits,
    interior_edges,
    shortest_first,
)
from .arc_network import Arc, ArcSamples

# Samples nearer than this share of an edge to its end are there.
AT_END = 1e-9
# Rounds of splits, or of collapses, each of edges without a triangle in common.
MAX_ROUNDS = 200


@dataclass(frozen=True)
class _Waiting:
    """Samples (k,) that are to be vertices: on edges with the ends (k,2), and the share along these (k,)."""

    sample: np.ndarray
    ends: np.ndarray
    share: np.ndarray

    def only(self, rows: np.ndarray) -> _Waiting:
        return _Waiting(self.sample[rows], self.ends[rows], self.share[rows])


def insert_samples(component: Component, arcs: list[Arc], samples: ArcSamples) -> tuple[Component, np.ndarray]:
    """Put a vertex at every sample of a component's kept arcs; the vertex (s,) of each, -1 for samples on other arcs.

    All kept arcs become features.
    """
    kept_arcs = [k for k, arc in enumerate(arcs) if arc.kept]
    chains = [arcs[k].vertices for k in kept_arcs]
    component = replace(component, features=np.concatenate([np.stack([c[:-1], c[1:]], axis=1) for c in chains]))
    ends = np.concatenate(
        [np.stack([arcs[k].vertices[samples.edge[k] + i] for i in (0, 1)], axis=1) for k in kept_arcs]
    )
    sample = np.concatenate([samples.along[k] for k in kept_arcs])
    waiting = _Waiting(sample, ends, np.concatenate([samples.share[k] for k in kept_arcs]))
    vertex, twin = np.full(len(samples.points), -1), twins(component.triangles)
    for _ in range(MAX_ROUNDS):
        for end, near in ((0, waiting.share <= AT_END), (1, waiting.share >= 1 - AT_END)):
            vertex[waiting.sample[near]] = waiting.ends[near, end]
        waiting = waiting.only((waiting.share > AT_END) & (waiting.share < 1 - AT_END))
        if not len(waiting.sample):
            break
        component, twin, waiting = _split_at_middles(component, twin, waiting)
    return component, vertex


def _split_at_middles(
    component: Component, twin: np.ndarray, waiting: _Waiting
) -> tuple[Component, np.ndarray, _Waiting]:
    """Split edges with samples at the middle one of each, as far as they have no triangle in common."""
    key = pair_keys(*waiting.ends.T)
    # Shares from the smaller end, so that samples from two arcs are in one order.
    turned = waiting.ends[:, 0] > waiting.ends[:, 1]
    share = np.where(turned, 1 - waiting.share, waiting.share)
    order = np.lexsort((share, key))
    first, count = np.unique(key[order], return_index=True, return_counts=True)[1:]
    middle = order[first + count // 2]
    tail, head = halfedges(component.triangles)
    all_keys = pair_keys(tail, head)
    by_key = np.argsort(all_keys, kind="stable")
    h = by_key[np.searchsorted(all_keys[by_key], key[middle])]
    chosen = independent_splits(component.triangles, h, twin)
    row = middle[np.searchsorted(key[middle], all_keys[chosen])]
    n = len(component.vertices)
    low, high = np.sort(waiting.ends[row], axis=1).T
    places = component.vertices[low] + share[row, None] * (component.vertices[high] - component.vertices[low])
    component, twin = split_component(component, chosen, twin)
    component = replace(component, vertices=np.concatenate([component.vertices[:n], places]))
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
    return component, twin, _Waiting(waiting.sample, ends, along)


@dataclass(frozen=True)
class LineMesh:
    """A mesh (n,3), (m,3), its lines (l,2), those to be reopened (s,2) among them, the vertices (v,) to keep, and the
    opposite halfedges (3m,)."""

    points: np.ndarray
    triangles: np.ndarray
    lines: np.ndarray
    to_reopen: np.ndarray
    vertices: np.ndarray
    twin: np.ndarray


def collapse_along_lines(component: Component, vertices: np.ndarray) -> LineMesh:
    """Collapse all vertices of a component's features but `vertices` (v,) along these, as far as that goes."""
    to_reopen = paired(component.to_reopen)
    mesh = LineMesh(
        points=component.vertices,
        triangles=component.triangles,
        lines=component.features,
        to_reopen=to_reopen,
        vertices=vertices,
        twin=twins(component.triangles),
    )
    least = MIN_COSINE
    for _ in range(MAX_ROUNDS):
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


def collapse_short_edges(mesh: LineMesh, shortest: Callable[[np.ndarray], np.ndarray]) -> LineMesh:
    """Collapse edges between a mesh's lines that are shorter than (k,) what `shortest` gives for places (k,3)."""
    for _ in range(MAX_ROUNDS):
        tail, head = halfedges(mesh.triangles)
        h = interior_edges(mesh.triangles, np.sort(pair_keys(*mesh.lines.T)), mesh.twin)
        a, b = mesh.points[tail[h]], mesh.points[head[h]]
        short = np.linalg.norm(a - b, axis=1) < shortest((a + b) / 2)
        kept = np.zeros(len(mesh.points), dtype=bool)
        kept[mesh.lines] = kept[mesh.vertices] = True
        fewer = _collapsed(mesh, h[short], kept, MIN_COSINE, False)
        if len(fewer.points) == len(mesh.points):
            break
        mesh = fewer
    return mesh


def _collapsed(mesh: LineMesh, h: np.ndarray, kept: np.ndarray, least: float, along: bool) -> LineMesh:
    """Collapse edges of the halfedges h (k,), the shortest first, but for vertices `kept` (n,) bool."""
    tail, head = halfedges(mesh.triangles)
    h = h[shortest_first(np.linalg.norm(mesh.points[tail[h]] - mesh.points[head[h]], axis=1))]
    edit = collapse_edges(mesh.points, mesh.triangles, h, kept, len(h), least, along, mesh.twin)
    lines, to_reopen = (
        np.unique(np.sort(edit.new_number[pairs], axis=1), axis=0) for pairs in (mesh.lines, mesh.to_reopen)
    )
    lines, to_reopen = (pairs[pairs[:, 0] < pairs[:, 1]] for pairs in (lines, to_reopen))
    return LineMesh(
        points=edit.points,
        triangles=edit.triangles,
        lines=lines,
        to_reopen=to_reopen,
        vertices=edit.new_number[mesh.vertices],
        twin=edit.twin,
    )
