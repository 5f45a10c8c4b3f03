"""Points spread on the sphere are even, and the map to it keeps areas."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial.sphere_samples import sample_sphere, sphere_image, spread_on_sphere
from omt_uv.solver.sphere.conformal import conformal_sphere


def test_points_are_unit_vectors_and_even():
    points = spread_on_sphere(400)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 1)
    assert np.linalg.norm(points.mean(axis=0)) < 1e-3
    gap = np.linalg.norm(points[:, None] - points, axis=2) + 9 * np.eye(400)
    assert gap.min(axis=1).std() < 0.1 * gap.min(axis=1).mean()


def test_areas_times_density_are_kept():
    V, F = meshes.icosphere(3)
    density = np.where(V[F].mean(axis=1)[:, 2] > 0, 4.0, 1.0)
    image = drain(sphere_image(V, F, drain(conformal_sphere(V, F)), density))
    mass, area = vertex_areas(V, F, density), vertex_areas(image, F)
    assert np.abs(area / area.sum() - mass / mass.sum()).sum() < 0.05
    samples = sample_sphere(V, F, image, V, 400)
    above = samples.points[:, 2] > 0
    assert len(samples.triangles) == 2 * 400 - 4 and abs(above.mean() - 0.8) < 0.02
