"""Take bodies of flat and developable sides apart along their creases, where no net of them is short enough.

A casting or a machined part bends along hard edges that are curved: a flat side beside a round one. Joined along such
an edge, neither can be laid flat. Sides come apart there; across straight edges they stay together, as a net does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..analysis.feature_edges import fold_angles
from ..maps.development import developed
from ..maps.overlap import overlap_share
from ..mesh.geometry import angle_defects, angles_from_lengths, face_areas, halfedge_lengths
from ..mesh.gluing import Gluing, components, corner_classes, groups
from ..mesh.surface import Surface
from ..mesh.topology import graph_components, pair_keys
from .component import SMOOTH, CutComponent, make_component
from .cut_graph import cut_classes
from .developable_nets import HARD, net
from .gluing_facts import cost_factors, marked_triangles

# Components with less than this share of the area stay whole: of thousands of pieces none is looked at.
VISIBLE = 1e-3
# A side unrolls but for little if it has no more curvature than this, in radians and summed without sign.
ROUND = 1.0
# A side is large with this share of the area of a body. One whose large sides that unroll have that share of it, and
# whose sides meet at more than `HARD` along that share of their borders, has a hard surface: low ones of animals are
# folded everywhere, into small sides and bluntly.
LARGE = 0.03
MOSTLY = 0.5
SHARP = 0.8
# Sides stay together across an edge whose curvature, in radians and summed without sign, is no more than this, and
# which is that share of the outline of the smaller one; laid flat, they cover no more than a share of themselves.
STRAIGHT = 0.1
SHARED = 0.15
COVERED = 2e-3
SAMPLES = 2_000
# So many of the longest edges are tried.
MOST_JOINED = 256
# What does not close when it is laid flat, over its extent, does not unroll.
GAP = 0.01
# Sides of less than this share of the area stay with what they share most of their outline with.
CRUMB = 3e-3


def hard_borders(
    surface: Surface,
    gluing: Gluing,
    positions: np.ndarray,
    gone: np.ndarray,
    wants: Callable[[np.ndarray, bool], bool],
) -> np.ndarray:
    """Pairs (p,) bool of a gluing, without those that are gone (p,) bool, along which bodies of hard sides come apart.

    Bodies with a net that is short enough, and those that are not searched, stay whole; positions (n,3) in a unit box,
    wants: see `cuts.SeamFinder`
    """
    left, number, found = gluing.without(gone), np.flatnonzero(~gone), np.zeros(len(gone), dtype=bool)
    component_of, classes = components(left), corner_classes(left)
    fold = np.abs(fold_angles(positions, left.vertex[left.triangles], np.stack([left.first, left.second], axis=1)))
    area = np.bincount(component_of, face_areas(positions, left.vertex[left.triangles]))
    creased = np.unique(component_of[left.first[fold > SMOOTH] // 3])
    creased = creased[area[creased] >= VISIBLE * area.sum()]
    if not len(creased):
        return found
    marked = np.unique(component_of[marked_triangles(surface, left)])
    free, factor, members = np.zeros(len(positions)), cost_factors(surface, left), groups(component_of)
    pairs = groups(np.append(component_of[left.first // 3], np.arange(len(members))))
    for k in creased:
        if not wants(left.owner[members[k]], bool(np.isin(k, marked))):
            continue
        component = make_component(left, positions, classes, members[k], pairs[k][pairs[k] < len(number)], free, factor)
        sides = hard_sides(component)
        if sides is not None and not _has_clear_net(component):
            found[number[component.gluing_pair[side_borders(component, *sides)]]] = True
    return found


def _has_clear_net(component: CutComponent) -> bool:
    unrolled = net(component)
    found = None if unrolled is None else unrolled.up_to(unrolled.most)
    return found is not None and found.is_clear()


def hard_sides(component: CutComponent) -> tuple[np.ndarray, np.ndarray] | None:
    """The side (m,) of every triangle of a component of a hard surface, and which sides (s,) bool unroll; None of any
    other."""
    fold = np.abs(fold_angles(component.positions, component.triangles, component.pair))
    joined, count = component.pair // 3, len(component.triangles)
    hard = (fold > SMOOTH) & np.isfinite(component.cost)
    side = graph_components(joined[~hard, 0], joined[~hard, 1], count)[1]
    border = side[joined[:, 0]] != side[joined[:, 1]]
    length = component.length
    if not border.any() or length[border & (fold > HARD)].sum() < SHARP * length[border].sum():
        return None
    area = np.bincount(side, face_areas(component.positions, component.triangles))
    unrolls = _inner_curvature(component, side, border, _curvature(component)) <= ROUND
    if area[unrolls & (area >= LARGE * area.sum())].sum() < MOSTLY * area.sum():
        return None
    return side, unrolls


def _curvature(component: CutComponent) -> np.ndarray:
    """Curvature (n,) of the vertices without sign, in radians, 0 on the boundary."""
    angle = angles_from_lengths(halfedge_lengths(component.positions, component.triangles).reshape(-1, 3))
    outer = component.on_boundary()
    defects = np.abs(angle_defects(component.triangles, angle, np.flatnonzero(outer), component.vertex_count))
    return np.where(outer, 0.0, defects)


def _inner_curvature(component: CutComponent, side: np.ndarray, border: np.ndarray, curvature) -> np.ndarray:
    """What of the curvature (n,) lies within each side (s,), off the borders (e,) bool."""
    of_vertex = np.zeros(component.vertex_count, np.int64)
    of_vertex[component.triangles.ravel()] = np.repeat(side, 3)
    inner = np.ones(component.vertex_count, dtype=bool)
    inner[component.ends[border]] = False
    return np.bincount(of_vertex[inner], curvature[inner], int(side.max()) + 1)


def side_borders(component: CutComponent, side: np.ndarray, unrolls: np.ndarray) -> np.ndarray:
    """Edges (e,) bool along which a component comes apart: around sides (m,) that unroll (s,) bool, less those across
    which they stay together."""
    joined = side[component.pair // 3]
    border = (joined[:, 0] != joined[:, 1]) & unrolls[joined].any(axis=1)
    area = np.bincount(side, face_areas(component.positions, component.triangles))
    chain, pair, length, turned = _chains(component, side, border, _curvature(component))
    outline = np.bincount(pair.ravel(), np.repeat(length, 2), len(area))
    smaller = np.take_along_axis(pair, np.argmin(area[pair], axis=1)[:, None], axis=1)[:, 0]
    fits = unrolls[pair].all(axis=1) & (turned <= STRAIGHT) & (length >= SHARED * outline[smaller])
    group = np.arange(len(area))
    left = border.copy()
    for k in np.argsort(-length, kind="stable")[:MOST_JOINED]:
        one, other = group[pair[k]]
        if fits[k] and one != other:
            without = left & (chain != k)
            if _lies_flat(component, without, np.isin(group[side], (one, other))):
                left, group = without, np.where(group == other, one, group)
    for k in np.argsort(-length, kind="stable"):
        one, other = group[pair[k]]
        total = np.bincount(group, area, len(area))
        if one != other and min(total[one], total[other]) < CRUMB * area.sum():
            left, group = left & (chain != k), np.where(group == other, one, group)
    return left


def _chains(component, side, border, curvature) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The chain (e,) of each border edge, -1 for others; the two sides (c,2) of the chains, their lengths (c,), and
    the curvature (c,) of the vertices on each and on no other."""
    edges = np.flatnonzero(border)
    pair = np.sort(side[component.pair[edges] // 3], axis=1)
    _, of_pair = np.unique(pair_keys(*pair.T), return_inverse=True)
    # A vertex is another one for every pair of sides.
    node = of_pair.ravel()[:, None] * component.vertex_count + component.ends[edges]
    nodes, index = np.unique(node, return_inverse=True)
    index = index.reshape(-1, 2)
    label = graph_components(index[:, 0], index[:, 1], len(nodes))[1]
    of_edge = label[index[:, 0]]
    count = int(of_edge.max()) + 1
    first = np.unique(of_edge, return_index=True)[1]
    vertex = nodes % component.vertex_count
    chains_at = np.bincount(vertex, minlength=component.vertex_count)
    alone = (chains_at[vertex] == 1) & (np.bincount(index.ravel(), minlength=len(nodes)) == 2)
    turned = np.bincount(label[alone], curvature[vertex[alone]], count)
    chain = np.full(len(border), -1)
    chain[edges] = of_edge
    return chain, pair[first], np.bincount(of_edge, component.length[edges], count), turned


def _lies_flat(component: CutComponent, border: np.ndarray, rows: np.ndarray) -> bool:
    """Whether triangles (m,) bool of a component that is open along borders (e,) bool unroll beside one another."""
    corners = cut_classes(component, border)[rows]
    used, first, triangles = np.unique(corners, return_index=True, return_inverse=True)
    positions = component.positions[component.triangles[rows].ravel()[first]]
    triangles = triangles.reshape(-1, 3)
    flat, gap = developed(positions, triangles)
    if gap.max() > GAP * np.ptp(positions, axis=0).max():
        return False
    return overlap_share(np.stack([flat.real, flat.imag], axis=1)[triangles], samples=SAMPLES) <= COVERED
