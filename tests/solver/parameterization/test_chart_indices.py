"""A surface's target, read in one of its charts."""

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.mesh.charts import strict_charts, triangle_rows
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import chart_target, cut_as_given, in_order_of_places, located


def two_charts():
    V, F = meshes.grid(3, 2)
    order = np.random.default_rng(0).permutation(2 * len(F))
    return triangle_surface(np.concatenate([V, V + 5]), np.concatenate([F, F + len(V)])[order])


def test_every_triangle_has_its_own_density():
    surface = two_charts()
    target = Target(1.0 + np.arange(len(surface.triangles)), np.arange(len(surface.triangles)) / 100)
    for chart in strict_charts(surface):
        found = chart_target(target, surface, chart)
        np.testing.assert_array_equal(found.density, 1 + chart.faces)
        np.testing.assert_array_equal(found.region, chart.faces / 100)
    assert chart_target(None, surface, chart) is None


@pytest.mark.parametrize("shuffled", [False, True])
def test_triangles_of_a_chart_are_found_whichever_way_the_surface_has_them(shuffled):
    """In the order of their polygons, or in none; some from another corner on, as who cuts quads anew has them."""
    surface = two_charts()
    rng = np.random.default_rng(1)
    rows = rng.permutation(len(surface.triangles)) if shuffled else np.arange(len(surface.triangles))
    turned = (rng.integers(3, size=len(rows))[:, None] + np.arange(3)) % 3
    triangles = np.take_along_axis(surface.triangles[rows], turned, axis=1)
    surface = replace(surface, triangles=triangles, triangle_face=surface.triangle_face[rows])
    charts = strict_charts(surface)
    assert len(charts) == 2
    for chart in charts:
        found = triangle_rows(surface, chart)
        np.testing.assert_array_equal(np.sort(surface.triangles[found], axis=1), np.sort(chart.corners, axis=1))
        np.testing.assert_array_equal(surface.triangle_face[found], chart.faces)
        twice = np.concatenate([chart.corners, chart.corners[::-1]]), np.concatenate([chart.faces, chart.faces[::-1]])
        both = triangle_rows(surface, replace(chart, corners=twice[0], faces=twice[1]))
        np.testing.assert_array_equal(both, np.concatenate([found, found[::-1]]))


@pytest.mark.parametrize("turned", [False, True])
def test_a_chart_gets_its_diagonals_back(turned):
    V, quads = meshes.quad_grid(4, 3)
    given = meshes.polygon_surface(np.column_stack([V[:, :2] * [1, 1.3], V[:, 0] * V[:, 1]]), quads)
    other = given.triangles.reshape(-1, 6).copy()
    a, b, c, d = given.face_start[:-1] + np.arange(4)[:, None]
    other[::2] = np.column_stack([b, c, d, b, d, a])[::2]
    cut = replace(given, triangles=other.reshape(-1, 3))
    (chart,) = strict_charts(cut)
    if turned:
        chart = replace(chart, triangles=chart.triangles[:, [0, 2, 1]], corners=chart.corners[:, [0, 2, 1]])
    back = cut_as_given(chart, cut, given)
    rows = np.sort(given.triangles[triangle_rows(given, back)], axis=1)
    np.testing.assert_array_equal(rows, np.sort(back.corners, axis=1))
    np.testing.assert_array_equal(back.vertex_ids[back.triangles], given.corner_vertex[back.corners])
    area = signed_areas(chart.vertices[:, :2], back.triangles)
    assert (area < 0 if turned else area > 0).all() and len(area) == len(chart.triangles)
    assert cut_as_given(chart, cut, cut) is chart


def test_errors_have_the_elements_of_the_surface():
    for chart in strict_charts(two_charts()):
        for kind, elements, expected in (
            ("face", [0, 3], chart.faces[[0, 3]]),
            ("vertex", [2], chart.vertex_ids[[2]]),
            ("edge", [[0, 1]], chart.vertex_ids[[[0, 1]]]),
        ):
            found = located(FoldedUVError("cause", "remedy", kind=kind, elements=np.array(elements)), chart)
            np.testing.assert_array_equal(found.elements, expected)
            assert isinstance(found, FoldedUVError) and (found.cause, found.remedy) == ("cause", "remedy")


def test_what_fills_a_hole_is_no_element_of_the_surface_nor_is_what_leads_there():
    V, F = meshes.annulus(12, 2)
    (chart,) = cut_to_disks(triangle_surface(V, F), fill_holes=True).charts
    (middle,) = np.flatnonzero(chart.vertex_ids < 0)
    ring = np.setdiff1d(chart.patches, middle)
    for kind, elements, expected in (
        ("vertex", np.append(ring, middle), chart.vertex_ids[ring]),
        ("edge", [[ring[0], middle], ring[:2], [middle, ring[2]], ring[2:4]], chart.vertex_ids[ring[:4].reshape(2, 2)]),
        ("face", np.array([4, len(F), 2, len(F) + 11]), np.sort(chart.faces[[4, 2]])),
    ):
        found = located(FoldedUVError("cause", "remedy", kind=kind, elements=np.array(elements)), chart)
        np.testing.assert_array_equal(found.elements, expected)


def shuffled(chart, seed):
    """The chart with its vertices and triangles in another order, and the quads' triangles from other corners on."""
    rng = np.random.default_rng(seed)
    order, rows = rng.permutation(len(chart.vertices)), rng.permutation(len(chart.triangles))
    turn = (rng.integers(3, size=len(rows))[:, None] + np.arange(3)) % 3
    triangles, corners = (np.take_along_axis(x[rows], turn, axis=1) for x in (chart.triangles, chart.corners))
    return replace(
        chart,
        vertices=chart.vertices[order],
        triangles=np.argsort(order)[triangles],
        corners=corners,
        faces=chart.faces[rows],
        vertex_ids=chart.vertex_ids[order],
    )


def test_places_alone_decide_the_order():
    # A cut cylinder: the sides of the cut lie on one another.
    turn, height = np.divmod(np.arange(13 * 5), 5)
    V = np.column_stack([np.cos(turn * np.pi / 6), np.sin(turn * np.pi / 6), height])
    V[-5:] = V[:5]
    corner = (5 * np.arange(12)[:, None] + np.arange(4)).ravel()
    quads = np.column_stack([corner, corner + 5, corner + 6, corner + 1])
    F = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    (chart,) = strict_charts(triangle_surface(V, F))
    chart = replace(chart, faces=chart.faces // 2)
    for given in (chart, shuffled(chart, 0), shuffled(chart, 1)):
        found, order = in_order_of_places(given)
        np.testing.assert_array_equal(found.vertices, given.vertices[order])
        np.testing.assert_array_equal(found.vertex_ids, given.vertex_ids[order])
        for name in ("vertices", "triangles", "faces", "corners", "vertex_ids"):
            np.testing.assert_array_equal(getattr(found, name), getattr(in_order_of_places(chart)[0], name))
        again, kept = in_order_of_places(found)
        np.testing.assert_array_equal(kept, np.arange(len(V)))
        np.testing.assert_array_equal(again.triangles, found.triangles)


@pytest.mark.parametrize("sides", [(3, 4, 5), (5, 4, 3), (4, 4, 5), (1, 1, 1)])
def test_the_order_of_a_lone_triangle_is_that_of_its_sides(sides):
    """Whichever vertex comes first, on whichever side it is seen, the same places with the same turn."""
    a, b, c = sides
    x = (a * a + c * c - b * b) / (2 * c)
    V = np.array([[0, 0, 1], [c, 0, 1], [x, np.sqrt(a * a - x * x), 1]], float)
    for face in ([0, 1, 2], [0, 2, 1]):
        (chart,) = strict_charts(triangle_surface(V, np.array([face])))
        first, order = in_order_of_places(chart)
        np.testing.assert_array_equal(first.vertices, chart.vertices[order])
        length = np.linalg.norm(first.vertices[[1, 2, 0]] - first.vertices[[2, 0, 1]], axis=1)
        assert (np.diff(length) > -1e-12).all() and first.triangles[0, 0] == 0
        np.testing.assert_array_equal(first.vertex_ids[first.triangles[0]], np.array(face)[first.corners[0]])
        before, now = (np.cross(p[1] - p[0], p[2] - p[0]) for p in (V[face], first.vertices[first.triangles[0]]))
        np.testing.assert_allclose(now, before)
        for seed in range(4):
            found, kept = in_order_of_places(shuffled(chart, seed))
            for name in ("vertices", "triangles", "vertex_ids"):
                np.testing.assert_array_equal(getattr(found, name), getattr(first, name))
