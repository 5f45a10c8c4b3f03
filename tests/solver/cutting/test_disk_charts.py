"""Any mesh becomes disks, without a face more or less."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.cutting import disk_charts as disk_charts_module
from omt_uv.solver.cutting.disk_charts import cut_to_disks
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops


@pytest.mark.parametrize("mesh", [meshes.cube, meshes.torus, meshes.annulus, meshes.icosphere, meshes.head])
def test_charts_have_every_face_once_and_its_area(mesh):
    V, F = mesh()
    found = cut_to_disks(triangle_surface(V, F))
    faces = np.concatenate([c.faces for c in found.charts])
    np.testing.assert_array_equal(np.sort(faces), np.arange(len(F)))
    for chart in found.charts:
        np.testing.assert_array_equal(chart.vertices, V[chart.vertex_ids])
        np.testing.assert_allclose(face_areas(chart.vertices, chart.triangles), face_areas(V, F)[chart.faces])
        assert len(boundary_loops(chart.disk)) == 1


def test_disks_are_not_cut():
    found = cut_to_disks(triangle_surface(*meshes.bumpy()))
    assert len(found.charts) == 1 and len(found.cuts.edges) == 0 and not found.warnings


def test_a_filled_hole_leaves_the_faces_and_adds_a_fan():
    V, F = meshes.annulus(12, 2)
    (chart,) = cut_to_disks(triangle_surface(V, F), fill_holes=True).charts
    assert len(chart.triangles) == len(F) and len(chart.patches) == 12
    assert (chart.vertex_ids == -1).sum() == 1
    np.testing.assert_allclose(
        chart.vertices[chart.vertex_ids == -1], [V[np.linalg.norm(V, axis=1) < 1.4].mean(0)], atol=1e-12
    )


@pytest.mark.parametrize("options", [{}, {"fill_holes": True}, {"sieve": 0}])
def test_what_is_repaired_is_said_whether_seams_are_added_or_not(options):
    V, F = meshes.bumpy(6, 5)
    F = np.concatenate([F, F[[7], ::-1]])
    (plain,), (kept,) = (
        cut_to_disks(triangle_surface(V, F), seams=s, **options).warnings for s in ("auto", "existing")
    )
    assert plain == kept


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e307])
@pytest.mark.parametrize("offset", [[0, 0, 0], [3, -1, 2]])
def test_lines_are_no_area_wherever_they_lie_and_however_large_they_are(scale, offset):
    way = np.array([1.0, 2.0, -0.5])
    lines = scale * (np.array([0.0, 1.0, 3.0])[None, :, None] * way + np.array(offset))
    lines = np.concatenate([lines, scale * np.array(offset, float) + np.zeros((1, 3, 3))])
    assert disk_charts_module._all_lines(lines)
    wide = lines.copy()
    wide[0, 2, 0] += 2 * scale
    assert not disk_charts_module._all_lines(wide)
