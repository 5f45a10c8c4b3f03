"""What a map leaves open is fixed by markers: a middle, a start, three places on the circle, four corners."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.canonical.markers import ChartMarkers, MapMarkers, markers_of_chart
from omt_uv.solver.canonical.rectangles import natural_aspect
from omt_uv.solver.conformal.disk_map import conformal_disk, conformal_rectangle, sharpest_corners
from omt_uv.solver.errors import LandmarkError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import as_complex
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain

NONE = np.zeros(0, np.int64)


@pytest.fixture(scope="module")
def disk():
    V, F = meshes.bumpy(12, 12)
    return V, F, boundary_loops(F)[0], drain(conformal_disk(V, F)).uv


def cross_ratio(z):
    return (z[0] - z[2]) * (z[1] - z[3]) / ((z[0] - z[3]) * (z[1] - z[2]))


@pytest.mark.parametrize("three", [False, True])
def test_markers_come_to_their_places_by_a_moebius_map(disk, three):
    _, _, loop, uv = disk
    corners = tuple(loop[[0, 17, 30]].tolist()) if three else ()
    markers = ChartMarkers(centre=-1 if three else 50, start=int(loop[5]), corners=corners)
    w, before = as_complex(markers.in_disk(uv, loop)), as_complex(uv)
    if three:
        assert w[list(corners)] == pytest.approx([1, 1j, -1])
    else:
        assert w[50] == pytest.approx(0, abs=1e-12) and w[loop[5]] == pytest.approx(1)
    assert np.abs(w[loop]) == pytest.approx(1) and np.abs(w).max() < 1 + 1e-12
    some = [3, 40, 77, 101]
    assert cross_ratio(w[some]) == pytest.approx(cross_ratio(before[some]))


def test_corners_come_in_the_order_of_the_boundary_from_the_start():
    V, F = meshes.bumpy(6, 6)
    (chart,) = strict_charts(triangle_surface(V, F))
    loop = chart.vertex_ids[boundary_loops(chart.triangles)[0]]
    marked = loop[[2, 8, 14, 20]]
    found = markers_of_chart(MapMarkers(NONE, marked[1:2], np.sort(marked)), chart)
    assert chart.vertex_ids[list(found.corners)].tolist() == np.roll(marked, -1).tolist()
    assert chart.vertex_ids[found.start] == marked[1]


@pytest.mark.parametrize(
    "markers",
    [
        MapMarkers(np.array([0, 1]), NONE, NONE),
        MapMarkers(NONE, np.array([24]), NONE),
        MapMarkers(NONE, NONE, np.array([0, 1])),
        MapMarkers(NONE, NONE, np.array([24])),
    ],
)
def test_markers_that_fix_nothing_are_refused_with_their_vertices(markers):
    (chart,) = strict_charts(triangle_surface(*meshes.bumpy(6, 6)))
    with pytest.raises(LandmarkError) as error:
        markers_of_chart(markers, chart)
    assert "one centre" in str(error.value)


@pytest.mark.parametrize("size", [(4, 4, 1.0, 1.0), (9, 5, 3.0, 1.0), (6, 6, 1.0, 2.5)])
def test_the_aspect_of_a_flat_rectangle_is_its_own(size):
    V, F = meshes.grid(*size)
    corners = np.array([0, size[0], len(V) - 1, len(V) - 1 - size[0]])
    assert natural_aspect(V, F, corners) == pytest.approx(size[3] / size[2], rel=1e-6)


def test_the_aspect_of_a_surface_is_nearly_that_of_its_conformal_map(disk):
    V, F, loop, _ = disk
    corners = sharpest_corners(V, F, loop)
    assert natural_aspect(V, F, corners) == pytest.approx(drain(conformal_rectangle(V, F, corners)).aspect, rel=0.05)


@pytest.mark.parametrize(("centre", "start"), [(-1, 3), (0, 3), (7, 3), (7, 0), (-1, 0)])
def test_maps_are_turned_until_the_start_lies_to_the_right_of_the_centre(centre, start):
    """The centre may be any vertex, the first one, too; without one it is 0."""
    uv = np.random.default_rng(0).normal(size=(20, 2))
    turned = ChartMarkers(centre=centre, start=start).turned(uv)
    w, before = as_complex(turned), as_complex(uv)
    way = w[start] - (w[centre] if centre >= 0 else 0)
    assert way.real > 0 and abs(way.imag) < 1e-12
    np.testing.assert_allclose(w / before, w[0] / before[0])
    assert abs(w[0] / before[0]) == pytest.approx(1)
