"""Keep polygons that are convex on the surface convex in the map, by Newton steps with barriers for their corners.

The refinement keeps the triangles of one triangulation positive. Who draws the mesh may use another one, and a quad
whose image is a dart is folded there. Where that is so, the vertices around are placed anew by a few Newton steps on
the refinement's energy, with a barrier for the area of every corner, the triangle of a vertex and its two neighbours:

    share of the polygon * [ (r + 1/r)/2 - 1 ],     r = (area + slack) / (target + slack).

A slack lets corners in that are not convex yet, and goes as they become so; then the barrier weakens, so that the
faces get their areas back (an interior point method with a first phase).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from ...linalg.nested_dissection import vertex_graph
from ...linalg.sparse import minimum_degree
from ...maps.contacts import crossings
from ...maps.mirror_symmetry import MirrorSymmetry, mirror_symmetry, without_symmetry
from ...maps.polygon_elements import polygon_elements
from ...mesh.charts import Chart
from ...mesh.geometry import face_areas, signed_areas
from ...mesh.polygon_areas import polygon_areas
from ...mesh.surface import Surface
from ...mesh.topology import boundary_loops, row_labels
from ...refinement.mirrored_motion import find_symmetry
from .corner_solver import CornerMesh, CornerPatches
from .polygon_corners import (
    CONVEX,
    DENTED,
    Forced,
    PolygonCorners,
    areas_in_map,
    convex_corners,
    corners_in_turn,
    straight_share,
)
from .polygon_disk import with_fans

# Rings of faces around a reflex corner that may move, at most.
RINGS = 4
# Vertices that are enough for a corner, on average: then no more rings are added.
ROOM = 50
# Most vertices of one patch: a large one goes as far as the worst of its corners lets it.
LARGEST = 800
# Share of a chart's area in the map below which that of a triangle has lost its sign.
ROUNDING = 1e-15
# How far, over its extent, a map may be from its mirror image to be kept symmetric: what is rounded.
SYMMETRIC = 1e-9
NO_CORNERS = PolygonCorners(np.zeros((0, 3), np.int64), np.zeros(0, np.int64), *np.zeros((3, 0)))
# Tries with more and more of the outlines fixed where they would come to cross themselves.
ATTEMPTS = 5


def keep_convex(
    surface: Surface,
    charts: Sequence[Chart],
    maps: Sequence[np.ndarray],
    fixed: Sequence[np.ndarray],
    density: Sequence[np.ndarray | None],
    area_weights: Sequence[float],
    spare: Sequence[float] | None,
    forced: Forced | None = None,
) -> dict[int, np.ndarray]:
    """Make the corners of convex polygons convex in the maps: new maps, by the number of the chart, where any changed.

    Corners that would cost too much area, a fold, or an outline that crosses itself, stay as they are.

    Parameters
    ----------
    maps : (n_i,2) of the charts; where triangles are folded their vertices stay
    fixed : (n_i,) bool, vertices that stay
    density : (m_i,) of the triangles, None where they get their own areas
    area_weights : of the area term, one for each chart
    spare : by how much the area error of each chart may grow; None for a start of a refinement, whatever it costs
    forced : what corners were forced open before, which is added to
    """
    fans = [with_fans(chart, uv) for chart, uv in zip(charts, maps, strict=True)]
    first = np.cumsum([0, *(len(uv) for _, uv, _ in fans)])
    # In units of the map, so that no area under- or overflows.
    unit = float(np.abs(np.concatenate(maps)).max())
    w = np.concatenate([uv / unit for _, uv, _ in fans]) @ [1, 1j]
    triangles = np.concatenate([c.triangles + k for c, k in zip(charts, first, strict=False)])
    if _all_open(surface, charts, triangles, w):
        return {}
    corners = _mapped_corners(surface, charts, triangles, w)
    if not corners.reflex(w).any():
        return {}
    density = [None if d is None else _of_polygons(d, c)[f[2]] for d, c, f in zip(density, charts, fans, strict=True)]
    mesh = _union([chart for chart, _, _ in fans], first, density, area_weights, spare, w)
    squeezed = _squeezed(mesh, w)
    immobile = np.concatenate([_longer(one, k) for one, k in zip(fixed, np.diff(first), strict=True)])
    immobile[mesh.triangles[squeezed]] = True
    bent = np.unique(np.searchsorted(first, corners.triangles[corners.reflex(w), 0], side="right") - 1)
    symmetry, middle = _symmetry(mesh, first, w, bent)
    mesh, w = _without(mesh, squeezed), w - middle
    for attempt in range(ATTEMPTS):
        moved = _relaxed(mesh, w, corners, immobile, spare is None, symmetry, forced)
        changed = np.unique(np.searchsorted(first, np.flatnonzero(moved != w), side="right") - 1)
        loops = [boundary_loops(charts[k].disk)[0] + first[k] for k in changed]
        crossed = [_crossed(w, moved, loop, attempt == ATTEMPTS - 2) for loop in loops]
        if not any(map(len, crossed)):
            break
        immobile[np.concatenate(crossed)] = True
    new = {int(k): maps[k].copy() for k in changed}
    for k, uv in new.items():
        mine = slice(first[k], first[k] + len(uv))
        rows, placed = np.flatnonzero(moved[mine] != w[mine]), (moved + middle)[mine]
        uv[rows] = unit * np.column_stack([placed.real, placed.imag])[rows]
    return new


def _longer(values: np.ndarray, count: int) -> np.ndarray:
    """Values (n,) bool, and False for what is added to that, (count,)."""
    return np.append(values, np.zeros(count - len(values), bool))


def _of_polygons(values: np.ndarray, chart: Chart) -> np.ndarray:
    """Values per area (m,) of the triangles of a chart as means over their polygons, (m,)."""
    owner, area = row_labels(chart.faces[:, None]), face_areas(chart.vertices, chart.triangles)
    return (np.bincount(owner, area * values) / np.bincount(owner, area))[owner]


def reflex_triangles(surface: Surface, charts: Sequence[Chart], maps: Sequence[np.ndarray]) -> np.ndarray:
    """How many corners of convex polygons of each chart (c,) are triangles without area, or folded, in maps (n_i,2)."""
    first = np.cumsum([0, *(len(uv) for uv in maps)])
    folded = _folded_corners(surface, charts, maps).triangles[:, 0]
    return np.bincount(np.searchsorted(first, folded, side="right") - 1, minlength=len(charts))


def dented_faces(surface: Surface, chart: Chart, uv: np.ndarray) -> np.ndarray:
    """Polygons (k,) of a chart that are convex on the surface and fold in its map (n,2), though not along the diagonals
    by which the surface cuts them."""
    at = np.zeros((len(surface.corner_vertex), 2))
    at[chart.corners.ravel()] = uv[chart.triangles.ravel()]
    area = signed_areas(at, surface.triangles)
    # Charts may look to the other side, and so may some of their polygons.
    whole = np.bincount(surface.triangle_face, area, len(surface.face_start) - 1)
    folded = surface.triangle_face[area * np.sign(whole[surface.triangle_face]) <= 0]
    return np.setdiff1d(_folded_corners(surface, [chart], [uv]).polygon, folded)


def _folded_corners(surface: Surface, charts: Sequence[Chart], maps: Sequence[np.ndarray]) -> PolygonCorners:
    """The corners of convex polygons that are without area, or folded, in maps (n_i,2)."""
    first = np.cumsum([0, *(len(uv) for uv in maps)])
    w = np.concatenate(maps) @ [1, 1j]
    triangles = np.concatenate([c.triangles + k for c, k in zip(charts, first, strict=False)])
    if _all_open(surface, charts, triangles, w):
        return NO_CORNERS
    corners = _mapped_corners(surface, charts, triangles, w)
    return corners.of(corners.areas(w) <= 0, np.arange(len(w)))


def _squeezed(mesh: CornerMesh, w: np.ndarray) -> np.ndarray:
    """Triangles (m,) bool that are folded in the map w (n,), or whose areas are rounding: they have no energy."""
    area = signed_areas(np.column_stack([w.real, w.imag]), mesh.triangles)
    return area <= ROUNDING * np.bincount(mesh.chart, area)[mesh.chart]


def _symmetry(
    mesh: CornerMesh, first: np.ndarray, w: np.ndarray, charts: np.ndarray
) -> tuple[MirrorSymmetry | None, np.ndarray]:
    """The mirror symmetry of those of some charts (k,) whose maps w (n,) have it, too, if there are any; and the
    middle (n,) of these maps, 0 for others. first (c+1,): vertices of the charts"""
    found, middle = without_symmetry(len(w)), np.zeros(len(w), complex)
    for k in charts:
        vertices, rows = np.arange(first[k], first[k + 1]), np.flatnonzero(mesh.chart == k)
        own, polygon = mesh.triangles[rows] - first[k], mesh.polygon[rows]
        faces = polygon_elements(mesh.positions[vertices], own, mesh.target[rows], polygon)
        shape = find_symmetry(mesh.positions[vertices], own, polygon, faces)
        if shape is None:
            continue
        centred = w[vertices] - w[vertices].mean()
        # Of two mirrors the map may have one.
        for images in (shape.images, *shape.images[:, None]):
            turn = (centred[images[0]] * centred).sum()
            one = mirror_symmetry(images, turn / abs(turn) if turn else 1.0, centred)
            if np.abs(one.averaged(centred) - centred).max() <= SYMMETRIC * np.abs(centred).max():
                found = found.with_part(one, vertices)
                middle[vertices] = w[vertices].mean()
                break
    return (found if found.follows.any() else None), middle


def _without(mesh: CornerMesh, squeezed: np.ndarray) -> CornerMesh:
    """The charts without some of their triangles (m,) bool; what is left of their polygons counts one by one."""
    broken = np.isin(mesh.polygon, mesh.polygon[squeezed])
    alone = mesh.polygon.max(initial=0) + 1 + np.arange(len(broken))
    mesh = replace(mesh, polygon=np.where(broken, alone, mesh.polygon))
    every = np.arange(len(mesh.positions))
    return mesh.of(every, ~squeezed, every)


def _union(charts, first, density, area_weights, spare, w) -> CornerMesh:
    """All charts side by side, patches over holes included; they ask for their own areas."""
    positions = np.concatenate([c.vertices for c in charts])
    low, high = positions.min(axis=0) / 2, positions.max(axis=0) / 2
    positions = (positions / 2 - low) / (high - low).max()
    triangles = np.concatenate([c.disk + k for c, k in zip(charts, first, strict=False)])
    begin = np.cumsum([0, *(len(c.disk) for c in charts)])
    chart = np.repeat(np.arange(len(charts)), np.diff(begin))
    # Patches over holes are no polygons.
    faces = np.concatenate([np.append(c.faces, -1 - np.arange(len(c.patches))) for c in charts])
    polygon = row_labels(np.column_stack([chart, faces - faces.min()]))
    target, asked = face_areas(positions, triangles), polygon_areas(positions, triangles, polygon)
    covered = signed_areas(np.column_stack([w.real, w.imag]), triangles)
    given = np.zeros(len(charts))
    for k, (one, values) in enumerate(zip(charts, density, strict=True)):
        own = slice(begin[k], begin[k] + len(one.triangles))
        if values is not None:
            target[own] *= values
            asked[own] *= values
        given[k] = covered[own].sum()
        # Pins give a chart a scale of its own.
        target[begin[k] : begin[k + 1]] *= given[k] / asked[own].sum()
    return CornerMesh(
        positions=positions,
        triangles=triangles,
        polygon=polygon,
        target=target,
        area_weight=np.asarray(area_weights, float),
        chart=chart,
        spare=np.asarray(np.zeros(len(charts)) if spare is None else spare) * given,
    )


def _mapped_corners(surface: Surface, charts: Sequence[Chart], triangles: np.ndarray, w: np.ndarray) -> PolygonCorners:
    """The corners of convex polygons as vertices of all charts, counter-clockwise in the map."""
    corner, polygon, share = convex_corners(surface, straight=True)
    vertex, area = _on_surface(surface, charts, triangles, w)
    ears = vertex[corner]
    kept = (ears >= 0).all(1) & (area[polygon] > 0)
    kept[kept] &= _possible(ears[kept], corner[kept], surface)
    found = _as_corners(surface, ears[kept], polygon[kept], share[kept], area)
    # Polygons may have been turned over for the map.
    turned = np.bincount(found.polygon, found.areas(w), len(area))[found.polygon] < 0
    return replace(found, triangles=np.where(turned[:, None], found.triangles[:, [0, 2, 1]], found.triangles))


def _on_surface(surface: Surface, charts: Sequence[Chart], triangles, w) -> tuple[np.ndarray, np.ndarray]:
    """The vertex (k,) of every corner of the surface, -1 for none, and the areas (f,) of its polygons in a map (n,)."""
    vertex = np.full(len(surface.corner_vertex), -1, np.int32)
    for c, some in zip(charts, np.split(triangles, np.cumsum([len(c.triangles) for c in charts])[:-1]), strict=True):
        vertex[c.corners] = some
    owner = np.concatenate([c.faces for c in charts])
    return vertex, np.bincount(owner, areas_in_map(triangles, w), len(surface.face_start) - 1)


def _as_corners(surface: Surface, ears: np.ndarray, polygon: np.ndarray, share: np.ndarray, area) -> PolygonCorners:
    """Corners (k,3) of polygons (k,) of which they have a share (k,); area (f,) : of all polygons in the map."""
    whole = area[polygon]
    straight = straight_share(surface.face_start[polygon + 1] - surface.face_start[polygon])
    kept_share = np.maximum(share, straight)
    return PolygonCorners(
        triangles=ears,
        polygon=polygon,
        target=kept_share * whole,
        whole=whole,
        least=np.where(share < straight, share - DENTED, CONVEX * kept_share) * whole,
    )


def _all_open(surface: Surface, charts: Sequence[Chart], triangles: np.ndarray, w: np.ndarray) -> bool:
    """Whether no corner of a convex polygon is reflex in a map w (n,) complex, and none has to be left out to see that:
    corners are looked at some after the others, as all of them take several times the memory of the mesh."""
    vertex, area = _on_surface(surface, charts, triangles, w)
    for corner, polygon, share in corners_in_turn(surface, straight=True):
        ears = vertex[corner]
        kept = (ears >= 0).all(1) & (area[polygon] > 0)
        found = _as_corners(surface, ears[kept], polygon[kept], share[kept], area)
        if not (found.areas(w) > np.maximum(found.least, 0)).all():
            return False
    return True


def _possible(ears: np.ndarray, corner: np.ndarray, surface: Surface) -> np.ndarray:
    """Which corners (k,), triangles of vertices `ears` (k,3) and of `corner` (k,3) of the surface, may all be convex.

    Around a vertex that only two polygons share no more than one of them is. It is the one whose corner is a triangle
    of the surface: who draws it has the other diagonal in the other one.
    """
    label = row_labels(np.sort(ears, axis=1))
    count = np.bincount(label)
    twice = count[label] > 1
    if not twice.any():
        return ~twice
    asked = np.sort(corner[twice], axis=1)
    near = np.sort(surface.triangles[np.isin(surface.triangles, asked).all(axis=1)], axis=1)
    same = row_labels(np.concatenate([near, asked]))
    shown = np.zeros(len(ears), bool)
    shown[twice] = np.isin(same[len(near) :], same[: len(near)])
    return ~twice | (shown & (np.bincount(label, shown)[label] == 1))


def _crossed(w: np.ndarray, moved: np.ndarray, loop: np.ndarray, all_of_it: bool) -> np.ndarray:
    """Vertices of an outline (b,) about the places where it crosses itself, or all of it, if it did not before."""
    pairs = crossings(moved, loop)
    if not len(pairs) or len(crossings(w, loop)):
        return loop[:0]
    return loop if all_of_it else np.unique([np.roll(loop, -k)[pairs] for k in range(-2, 4)])


def _relaxed(
    mesh: CornerMesh,
    w: np.ndarray,
    corners: PolygonCorners,
    fixed: np.ndarray,
    opening: bool,
    symmetry: MirrorSymmetry | None,
    forced: Forced | None,
) -> np.ndarray:
    """The map w (n,) complex with the vertices around reflex corners placed anew, those `fixed` (n,) excepted.

    opening: as a start of a refinement, which gives the faces their areas back
    """
    triangles = mesh.triangles
    free = _around(corners.triangles[corners.reflex(w)], triangles, len(w))
    if symmetry is not None:
        free, fixed = _with_images(free, symmetry), _with_images(fixed, symmetry)
    free &= ~fixed
    here = free[corners.triangles].any(1)
    near = free.copy()
    near[corners.triangles[here]] = True
    # Polygons are there as a whole, since it is their areas that count.
    faces = np.isin(mesh.polygon, mesh.polygon[near[triangles].any(1)])
    if not free.any():
        return w
    # Corners may reach to vertices of squeezed triangles alone.
    joined = np.concatenate([triangles[faces], corners.triangles[here]])
    chosen = np.zeros(len(w), bool)
    chosen[joined] = True
    vertices = np.flatnonzero(chosen if symmetry is None else _with_images(chosen, symmetry))
    place = np.full(len(w), -1)
    place[vertices] = np.arange(len(vertices))
    joined = place[joined]
    vertices = vertices[minimum_degree(vertex_graph(joined, len(vertices)))]
    place[vertices] = np.arange(len(vertices))
    mirrored = None if symmetry is None else symmetry.restricted(vertices, place)
    given = mesh.of(vertices, faces, place), corners.of(here, place), free[vertices], mirrored
    patches = CornerPatches(*given, forced)
    moved = w.copy()
    moved[vertices] = patches.opened(w[vertices]) if opening else patches.convexified(w[vertices])
    return moved


def _with_images(chosen: np.ndarray, symmetry: MirrorSymmetry) -> np.ndarray:
    """Vertices (n,) bool and all their images."""
    either = np.zeros(len(chosen), bool)
    either[symmetry.representative[chosen]] = True
    return either[symmetry.representative]


def _around(reflex: np.ndarray, triangles: np.ndarray, vertex_count: int) -> np.ndarray:
    """Vertices (n,) bool of reflex corners (k,3), and some rings of triangles around them."""
    free = np.zeros(vertex_count, bool)
    free[reflex] = True
    for _ in range(RINGS):
        more = free.copy()
        more[triangles[free[triangles].any(1)]] = True
        ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
        ends = ends[more[ends].all(1)]
        graph = coo_matrix((np.ones(len(ends)), ends.T), shape=(vertex_count, vertex_count))
        if np.bincount(connected_components(graph, directed=False)[1]).max() > LARGEST:
            break
        free = more
        if free.sum() > ROOM * len(reflex):
            break
    return free
