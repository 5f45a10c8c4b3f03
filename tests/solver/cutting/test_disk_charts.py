"""Any mesh becomes disks, without a face more or less."""

import meshes
import numpy as np
import pytest

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
