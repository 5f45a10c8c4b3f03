"""Take bodies of flat and developable sides apart along their creases, where no net of them lies beside itself.

A casting or a machined part bends along hard edges that are curved: a flat side beside a round one. Joined along such
an edge, neither can be laid flat. Sides come apart there; across straight edges they stay together, as a net does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..analysis.feature_edges import fold_angles
from ..maps.development import developed
from ..maps.overlap import overlap_share
from ..mesh.geometry import face_areas
from ..mesh.gluing import Gluing, components, corner_classes, groups
from ..mesh.surface import Surface
from ..mesh.topology import graph_components, pair_keys, paired
from .component import SMOOTH, CutComponent, make_component
from .cut_graph import cut_classes
from .developable_nets import BENT, HARD, MUCH, defects, net
from .gluing_facts import cost_factors, marked_triangles

# Components with less than this share of the area stay whole: of thousands of pieces none is looked at.
VISIBLE = 1e-3
# A side unrolls but for little if it has no more curvature than this, in radians and summed without sign.
ROUND = 1.0
# A fold belongs to a bevel if its radius is at most that share of the side of a square with the area of the body.
TIGHT = 0.05
# A side is large with this share of the area of a body. One whose large sides that unroll have that share of it, and
# whose sides meet at more than `HARD` along that share of their borders, has a hard surface: low ones of animals are
# folded everywhere, into small sides and bluntly.
LARGE = 0.03
MOSTLY = 0.7
SHARP = 0.8
# Sides stay together across an edge whose curvature, in radians and summed without sign, is no more than this, and
# which is that share of the outline of the smaller one; laid flat, they cover no more than a share of themselves.
STRAIGHT = 0.1
SHARED = 0.15
COVERED = 2e-3
SAMPLES = 2_000
# Joined sides fill that share of a box, turned in so many ways, at least: a cross does, sprawling nets leave a texture
# empty.
FILLED = 0.4
TURNS = 12
# So many of the longest edges are tried.
MOST_JOINED = 256
# What does not close when it is laid flat, over its extent, does not unroll.
GAP = 0.02
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

    Bodies with a net that is short enough and lies beside itself, and those that are not searched, stay whole;
    positions (n,3) in a unit box, wants: see `cuts.SeamFinder`
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
    if found is None:
        return False
    # Corners of bevels do not lie flat, and what covers itself for that is little.
    flat, corners, _ = _laid_out(component, found.cut, np.ones(len(component.triangles), dtype=bool))
    return _covered(flat, corners) <= MUCH


def hard_sides(component: CutComponent) -> tuple[np.ndarray, np.ndarray] | None:
    """The side (m,) of every triangle of a component of a hard surface, and which sides (s,) bool unroll; None of any
    other."""
    fold = np.abs(fold_angles(component.positions, component.triangles, component.pair))
    joined, count, length = component.pair // 3, len(component.triangles), component.length
    tight = _tight(component, fold)
    hard = ((fold > SMOOTH) | tight) & np.isfinite(component.cost)
    side = graph_components(joined[~hard, 0], joined[~hard, 1], count)[1]
    border = side[joined[:, 0]] != side[joined[:, 1]]
    if not border.any():
        return None
    area = np.bincount(side, face_areas(component.positions, component.triangles))
    unrolls = _inner_curvature(component, side, border, np.abs(defects(component))) <= ROUND
    large = area >= LARGE * area.sum()
    # Bands of bevels lie between large sides; where these meet in a blunt fold, that is no bevel.
    sharp = border & ((fold > HARD) | (tight & ~large[side[joined]].all(axis=1)))
    if area[unrolls & large].sum() < MOSTLY * area.sum() or length[sharp].sum() < SHARP * length[border].sum():
        return None
    pair, blunt = np.sort(side[joined[border]], axis=1), np.where(fold[border] <= HARD, length[border], 0.0)
    group = _with_bands(pair, length[border], blunt, large)
    anchored = np.bincount(group, large, len(area)) > 0
    return group[side], np.where(anchored, np.bincount(group, unrolls & large, len(area)) > 0, unrolls)


def _tight(component: CutComponent, fold: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of bevels: with folds (e,) of a radius that is small for the body, however many they are."""
    _, polygon = np.unique(component.polygons, return_inverse=True)
    area = np.bincount(polygon.ravel(), face_areas(component.positions, component.triangles))
    width = area[polygon.ravel()[component.pair // 3]].min(axis=1) / np.maximum(component.length, 1e-30)
    return (fold > BENT) & (width < TIGHT * np.sqrt(area.sum()) * fold)


def _with_bands(pair: np.ndarray, length: np.ndarray, blunt: np.ndarray, large: np.ndarray) -> np.ndarray:
    """A number (s,) for every side, the same for a large one (s,) bool and the bands of bevels around it.

    pair (e,2) : the sides at the borders, the smaller one first; length (e,), blunt (e,) : of these, and of what of
    them is no hard edge
    """
    count = len(large)
    outline, soft = (np.bincount(pair.ravel(), np.repeat(x, 2), count) for x in (length, blunt))
    anchor = large | (soft < SHARP * outline)
    keys, index = np.unique(pair_keys(*pair.T), return_inverse=True)
    total, group, fixed = np.bincount(index.ravel(), blunt), np.arange(count), anchor.copy()
    for one, other in paired(keys[np.argsort(-total, kind="stable")[: np.count_nonzero(total)]]):
        one, other = group[one], group[other]
        if one != other and not (fixed[one] and fixed[other]):
            group[group == other] = one
            fixed[one] |= fixed[other]
    return group


def side_borders(component: CutComponent, side: np.ndarray, unrolls: np.ndarray) -> np.ndarray:
    """Edges (e,) bool along which a component comes apart: around sides (m,) that unroll (s,) bool, less those across
    which they stay together."""
    joined = side[component.pair // 3]
    border = (joined[:, 0] != joined[:, 1]) & unrolls[joined].any(axis=1)
    if not border.any():
        return border
    area = np.bincount(side, face_areas(component.positions, component.triangles), len(unrolls))
    chain, pair, length, turned = _chains(component, side, border, np.abs(defects(component)))
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
    return left & ~lone_edges(component, left)


def lone_edges(component: CutComponent, cut: np.ndarray) -> np.ndarray:
    """Edges (e,) bool of a cut (e,) bool that touch no other of it, nor the boundary: these open nothing."""
    ends = component.ends[cut]
    label = graph_components(ends[:, 0], ends[:, 1], component.vertex_count)[1][ends[:, 0]]
    lone = np.zeros(len(cut), dtype=bool)
    lone[cut] = (np.bincount(label)[label] == 1) & ~component.on_boundary()[ends].any(axis=1)
    return lone


def _inner_curvature(component: CutComponent, side: np.ndarray, border: np.ndarray, curvature) -> np.ndarray:
    """What of the curvature (n,) lies within each side (s,), off the borders (e,) bool."""
    of_vertex = np.zeros(component.vertex_count, np.int64)
    of_vertex[component.triangles.ravel()] = np.repeat(side, 3)
    inner = np.ones(component.vertex_count, dtype=bool)
    inner[component.ends[border]] = False
    return np.bincount(of_vertex[inner], curvature[inner], int(side.max()) + 1)


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
    """Whether triangles (m,) bool of a component that is open along borders (e,) bool unroll beside one another, and
    fill a box well enough."""
    flat, corners, gap = _laid_out(component, border, rows)
    turned = flat * np.exp(1j * np.pi / 2 * np.arange(TURNS) / TURNS)[:, None]
    boxes = np.ptp(turned.real, axis=1) * np.ptp(turned.imag, axis=1)
    area = face_areas(component.positions, component.triangles[rows]).sum()
    return gap <= GAP and area >= FILLED * boxes.min() and _covered(flat, corners) <= COVERED


def _laid_out(component: CutComponent, border: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Places (k,) complex and corners (t,3) of triangles (m,) bool of a component that is open along borders (e,) bool,
    laid flat, and how far these do not close, over their extent."""
    corners = cut_classes(component, border)[rows]
    _, first, triangles = np.unique(corners, return_index=True, return_inverse=True)
    positions, triangles = component.positions[component.triangles[rows].ravel()[first]], triangles.reshape(-1, 3)
    flat, gap = developed(positions, triangles)
    return flat, triangles, float(gap.max() / np.ptp(positions, axis=0).max())


def _covered(flat: np.ndarray, corners: np.ndarray) -> float:
    """Which share of themselves triangles (t,3) with places (k,) complex cover."""
    return overlap_share(np.stack([flat.real, flat.imag], axis=1)[corners], samples=SAMPLES)
