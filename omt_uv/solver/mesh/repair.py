"""Repair broken geometry for the map alone: the mesh itself is never touched.

Edges where several faces meet are cut open, coincident faces come apart in layers, faces that look to the wrong side
are turned over, and triangles without area are given a little.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from ..errors import DISSOLVE, MERGE, ZeroAreaFaceError, plural
from .charts import Chart
from .geometry import cross3, edge_lengths, extents, lengths, places
from .gluing import Gluing, corner_classes, polygon_gluing
from .surface import (
    FlatTriangles,
    Surface,
    degenerate_triangles,
    duplicate_faces,
    is_seam,
    side_ends,
    used_twice,
    using_twice,
)
from .topology import (
    expand,
    first_of,
    graph_components,
    halfedges,
    joined_along,
    next_corners,
    only_once,
    opposite_sides,
    order_of_pairs,
    pair_keys,
    pair_up,
    row_labels,
)

# Vertices of a triangle without area move by this share of the height of the flattest sound triangle around them:
# it has area then, and its neighbours keep theirs to within a few thousandths.
PERTURBATION = 1e-3
# Polygons whose perimeters differ by less than this share may be each other's mirror image.
ALIKE = 1e-4
# A round moves four times as far as the one before.
PERTURBATION_ROUNDS = 12
# Triangles with less than this share of the square of their longest side have no area that a texture could show, but
# their angles would cost the solvers half of their digits.
NEEDLE = 1e-7
# With less than this share, the height of a triangle is no measure of what is around it.
THIN = 1e-4
# A chart of less than this share of the extent of its mesh has no size.
TINY = 1e-9
# Vertices of nothing but bad triangles take the height from so many triangles away.
ACROSS_BAD = 8
# Share of the extent of the mesh that stands for the size of a chart which has none.
SHAPELESS_SIZE = 1e-5


@dataclass(frozen=True)
class Repaired:
    """Gluing in which at most two faces meet at every edge, the edges (k,2) where it was torn, and what was done."""

    gluing: Gluing
    torn: np.ndarray
    warnings: tuple[str, ...]


def repaired_gluing(surface: Surface, faces: np.ndarray, triangles: np.ndarray, owner: np.ndarray) -> Repaired:
    """Join triangles (m,3) of corners of the polygons `faces` (f,) bool across every edge where two of them meet.

    Faces are joined whichever way they look: see `gluing.orientations`. Raises nothing: what cannot be joined is
    cut open, and said.
    """
    gluing = polygon_gluing(triangles, owner, surface.corner_vertex, surface.face_start)
    layer, warnings = _layers(surface, faces)
    joined, torn = _pair_sides(surface, gluing, layer)
    around = np.zeros(0) if joined.side.all() else _perimeters(surface)
    while len(folded := _folded_faces(joined, layer, around)):
        layer[folded] = -1
        joined, torn = _pair_sides(surface, gluing, layer)
        warnings.append(
            f"{plural(len(folded), '1 face', '{} faces')} sharing several edges in a row with another, mapped apart; "
            "dissolve the vertex that only the two share"
        )
    if len(torn):
        edges = plural(len(torn), "an edge", "{} edges")
        warnings.append(f"More than two faces meet at {edges}; cut open there for the map")
    return Repaired(_healed(joined), torn, tuple(warnings))


def _layers(surface: Surface, faces: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Layer (f,) of every polygon, -1 for those that cannot be joined to any, and warnings.

    Of several faces on the same vertices one is in layer 0, the next in layer 1: a surface that lies double falls into
    two, each with its own map.
    """
    f = len(surface.face_start) - 1
    layer = np.zeros(f, dtype=np.int64)
    warnings = []
    rows = duplicate_faces(surface, faces)
    layer[rows[:, 0]] = _floors(surface, faces, rows)
    copies = int((rows[:, 1] > 0).sum())
    if copies:
        warnings.append(
            f"{plural(copies, '1 face', '{} faces')} with the same vertices as another, mapped apart; "
            f"delete what is double, or {MERGE}"
        )
    repeating = using_twice(surface)
    layer[repeating] = -1
    repeating = repeating[faces[repeating]]
    if len(repeating):
        warnings.append(
            f"{plural(len(repeating), '1 face', '{} faces')} with a vertex used twice, mapped apart; {DISSOLVE}"
        )
    return layer, warnings


def _floors(surface: Surface, faces: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """A number (k,) from 0 on of each of the faces `rows` (k,3) of `duplicate_faces` among its likes: faces that go on
    in one another have the same, whichever comes first in the mesh."""
    if not len(rows):
        return np.zeros(0, np.int64)
    ends, owner = side_ends(surface), np.repeat(np.arange(len(faces)), np.diff(surface.face_start))
    double = np.zeros(len(surface.positions), dtype=bool)
    double[surface.corner_vertex[np.isin(owner, rows[:, 0])]] = True
    sides = np.flatnonzero(faces[owner] & double[ends].all(axis=0))
    twin = _twins(rows, len(faces))[owner[sides]]
    one, other = opposite_sides(np.arange(len(double)), ends[:, sides], twin)
    part = graph_components(owner[sides[one]], owner[sides[other]], len(faces))[1]
    # The larger part first: what lies on it is its other side.
    rank = np.argsort(np.argsort(-np.bincount(part), kind="stable"))[part[rows[:, 0]]]
    order = np.lexsort((rows[:, 0], rank, rows[:, 2]))
    begin = np.flatnonzero(np.diff(rows[order, 2], prepend=-1))
    count = np.diff(begin, append=len(rows))
    floor = np.zeros(len(rows), np.int64)
    floor[order] = expand(count)[1]
    return floor


def _pair_sides(surface: Surface, gluing: Gluing, layer: np.ndarray) -> tuple[Gluing, np.ndarray]:
    """Join the sides of polygons of one layer, and the vertex pairs (k,2) where more than two of them meet."""
    sides = np.flatnonzero(gluing.side)
    a, b = gluing.ends(sides)
    edge = pair_keys(a, b)
    floor = layer[gluing.owner[sides // 3]]
    keep = (floor >= 0) & ~is_seam(surface, edge)
    sides, a, b, edge, floor = sides[keep], a[keep], b[keep], edge[keep], floor[keep]
    layers = int(floor.max(initial=0)) + 1
    key = edge if layers == 1 else np.unique(edge, return_inverse=True)[1].ravel() * layers + floor
    order = order_of_pairs(key)
    first = np.flatnonzero(np.diff(key[order], prepend=-1))
    h = order[first[np.diff(first, append=len(key)) > 2]]
    torn = np.unique(np.stack([np.minimum(a[h], b[h]), np.maximum(a[h], b[h])], axis=1), axis=0)
    first, second = pair_up(key, order)
    first = np.concatenate([gluing.first, sides[first]])
    second = np.concatenate([gluing.second, sides[second]])
    return replace(gluing, first=first, second=second), torn


def _folded_faces(gluing: Gluing, layer: np.ndarray, around: np.ndarray) -> np.ndarray:
    """One polygon for every diagonal that has the same two ends as another edge: no plane map keeps them apart. Its
    mirror image, which is as long around (f,), goes with it.

    Polygons of layer (f,) -1 are apart already.
    """
    if gluing.side.all():
        return np.zeros(0, np.int64)
    tail, head = halfedges(gluing.triangles)
    corner_class = corner_classes(gluing)
    key = pair_keys(corner_class[tail], corner_class[head])
    _, number, count = np.unique(key, return_inverse=True, return_counts=True)
    number = number.ravel()
    h = np.flatnonzero((count[number] > 2) & ~gluing.side)
    polygon = gluing.owner[h // 3]
    last = np.zeros(len(count), dtype=np.int64)
    np.maximum.at(last, number[h], polygon)
    alike = np.abs(around[polygon] - around[last[number[h]]]) <= ALIKE * around[polygon]
    folded = np.unique(polygon[alike])
    return folded[layer[folded] >= 0]


def _perimeters(surface: Surface) -> np.ndarray:
    """Length (f,) around every polygon, of those that have one."""
    start, vertex = surface.face_start, surface.corner_vertex
    after = np.arange(len(vertex)) + 1
    filled = start[1:] > start[:-1]
    after[start[1:][filled] - 1] = start[:-1][filled]
    length = edge_lengths(surface.positions, np.column_stack([vertex, vertex[after]]))
    return np.bincount(np.repeat(np.arange(len(filled)), np.diff(start)), length, len(filled))


def _healed(gluing: Gluing) -> Gluing:
    """A slit of a single edge has no inside: its two sides are joined again."""
    tail, head = halfedges(gluing.triangles)
    corner_class = corner_classes(gluing)
    open_ = np.ones(len(tail), dtype=bool)
    open_[gluing.first] = open_[gluing.second] = False
    h = np.flatnonzero(open_)
    first, second = pair_up(pair_keys(corner_class[tail[h]], corner_class[head[h]]))
    first, second = h[first], h[second]
    slit = first // 3 != second // 3
    if not slit.any():
        return gluing
    return replace(
        gluing,
        first=np.concatenate([gluing.first, first[slit]]),
        second=np.concatenate([gluing.second, second[slit]]),
    )


def flat_triangles(surface: Surface, faces: np.ndarray, was_split: bool | None = None) -> FlatTriangles:
    """Triangles of the polygons `faces` (f,) bool with two corners at one place that would tear a map: with a vertex
    used twice, or an open side. Without them their neighbours meet. What lies on no other polygon is none of them.

    was_split : see `joined_vertices`, where that follows; one that keeps it from joining what is around it goes, too
    """
    vertex, after, size = surface.corner_vertex, next_corners(surface.face_start), np.diff(surface.face_start)
    tail, head = surface.positions[vertex], surface.positions[vertex[after]]
    owner = np.repeat(np.arange(len(faces)), size)
    short = np.flatnonzero((tail == head).all(axis=1) & (faces & (size == 3))[owner])
    if not len(short):
        return FlatTriangles(short, short, short)
    torn = np.zeros(len(faces), dtype=bool)
    while True:
        found = _torn_triangles(surface, faces, short, torn)
        if was_split is None:
            return found
        rest = faces.copy()
        rest[found.polygons] = False
        more = owner[used_twice(surface, rest, _along_sides(surface, rest, was_split))]
        more = np.intersect1d(more, owner[short])
        if torn[more].all():
            return found
        torn[more] = True


def _torn_triangles(surface: Surface, faces: np.ndarray, short: np.ndarray, also: np.ndarray) -> FlatTriangles:
    """Those of triangles with short sides, from the corners (k,) on, that tear a map, or go `also` (f,) bool."""
    vertex, after = surface.corner_vertex, next_corners(surface.face_start)
    owner = np.repeat(np.arange(len(faces)), np.diff(surface.face_start))
    found, torn = np.zeros(len(faces), dtype=bool), also.copy()
    found[owner[short]] = True
    chosen, place = np.flatnonzero(faces[owner]), places(surface.positions)[vertex]
    open_ = chosen[only_once(pair_keys(vertex[chosen], vertex[after[chosen]]))]
    in_point = np.bincount(owner[short], minlength=len(faces)) == 3
    torn[owner[open_[(place[open_] != place[after[open_]]) | in_point[owner[open_]]]]] = True
    torn[owner[short[vertex[short] == vertex[after[short]]]]] = True
    # Where only the short side is open, a triangle joins its neighbours, unless what lies there goes.
    there = short[torn[owner[short]]]
    ends = open_[np.isin(place[open_], place[there])]
    torn[owner[ends[place[ends] == place[after[ends]]]]] = True
    found &= torn
    kept, mine = np.flatnonzero((faces & ~found)[owner]), np.flatnonzero(found[owner]).reshape(-1, 3)
    hosts = _hosts(place, after, kept, mine)
    mine, hosts = mine[(hosts >= 0).all(axis=1)], hosts[(hosts >= 0).all(axis=1)]
    return FlatTriangles(owner[mine[:, 0]], mine.ravel(), hosts.ravel())


def _hosts(place: np.ndarray, after: np.ndarray, kept: np.ndarray, mine: np.ndarray) -> np.ndarray:
    """For every corner of triangles (t,3) one at the same place (c,) among those `kept` (k,), all of one side for all
    three; -1 where there is none. after (c,): the next corner."""
    sides = np.concatenate([kept, mine.ravel()])
    key = row_labels(np.sort(np.stack([place[sides], place[after[sides]]], axis=1), axis=1))
    of_side, of_corner = np.full((2, max(int(key.max()), int(place.max())) + 1), -1)
    of_side[key[: len(kept)][::-1]] = kept[::-1]
    of_corner[place[kept][::-1]] = kept[::-1]
    side = of_side[key[len(kept) :]].reshape(-1, 3)
    side = np.where(place[mine] == place[after[mine]], -1, side).max(axis=1)[:, None]
    both = np.where(place[side] == place[mine], side, after[side])
    in_point = (place[mine] == place[mine[:, :1]]).all(axis=1)[:, None]
    return np.where(in_point, of_corner[place[mine]], np.where(side < 0, -1, both))


def charts_without_area(charts: Sequence[Chart]) -> np.ndarray:
    """Which charts (c,) bool have a triangle without area that `with_area` would move."""
    disks = [chart.disk for chart in charts]
    owner = np.repeat(np.arange(len(charts)), [len(disk) for disk in disks])
    first = np.cumsum([0, *(len(chart.vertices) for chart in charts)])
    positions = np.concatenate([chart.vertices for chart in charts])
    bad = degenerate_triangles(positions, np.concatenate(disks) + first[owner][:, None], NEEDLE, owner)
    return np.bincount(owner, bad, len(charts)) > 0


def with_area(chart: Chart, extent: float) -> tuple[Chart, int]:
    """The chart with the vertices of triangles without area moved a little, and how many of its faces have no area.

    See `perturbed`. `extent` is that of the whole mesh, for charts without any size.

    Raises
    ------
    ZeroAreaFaceError : a triangle has no area wherever its vertices move (its size is nothing next to its chart's)
    """
    if len(chart.vertices) == 3 and degenerate_triangles(chart.vertices, chart.disk, NEEDLE).all():
        return replace(chart, vertices=_lone_triangle() * _scale(_size(chart.vertices), extent)), 1
    vertices, count = perturbed(chart.vertices, chart.disk, extent, chart.faces)
    if not count:
        return chart, 0
    # What fills a hole is no triangle of anybody's.
    return replace(chart, vertices=vertices), faces_without_area(chart.vertices, chart.triangles, chart.faces)


def faces_without_area(vertices: np.ndarray, triangles: np.ndarray, faces: np.ndarray) -> int:
    """How many faces (m,) of triangles (m,3) have no area: one with corners in line has some, however it is cut."""
    flat = degenerate_triangles(vertices, triangles, NEEDLE)
    return len(np.setdiff1d(faces[flat], faces[~flat]))


def perturbed(
    vertices: np.ndarray, triangles: np.ndarray, extent: float, faces: np.ndarray | None = None
) -> tuple[np.ndarray, int]:
    """Positions (n,3) with the vertices of triangles (m,3) without area moved a little, and how many these are.

    The moves are random but always the same. faces (k,): the names of the first triangles for an error, which names no
    others; their own numbers by default.

    Raises
    ------
    ZeroAreaFaceError : a triangle has no area wherever its vertices move (its size is nothing next to the whole)
    """
    bad = degenerate_triangles(vertices, triangles, NEEDLE)
    if not bad.any():
        return vertices, 0
    count = int(bad.sum())
    low, size = vertices.min(axis=0), _size(vertices)
    scale = _scale(size, extent)
    rng = np.random.default_rng(0)
    # A chart without any area, or without a size that counts, has no shape to keep.
    shapeless = bad.all() or size < TINY * extent
    moving = SHAPELESS_SIZE * rng.random((len(vertices), 3)) if shapeless else vertices / scale - low / scale
    # Of the mesh as it came: next to what has moved already, heights say nothing.
    reach = _least_height(moving, triangles)
    for k in range(PERTURBATION_ROUNDS):
        bad = degenerate_triangles(moving, triangles, NEEDLE)
        if not bad.any():
            return moving * scale, count
        moved = np.unique(triangles[bad])
        moving[moved] += PERTURBATION * 4.0**k * reach[moved, None] * rng.uniform(-1, 1, (len(moved), 3))
    names = np.arange(len(triangles)) if faces is None else faces
    raise ZeroAreaFaceError("Faces have no area", kind="face", elements=np.unique(names[bad[: len(names)]]))


def _size(vertices: np.ndarray) -> float:
    """How large a chart (n,3) is. Halves: the difference of two huge numbers may be infinite."""
    return 2 * float(extents(vertices / 2).max())


def _scale(size: float, extent: float) -> float:
    """The unit of a chart of this size in a mesh of some extent: that one where its own is none next to it."""
    return (extent if size < TINY * extent else size) or 1.0


@cache
def _lone_triangle() -> np.ndarray:
    """What becomes of the corners (3,3) of a triangle without area that is a chart of its own, in a unit of its size:
    decimated meshes have them by the thousand."""
    return perturbed(np.zeros((3, 3)), np.array([[0, 1, 2]]), 1.0)[0]


def _least_height(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Least height (n,) of the sound triangles around every vertex, or of those nearest across others."""
    bad = degenerate_triangles(vertices, triangles, THIN)
    bad = degenerate_triangles(vertices, triangles, NEEDLE) if bad.all() else bad
    p = vertices[triangles]
    double_area = lengths(cross3(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]))
    longest = lengths(p - p[:, [1, 2, 0]]).max(axis=1)
    height = np.where(bad, np.inf, double_area / np.where(longest > 0, longest, 1))
    reach = np.full(len(vertices), np.inf)
    np.minimum.at(reach, triangles.ravel(), np.repeat(height, 3))
    for _ in range(ACROSS_BAD):
        np.minimum.at(reach, triangles[bad].ravel(), np.repeat(reach[triangles[bad]].min(axis=1), 3))
    known = reach[np.isfinite(reach)]
    usual = np.median(known) if len(known) else 1 / np.sqrt(len(vertices))
    return np.where(np.isfinite(reach), reach, usual)


def coincident_boundary_vertices(surface: Surface, gluing: Gluing, component: np.ndarray, is_disk: np.ndarray) -> int:
    """Number of boundary vertices that lie exactly on one of another component, or of the same where it is no disk.

    component (m,): that of every triangle; is_disk (k,): which components are disks.

    A disk that touches itself was meant to be open there.
    """
    open_ = np.ones(3 * len(gluing.triangles), dtype=bool)
    open_[gluing.first] = open_[gluing.second] = False
    boundary = np.flatnonzero(open_)
    vertex, owner = np.divmod(np.unique(_keys(gluing.ends(boundary)[0], component[boundary // 3])), 1 << 32)
    place = places(surface.positions[vertex])
    apart = _more_than_one(place, vertex)
    return len(np.unique(vertex[apart & (_more_than_one(place, owner) | ~is_disk[owner])]))


def _more_than_one(group: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Whether the group (k,) of each item has items of different values (k,), per item."""
    first = np.unique(_keys(group, value)) >> 32
    return np.bincount(first, minlength=int(group.max(initial=0)) + 1)[group] > 1


def _keys(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """One integer (k,) for each pair of integers from 0 to 2^31 - 1."""
    return (a.astype(np.int64) << 32) | b.astype(np.int64)


def _twins(rows: np.ndarray, count: int) -> np.ndarray:
    """A number for each of so many polygons, the same for those on one another: rows (k,3) of `duplicate_faces`."""
    number = np.arange(count)
    number[rows[:, 0]] = rows[:, 2]
    return number


def joined_vertices(surface: Surface, faces: np.ndarray, was_split: bool = False) -> np.ndarray:
    """The vertex (n,) that each one is, where sides of separate parts lie exactly on one another: the first of those
    that are joined, or itself. Importers split meshes so, at hard edges and at the borders of their UVs.

    faces (f,) bool : the polygons that count. Two sides are joined that run against each other, see `opposite_sides`,
    and neither of which is a seam. A part that touches itself was meant to be open there, unless a file format has no
    other way to say where its UVs part, was_split.
    """
    label = _along_sides(surface, faces, was_split)
    # No polygon shall have one vertex twice.
    spoilt = np.isin(label, label[surface.corner_vertex[used_twice(surface, faces, label)]])
    return np.where(spoilt, np.arange(len(label)), first_of(label))


def _along_sides(surface: Surface, faces: np.ndarray, was_split: bool) -> np.ndarray:
    """A number (n,) for every vertex, the same where `joined_vertices` joins sides."""
    n, owner = len(surface.positions), np.repeat(np.arange(len(faces)), np.diff(surface.face_start))
    ends, chosen = side_ends(surface), np.flatnonzero(faces[owner])
    key = pair_keys(*ends[:, chosen])
    once = only_once(key)
    side = chosen[once[~is_seam(surface, key[once])]]
    # Most meshes are whole, or open in few places.
    border = np.zeros(len(faces), dtype=bool)
    border[owner[side]] = True
    place, used = np.full(n, -1), np.unique(surface.corner_vertex[border[owner]])
    place[used] = places(surface.positions[used])
    doubles = duplicate_faces(replace(surface, corner_vertex=place[surface.corner_vertex]), border)
    twin = _twins(doubles, len(faces))
    sides = ends[:, side]
    first, second = (sides[:, k] for k in opposite_sides(place, sides, twin[owner[side]]))
    if not first.size:
        return np.arange(n)
    part = graph_components(ends[0, chosen], ends[1, chosen], n)[1]
    apart = (part[first[0]] != part[second[0]]) | was_split
    return joined_along(n, first[:, apart], second[:, apart])
