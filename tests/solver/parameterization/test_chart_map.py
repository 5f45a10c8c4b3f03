"""The map of one chart: units, places, options and what is said of it."""

import json

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.errors import PinError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_edges
from omt_uv.solver.parameterization.chart_indices import ChartPins
from omt_uv.solver.parameterization.chart_map import in_unit_box, map_chart, placed_chart
from omt_uv.solver.parameterization.options import MapOptions, UnwrapOptions
from omt_uv.solver.progress import drain


def chart_of(V, F):
    (chart,) = strict_charts(triangle_surface(V, F))
    return chart


@pytest.mark.parametrize("scale", [1e-150, 1.0, 1e150])
def test_a_unit_box_holds_every_unit(scale):
    V, _ = meshes.bumpy()
    inside, extent = in_unit_box(scale * V)
    assert extent == pytest.approx(scale * np.ptp(V, axis=0).max()) and np.abs(inside).max() <= 0.5 + 1e-12
    np.testing.assert_allclose(inside, in_unit_box(V)[0], atol=1e-12)


@pytest.mark.parametrize("boundary", ["disk", "square"])
@pytest.mark.parametrize(
    "balance, kind, free", [(0.0, "authalic", True), (0.5, "authalic", False), (0.0, "polar", False)]
)
def test_what_no_circle_has_room_for_has_a_free_boundary(boundary, balance, kind, free):
    """Triangles along the whole outline, each behind one edge, of which everyone takes a tenth of a circle."""
    V, F = meshes.bumpy(8, 8)
    edges = boundary_edges(F)
    tips = V[edges].mean(axis=1) + [0, 0, 0.2]
    F = np.vstack([F, np.column_stack([edges[:, ::-1], len(V) + np.arange(len(edges))])])
    chart = chart_of(np.vstack([V, tips]), F)
    found = drain(map_chart(chart, options=MapOptions(boundary, balance=balance, kind=kind)))
    text = f"The {boundary} has no room for this chart (parts that single edges cut off take more than all of a circle)"
    assert any(warning.startswith(text) for warning in found.warnings) == free
    assert found.folds == 0 or not free


@pytest.mark.parametrize("boundary", ["free", "disk", "square"])
def test_the_map_has_the_area_of_the_target(boundary):
    chart = chart_of(*meshes.bumpy(8, 8))
    density = 1 + chart.vertices[chart.triangles].mean(1)[:, 0]
    found = drain(map_chart(chart, options=MapOptions(boundary), target=Target(density)))
    area = face_areas(chart.vertices, chart.triangles)
    assert signed_areas(found.uv, chart.triangles).sum() == pytest.approx(area @ density, rel=1e-9)
    assert found.folds == 0 and not found.pinned


def test_a_free_map_has_its_centroid_at_0():
    chart = chart_of(*meshes.bumpy(8, 8))
    uv = placed_chart(chart.vertices[:, :2] + 7, chart.vertices, chart, None, 1.0, None)
    area = signed_areas(uv, chart.triangles)
    np.testing.assert_allclose(area @ uv[chart.triangles].mean(1), 0, atol=1e-12)
    assert area.sum() == pytest.approx(face_areas(chart.vertices, chart.triangles).sum())


def test_flat_charts_are_unrolled_exactly():
    V, F = meshes.grid(5, 4)
    turned = V @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    chart = chart_of(turned, F)
    found = drain(map_chart(chart))
    assert found.newton_conformal is None and found.newton_transport is None
    sides = [
        np.linalg.norm(p[chart.triangles] - p[np.roll(chart.triangles, 1, 1)], axis=2)
        for p in (chart.vertices, found.uv)
    ]
    np.testing.assert_allclose(*sides, rtol=1e-6)


def test_a_triangle_fills_no_square_and_says_so():
    found = drain(map_chart(chart_of(*meshes.single_triangle()), options=MapOptions("square")))
    assert any("does not fill a square" in text for text in found.warnings)


def test_a_report_holds_all_but_the_coordinates():
    chart = chart_of(*meshes.bumpy(6, 6))
    found = drain(map_chart(chart))
    report = json.loads(json.dumps(found.report(chart)))
    assert report["faces"] == report["triangles"] == 72 and report["vertices"] == 49
    assert "uv" not in report and report["weight"] == found.area_weight > 0


def test_a_disk_keeps_no_pins():
    chart = chart_of(*meshes.grid(3, 3))
    pins = ChartPins(np.array([0]), np.zeros((1, 2)), chart.vertices[chart.triangles][..., :2])
    with pytest.raises(PinError) as caught:
        drain(map_chart(chart, options=MapOptions("disk"), pins=pins))
    assert caught.value.elements.tolist() == [0]


@pytest.mark.parametrize("options", [{"boundary": "round"}, {"quality": "best"}, {"balance": 1.5}, {"seams": "none"},
                                     {"max_shear": 0.5}])  # fmt: skip
def test_options_are_checked_when_they_are_made(options):
    (name,) = options
    with pytest.raises(ValueError, match="bound" if name == "max_shear" else name):
        UnwrapOptions(**options)
