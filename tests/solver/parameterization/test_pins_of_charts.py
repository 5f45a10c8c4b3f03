"""Pins of a surface as pins of its charts, and charts laid at them."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import PinError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import (
    ChartPins,
    CornerPins,
    clear_of_pins,
    mirrored_to_pins,
    moved_to_pins,
    pins_of_chart,
)

V, F = meshes.grid(4, 3)
UV = V[:, :2]


def two_charts():
    return triangle_surface(np.concatenate([V, V + 5]), np.concatenate([F, F + len(V)]))


def corner_pins(surface, vertices, uv):
    return CornerPins(np.isin(surface.corner_vertex, vertices), uv[surface.corner_vertex])


def test_every_pinned_vertex_is_a_pin_once_at_its_place():
    surface = two_charts()
    uv = np.random.default_rng(0).random((2 * len(V), 2))
    vertices = [3, 7, len(V) + 2]
    found = [pins_of_chart(corner_pins(surface, vertices, uv), chart) for chart in strict_charts(surface)]
    for chart, pins, own in zip(strict_charts(surface), found, ([3, 7], [len(V) + 2]), strict=True):
        assert sorted(chart.vertex_ids[pins.vertices]) == own
        np.testing.assert_array_equal(pins.places, uv[chart.vertex_ids[pins.vertices]])
        np.testing.assert_array_equal(pins.given, uv[chart.vertex_ids[chart.triangles]])


def test_a_chart_without_pins_has_none():
    surface = two_charts()
    _, second = strict_charts(surface)
    assert pins_of_chart(None, second) is None
    assert pins_of_chart(corner_pins(surface, [0], np.zeros((2 * len(V), 2))), second) is None


def test_two_places_of_a_vertex_are_named_by_the_surface():
    surface = two_charts()
    pins = corner_pins(surface, [len(V) + 7], np.tile(UV, (2, 1)))
    pins.uv[np.flatnonzero(pins.pinned)[0]] += 0.1
    with pytest.raises(PinError) as caught:
        pins_of_chart(pins, strict_charts(surface)[1])
    assert caught.value.elements.tolist() == [len(V) + 7]


def test_cuts_avoid_pins_and_what_is_to_be_avoided():
    surface = two_charts()
    pins = corner_pins(surface, [3, 7], np.tile(UV, (2, 1)))
    avoid = np.zeros(2 * len(V))
    avoid[5] = 0.5
    both = clear_of_pins(surface, pins, avoid)
    assert np.flatnonzero(both).tolist() == [3, 5, 7] and both[5] == 0.5 and both[3] == 1
    assert avoid[3] == 0 and clear_of_pins(surface, None, avoid) is avoid


@pytest.mark.parametrize("factor", [1.0, 2 - 1j, 1e-3j])
def test_two_pins_place_a_map_exactly(factor):
    w = UV @ [1, 1j]
    moved = factor * w[[0, 9]] + (3 - 4j)
    places = np.column_stack([moved.real, moved.imag])
    pins = ChartPins(np.array([0, 9]), places, UV[F])
    found = moved_to_pins(UV, F, pins)
    np.testing.assert_array_equal(found[[0, 9]], places)
    np.testing.assert_allclose(found @ [1, 1j], factor * w + (3 - 4j), rtol=1e-12)


def test_one_pin_keeps_area_and_direction_of_the_uvs_there_are():
    turn = np.array([[0.6, 0.8], [-0.8, 0.6]])
    given = 2 * UV[F] @ turn
    pins = ChartPins(np.array([4]), np.array([[7.0, 8.0]]), given)
    found = moved_to_pins(UV, F, pins)
    np.testing.assert_allclose(found - found[4], 2 * (UV - UV[4]) @ turn, atol=1e-12)
    np.testing.assert_array_equal(found[4], [7, 8])
    nowhere = moved_to_pins(UV, F, ChartPins(np.array([4]), np.array([[7.0, 8.0]]), 0 * given))
    assert np.ptp(nowhere, axis=0).max() == pytest.approx(1)


def test_a_start_is_mirrored_where_that_comes_nearer():
    pins = ChartPins(np.array([0, 4, 12]), UV[[0, 4, 12]] * [-3, 3] + 1, UV[F])
    start, (vertices, places) = mirrored_to_pins(UV, pins)
    np.testing.assert_array_equal(start, UV * [1, -1])
    np.testing.assert_array_equal(vertices, pins.vertices)
    np.testing.assert_array_equal(places, pins.places)
    straight = ChartPins(np.array([0, 2, 4]), UV[[0, 2, 4]], UV[F])
    np.testing.assert_array_equal(mirrored_to_pins(UV, straight)[0], UV)
