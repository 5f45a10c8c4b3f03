"""Points spread on the sphere are even, and the map to it keeps areas."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import PrecisionError, TransportError
from omt_uv.solver.mesh.geometry import vertex_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial import sphere_samples as module
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


@pytest.mark.parametrize("wrong", [[], [[3]], [[3, 7], [0]], [[0], [0], [0]], [[1, 2], [5, 1], [4], [0, 3]]])
def test_samples_that_the_hull_has_no_room_for_go_and_all_others_stay(wrong, monkeypatch):
    """Every attempt numbers those that are left; points and triangles are of these."""
    V, F = meshes.icosphere(2)
    real, left, calls = module.by_hull, [np.arange(300)], []
    for rows in wrong:
        left.append(np.delete(left[-1], rows))

    def hull(points, weights):
        calls.append(points)
        assert len(points) == len(weights) and not weights.any()
        if len(calls) <= len(wrong):
            raise TransportError("Sites coincide", "", "vertex", np.array(wrong[len(calls) - 1]))
        return real(points, weights)

    whole = sample_sphere(V, F, V, V, 300)
    spread = spread_on_sphere(300)
    monkeypatch.setattr(module, "spread_on_sphere", lambda count: spread)
    monkeypatch.setattr(module, "by_hull", hull)
    found = sample_sphere(V, F, V, V, 300)
    assert [len(points) for points in calls] == [len(rows) for rows in left]
    np.testing.assert_array_equal(found.points, whole.points[left[-1]])
    assert len(found.triangles) == 2 * len(left[-1]) - 4 and found.triangles.max() == len(left[-1]) - 1


@pytest.mark.parametrize("each, attempts", [(6, 3), (3, 5), (1, 5), (0, 1), (16, 1)])
def test_where_too_many_go_or_none_does_it_is_refused(each, attempts, monkeypatch):
    """A twentieth may go, in five attempts."""
    V, F = meshes.icosphere(1)
    spread, calls = spread_on_sphere(300), []

    def hull(points, weights):
        calls.append(points)
        raise TransportError("Sites coincide", "", "vertex", np.arange(each))

    monkeypatch.setattr(module, "spread_on_sphere", lambda count: spread)
    monkeypatch.setattr(module, "by_hull", hull)
    with pytest.raises(PrecisionError, match="too close together"):
        sample_sphere(V, F, V, V, 300)
    assert len(calls) == attempts
