"""Areas of a laid out sphere corrected: those that are right stay, the others come nearer, fixed points stay."""

from __future__ import annotations

import numpy as np
import pytest
from sphere_shapes import random_sphere

from omt_uv.solver.globe.exact_areas import correct_areas, equirectangular_areas
from omt_uv.solver.globe.projections import EQUIRECT, LAMBERT, OCTAHEDRAL, PROJECTIONS
from omt_uv.solver.globe.unfolding import Polygons, unfold
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.mesh.spherical_geometry import spherical_areas
from omt_uv.solver.progress import drain


def triangle_polygons(F):
    m = len(F)
    return Polygons(F.ravel(), np.repeat(np.arange(m), 3), np.arange(3 * m).reshape(m, 3))


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_areas_that_are_right_already_stay(projection):
    P, F = random_sphere(400)
    polygons = triangle_polygons(F)
    unfolded, _ = unfold(P, polygons, projection)
    areas = signed_areas(unfolded.corners(), polygons.triangles)
    # Faces that the layout folds have no share to keep.
    if areas.min() <= 0:
        unfolded = drain(correct_areas(unfolded, polygons, spherical_areas(P, F), projection)).unfolding
        areas = signed_areas(unfolded.corners(), polygons.triangles)
    shares = np.maximum(areas / areas.sum(), 2e-4 / len(areas))
    found = drain(correct_areas(unfolded, polygons, shares / shares.sum(), projection))
    assert found.residual < 1e-4 and found.status == "converged" and not len(found.folded)
    np.testing.assert_allclose(found.unfolding.uv, unfolded.uv, atol=1e-3)


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_fixed_points_stay_and_what_is_left_is_reported(projection):
    P, F = random_sphere(400)
    polygons = triangle_polygons(F)
    unfolded, _ = unfold(P, polygons, projection)
    shares = spherical_areas(P, F) / (4 * np.pi)
    found = drain(correct_areas(unfolded, polygons, shares, projection))
    np.testing.assert_array_equal(found.unfolding.uv[unfolded.fixed], unfolded.uv[unfolded.fixed])
    areas = signed_areas(found.unfolding.corners(), polygons.triangles)
    np.testing.assert_allclose(found.residual, np.abs(areas / areas.sum() - shares).sum(), rtol=1e-3, atol=1e-9)
    before = signed_areas(unfolded.corners(), polygons.triangles)
    assert found.residual < np.abs(before / before.sum() - shares).sum()


@pytest.mark.parametrize("projection", [LAMBERT, OCTAHEDRAL])
def test_shares_are_relative(projection):
    P, F = random_sphere(200)
    polygons = triangle_polygons(F)
    unfolded, _ = unfold(P, polygons, projection)
    found, scaled = (
        drain(correct_areas(unfolded, polygons, s * spherical_areas(P, F), projection)).unfolding for s in (1, 8)
    )
    np.testing.assert_array_equal(found.uv, scaled.uv)


def test_equirectangular_faces_keep_the_areas_of_their_images():
    """Far from the poles a target is the area of the straight triangle, near to them that of the curved one."""
    P, F = random_sphere(900, 1)
    polygons = triangle_polygons(F)
    unfolded, points = unfold(P, polygons, EQUIRECT)
    target = equirectangular_areas(points, unfolded, polygons)
    straight = signed_areas(unfolded.corners(), polygons.triangles)
    assert target.min() > 0
    middle = np.abs(points[F][..., 2]).max(axis=1) < 0.8
    np.testing.assert_array_equal(target[middle], straight[middle])
    # The square has the area 1; what is missing is at the poles, where half of every row is covered.
    assert 0.9 < target.sum() < 1
