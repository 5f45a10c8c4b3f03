"""What is nearest to points adds up to the whole surface; carried points are on it."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import face_areas, vertex_normals
from omt_uv.solver.remeshing.relaxation.surface_carrier import SurfaceCarrier


@pytest.fixture
def carrier():
    V, F = meshes.icosphere(3)
    density = np.where(V[F].mean(axis=1)[:, 2] > 0, 1.5, 0.5)
    return SurfaceCarrier(ClosestPoint(V, F, 0.3), density, 162)


def test_sums_are_those_of_the_surface(carrier):
    P, Q = meshes.icosphere(2)
    sums, crests = carrier.nearest_sums(P, vertex_normals(P, Q))
    V, F = carrier.index.vertices, carrier.index.triangles
    area = face_areas(V, F)
    assert sums.area.sum() == pytest.approx(area.sum(), rel=0.02)
    assert sums.mass.sum() == pytest.approx(area @ carrier.density**2, rel=0.02)
    assert carrier.measure.sum() == pytest.approx(area @ carrier.density, rel=1e-9)
    assert sums.area.min() >= 0 and crests.area.shape == (len(P),)
    near = carrier.nearest(P, vertex_normals(P, Q), np.ones(len(P)))
    assert len(near) == len(carrier.measure) and len(np.unique(near)) > 0.9 * len(P)


def test_closest_points_are_on_the_surface_with_its_density(carrier):
    P, Q = meshes.icosphere(2)
    for scale in (1.1, 1.05):
        found, density = carrier.closest(scale * P, vertex_normals(P, Q))
        assert np.abs(np.linalg.norm(found, axis=1) - 1).max() < 0.01
        above = np.abs(P[:, 2]) > 0.1
        np.testing.assert_array_equal(density[above], np.where(P[above, 2] > 0, 1.5, 0.5))


def test_points_on_the_surface_begin_where_they_are_and_only_others_are_searched_for(carrier, monkeypatch):
    P, Q = meshes.icosphere(2)
    normals = vertex_normals(P, Q)
    on, _ = carrier.closest(P, normals)
    faces = carrier.faces
    asked = []
    search = ClosestPoint.__call__

    def counting(index, points, *words):
        asked.append(len(points))
        return search(index, points, *words)

    monkeypatch.setattr(ClosestPoint, "__call__", counting)
    # Some left the surface, and some of these are said to be on the far side.
    points, near = on.copy(), faces.copy()
    points[:7] *= 1.2
    near[:3] = faces[::-1][:3]
    carrier.begin_at(points, normals, near)
    assert asked == [7]
    np.testing.assert_array_equal(carrier.faces[7:], faces[7:])
    found, _ = carrier.closest(points, normals)
    np.testing.assert_allclose(found, search(carrier.index, points, normals).points, atol=1e-12)
    assert asked == [7]
    carrier.begin_at(points[:5], normals[:5], None)
    assert asked == [7, 5] and len(carrier.faces) == 5
