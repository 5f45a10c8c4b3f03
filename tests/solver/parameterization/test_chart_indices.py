"""A surface's target, read in one of its charts."""

from dataclasses import replace

import meshes
import numpy as np

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import chart_target, in_order_of_places, located


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
