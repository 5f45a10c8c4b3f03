"""Make disk charts of a polygon surface with seams, with index maps back to the face corners.

A chart vertex is a class of corners that are joined around a vertex by edges which are no seams, so a seam
that ends inside a chart, and a vertex where two fans meet, are cut open for the map only.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import (
    NonManifoldEdgeError,
    NotADiskError,
    SeveralBoundariesError,
    TouchingBoundariesError,
    plural,
)
from .gluing import Gluing, components, corner_classes
from .surface import Surface, strict_gluing
from .topology import (
    boundary_loops,
    distinct,
    euler_characteristic,
    first_places,
    graph_components,
    halfedges,
    order_of_pairs,
    pair_keys,
)


@dataclass(frozen=True)
class Chart:
    """A disk: vertices (n,3), triangles (m,3), the surface's corners (m,3), faces (m,) and vertex_ids (n,).

    patches (k,3) are triangles that fill holes of the chart. They exist for the map only: they have no corners,
    and vertices that only they use have the id -1. `disk` (m+k,3), the triangles and the patches, is what is a disk.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    corners: np.ndarray
    faces: np.ndarray
    vertex_ids: np.ndarray
    patches: np.ndarray = field(default_factory=lambda: np.zeros((0, 3), np.int64))

    @property
    def disk(self) -> np.ndarray:
        """Triangles and patches together, (m+k,3) vertex indices."""
        return np.concatenate([self.triangles, self.patches]) if len(self.patches) else self.triangles


def turned_polygons(charts: Sequence[Chart], count: int) -> np.ndarray:
    """Which of `count` polygons have their corners in the opposite order in the triangles of their charts: (f,) bool.

    Those look to the other side than what is around them.
    """
    turned = np.zeros(count, bool)
    for chart in charts:
        backward = (chart.corners > np.roll(chart.corners, -1, axis=1)).sum(axis=1) == 2
        turned[chart.faces[backward]] = True
    return turned


def strict_charts(surface: Surface, faces: np.ndarray | None = None) -> list[Chart]:
    """Charts of the polygons `faces` (f,) bool (all by default), each a topological disk.

    Nothing is repaired: see `cutting.disk_charts` for meshes that need it.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError, DuplicateFaceError, NonManifoldEdgeError,
    OrientationError, NotADiskError : with the indices of the offending elements of the surface
    """
    charts = charts_of(surface, strict_gluing(surface, faces))
    check_disks(charts)
    return charts


def check_disks(charts: Sequence[Chart]) -> None:
    """Raise what `check_edges` and `check_disk` raise about the first chart that is no disk."""
    for k in np.flatnonzero(~sound_disks(charts)):
        check_edges(charts[k])
        check_disk(charts[k])


def charts_of(surface: Surface, gluing: Gluing) -> list[Chart]:
    """One chart per component of the glued triangles, in the order of their first triangles.

    Its vertices are classes of corners.
    """
    component = components(gluing)
    order = np.argsort(component, kind="stable")
    component, owner, corners = component[order], gluing.owner[order], gluing.triangles[order]
    classes = corner_classes(gluing)[corners]
    index, inverse = first_places(classes)[1], distinct(classes)[1]
    of_vertex = component[index // 3]
    by_chart = np.argsort(of_vertex, kind="stable")
    place = np.empty(len(by_chart), np.int64)
    place[by_chart] = np.arange(len(by_chart))
    triangles = place[inverse].reshape(-1, 3).astype(np.int64)
    vertex_ids = gluing.vertex[corners.ravel()[index[by_chart]]]
    positions = surface.positions[vertex_ids]
    # Triangles of no polygon fill holes; vertices that only they use are no vertices of the mesh.
    real = owner >= 0
    own = np.zeros(len(vertex_ids), dtype=bool)
    own[triangles[real]] = True
    vertex_ids = np.where(own, vertex_ids, -1)
    count = int(component[-1]) + 1
    first = np.searchsorted(of_vertex[by_chart], np.arange(count + 1))
    begin = np.searchsorted(component, np.arange(count + 1))
    triangles = triangles - first[component][:, None]
    charts = []
    for k in range(count):
        members, vertices = slice(begin[k], begin[k + 1]), slice(first[k], first[k + 1])
        chart = Chart(
            vertices=positions[vertices],
            triangles=triangles[members],
            corners=corners[members],
            faces=owner[members],
            vertex_ids=vertex_ids[vertices],
        )
        charts.append(chart if real[members].all() else _with_patches(chart))
    return charts


def _with_patches(chart: Chart) -> Chart:
    """The chart with its triangles of no polygon as patches."""
    real = chart.faces >= 0
    return replace(
        chart,
        triangles=chart.triangles[real],
        corners=chart.corners[real],
        faces=chart.faces[real],
        patches=chart.triangles[~real],
    )


def part_of_chart(chart: Chart, rows: np.ndarray) -> tuple[Chart, np.ndarray]:
    """The triangles `rows` (m,) bool of a chart as a chart, and its vertices (k,) in the whole one.

    Patches of a hole go with what is all around it; one that has several parts around it stays open.
    """
    own = np.zeros(len(chart.vertices), dtype=bool)
    own[chart.triangles[rows]] = True
    patches = chart.patches
    if len(patches):
        hole = graph_components(patches[:, [0, 1]].ravel(), patches[:, [1, 2]].ravel(), len(own))[1]
        of_others = np.zeros(len(own), dtype=bool)
        of_others[chart.triangles] = True
        of_others &= ~own
        open_ = np.unique(hole[of_others])
        patches = patches[~np.isin(hole[patches[:, 0]], open_)]
    used, vertices = np.unique(np.concatenate([chart.triangles[rows], patches]), return_inverse=True)
    vertices = vertices.reshape(-1, 3)
    count = int(np.count_nonzero(rows))
    part = Chart(
        chart.vertices[used],
        vertices[:count],
        chart.corners[rows],
        chart.faces[rows],
        chart.vertex_ids[used],
        vertices[count:],
    )
    return part, used


def triangle_rows(surface: Surface, chart: Chart) -> np.ndarray:
    """Which triangles of the surface the triangles of a chart are, (m,).

    A triangle is known by the smaller two of its corners: no other triangle of its polygon has the same two as such.
    """

    def key(triangles: np.ndarray) -> np.ndarray:
        ordered = np.sort(triangles, axis=1)
        return pair_keys(ordered[:, 0], ordered[:, 1])

    def found_among(rows: np.ndarray) -> tuple[np.ndarray, bool]:
        keys = key(surface.triangles[rows])
        order = np.argsort(keys)
        at = order[np.minimum(np.searchsorted(keys[order], asked), len(rows) - 1)] if len(rows) else rows
        return rows[at], len(at) == len(asked) and bool((keys[at] == asked).all())

    # Triangles nearly always come in the order of their polygons: a small chart then takes no look at the others.
    asked, polygons = key(chart.corners), np.unique(chart.faces)
    first = np.searchsorted(surface.triangle_face, polygons)
    count = np.searchsorted(surface.triangle_face, polygons, side="right") - first
    begin = np.cumsum(count) - count
    found, right = found_among(np.repeat(first - begin, count) + np.arange(count.sum()))
    return found if right else found_among(np.arange(len(surface.triangles)))[0]


def check_edges(chart: Chart) -> None:
    """Raise NonManifoldEdgeError where two edges of a chart, or diagonals, have the same two vertices.

    Straight lines in the plane could not tell them apart.
    """
    tail, head = halfedges(chart.disk)
    unique, index, count = np.unique(pair_keys(tail, head), return_index=True, return_counts=True)
    wrong = index[count > 2]
    if len(wrong):
        raise NonManifoldEdgeError(
            "Two faces share several edges in a row, so that their diagonals coincide",
            remedy="Triangulate these faces, or dissolve the vertex that only they share",
            kind="edge",
            elements=chart.vertex_ids[np.stack([tail[wrong], head[wrong]], axis=1)],
        )


def sound_disks(charts: Sequence[Chart]) -> np.ndarray:
    """Which charts (c,) bool neither `check_edges` nor `check_disk` refuses, all of them looked at together."""
    count = len(charts)
    first = np.cumsum([0, *(len(c.vertices) for c in charts)])
    disks = [c.disk for c in charts]
    of_face = np.repeat(np.arange(count), [len(d) for d in disks])
    triangles = disks[0] if count == 1 else np.concatenate(disks) + first[of_face][:, None]
    tail, head = halfedges(triangles)
    keys = pair_keys(tail, head)
    order = order_of_pairs(keys)
    keys = keys[order]
    begin = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))
    shared = np.diff(begin, append=len(keys))
    del keys
    wrong = np.zeros(count, bool)
    wrong[of_face[order[begin[shared > 2]] // 3]] = True
    boundary = np.sort(order[np.repeat(shared != 2, shared)])
    of_boundary = of_face[boundary // 3]
    # Every loop once, by its least vertex.
    _, loop = graph_components(tail[boundary], head[boundary], int(first[-1]))
    loops = np.bincount(of_boundary[np.unique(loop[tail[boundary]], return_index=True)[1]], minlength=count)
    edges = (3 * np.bincount(of_face, minlength=count) + np.bincount(of_boundary, minlength=count)) // 2
    euler = np.diff(first) - edges + np.bincount(of_face, minlength=count)
    return ~wrong & (loops == 1) & (euler == 1)


def check_disk(chart: Chart) -> None:
    """Raise NotADiskError unless the chart, holes filled, is connected to one boundary without handles."""
    loops = boundary_loops(chart.disk)
    n, m, b = len(chart.vertices), len(chart.disk), sum(len(loop) for loop in loops)
    handles = (2 - euler_characteristic(n, m, b) - len(loops)) // 2
    faces = np.unique(chart.faces)
    if not loops:
        shape = "sphere" if handles == 0 else f"surface of genus {handles}"
        raise NotADiskError(f"A chart is a closed {shape} without a boundary", kind="face", elements=faces)
    if len(loops) > 1:
        rest = np.concatenate([np.stack([x, np.roll(x, -1)], axis=1) for x in loops[1:]])
        error = TouchingBoundariesError if _touch(chart, np.concatenate(loops)) else SeveralBoundariesError
        raise error(f"A chart has {len(loops)} boundaries instead of one", kind="edge", elements=chart.vertex_ids[rest])
    if handles:
        found = plural(handles, "a handle", "{} handles")
        raise NotADiskError(f"A chart has {found}", kind="face", elements=faces)


def _touch(chart: Chart, boundary: np.ndarray) -> bool:
    """Whether different vertices of the boundary (k,) lie in one place."""
    # Adding zero makes -0.0 and 0.0 the same.
    return len(np.unique(chart.vertices[boundary] + 0.0, axis=0)) < len(np.unique(chart.vertex_ids[boundary]))
