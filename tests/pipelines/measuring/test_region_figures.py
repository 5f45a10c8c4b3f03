"""Figures of regions, and values of faces, computed by hand."""

from __future__ import annotations

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from omt_uv.pipelines.measuring.per_face import face_values
from omt_uv.pipelines.measuring.region_figures import diameter, figures_by_region, perimeter, table_text
from omt_uv.pipelines.reading import Reading
from omt_uv.solver.errors import EmptyMeshError
from omt_uv.solver.maps.distortion import SHEAR_CAP
from omt_uv.solver.mesh.surface import Surface


@pytest.fixture
def squares():
    """Two quads of 2 x 1, side by side: the first has UVs of 0.2 x 0.1, the second of 0.1 x 0.2, across."""
    positions = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0], [4, 0, 0], [4, 1, 0]], float)
    surface = Surface(
        positions=positions,
        corner_vertex=np.array([0, 1, 2, 3, 1, 4, 5, 2]),
        face_start=np.array([0, 4, 8]),
        triangles=np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]),
        triangle_face=np.array([0, 0, 1, 1]),
        seams=np.zeros((0, 2), np.int64),
    )
    uv = [[0, 0], [0.2, 0], [0.2, 0.1], [0, 0.1], [0.5, 0.5], [0.6, 0.5], [0.6, 0.7], [0.5, 0.7]]
    return Reading(surface, np.ones(2, bool), np.array(uv, np.float32), None)


def test_regions_have_the_figures_of_hand(squares):
    masks = [("left", [np.array([True, False])]), ("right", [np.array([False, True])]), ("both", [np.ones(2, bool)])]
    every, left, right, both = figures_by_region([squares], masks, 1000)
    assert (every.name, every.faces, every.area, every.surface_share) == ("all", 2, pytest.approx(4), 1.0)
    assert left.faces == right.faces == 1
    assert vars(every) == {**vars(both), "name": "all"}
    assert (left.area, left.perimeter, right.perimeter) == pytest.approx(
        (2, 6, 6)
    ) and every.perimeter == pytest.approx(10)
    assert left.texture_share == pytest.approx(0.5) and left.ratio_mean == pytest.approx(1, rel=1e-5)
    assert left.shear == pytest.approx(1, rel=1e-5) and right.shear == pytest.approx(4, rel=1e-5)
    assert left.uv_diameter == pytest.approx(0.05**0.5, rel=1e-6)
    assert left.texel_density == pytest.approx(100, rel=1e-5)
    assert both.ratio_sd == pytest.approx(0, abs=1e-5) and both.shear == pytest.approx(2.5, rel=1e-5)


@pytest.mark.parametrize("thin", [0.0, 1e-12, 1e-9])
def test_a_face_that_is_squashed_onto_a_line_does_not_drown_the_shear_of_others(squares, thin):
    """It counts as the most that any face counts, and leaves the figures of other regions as they are."""
    uv = squares.uv.astype(float)
    uv[4:, 1] = 0.5 + thin * np.array([0, 0, 1, 1])
    left, right = np.array([True, False]), np.array([False, True])
    every, first, second = figures_by_region([replace(squares, uv=uv)], [("l", [left]), ("r", [right])], 1000)
    assert second.shear == pytest.approx(SHEAR_CAP) and first.shear == pytest.approx(1, rel=1e-5)
    assert every.shear == pytest.approx((SHEAR_CAP + 1) / 2)


def test_several_readings_are_counted_as_one(squares):
    masks = [np.array([True, False]), np.array([False, True])]
    every, region = figures_by_region([squares, squares], [("x", masks)], 1000)
    assert every.area == pytest.approx(8) and region.surface_share == pytest.approx(0.5)
    assert region.shear == pytest.approx(2.5, rel=1e-5)


def test_a_region_without_faces_is_refused_by_name(squares):
    with pytest.raises(EmptyMeshError, match="'empty'"):
        figures_by_region([squares], [("empty", [np.zeros(2, bool)])], 1000)


def test_a_table_is_read_back(squares):
    rows = figures_by_region([squares], [("a, b", [np.ones(2, bool)])], 1000)
    read = list(csv.DictReader(io.StringIO(table_text(rows))))
    assert [row["name"] for row in read] == ["all", "a  b"] and float(read[0]["area"]) == pytest.approx(4)


def test_values_of_faces(squares):
    values = face_values(squares)
    assert values.area == pytest.approx([0, 0], abs=1e-5) and values.shear == pytest.approx([1, 4], rel=1e-5)
    assert values.stretch[0] == pytest.approx([0, 0, 0], abs=1e-9)
    # Along x the second has a twentieth of the texture for its length, along y a fifth.
    assert np.abs(values.stretch[1]) == pytest.approx([1, 0, 0], abs=1e-9)


def test_polygons_that_are_not_chosen_have_no_values(squares):
    chosen = Reading(squares.surface, np.array([False, True]), squares.uv, None)
    values = face_values(chosen)
    assert (values.area[0], values.shear[0]) == (0, 1) and not values.stretch[0].any()


def test_diameters_of_any_points():
    t = np.linspace(0, 2 * np.pi, 3000)
    assert diameter(np.column_stack([np.cos(t), np.sin(t)])) == pytest.approx(2, rel=1e-5)
    assert diameter(np.array([[0, 0], [3, 4], [1.5, 2.0]])) == pytest.approx(5)
    assert diameter(np.array([[1.0, 2.0]])) == 0


def test_the_perimeter_of_a_ring_has_both_boundaries():
    V = np.array([[x, y, 0] for y in range(4) for x in range(4)], float)
    i = np.array([4 * y + x for y in range(3) for x in range(3) if (x, y) != (1, 1)])
    F = np.concatenate([np.stack([i, i + 1, i + 5], 1), np.stack([i, i + 5, i + 4], 1)])
    assert perimeter(V, F) == pytest.approx(12 + 4)
