"""Translate between a surface and one of its charts: targets and pins to the chart, the elements of errors back, any
order; and lay charts where their pins are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..analysis.density import Target
from ..analysis.order_of_places import lowest_first, order_of_places, order_of_rows
from ..analysis.symmetry_plane import MirrorImages
from ..errors import MeshError, PinError
from ..maps.similarity import fit_similarity
from ..mesh.charts import Chart, triangle_rows
from ..mesh.geometry import of_corners
from ..mesh.surface import Surface, is_seam
from ..mesh.topology import boundary_edges, distinct, graph_components, pair_keys
from ..refinement.pins import Pins, aligned_to_pins, check_pins

# Triangles beyond which the numbers of a chart take half of the memory.
MANY = 100_000


def chart_target(target: Target | None, surface: Surface, chart: Chart) -> Target | None:
    """The part of a surface's target that the triangles of a chart have; None for none."""
    return None if target is None else target.of(triangle_rows(surface, chart))


def located(error: MeshError, chart: Chart) -> MeshError:
    """The same error with the element indices of the surface instead of the chart's; patches have none."""
    patched = np.concatenate([chart.faces, np.full(len(chart.patches), -1)])
    place = {"vertex": chart.vertex_ids, "edge": chart.vertex_ids, "face": patched}.get(error.kind)
    elements = error.elements
    if place is not None:
        elements = place[elements]
        there = elements >= 0
        elements = elements[there.all(axis=1) if there.ndim > 1 else there]
        # A polygon has several triangles that something may be wrong with.
        elements = np.unique(elements) if error.kind == "face" else elements
    return type(error)(error.cause, error.remedy, error.kind, elements)


def in_order_of_places(chart: Chart) -> tuple[Chart, np.ndarray]:
    """The chart with its vertices and triangles in an order that their places alone decide, and that order (n,).

    Vertex k is the given chart's order[k].
    """
    if len(chart.vertices) == 3 == chart.corners.size:
        return _lone_triangle(chart)
    order = order_of_places(chart.vertices, chart.disk)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    triangles, turn = lowest_first(place[chart.triangles])
    corners = np.take_along_axis(chart.corners, turn, axis=1)
    polygon = distinct(chart.faces)[1]
    rows = order_of_rows(*_polygon_keys(triangles, polygon)[::-1], *triangles.T)
    patches = lowest_first(place[chart.patches])[0]
    # What is kept while a large chart is mapped takes half of the memory that it was found in.
    kept = np.int32 if len(rows) > MANY else np.int64
    found = replace(
        chart,
        vertices=chart.vertices[order],
        triangles=triangles.astype(kept)[rows],
        corners=corners.astype(kept)[rows],
        faces=chart.faces.astype(kept)[rows],
        vertex_ids=chart.vertex_ids.astype(kept)[order],
        patches=patches[np.lexsort(patches.T[::-1])],
    )
    return found, order


def _lone_triangle(chart: Chart) -> tuple[Chart, np.ndarray]:
    """`in_order_of_places` of a triangle: thousands of them would wait for principal axes. The longest side is last."""
    p = chart.vertices / (np.abs(chart.vertices).max() or 1.0)
    side = ((p[[1, 2, 0]] - p[[2, 0, 1]]) ** 2).sum(axis=1)
    order = np.lexsort((*p.T, side))
    corner = np.argsort(chart.triangles[0])[order]
    # Counter-clockwise as it was, from the first vertex on.
    even = (corner[1] - corner[0]) % 3 == 1
    turn = corner if even else corner[[0, 2, 1]]
    triangles = np.array([[0, 1, 2]] if even else [[0, 2, 1]])
    found = replace(
        chart,
        vertices=chart.vertices[order],
        triangles=triangles,
        corners=chart.corners[:, turn],
        vertex_ids=chart.vertex_ids[order],
    )
    return found, order


def _polygon_keys(triangles: np.ndarray, polygon: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of the polygon (m,) of each triangle: the highest vertex, the sum of all, the lowest; whichever way it is cut."""
    count, n = int(polygon.max(initial=-1)) + 1, int(triangles.max(initial=-1)) + 1
    if count == len(triangles):
        total = of_corners(np.add, triangles).astype(float)
        return of_corners(np.maximum, triangles), total, of_corners(np.minimum, triangles)
    pairs = np.unique(np.repeat(polygon, 3) * np.int64(n) + triangles.ravel())
    owner, vertex = np.divmod(pairs, n)
    first = np.searchsorted(owner, np.arange(count))
    last = np.append(first[1:], len(owner)) - 1
    total = np.bincount(owner, vertex, count)
    return vertex[last][polygon], total[polygon], vertex[first][polygon]


def cut_as_given(chart: Chart, cut: Surface, given: Surface) -> Chart:
    """A chart of the surface `cut` with the diagonals of `given`, which has the triangles of the same polygons in the
    same rows."""
    rows = triangle_rows(cut, chart)
    changed = np.flatnonzero((cut.triangles[rows] != given.triangles[rows]).any(axis=1))
    if not len(changed):
        return chart
    known = np.argsort(chart.corners, axis=None)
    before, now = (lowest_first(x)[0] for x in (cut.triangles[rows[changed]], chart.corners[changed]))
    corners = given.triangles[rows[changed]]
    # Faces may have been turned over for the map.
    corners = np.where((before[:, 1] != now[:, 1])[:, None], corners[:, [0, 2, 1]], corners)
    triangles, every = chart.triangles.copy(), chart.corners.copy()
    at = known[np.searchsorted(chart.corners.ravel()[known], corners)]
    triangles[changed], every[changed] = chart.triangles.ravel()[at], corners
    return replace(chart, triangles=triangles, corners=every)


def outline(chart: Chart) -> np.ndarray:
    """Keys (e,) of the edges around a chart."""
    return pair_keys(*chart.vertex_ids[boundary_edges(chart.triangles)].T)


def within(chart: Chart) -> np.ndarray:
    """Keys (e,) of the edges that a chart lies on both sides of, cut all the same."""
    keys, count = np.unique(outline(chart), return_counts=True)
    return keys[count > 1]


def all_within(charts: list[Chart]) -> np.ndarray:
    """Keys (e,) of the edges within any of the charts, see `within`."""
    return np.concatenate([np.zeros(0, np.int64), *(within(chart) for chart in charts)])


def but_within(edges: np.ndarray, charts: list[Chart]) -> np.ndarray:
    """Those of the edges (e,2) that are not within charts, which are cut anew."""
    return edges[~np.isin(pair_keys(*edges.T), all_within(charts))]


def is_marked(surface: Surface, chart: Chart) -> bool:
    """Whether seams of the surface bound a chart."""
    return bool(is_seam(surface, outline(chart)).any())


def identity(chart: Chart) -> tuple[bytes, bytes]:
    """Equal for charts of the same corners and patches that are joined in the same way, whatever the order of their
    vertices and triangles."""
    if len(chart.patches):
        # What fills holes has no corners to go by.
        placed, _ = in_order_of_places(chart)
        parts = placed.triangles, placed.patches
        return placed.corners.astype(np.int64).tobytes(), np.concatenate(parts).astype(np.int64).tobytes()
    corners, triangles = in_order_of_corners(chart)
    _, first, number = np.unique(triangles, return_index=True, return_inverse=True)
    return corners.tobytes(), first[number.ravel()].tobytes()


def chart_of_polygons(charts: list[Chart], count: int) -> np.ndarray:
    """The chart (f,) that each of so many polygons of the surface is in, -1 for none."""
    found = np.full(count, -1)
    for k, chart in enumerate(charts):
        found[chart.faces] = k
    return found


def with_entangled(region: np.ndarray, chosen: np.ndarray, others: list[Chart]) -> np.ndarray:
    """Charts (k,) bool, of which polygons are in these (f,), that are chosen, or hang together with one that is by
    other charts of the same polygons, that have some of both, as where faces lie on each other."""
    faces, count = np.concatenate([chart.faces for chart in others]), len(chosen)
    other = np.repeat(np.arange(len(others)), [len(chart.faces) for chart in others])
    label = graph_components(region[faces], count + other, count + len(others))[1][:count]
    return np.isin(label, label[chosen])


def refuse_lost_faces(before: list[Chart], after: list[Chart]) -> None:
    """Raise a MeshError where a polygon is in a chart before, and in none after."""
    lost = np.setdiff1d(*(np.concatenate([chart.faces for chart in charts]) for charts in (before, after)))
    if len(lost):
        raise MeshError("Faces were lost when charts were cut further", "Unwrap without a maximal shear", "face", lost)


def in_order_of_corners(chart: Chart) -> tuple[np.ndarray, np.ndarray]:
    """The corners of the surface (m,3) and the triangles (m,3) of a chart, in the order of the former alone."""
    corners, turn = lowest_first(chart.corners)
    order = np.lexsort(corners.T[::-1])
    triangles = np.take_along_axis(chart.triangles, turn, axis=1)
    return corners[order].astype(np.int64), triangles[order].astype(np.int64)


def edge_set(edges: np.ndarray) -> bytes:
    """Equal for the same edges (e,2) in any order: from the same cut, these may come out again, whose map is known."""
    return np.unique(pair_keys(*edges.T)).tobytes()


@dataclass(frozen=True)
class CornerPins:
    """pinned (c,) bool: corners of a surface that must keep their places; uv (c,2): where all corners are now."""

    pinned: np.ndarray
    uv: np.ndarray


@dataclass(frozen=True)
class ChartPins:
    """Vertices (k,) of a chart, each once, their places (k,2), and where its triangles' corners are now (m,3,2)."""

    vertices: np.ndarray
    places: np.ndarray
    given: np.ndarray


def pins_of_chart(pins: CornerPins | None, chart: Chart) -> ChartPins | None:
    """Pins of a chart, None if it has none.

    Raises
    ------
    PinError : see `pins.check_pins`; pinned corners of one chart vertex that lie apart are two places of it. Its
        elements are those of the surface
    """
    if pins is None or not pins.pinned[chart.corners].any():
        return None
    mask = pins.pinned[chart.corners]
    given = np.asarray(pins.uv, float)[chart.corners]
    try:
        checked = check_pins(chart.triangles[mask], given[mask], len(chart.vertices))
    except PinError as error:
        raise located(error, chart) from error
    places = np.column_stack([checked.places.real, checked.places.imag])
    return ChartPins(vertices=checked.vertices, places=places, given=given)


def clear_of_pins(surface: Surface, pins: CornerPins | None, avoid: np.ndarray | None) -> np.ndarray | None:
    """Vertices (n,) in [0,1] to keep free of cuts: those to `avoid`, and all with a pin; None for none.

    A cut through a pinned vertex would give one point of the surface two places in the texture.
    """
    if pins is None or not pins.pinned.any():
        return avoid
    free = np.zeros(len(surface.positions)) if avoid is None else np.array(avoid, float)
    free[surface.corner_vertex[pins.pinned]] = 1.0
    return free


def refuse_pins_on_outline(pins: ChartPins | None, boundary: str) -> None:
    """Raise PinError for pins in a disk or a square, which has its own place for every vertex."""
    if pins is not None and boundary != "free":
        raise PinError(
            f"Pinned UVs cannot stay in place in a {boundary}",
            remedy="Choose a free boundary, or unpin these vertices",
            kind="vertex",
            elements=pins.vertices,
        )


def mirrored_to_pins(uv: np.ndarray, pins: ChartPins | None) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray] | None]:
    """Start uv (n,2) and pins for `refine`, which takes three or more here; None for fewer, see `moved_to_pins`.

    The start is mirrored where that comes nearer to the pins once it is moved, turned and scaled.
    """
    if pins is None or len(pins.vertices) < 3:
        return uv, None
    pinned = Pins(pins.vertices, pins.places @ [1, 1j])
    maps = uv @ [1, 1j], uv @ [1, -1j]
    miss, mirrored = (np.abs(aligned_to_pins(w, pinned)[pinned.vertices] - pinned.places).sum() for w in maps)
    # Pins in a row fit either way: then the map is not mirrored.
    turn_over = miss - mirrored > 1e-4 * np.abs(pinned.places - pinned.places.mean()).sum()
    return uv * [1, -1 if turn_over else 1], (pins.vertices, pins.places)


def moved_to_pins(uv: np.ndarray, triangles: np.ndarray, pins: ChartPins) -> np.ndarray:
    """The map uv (n,2) moved, turned and scaled to its pins, one or two: its shape is what it would be without them.

    With one pin it is as large as the UVs that the chart has now and turned like them, or one unit wide where those
    have no area.
    """
    w, places = uv @ [1, 1j], pins.places @ [1, 1j]
    if len(pins.vertices) > 1:
        w = aligned_to_pins(w, Pins(pins.vertices, places))
    else:
        w = _placed_like_given(w, triangles, pins.given @ [1, 1j])
        w = w + (places[0] - w[pins.vertices[0]])
    w[pins.vertices] = places
    return np.column_stack([w.real, w.imag])


def _placed_like_given(w: np.ndarray, triangles: np.ndarray, given: np.ndarray) -> np.ndarray:
    """The map w (n,), its triangles turned and scaled to the direction and area of those given, by corners (m,3)."""
    corners = w[triangles]
    now, then = (np.abs(((x[:, 1] - x[:, 0]).conj() * (x[:, 2] - x[:, 0])).imag).sum() for x in (corners, given))
    if not (np.isfinite(then) and then > 0):
        return w / max(np.ptp(corners.real), np.ptp(corners.imag))
    scale = np.sqrt(then / now)
    return fit_similarity(scale * corners.ravel(), given.ravel(), rigid=True)(scale * w)


def mirror_twins(charts: list[Chart], images: MirrorImages | None) -> np.ndarray:
    """The number (k,) of the chart before each of which it is the mirror image, vertex by vertex; -1 for none."""
    twin = np.full(len(charts), -1)
    if images is None or not images.are_exact or len(charts) < 2:
        return twin
    sets = [np.unique(chart.vertex_ids) for chart in charts]
    number = {vertices.tobytes(): k for k, vertices in enumerate(sets)}
    for k, vertices in enumerate(sets):
        other = number.get(np.sort(images.exact[vertices]).tobytes(), k)
        if other < k and twin[other] < 0:
            twin[k] = other
    return twin
