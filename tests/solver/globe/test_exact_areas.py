"""Areas of a laid out sphere corrected: those that are right stay, the others come nearer, fixed points stay."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from sphere_shapes import random_sphere

from omt_uv.solver.globe import exact_areas
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


def test_faces_at_a_pole_keep_what_they_have_and_what_folds_beside_it_gets_the_area_of_its_image():
    P, F = random_sphere(900, 1)
    polygons = triangle_polygons(F)
    unfolded, points = unfold(P, polygons, EQUIRECT)
    moved = unfolded.uv.copy()
    # All rows in the place of the row opposite: every face is folded.
    moved[:, 1] = 1 - moved[:, 1]
    turned = unfolded.with_points(moved)
    straight = signed_areas(turned.corners(), polygons.triangles)
    target = equirectangular_areas(points, turned, polygons)
    at_pole = turned.poles[turned.index][polygons.triangles].any(axis=1)
    assert 0 < at_pole.sum() < len(F) and (straight < 0).mean() > 0.9
    np.testing.assert_array_equal(target[at_pole], straight[at_pole])
    assert (target[~at_pole] > 0).all()


def test_lengths_on_the_sphere_are_those_of_the_projection():
    """Squared lengths of the unit directions beside differences of the points that a cylinder stands for."""
    rng = np.random.default_rng(0)
    uv = np.column_stack([rng.random(40), np.linspace(0.1, 0.9, 40)])
    unfolded = SimpleNamespace(uv=uv, poles=np.zeros(40, bool))
    sines = {EQUIRECT: lambda v: np.sin(np.pi * (v - 0.5)), LAMBERT: lambda v: 2 * v - 1}

    def point(uv, sine):
        z = sine(uv[:, 1])
        return np.column_stack([np.sqrt(1 - z * z) * f(2 * np.pi * uv[:, 0]) for f in (np.cos, np.sin)] + [z])

    for projection, sine in sines.items():
        found = exact_areas._sphere_metric(unfolded, projection)
        for axis, step in enumerate(1e-6 * np.eye(2)):
            true = (((point(uv + step, sine) - point(uv - step, sine)) / 2e-6) ** 2).sum(axis=1)
            inside = slice(2, -2)
            np.testing.assert_allclose(found[inside, axis], true[inside], rtol=1e-5)
    np.testing.assert_allclose(exact_areas._sphere_metric(unfolded, OCTAHEDRAL), 4 * np.pi)


def test_a_step_that_presses_a_globe_flat_is_none():
    """As small globes have them: without an error, and never taken."""
    P, F = random_sphere(20)
    polygons = triangle_polygons(F)
    unfolded, _ = unfold(P, polygons, LAMBERT)
    shares = spherical_areas(P, F) / (4 * np.pi)
    metric = exact_areas._sphere_metric(unfolded, LAMBERT)
    problem = exact_areas._AreaProblem(unfolded, polygons, shares, metric, True)
    with np.errstate(all="raise"):
        assert problem.energy(0 * unfolded.uv) == np.inf
        assert problem.energy(unfolded.uv) < np.inf


class Overshooting:
    """The squared distance from 0, with steps that go much too far unless they are damped."""

    order = None

    def __init__(self, factor):
        self.factor, self.tried = factor, []

    def energy(self, uv):
        self.tried.append(float((uv**2).sum()))
        return self.tried[-1]

    def step(self, uv, damping, order):
        return -self.factor * uv / (1 + damping)

    def within(self, uv):
        return uv


@pytest.mark.parametrize("factor", [1.0, 3.0, 30.0, 1000.0])
def test_steps_that_lower_nothing_are_damped_until_they_do(factor):
    problem = Overshooting(factor)
    start = np.array([[3.0, -4.0]])
    found, rounds = drain(exact_areas._levenberg_marquardt(problem, start, 0.0))
    assert (found**2).sum() < 1e-3 * (start**2).sum() and 0 < rounds <= 14
    # What comes out is the least that was seen.
    assert (found**2).sum() == min(problem.tried)
