"""Take bodies of flat and developable sides apart along their creases, where no net of them lies beside itself.

A casting or a machined part bends along hard edges that are curved: a flat side beside a round one. Joined along such
an edge, neither can be laid flat. Sides come apart there; across straight edges they stay together, as a net does.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from ..analysis.feature_edges import fold_angles
from ..maps.development import developed
from ..maps.overlap import covered_share, covers_little
from ..mesh.geometry import cross3, face_areas, lengths
from ..mesh.gluing import Gluing
from ..mesh.surface import Surface
from ..mesh.topology import graph_components, halfedges, pair_keys, paired
from ..revolution.axis import has_axis
from ..revolution.rings import rings_of_edges
from .component import SMOOTH, CutComponent, SideFinder, lone_edges, with_quads
from .cut_graph import cut_classes, distance_from
from .developable_nets import HARD, MUCH, defects, net, tight_edges
from .gluing_facts import cost_factors, diagonal_pairs, seen_parts

# A side unrolls but for little if it has no more curvature than this, in radians and summed without sign.
ROUND = 1.0
# A side is large with this share of the area of a body. One whose large sides that unroll have that share of it, and
# whose sides meet at more than `HARD` along that share of their borders, has a hard surface, and one of so many sides
# that nearly all unroll, or most, or half of it is large, where nearly all borders are hard: low ones of animals are
# folded everywhere, into small sides and bluntly. Of so few sides, as bodies of few polygons have, half of the borders
# do.
LARGE = 0.03
MOSTLY = 0.7
HALF = 0.5
SHARP = 0.8
ALL = 0.95
MOST_SIDES = 2_000
FEW_SIDES = 64
# Or so many sides for each triangle: of noise every triangle is one, and of a fine body a side has many.
PER_TRIANGLE = 0.25
# A body of more sides than this has no hard surface if those with at most so much curvature in the mean, in radians, at
# the vertices within have less than that share of its area: low ones of animals and people are folded into many sides,
# too, but these swell. Where one of very many has hardly any borders within so much, in radians, of a right angle, as
# buildings and machines have, nearly all of it has to be sides with no more in sum.
SIMPLE = 50
SWELLS = 0.05
MOSTLY_FLAT = 0.85
INTRICATE = 220
SQUARED = 0.2
NEARLY_RIGHT = np.radians(6)
# A side is a ribbon with less of the area of a disk that has as long an outline.
RIBBON = 0.2
# A band stays with a side unless it is no wider than the first share of its length, or turns about, and its far edge
# would have to be longer or shorter by the second share, and is shorter than the third: where a hole is countersunk.
COMPACT = 0.3
STRAIN = 0.25
NARROWS = 0.75
# Sides stay together across an edge whose curvature, in radians and summed without sign, is no more than this but for
# that share of its length at either end, and which is that share of the outline of the smaller one; laid flat, they
# cover no more than a share of themselves, and of the smaller one.
STRAIGHT = 0.1
CORNER = 0.15
SHARED = 0.15
COVERED = 2e-3
COVERED_PART = 1e-2
SAMPLES = 2_000
# Joined sides fill that share of a box, turned in so many ways, at least, and nets the second one of a square as long:
# a cross does, sprawling ones leave a texture empty.
FILLED = 0.4
SPRAWLING = 0.25
TURNS = 12
# So many of the longest edges are tried, and of those around small sides.
MOST_JOINED = 256
# Triangles that turn by less, in radians, are of one flat side, if most of its area looks one way; one with fewer edges
# around it unrolls with what is beside it.
LEVEL = np.radians(2)
FLAT = 0.999
LEAST_OUTLINE = 6
# An end has this share of the area of a disk with as long an outline, or it is a strip. Those of hoses are small beside
# all else, with that share of it, but round: more than a square is.
STRIP = 0.35
LEAST_END = 5e-3
ROUND_END = 0.85
# An edge closes it off that folds by more: prisms of ten sides do, chamfers too, and bodies of twelve are smooth.
CLOSED = np.radians(33)
# What does not close when it is laid flat, over its extent, does not unroll.
GAP = 0.02
# Sides of less than this share of the area stay with what they share most of their outline with; the wall of a hole,
# and what is beside another such side, only where both lie flat together. Specks of less than the second one always do.
CRUMB = 3e-3
SPECK = 3e-5


def hard_borders(
    surface: Surface, gluing: Gluing, positions: np.ndarray, gone: np.ndarray, search: SideFinder
) -> np.ndarray:
    """Pairs (p,) bool of a gluing, without those that are gone (p,) bool, along which bodies of hard sides come apart,
    and bodies of revolution.

    Bodies with a net that is short enough and lies beside itself, and those that are not searched, stay whole;
    positions (n,3) in a unit box
    """
    found, known = np.zeros(len(gone), dtype=bool), search.borders[int(search.as_drawn)]
    left = gluing.without(gone)
    diagonals = cache(lambda: diagonal_pairs(left, positions, cost_factors(surface, left)))
    for component, number, creased in seen_parts(surface, gluing, positions, gone, search):
        turns = search.asked > 0 and has_axis(component.positions, component.triangles, component.polygons)
        edges = known.found_for(component)
        if edges is None:
            edges = _borders(component, creased, turns * search.asked, None if search.as_drawn else diagonals)
            known.tell(component, edges)
        found[number[edges]] = True
    return found


def _borders(
    component: CutComponent, creased: bool, asked: float, diagonals: Callable[[], np.ndarray] | None
) -> np.ndarray:
    """Edges (e,) bool along which a component comes apart; asked : see `rings.rings_of_edges`, 0 of what has no axis;
    diagonals : gives pairs (p,) bool of the gluing that are those of quads it was triangulated from, None where its
    creases, if it is creased, count as they are."""
    # Bodies whose edges are all rounded have sides, too; a disk with such an outline lies flat as it is.
    sides = hard_sides(component, diagonals is None) if creased or not component.is_disk else None
    if sides is not None and diagonals is not None and _creased(component)[-1] < ALL:
        # Diagonals of what was triangulated are creases, too, and bodies that swell seem flat between these: not such
        # as have hard edges alone.
        diagonal = diagonals()[component.gluing_pair]
        if diagonal.any():
            component = with_quads(component, diagonal)
            sides = hard_sides(component)
    if sides is not None:
        return np.zeros(len(component.pair), bool) if _has_clear_net(component) else side_borders(component, *sides)
    given = component.positions, component.triangles, component.polygons, component.pair, component.length
    around = rings_of_edges(*given, component.cost, asked) if asked else np.zeros(len(component.pair), dtype=bool)
    return around if around.any() or not creased else cap_borders(component)


def cap_borders(component: CutComponent) -> np.ndarray:
    """Edges (e,) bool around the large flat sides of a component that sharp edges or bevels close off all around, as
    the ends of a barrel are: what is no disk is cut anyway, and a cut across one would leave it in petals."""
    joined, count = component.pair // 3, len(component.triangles)
    if component.is_disk:
        return np.zeros(len(joined), dtype=bool)
    fold = np.abs(fold_angles(component.positions, component.triangles, component.pair))
    level = (fold <= LEVEL) | ~np.isfinite(component.cost)
    side = graph_components(joined[level, 0], joined[level, 1], count)[1]
    corners = component.positions[component.triangles]
    normal = cross3(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    area = np.bincount(side, lengths(normal))
    whole = np.linalg.norm([np.bincount(side, x) for x in normal.T], axis=0)
    pair = side[joined]
    border = pair[:, 0] != pair[:, 1]
    has_hole = ~_disks(component, border, side, len(area))
    pair, length = pair[border], component.length[border]
    sharp = ((fold > CLOSED) | tight_edges(component, fold))[border]

    def around(amount: np.ndarray) -> np.ndarray:
        return np.bincount(pair.ravel(), np.repeat(amount, 2), len(area))

    disk = around(length) ** 2 / (4 * np.pi)
    # Facets of hoses and bevels of limbs are strips, and what is small beside all else has to be round.
    cap = (area >= LARGE * area.sum()) & (has_hole | (area >= STRIP * disk))
    cap &= around(length * sharp) >= ALL * around(length)
    end = (area >= LEAST_END * area.sum()) & (area >= ROUND_END * disk)
    cap |= end & (around(length * (fold > HARD)[border]) >= ALL * around(length))
    cap &= (whole >= FLAT * area) & (around(np.ones(len(pair))) >= LEAST_OUTLINE)
    # The sides of a beam end at one another.
    cap &= around(length * cap[pair].all(axis=1)) < HALF * around(length)
    border[border] = cap[pair].any(axis=1)
    return border


def _has_clear_net(component: CutComponent) -> bool:
    unrolled = net(component)
    found = None if unrolled is None else unrolled.up_to(unrolled.most)
    if found is None or found.winds:
        return False
    # Corners of bevels do not lie flat, and what covers itself for that is little.
    flat, corners, _ = _laid_out(component, found.cut, np.ones(len(component.triangles), dtype=bool))
    area, (wide, high) = face_areas(component.positions, component.triangles).sum(), _boxes(flat)
    return (
        area >= SPRAWLING * float(np.maximum(wide, high).max()) ** 2 and covered_share(flat, corners, SAMPLES) <= MUCH
    )


def hard_sides(component: CutComponent, may_swell: bool = False) -> tuple[np.ndarray, np.ndarray] | None:
    """The side (m,) of every triangle of a component of a hard surface, and which sides (s,) bool unroll; None of any
    other, and of one that swells unless it may."""
    joined, length = component.pair // 3, component.length
    side, border, fold, area, large, keen = _creased(component)
    if not border.any():
        return None
    curvature = np.abs(defects(component))
    bent = _inner_curvature(component, side, border, curvature, len(area))
    unrolls = bent <= ROUND
    mostly, few = area[unrolls & large].sum() / area.sum(), len(area) <= max(MOST_SIDES, PER_TRIANGLE * len(side))
    if not may_swell and len(area) > SIMPLE and _swells(component, side, border, fold, area, bent):
        return None
    sure = (mostly >= MOSTLY and keen >= SHARP) or (few and mostly >= HALF and keen >= ALL)
    unrolled = area[unrolls].sum() >= (SHARP if keen >= ALL else ALL) * area.sum()
    if not sure and not (few and unrolled):
        return None
    pair, blunt = np.sort(side[joined[border]], axis=1), np.where(fold[border] <= HARD, length[border], 0.0)
    whole = _with_bands(pair, length[border], blunt, large, area)[side]
    whole = _without_strained(component, whole, fold, large[side], curvature)
    inside = np.bincount(whole, large[side]) > 0
    border = whole[joined[:, 0]] != whole[joined[:, 1]]
    # What is folded everywhere into sides that unroll is hard, too, if it is where bands have joined these; and a body
    # of few polygons is made of few sides, but for tubes, which are made of ribbons.
    sure |= length[border & (fold > HARD)].sum() >= SHARP * length[border].sum()
    if not sure and (mostly < MOSTLY or len(area) > FEW_SIDES or keen < HALF or _ribbons(component, whole, border)):
        return None
    flat = _inner_curvature(component, whole, border, curvature, len(inside)) <= ROUND
    return whole, np.where(inside, np.bincount(whole, (unrolls & large)[side]) > 0, flat)


def _creased(component: CutComponent) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, float]:
    """What lies between creases: the side (m,) of every triangle, the edges (e,) bool between sides, folds (e,), areas
    (s,), which sides (s,) bool are large, and along which share of their borders they meet in hard edges."""
    fold = np.abs(fold_angles(component.positions, component.triangles, component.pair))
    joined, length, tight = component.pair // 3, component.length, tight_edges(component, fold)
    hard = ((fold > SMOOTH) | tight) & np.isfinite(component.cost)
    side = graph_components(joined[~hard, 0], joined[~hard, 1], len(component.triangles))[1]
    border = side[joined[:, 0]] != side[joined[:, 1]]
    area = np.bincount(side, face_areas(component.positions, component.triangles))
    large = area >= LARGE * area.sum()
    # Bands of bevels lie between large sides; where these meet in a blunt fold, that is no bevel.
    sharp = border & ((fold > HARD) | (tight & ~large[side[joined]].all(axis=1)))
    return side, border, fold, area, large, float(length[sharp].sum() / max(length[border].sum(), 1e-300))


def _swells(component: CutComponent, side, border, fold, area, bent) -> bool:
    """Whether much of a component is sides (m,), with areas (s,) and curvature within (s,), that swell.

    border (e,) bool, fold (e,) : of its edges
    """
    right = border & (np.abs(fold - np.pi / 2) <= NEARLY_RIGHT)
    if len(area) > INTRICATE and component.length[right].sum() < SQUARED * component.length[border].sum():
        return bool(area[bent <= SWELLS].sum() < ALL * area.sum())
    within = _inner_curvature(component, side, border, np.ones(component.vertex_count), len(area))
    return bool(area[bent <= SWELLS * within].sum() < MOSTLY_FLAT * area.sum())


def _ribbons(component: CutComponent, side: np.ndarray, border: np.ndarray) -> bool:
    """Whether most of a component is sides (m,) that are long and narrow, between borders (e,) bool."""
    count = int(side.max()) + 1
    area = np.bincount(side, face_areas(component.positions, component.triangles), count)
    tail, head = halfedges(component.triangles)
    ends = component.positions[np.stack([tail, head])[:, component.boundary]]
    outline = np.bincount(side[component.pair[border] // 3].ravel(), np.repeat(component.length[border], 2), count)
    outline += np.bincount(side[component.boundary // 3], lengths(ends[1] - ends[0]), count)
    return bool(area[4 * np.pi * area < RIBBON * outline**2].sum() > HALF * area.sum())


def _with_bands(
    pair: np.ndarray, length: np.ndarray, blunt: np.ndarray, large: np.ndarray, area: np.ndarray
) -> np.ndarray:
    """A number (s,) for every side, the same for a large one (s,) bool and the bands of bevels around it, and for the
    strips of the wall of a hole.

    pair (e,2) : the sides at the borders, the smaller one first; length (e,), blunt (e,) : of these, and of what of
    them is no hard edge; area (s,)
    """
    count = len(large)
    outline, soft = (np.bincount(pair.ravel(), np.repeat(x, 2), count) for x in (length, blunt))
    # Bands have blunt edges all around, strips of a wall on two sides.
    rank = np.where(large, 2, np.where(soft < SHARP * outline, 1, 0))
    keys, index = np.unique(pair_keys(*pair.T), return_inverse=True)
    total, group = np.bincount(index.ravel(), blunt), np.arange(count)
    order = np.argsort(-total, kind="stable")[: np.count_nonzero(total)]
    for k, (one, other) in zip(order, paired(keys[order]), strict=True):
        # Strips of a wall are beside one another; ribbons end at one another.
        beside = total[k] ** 2 >= min(area[one], area[other])
        one, other = group[one], group[other]
        if one != other and (min(rank[one], rank[other]) == 0 or (beside and rank[one] == rank[other] == 1)):
            group[group == other] = one
            rank[one] = max(rank[one], rank[other])
    return group


def _without_strained(component: CutComponent, side, fold, large, curvature) -> np.ndarray:
    """A number (m,) for every triangle, that of its side (m,), but others for bands that would be strained there.

    fold (e,); large (m,) bool : what is no band; curvature (n,)
    """
    joined, area = component.pair // 3, face_areas(component.positions, component.triangles)
    inner = side[joined[:, 0]] == side[joined[:, 1]]
    band = (np.bincount(side, large) > 0)[side] & ~large
    within, beside = inner & band[joined].all(axis=1), inner & (band[joined].sum(axis=1) == 1)
    label = graph_components(joined[within, 0], joined[within, 1], len(side))[1]
    count = int(label.max()) + 1
    last = np.where(band[joined[beside, 0]], joined[beside, 0], joined[beside, 1])
    shared = np.bincount(label[last], component.length[beside], count)
    at = np.full(component.vertex_count, -1)
    at[component.triangles[band].ravel()] = np.repeat(label[band], 3)
    at[component.ends[~inner]] = -1
    bent = np.bincount(at[at >= 0], curvature[at >= 0], count)
    outer, along = joined[~inner], np.repeat(component.length[~inner], 2).reshape(-1, 2)
    far = np.bincount(label[outer[band[outer]]], along[band[outer]], count)
    size = np.bincount(label, area, count)
    shape = (size < COMPACT * shared**2) | (bent > np.pi)
    strained = shape & (bent * size > STRAIN * shared**2) & (far < NARROWS * shared)
    # The cone of a countersunk hole and its wall unroll each by itself.
    smooth = within & (fold <= SMOOTH)
    strained, label = strained[label], graph_components(joined[smooth, 0], joined[smooth, 1], len(side))[1]
    _, number = np.unique(np.where(band & strained, len(area) + label, side), return_inverse=True)
    return number.ravel()


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
    group, total = np.arange(len(area)), area.copy()
    left = border.copy()
    for k in np.argsort(-length, kind="stable")[:MOST_JOINED]:
        one, other = group[pair[k]]
        if fits[k] and one != other:
            without = left & (chain != k)
            if _lies_flat(component, without, *_rows(group[side], total, one, other)):
                total[one] += total[other]
                left, group = without, np.where(group == other, one, group)
    left = _without_crumbs(component, side, group, left, unrolls, chain, pair, length)
    return left & ~lone_edges(component, left)


def _without_crumbs(component, side, group, left, unrolls, chain, pair, length) -> np.ndarray:
    """Borders (e,) bool that are left where small sides stay with what is beside them; see `_chains`."""
    area = np.bincount(side, face_areas(component.positions, component.triangles), len(unrolls))
    total = np.bincount(group, area, len(area))
    apart = (np.bincount(group, ~unrolls, len(area)) == 0) & ~_disks(component, left, group[side], len(area))
    tries = MOST_JOINED
    for k in np.argsort(-length, kind="stable"):
        one, other = group[pair[k]]
        small = one if total[one] < total[other] else other
        if one == other or total[small] >= CRUMB * area.sum():
            continue
        without = left & (chain != k)
        stays = total[small] < SPECK * area.sum()
        stays |= not (apart[small] or (total[[one, other]] < CRUMB * area.sum()).all())
        if not stays and tries:
            tries, extent = tries - 1, float(np.sqrt(total[small]))
            stays = _lies_flat(component, without, *_rows(group[side], total, one, other), 0.0, extent)
        if stays:
            left, group = without, np.where(group == other, one, group)
            total[one], apart[one] = total[one] + total[other], apart[[one, other]].any()
    return left


def _disks(component: CutComponent, border: np.ndarray, group: np.ndarray, count: int) -> np.ndarray:
    """Which of so many groups (m,) of triangles between borders (e,) bool are disks: they have no hole."""
    corners = cut_classes(component, border)
    first = np.unique(corners, return_index=True)[1]
    inner = group[component.pair[~border, 0] // 3]
    vertices, edges, faces = (np.bincount(x, minlength=count) for x in (group[first // 3], inner, group))
    return vertices + edges - 2 * faces == 1


def _inner_curvature(
    component: CutComponent, side: np.ndarray, border: np.ndarray, curvature: np.ndarray, count: int
) -> np.ndarray:
    """What of the curvature (n,) lies within each of so many sides, off the borders (e,) bool."""
    of_vertex = np.zeros(component.vertex_count, np.int64)
    of_vertex[component.triangles.ravel()] = np.repeat(side, 3)
    inner = np.ones(component.vertex_count, dtype=bool)
    inner[component.ends[border]] = False
    return np.bincount(of_vertex[inner], curvature[inner], count)


def _chains(component, side, border, curvature) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The chain (e,) of each border edge, -1 for others; the two sides (c,2) of the chains, their lengths (c,), and
    the curvature (c,) of the vertices on each and on no other, but near its ends."""
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
    length = np.bincount(of_edge, component.length[edges], count)
    # Where sides meet at a rounded corner, what is curved is the corner's.
    alone &= distance_from(~alone, index, component.length[edges]) > CORNER * length[label]
    turned = np.bincount(label[alone], curvature[vertex[alone]], count)
    chain = np.full(len(border), -1)
    chain[edges] = of_edge
    return chain, pair[first], length, turned


def _rows(group: np.ndarray, total: np.ndarray, one: int, other: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m,) bool of two groups (m,), and those of the smaller one by their areas (s,)."""
    return np.isin(group, (one, other)), group == (one if total[one] < total[other] else other)


def _lies_flat(
    component: CutComponent,
    border: np.ndarray,
    rows: np.ndarray,
    part: np.ndarray,
    filled: float = FILLED,
    extent: float | None = None,
) -> bool:
    """Whether triangles (m,) bool of a component that is open along borders (e,) bool unroll beside one another, and
    fill such a share of a box.

    part (m,) bool : those of them that are beside what is known to lie flat; extent : of what may not move by more than
    `GAP` of it, that of all by default
    """
    flat, corners, gap = _laid_out(component, border, rows)
    area = face_areas(component.positions, component.triangles[rows]).sum()
    if extent is None:
        extent = float(np.ptp(component.positions[component.triangles[rows]], axis=(0, 1)).max())
    return (
        gap <= GAP * extent
        and area >= filled * float(np.prod(_boxes(flat), axis=0).min())
        and covers_little(flat, corners, np.flatnonzero(part[rows]), (COVERED_PART, COVERED), SAMPLES)
    )


def _laid_out(component: CutComponent, border: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Places (k,) complex and corners (t,3) of triangles (m,) bool of a component that is open along borders (e,) bool,
    laid flat, and how far these do not close."""
    corners = cut_classes(component, border)[rows]
    _, first, triangles = np.unique(corners, return_index=True, return_inverse=True)
    positions, triangles = component.positions[component.triangles[rows].ravel()[first]], triangles.reshape(-1, 3)
    flat, gap = developed(positions, triangles, across_long=True)
    return flat, triangles, float(gap.max())


def _boxes(flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both extents (k,) of places (n,) complex turned in some ways."""
    turned = flat * np.exp(1j * np.pi / 2 * np.arange(TURNS) / TURNS)[:, None]
    return np.ptp(turned.real, axis=1), np.ptp(turned.imag, axis=1)
