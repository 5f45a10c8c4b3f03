"""Distortion of several meshes as one: they share a texture."""

import meshes
import numpy as np
import pytest
from readings import reading, together

from omt_uv.pipelines.distortion import measure_readings, summary, triangles_of
from omt_uv.solver.errors import EmptyMeshError
from omt_uv.solver.maps.distortion import distortion


def bumps():
    V, F = meshes.bumpy(6, 6)
    return V, F, V[:, :2].astype(np.float32)


def test_several_readings_measure_as_one_mesh():
    V, F, uv = bumps()
    W, G = meshes.grid(3, 3)
    found = measure_readings([reading(V, F, uv), reading(W, G, 3 * W[:, :2])])
    V1, F1 = together((V, F), (W, G))
    assert found == distortion(V1, F1, np.concatenate([uv, 3 * W[:, :2].astype(np.float32)])[F1].astype(float))


def test_a_similarity_has_no_distortion():
    V, F = meshes.grid(4, 4)
    turned = V[:, :2] @ np.array([[0.6, 0.8], [-0.8, 0.6]]) * 0.25
    found = measure_readings([reading(V, F, turned)])
    assert found.area_l1 == pytest.approx(0, abs=1e-6) and found.angle_mean == pytest.approx(1, abs=1e-6)
    assert found.folds == 0 and found.overlap == 0 and found.charts == 1
    assert "Area error 0.00 %" in summary(found) and "shear 1.000" in summary(found)


def test_only_chosen_polygons_count():
    V, F, uv = bumps()
    faces = np.arange(len(F)) % 3 == 0
    found = triangles_of([reading(V, F, uv, faces), reading(V, F, uv, faces)])
    n, m = len(V), faces.sum()
    assert np.array_equal(found.triangles[:m], F[faces]) and np.array_equal(found.triangles[m:], F[faces] + n)
    assert np.array_equal(found.positions, np.concatenate([V, V]))
    assert np.array_equal(found.uv[:m], uv[F[faces]]) and np.array_equal(found.uv[m:], uv[F[faces]])
    assert np.array_equal(found.polygons[:m], np.flatnonzero(faces)) and len(np.unique(found.polygons)) == 2 * m
    # A mesh of which nothing is chosen needs no UVs.
    alone = measure_readings([reading(V, F, uv)])
    assert measure_readings([reading(V, F, None, np.zeros(len(F), bool)), reading(V, F, uv)]) == alone


def test_nothing_to_measure_is_an_error():
    V, F, uv = bumps()
    with pytest.raises(EmptyMeshError, match="no UVs"):
        measure_readings([reading(V, F)])
    with pytest.raises(EmptyMeshError, match="no faces"):
        measure_readings([reading(V, F, uv, np.zeros(len(F), bool))])
