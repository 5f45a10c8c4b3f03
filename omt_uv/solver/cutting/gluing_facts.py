"""Tell what decides where and whether a gluing is cut: costs, curvature, marked seams, lines where it turns over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..analysis.feature_edges import fold_angles
from ..mesh.geometry import angle_defects, angles_from_lengths, bounds, face_areas, halfedge_lengths, lengths
from ..mesh.gluing import Gluing, components, corner_classes, groups
from ..mesh.surface import DEGENERATE, Surface, is_seam, is_sharp
from ..mesh.topology import distinct, first_places, halfedges, pair_keys
from ..quads.recombination import quad_diagonals
from .component import SEAM, SHARP, SMOOTH, CutComponent, SideFinder, make_component

# Components with less than this share of the area stay whole: of thousands of pieces none is looked at.
VISIBLE = 1e-3
# Edges that are marked are meant to be up to that share of all.
MEANT = 0.5


def cost_factors(surface: Surface, gluing: Gluing) -> np.ndarray:
    """Factor (p,) on the cost of cutting each pair: less where the artist marked a seam or a sharp edge.

    What cannot be oriented is rather cut where its faces look to opposite sides: then none has to be turned over.
    """
    key = pair_keys(*gluing.ends(gluing.first))
    factor = np.where(is_sharp(surface, key) | gluing.parallel(), SHARP, 1.0)
    factor[is_seam(surface, key)] = SEAM
    return factor


def diagonal_pairs(gluing: Gluing, positions: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """Pairs (p,) bool that are diagonals of quads which a gluing was triangulated from, none of them marked.

    positions (n,3) of the surface, in a unit box; factor (p,) : see `cost_factors`
    """
    polygon = distinct(gluing.owner)[1]
    pair, marked = np.stack([gluing.first, gluing.second], axis=1), factor < 1
    # Flat shading makes most edges sharp, and means none.
    marked &= np.count_nonzero(marked) <= MEANT * len(marked)
    may = (np.bincount(polygon)[polygon] == 1)[pair // 3].all(axis=1) & ~marked
    may[may] = quad_diagonals(positions, gluing.vertex[gluing.triangles], pair[may])
    return may


def total_curvature(gluing: Gluing, corner_class: np.ndarray, component_of: np.ndarray, positions) -> np.ndarray:
    """Curvature (k,) of every component off its boundary, in radians, summed without sign; none of what is a line."""
    classes = corner_class[gluing.triangles]
    n = int(classes.max()) + 1
    length = halfedge_lengths(positions, gluing.vertex[gluing.triangles]).reshape(-1, 3)
    tail, head = halfedges(classes)
    open_ = _open(gluing)
    boundary = np.unique(np.concatenate([tail[open_], head[open_]]))
    curvature = np.abs(angle_defects(classes, angles_from_lengths(length), boundary, n))
    curvature[boundary] = 0
    vertices, where = first_places(classes)
    count = int(component_of.max()) + 1
    area = np.bincount(component_of, face_areas(positions, gluing.vertex[gluing.triangles]), count)
    longest = np.zeros(count)
    np.maximum.at(longest, component_of, length.max(axis=1))
    return np.where(
        area > DEGENERATE * longest**2, np.bincount(component_of[where // 3], curvature[vertices], count), 0
    )


def marked_triangles(surface: Surface, gluing: Gluing) -> np.ndarray:
    """Triangles (t,) beside a marked seam that has the surface on both sides."""
    key = pair_keys(*gluing.ends(np.arange(3 * len(gluing.triangles))))
    open_ = _open(gluing) & is_seam(surface, key)
    keys, count = np.unique(key[open_], return_counts=True)
    return np.flatnonzero(open_ & np.isin(key, keys[count > 1])) // 3


def _open(gluing: Gluing) -> np.ndarray:
    """Halfedges (3m,) bool that are joined to none."""
    open_ = np.ones(3 * len(gluing.triangles), dtype=bool)
    open_[gluing.first] = open_[gluing.second] = False
    return open_


@dataclass(frozen=True)
class TurningLines:
    """Components (k,) bool that are opened along turning lines, and the length (k,) of these."""

    opened: np.ndarray
    length: np.ndarray

    @staticmethod
    def of(gluing: Gluing, lines: np.ndarray, component_of: np.ndarray, positions: np.ndarray) -> TurningLines:
        """What the pairs `lines` (p,) bool do to components (m,) of the triangles, positions (n,3)."""
        a, b = gluing.ends(gluing.first[lines])
        component, count = component_of[gluing.first[lines] // 3], int(component_of.max()) + 1
        length = np.bincount(component, lengths(positions[a] - positions[b]), count)
        return TurningLines(np.bincount(component, minlength=count) > 0, length)


def turning_lines(gluing: Gluing, component_of: np.ndarray, one_sided: np.ndarray) -> np.ndarray:
    """Pairs (p,) bool at which faces look to opposite sides, of components (m,) with one side that stay in one without.

    Cut there first, such a component has two sides, and no face has to be turned over.
    """
    pair_component = component_of[gluing.first // 3]
    lines = gluing.parallel() & one_sided[gluing.first // 3]
    apart = components(gluing.without(lines))
    first = first_places(apart)[1]
    parts = np.bincount(component_of[first], minlength=int(component_of.max()) + 1)
    return lines & (parts == 1)[pair_component]


def in_unit_box(surface: Surface, gluing: Gluing) -> tuple[np.ndarray, float]:
    """Positions (n,3) of the surface such that the triangles lie in a unit box, and its size; 0 where unused."""
    used = distinct(gluing.vertex[gluing.triangles])[0]
    p = surface.positions[used]
    low, high = bounds(p)
    # Halves first: the difference of two huge numbers may be infinite.
    unit = 2 * float((high / 2 - low / 2).max()) or 1.0
    positions = np.zeros(surface.positions.shape)
    positions[used] = p / unit - low / unit
    return positions, unit


def to_search(
    surface: Surface, gluing: Gluing, component_of: np.ndarray, members: list, search: SideFinder, among: np.ndarray
) -> np.ndarray:
    """Components (k,) bool of those `among` (k,) bool whose seams are to be searched; component_of (m,) : of each
    triangle, members : the triangles (l,) of each."""
    found, marked = np.zeros(len(members), dtype=bool), np.zeros(len(members), dtype=bool)
    marked[component_of[marked_triangles(surface, gluing)]] = True
    for k in np.flatnonzero(among):
        found[k] = search.wants(gluing.owner[members[k]], bool(marked[k]))
    return found


def seen_parts(
    surface: Surface, gluing: Gluing, positions: np.ndarray, gone: np.ndarray, search: SideFinder
) -> Iterator[tuple[CutComponent, np.ndarray, bool]]:
    """The components of a gluing, without pairs that are gone (p,) bool, that are to be searched and large enough to be
    seen, the pairs (e,) of the gluing that their edges are, and whether any of these is creased.

    positions (n,3) in a unit box
    """
    left, number = gluing.without(gone), np.flatnonzero(~gone)
    component_of, classes = components(left), corner_classes(left)
    fold = np.abs(fold_angles(positions, left.vertex[left.triangles], np.stack([left.first, left.second], axis=1)))
    area = np.bincount(component_of, face_areas(positions, left.vertex[left.triangles]))
    creased = np.bincount(component_of[left.first[fold > SMOOTH] // 3], minlength=len(area)) > 0
    marked = np.unique(component_of[marked_triangles(surface, left)])
    free, factor, members = np.zeros(len(positions)), cost_factors(surface, left), groups(component_of)
    pairs = groups(np.append(component_of[left.first // 3], np.arange(len(members))))
    for k in np.flatnonzero(area >= VISIBLE * area.sum()):
        if search.wants(left.owner[members[k]], bool(np.isin(k, marked))):
            own = pairs[k][pairs[k] < len(number)]
            component = make_component(left, positions, classes, members[k], own, free, factor)
            yield component, number[component.gluing_pair], bool(creased[k])
