"""Many charts by xatlas, as seams between polygons."""

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv import xatlas_charts
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.errors import EmptyMeshError
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.xatlas_charts import chart_seams

pytest.importorskip("xatlas")


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_cube_falls_into_its_sides(scale):
    V, F = meshes.cube()
    V, F = meshes.subdivide(V, F)
    mesh = triangle_surface(V * scale, F)
    prepared = cut_to_disks(replace(mesh, seams=chart_seams(mesh)))
    assert len(prepared.charts) == 6 and not prepared.cuts.components
    for chart in prepared.charts:
        assert (np.ptp(chart.vertices, axis=0) == 0).sum() == 1


def test_polygons_stay_whole():
    V, polygons = meshes.quad_grid(8, 8)
    V = V * [1, 1, 6]
    mesh = meshes.polygon_surface(V, polygons)
    seams = chart_seams(mesh)
    sides = {frozenset((p[k], p[k - 1])) for p in polygons for k in range(4)}
    assert all(frozenset(edge) in sides for edge in seams.tolist())


def test_closed_surfaces_become_disks():
    V, F = meshes.torus()
    mesh = triangle_surface(V, F)
    charts = cut_to_disks(replace(mesh, seams=chart_seams(mesh))).charts
    assert len(charts) > 1 and sum(len(c.triangles) for c in charts) == len(F)


def test_nothing_to_segment():
    V, F = meshes.cube()
    with pytest.raises(EmptyMeshError):
        chart_seams(triangle_surface(V, F), np.zeros(len(F), bool))


@pytest.mark.parametrize("backwards", [False, True])
def test_a_polygon_goes_where_its_first_triangle_goes(monkeypatch, backwards):
    """Of a row of quads whose triangles are in these charts, borders are where those of the first ones differ."""
    V, polygons = meshes.quad_grid(6, 1)
    mesh = meshes.polygon_surface(V, polygons)
    charts = np.array([[0, 1], [0, 0], [1, 0], [1, 1], [2, 1], [2, 2]])
    first = np.array([mesh.triangle_face.tolist().index(f) for f in range(6)])
    of = np.empty(12, int)
    for f in range(6):
        rows = np.flatnonzero(mesh.triangle_face == f)
        of[rows] = charts[f] if not backwards else charts[f][::-1]
    monkeypatch.setattr(xatlas_charts, "_chart_of_triangle", lambda *_: of)
    seams = {frozenset(edge) for edge in chart_seams(mesh).tolist()}
    chart = of[first]
    expected = set()
    for f in range(5):
        for g in range(f + 1, 6):
            common = set(polygons[f]) & set(polygons[g])
            if len(common) == 2 and chart[f] != chart[g]:
                expected.add(frozenset(map(int, common)))
    assert seams == expected and expected


def test_a_mesh_in_a_point_has_no_seams_and_no_number_is_divided_by_its_size():
    V, F = meshes.icosphere(1)
    with np.errstate(all="raise"):
        assert len(chart_seams(triangle_surface(0 * V + [3.0, 4.0, 5.0], F))) <= 3 * len(F) // 2
