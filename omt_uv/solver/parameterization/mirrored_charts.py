"""Find charts that are each other's mirror image, or equal but for a motion, so that one map serves both.

Also where quads are cut otherwise: sides of polygons count, and diagonals do not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..analysis.density import Target
from ..canonical.markers import ChartMarkers
from ..cutting.component_order import Outlined, motion, polygon_sides
from ..cutting.cuts import Cuts
from ..cutting.disk_charts import DiskCharts, disk_charts
from ..errors import MeshError
from ..mesh.charts import Chart, sound_disks
from ..mesh.geometry import edge_lengths, signed_areas
from ..mesh.mirror import Mirror, find_mirror, mirrored_quads, partial_mirror
from ..mesh.polygon_areas import quad_corners, triangle_pairs
from ..mesh.surface import Surface, chosen_triangles
from ..mesh.topology import boundary_loops, distinct, graph_components, on_boundary, pair_keys
from ..progress import Steps
from ..refinement.initial_maps import is_curved, unroll
from ..refinement.refine import Refinement
from .chart_indices import ChartPins, identity, in_order_of_corners, in_order_of_places
from .chart_map import (
    UNROLLED,
    ChartMap,
    in_unit_box,
    map_chart,
    measured_chart,
    measured_map,
    placed_chart,
    refined_on,
)
from .convex_maps import with_figures
from .options import MapOptions

# Maps of charts that are nearly what is looked for, None for those that have none; and what maps charts, from there on.
Starts = list[ChartMap | None] | None
MapCharts = Callable[..., Steps[list[ChartMap]]]
# Relative difference of densities of mirror images up to which they are the same.
SAME_DENSITY = 1e-4
# Area error, over the goal, that a map of symmetric quads may leave in the triangles that they came as.
AREA_KEPT = 1.5
# Cuts may be so many times as long if they are symmetric then.
LONGER = 1.5


def mirror_partners(charts: Sequence[Chart], targets: Sequence[Target | None]) -> dict[int, tuple[int, np.ndarray]]:
    """Charts that are the mirror image of one before them: that one, and its vertex (n,) for each of theirs.

    The mirror is one of all charts together. Targets of a pair are symmetric, too.
    """
    if len(charts) < 2:
        return {}
    first = np.cumsum([0, *(len(c.vertices) for c in charts)])
    mirror = _mirror_of_all(charts)
    if mirror is None:
        return {}
    owner = np.repeat(np.arange(len(charts)), np.diff(first))
    found = {}
    for k, chart in enumerate(charts):
        image = mirror.image[first[k] : first[k + 1]]
        j = int(owner[image[0]])
        same = j < k and len(charts[j].vertices) == len(chart.vertices) and (owner[image] == j).all()
        if same and _same_targets(charts, targets, j, k, image - first[j]):
            found[k] = (j, image - first[j])
    return found


def _mirror_of_all(charts: Sequence[Chart]) -> Mirror | None:
    """The mirror of all charts together, their vertices one after another."""
    first = np.cumsum([0, *(len(c.vertices) for c in charts)])
    triangles = np.concatenate([c.disk + k for c, k in zip(charts, first, strict=False)])
    size = max(int(c.faces.max()) for c in charts) + 1
    owners = [np.concatenate([c.faces, size + np.arange(len(c.patches))]) for c in charts]
    size += max(len(c.patches) for c in charts)
    polygons = np.concatenate([faces + k * size for k, faces in enumerate(owners)])
    return find_mirror(np.concatenate([c.vertices for c in charts]), triangles, polygons)


def images_of_cuts(surface: Surface, faces: np.ndarray | None, cuts: np.ndarray) -> np.ndarray:
    """Mirror images (k,2) of those of the cuts (c,2) that have none among them, where the rest is symmetric.

    None where the polygons `faces` (f,) bool of the surface, or its seams, are not their own image, or where the images
    would part what hangs together, or make the cuts much longer. A slit to one corner of a mouth spoils the symmetry
    of a head.
    """
    none, n = np.zeros((0, 2), np.int64), len(surface.positions)
    _, triangles, owner = chosen_triangles(surface, faces)
    used, compact = distinct(surface.corner_vertex[triangles])
    place = np.full(n, -1)
    place[used] = np.arange(len(used))
    seams, cuts = (place[edges][(place[edges] >= 0).all(axis=1)] for edges in (surface.seams, cuts))
    if not len(cuts):
        return none
    # What lies where: a slit is no seam that was there before.
    every = np.concatenate([seams, cuts])

    def accepted(image: np.ndarray) -> bool:
        return bool(np.isin(pair_keys(*image[seams].T), pair_keys(*seams.T)).all())

    triangles, mirror, found = compact.reshape(-1, 3), None, none
    length = edge_lengths(surface.positions, used[cuts]).sum()
    # A body may have two mirrors across one another.
    for _ in range(2):
        mirror = find_mirror(surface.positions[used], triangles, owner, mirror, accepted)
        if mirror is None:
            break
        more = mirror.image[np.concatenate([cuts, found])]
        more = more[~np.isin(pair_keys(*more.T), pair_keys(*every.T))]
        further = edge_lengths(surface.positions, used[np.concatenate([found, more])]).sum()
        if _are_slits(more, triangles, every) and length + further <= LONGER * length:
            found, every = np.concatenate([found, more]), np.concatenate([every, more])
    return used[found]


def with_images(surface: Surface, faces: np.ndarray | None, cuts: Cuts) -> Cuts:
    """The cuts of the polygons `faces` (f,) bool of a surface with those images that `images_of_cuts` finds."""
    more = images_of_cuts(surface, faces, cuts.edges)
    if not len(more):
        return cuts
    length = float(edge_lengths(surface.positions, more).sum())
    return replace(cuts, edges=np.concatenate([cuts.edges, more]), length=cuts.length + length)


def _are_slits(edges: np.ndarray, triangles: np.ndarray, cuts: np.ndarray) -> bool:
    """Whether edges (k,2) are trees that hang on the cuts (c,2), or the boundary of triangles (m,3), by one vertex."""
    if not len(edges):
        return True
    nodes, ends = np.unique(edges, return_inverse=True)
    a, b = ends.reshape(-1, 2).T
    label = graph_components(a, b, len(nodes))[1]
    held = on_boundary(triangles, int(triangles.max()) + 1)
    held[cuts] = True
    loose = np.bincount(label, held[nodes]) != 1
    return not (loose | (np.bincount(label[a]) != np.bincount(label) - 1)).any()


def mirrored_map(chart_map: ChartMap, image: np.ndarray) -> ChartMap:
    """The map of a chart whose vertices are the mirror images of those `image` (n,) of the one mapped."""
    return replace(chart_map, uv=chart_map.uv[image] * [-1.0, 1.0])


def equal_chart_map(
    chart: Chart, target: Target | None, mapped: Sequence[tuple[Chart, Target | None, ChartMap]]
) -> ChartMap | None:
    """The map of a chart that equals one of those mapped but for a motion, a mirrored one, too; None if there is none.

    A map that folds some triangle of the chart, which may be cut along other diagonals, is none.
    """
    for other, its_target, chart_map in mapped:
        if (target is None) != (its_target is None) or chart_map.folds:
            continue
        found = motion_between(other, chart)
        if found is None or not _same_targets((other, chart), (its_target, target), 0, 1, found[0]):
            continue
        uv = chart_map.uv[found[0]] * [found[1], 1.0]
        if (signed_areas(uv, chart.triangles) > 0).all():
            return replace(chart_map, uv=uv)
    return None


def motion_between(first: Chart, other: Chart) -> tuple[np.ndarray, float] | None:
    """The vertex (n,) of the first chart for each of the other one's, if a motion takes one to the other, and 1.0, or
    -1.0 if it is a mirrored one; None if there is none. Vertices that lie upon one another are told by their sides.
    """
    n = len(first.vertices)
    if n != len(other.vertices) or len(first.patches) or len(other.patches):
        return None
    # A diagonal has its own polygon on both sides.
    sides = [polygon_sides(chart.triangles, chart.faces) for chart in (first, other)]
    return motion(Outlined(first.vertices, sides[0]), Outlined(other.vertices, sides[1]))


def with_mirrored_quads(surface: Surface, charts: Sequence[Chart]) -> list[Chart]:
    """Charts in which two triangles whose mirror images are cut along the other diagonal are one polygon, a quad.

    The charts given, where these, together, are not symmetric all the same.
    """
    own = np.diff(surface.face_start)[surface.triangle_face] == 3
    rows = surface.triangle_face[own]
    pairs = rows[mirrored_quads(surface.positions, surface.corner_vertex[surface.triangles[own]])]
    if not len(pairs):
        return list(charts)
    label = np.arange(len(surface.face_start) - 1)
    label[pairs.max(axis=1)] = pairs.min(axis=1)
    joined = [_relabelled(chart, label) for chart in charts]
    return list(charts) if _mirror_of_all(joined) is None else joined


def _relabelled(chart: Chart, label: np.ndarray) -> Chart:
    """The chart with faces label[faces], but for two triangles that a cut has parted."""
    faces = label[chart.faces]
    first, second = triangle_pairs(np.unique(faces, return_inverse=True)[1].ravel())
    apart = ~quad_corners(chart.triangles, first, second)[1]
    back = np.concatenate([first[apart], second[apart]])
    faces[back] = chart.faces[back]
    return replace(chart, faces=faces)


def as_given(chart: Chart, found: ChartMap, density: np.ndarray | None, goal: float) -> ChartMap | None:
    """The map of a chart from `with_mirrored_quads`, measured on the chart (m,) as it was given, with its density.

    goal : area error asked for; None where the diagonals given have folds in the map, or areas farther off
    """
    vertices, unit = in_unit_box(chart.vertices)
    figures = measured_chart(vertices, chart, found.uv / unit, density)
    if figures.folds or figures.area_l1 > max(AREA_KEPT * goal, found.area_l1):
        return None
    return replace(found, area_l1=figures.area_l1, area_sd=figures.area_sd, angle_mean=figures.angle_mean)


def with_missing_images(chart: Chart) -> Chart | None:
    """A chart that is its own mirror image but for polygons across the plane, with those images of them that are
    missing after its own vertices and triangles; None for all others.

    Bodies that are modelled in one half have faces across the plane, and no edges in it: a cut along it goes around
    them, and they hang on one side.
    """
    mirror = None if len(chart.patches) else partial_mirror(chart.vertices, chart.triangles, chart.faces)
    if mirror is None:
        return None
    n, number = len(chart.vertices), np.unique(chart.faces, return_inverse=True)[1]
    image = mirror.image[chart.triangles]
    keys = number[:, None] * n + chart.triangles
    elsewhere = (image >= 0) & ~np.isin(number[:, None] * n + image, keys)
    rows = np.flatnonzero(mirror.own & (np.bincount(number, elsewhere.any(axis=1)) > 0)[number])
    if not len(rows) or find_mirror(chart.vertices, chart.triangles, chart.faces) is not None:
        return None
    lone = np.unique(chart.triangles[rows][image[rows] < 0])
    place = mirror.image.copy()
    place[lone] = n + np.arange(len(lone))
    if (place[chart.triangles[rows]] < 0).any():
        return None
    whole = Chart(
        np.concatenate([chart.vertices, mirror.reflected[lone]]),
        np.concatenate([chart.triangles, place[chart.triangles[rows]][:, ::-1]]),
        np.concatenate([chart.corners, chart.corners[rows][:, ::-1]]),
        np.concatenate([chart.faces, chart.faces[rows] + int(chart.faces.max()) + 1]),
        np.concatenate([chart.vertex_ids, np.full(len(lone), -1)]),
    )
    return whole if sound_disks([whole])[0] else None


def map_completed(
    chart: Chart,
    *,
    options: MapOptions,
    target: Target | None = None,
    pins: ChartPins | None = None,
    markers: ChartMarkers | None = None,
    start: ChartMap | None = None,
) -> Steps[ChartMap]:
    """`map_chart`, with a free boundary of the chart `with_missing_images`: the map is symmetric but for them.

    start : a map without folds that is nearly what is looked for, refined on where nothing is missing
    """
    plain = options.boundary == "free" and options.kind == "authalic" and target is None and pins is None
    given: dict[str, Any] = {"options": options, "target": target, "pins": pins, "markers": markers}
    alone = None
    if plain and _may_unroll(chart):
        alone = yield from map_chart(chart, **given)
        # What has no distortion has a map that is as symmetric as it is, whatever hangs on it.
        if max(alone.angle_mean - 1, alone.area_l1) <= UNROLLED:
            return alone
    whole = with_missing_images(chart) if plain else None
    if whole is not None:
        try:
            found = yield from map_chart(whole, options=options, markers=markers)
            if not found.folds:
                return _without_images(chart, found)
        except MeshError:
            pass  # it is that of the images, or the chart alone has it, too, and says where
    elif plain and start is not None and alone is None:
        refined = yield from refined_on(chart, start.uv, options, warm_start=False)
        if refined.status == "converged":
            return _refined_from(start, chart, refined)
    return (yield from map_chart(chart, **given)) if alone is None else alone


def _refined_from(start: ChartMap, chart: Chart, refined: Refinement) -> ChartMap:
    """What was found from the map of a chart on, with the figures of now."""
    return replace(
        with_figures(start, refined.uv, measured_map(chart, refined.uv, None)),
        newton_refinement=refined.iterations,
        residual_refinement=refined.residual,
        status=refined.status,
        area_weight=refined.area_weight,
    )


def _may_unroll(chart: Chart) -> bool:
    """Whether a chart unrolls, with little distortion or none."""
    vertices, _ = in_unit_box(chart.vertices)
    return unroll(vertices, chart.triangles, boundary_loops(chart.triangles)[0]) is not None


def _without_images(chart: Chart, found: ChartMap) -> ChartMap:
    """The map of a chart from one of it `with_missing_images`."""
    vertices, unit = in_unit_box(chart.vertices)
    uv = found.uv[: len(vertices)] / unit
    figures = measured_chart(vertices, chart, uv, None)
    return with_figures(found, placed_chart(uv, vertices, chart, None, unit, None), figures)


def _same_targets(charts, targets, j: int, k: int, image: np.ndarray) -> bool:
    """Whether the targets of charts j and k are mirror images, vertex by vertex."""
    one, two = targets[j], targets[k]
    if one is None or two is None:
        return one is two
    for name in ("density", "region"):
        a, b = getattr(one, name), getattr(two, name)
        if (a is None) != (b is None):
            return False
        if a is not None:
            at, here = _at_vertices(charts[j], a), _at_vertices(charts[k], b)
            if np.abs(at[image] - here).max() > SAME_DENSITY * np.abs(at).max():
                return False
    return True


def _at_vertices(chart: Chart, values: np.ndarray) -> np.ndarray:
    """Mean of values (m,) of a chart's triangles around its vertices, (n,)."""
    flat, n = chart.triangles.ravel(), len(chart.vertices)
    return np.bincount(flat, np.repeat(values, 3), n) / np.maximum(np.bincount(flat, minlength=n), 1)


def cut_alike(surface: Surface, faces: np.ndarray | None, prepared: DiskCharts, given: dict) -> Steps[DiskCharts]:
    """The charts cut along the mirror images of their cuts, too, where that leaves as many charts, all without holes;
    as they are otherwise. given : further arguments of `disk_charts`"""
    if prepared.cuts is None or not len(prepared.cuts.edges) or any(len(c.patches) for c in prepared.charts):
        return prepared
    # What unrolls has no slits that it could spare.
    if all(_is_flat(chart) for chart in prepared.charts):
        return prepared
    cuts = with_images(surface, faces, prepared.cuts)
    if cuts is prepared.cuts:
        return prepared
    open_there = replace(surface, seams=np.concatenate([surface.seams, cuts.edges]))
    found = yield from disk_charts(open_there, faces, extremities=0, **given)
    if len(found.charts) > len(prepared.charts) or found.cuts is None or len(found.cuts.edges):
        return prepared
    return replace(prepared, charts=found.charts, cuts=cuts)


def _is_flat(chart: Chart) -> bool:
    """Whether a chart without holes unrolls."""
    boundary = np.flatnonzero(on_boundary(chart.triangles, len(chart.vertices)))
    return not is_curved(chart.vertices, chart.triangles, boundary)


def mapped_anew(
    charts: list[Chart], known: list[tuple[Chart, ChartMap]], map_charts: MapCharts, starts: Starts = None
) -> Steps[list[ChartMap]]:
    """Maps of the charts; those that are as known ones were have the maps of these, and others start from the starts
    given, or, without any, where they lie in what is known."""
    maps = {identity(chart): (chart, chart_map) for chart, chart_map in known}
    names = [identity(chart) for chart in charts]
    rows = [k for k, name in enumerate(names) if name not in maps]
    others = [charts[k] for k in rows]
    begun = _where_they_lie(others, known) if starts is None else [starts[k] for k in rows]
    new = yield from map_charts(others) if begun is None else map_charts(others, begun)
    rest = iter(new)
    return [
        _numbered_as(chart, *maps[name]) if name in maps else next(rest)
        for chart, name in zip(charts, names, strict=True)
    ]


def _where_they_lie(charts: list[Chart], known: list[tuple[Chart, ChartMap]]) -> Starts:
    """Of charts that are parts of known ones, the maps that they are of; None for all others, and where there are no
    such charts. What is slit would begin where it touches itself."""
    whole = [(chart, found) for chart, found in known if _may_be_parted(chart, found)]
    if not charts or not whole:
        return None
    size = 1 + max(int(chart.corners.max()) for chart in (*charts, *(chart for chart, _ in whole)))
    owner, vertex = np.full(size, -1), np.zeros(size, np.int64)
    for k, (chart, _) in enumerate(whole):
        owner[chart.corners], vertex[chart.corners] = k, chart.triangles
    starts = list[ChartMap | None]()
    for chart in charts:
        k, there = owner[chart.corners], np.zeros(len(chart.vertices), np.int64)
        there[chart.triangles] = vertex[chart.corners]
        within = k.min() == k.max() >= 0 and not len(chart.patches) and len(np.unique(there)) == len(there)
        # Where a seam was closed, vertices were several.
        within = within and np.array_equal(there[chart.triangles], vertex[chart.corners])
        found = whole[int(k.max())][1]
        starts.append(replace(found, uv=found.uv[there]) if within else None)
    return starts if any(start is not None for start in starts) else None


def _may_be_parted(chart: Chart, found: ChartMap) -> bool:
    return found.failure is None and found.status == "converged" and not found.folds and not len(chart.patches)


def with_known_maps(map_charts: MapCharts) -> MapCharts:
    """What maps charts, which gives for one that is as another was the map of that: see `mapped_anew`."""
    known: list[tuple[Chart, ChartMap]] = []

    def again(charts: list[Chart], starts: Starts = None) -> Steps[list[ChartMap]]:
        maps = yield from mapped_anew(charts, known, map_charts, starts)
        known.extend(zip(charts, maps, strict=True))
        return maps

    return again


def _numbered_as(chart: Chart, other: Chart, chart_map: ChartMap) -> ChartMap:
    """The map of another chart for one that is the same, but for the order of its vertices and triangles."""
    if len(chart.patches):
        here, there = in_order_of_places(chart)[1], in_order_of_places(other)[1]
    else:
        here, there = in_order_of_corners(chart)[1], in_order_of_corners(other)[1]
    if np.array_equal(here, there):
        return chart_map
    uv = np.zeros_like(chart_map.uv)
    uv[here] = chart_map.uv[there]
    return replace(chart_map, uv=uv)


def remembered(
    refined: Callable[[Chart, ChartMap], Steps[np.ndarray]],
) -> Callable[[Chart, ChartMap], Steps[np.ndarray]]:
    """What refines the map of a chart, which gives for a chart with the same map again what it has found before."""
    found: dict[tuple[bytes, ...], np.ndarray] = {}

    def again(chart: Chart, chart_map: ChartMap) -> Steps[np.ndarray]:
        name = tuple(a.tobytes() for a in (chart.corners, chart.triangles, chart.patches, chart_map.uv))
        if name not in found:
            found[name] = yield from refined(chart, chart_map)
        return found[name]

    return again
