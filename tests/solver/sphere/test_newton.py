"""Newton on the sphere: faces in tangent planes, slopes that are derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from sphere_shapes import blob, creature, lopsided, random_rotation, random_sphere

from omt_uv.solver.maps.energy import area_forms_of, derivatives_of, elements
from omt_uv.solver.maps.polygon_elements import polygon_elements, with_convex_quads_of
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import normalized, signed_volumes, spherical_areas
from omt_uv.solver.refinement.hessian_blocks import Assembly, assembly_of
from omt_uv.solver.sphere import newton
from omt_uv.solver.sphere.newton import SphereProblem, derivatives, newton_direction, project_faces, retract, tangents


def test_the_slope_is_the_derivative():
    V, F = blob(1)
    target = face_areas(V, F)
    target *= 4 * np.pi / target.sum()
    faces = elements(V, F, target)
    problem = SphereProblem(faces, target, faces.ratio, Assembly(F, len(V)), 3.0)
    p = normalized(V)
    axes, face = tangents(p), project_faces(p, F)
    local = derivatives_of(faces, *derivatives(faces, face.corner), 3.0, 1.0)
    direction, slope = newton_direction(faces, problem.assembly, p, face, local)
    before, after = (problem.energy(retract(p, axes, s * direction)) for s in (-1e-6, 1e-6))
    np.testing.assert_allclose((after - before) / 2e-6, slope, rtol=1e-5)


def test_the_slope_of_quads_and_longer_polygons_is_the_derivative():
    V, F = creature(3, 0, 1, 0)
    V = V - V.mean(axis=0)
    owner = np.tile(np.arange(len(F) // 2), 2)
    owner[owner == 1] = 0
    faces = polygon_elements(V, F, face_areas(V, F), owner)
    assert len(faces.quads.convex) == len(F) // 2 - 2 and not faces.alone[:4].any()
    faces = with_convex_quads_of(faces, np.ones((len(faces.quads.convex), 4)))
    problem = SphereProblem(faces, faces.area * faces.ratio, faces.ratio, assembly_of(faces, len(V)), 3.0)
    p = normalized(V)
    axes, face = tangents(p), project_faces(p, faces.triangles)
    a, b = derivatives(faces, face.corner)
    local, area = derivatives_of(faces, a, b, 3.0, 1.0), area_forms_of(faces, a, b, 3.0)
    direction, slope = newton_direction(faces, problem.assembly, p, face, local, area=area)
    before, after = (problem.energy(retract(p, axes, s * direction)) for s in (-1e-6, 1e-6))
    np.testing.assert_allclose((after - before) / 2e-6, slope, rtol=1e-5)
    assert slope < 0 and problem.step(p, problem.energy(p), 1.0).share == 1.0


def test_projected_faces_have_the_area_of_their_determinant():
    """Of the area vector A, A . p_k = det / 2 for every corner, so A . c = 3 det / (2 |p_0 + p_1 + p_2|)."""
    P, F = random_sphere()
    z = project_faces(P, F).corner
    area = 0.5 * ((z[:, 1] - z[:, 0]).conj() * (z[:, 2] - z[:, 0])).imag
    np.testing.assert_allclose(area, 1.5 * signed_volumes(P, F) / np.linalg.norm(P[F].sum(axis=1), axis=1), atol=1e-15)


def test_projected_faces_turn_with_the_sphere():
    P, F = random_sphere()
    here, there = project_faces(P, F), project_faces(P @ random_rotation().T, F)
    np.testing.assert_allclose(there.corner, here.corner, atol=1e-13)
    np.testing.assert_allclose(there.axes, here.axes @ random_rotation().T, atol=1e-12)
    np.testing.assert_allclose(there.least_cosine, here.least_cosine, atol=1e-14)


def test_tangents_are_orthonormal_and_a_step_stays_on_the_sphere():
    P, _ = random_sphere()
    axes = np.concatenate([tangents(P), P[:, None]], axis=1)
    np.testing.assert_allclose(axes @ axes.transpose(0, 2, 1), np.broadcast_to(np.eye(3), axes.shape), atol=1e-15)
    np.testing.assert_allclose(np.linalg.det(axes), 1, atol=1e-14)
    step = np.random.default_rng(0).normal(size=(len(P), 2))
    np.testing.assert_allclose(np.linalg.norm(retract(P, tangents(P), step), axis=1), 1, atol=1e-15)
    np.testing.assert_allclose(retract(P, tangents(P), 0 * step), P, atol=1e-15)


def sphere_problem(P, F, target):
    faces = elements(P, F, target)
    return SphereProblem(faces=faces, target=target, ratio=faces.ratio, assembly=Assembly(F, len(P)), area_weight=3.0)


def test_no_error_where_areas_are_the_targets_and_no_energy_where_faces_are_folded():
    P, F = random_sphere()
    assert sphere_problem(P, F, spherical_areas(P, F)).area_error(P) < 1e-12
    problem = sphere_problem(P, F, lopsided(P, F))
    share, ratio = problem.target / problem.target.sum(), spherical_areas(P, F) / problem.target
    assert problem.area_error(P) >= share @ np.abs(ratio - 1) > 0.1
    assert np.isfinite(problem.energy(P)) and problem.energy(P * [1, 1, -1]) == np.inf


def test_fixed_vertices_stay_and_the_energy_falls():
    P, F = random_sphere(200)
    problem = sphere_problem(P, F, lopsided(P, F))
    face = project_faces(P, F)
    local = derivatives_of(problem.faces, *derivatives(problem.faces, face.corner), 3.0, 1.0)
    fixed = np.arange(len(P)) % 3 == 0
    direction, slope = newton_direction(problem.faces, problem.assembly, P, face, local, fixed)
    assert slope < 0 and (direction[fixed] == 0).all() and (direction[~fixed] != 0).any(axis=1).all()
    energy = problem.energy(P)
    step = problem.step(P, energy, 1.0)
    assert step.energy < energy


def test_one_folded_face_is_enough_for_no_energy():
    P, F = random_sphere(60)
    target = spherical_areas(P, F)
    faces = elements(P, F, target)
    problem = SphereProblem(faces, target, faces.ratio, Assembly(F, len(P)), 3.0)
    assert np.isfinite(problem.energy(P))
    # A vertex goes through one of its edges alone.
    p, (a, b, c) = P.copy(), F[0]
    middle = normalized((P[b] + P[c])[None])[0]
    for share in np.linspace(0, 1.5, 61):
        p[a] = normalized((P[a] + share * (middle - P[a]))[None])[0]
        folded = signed_volumes(p, F) <= 0
        assert np.isinf(problem.energy(p)) == folded.any()
    assert folded.any() and not folded.all()


@pytest.mark.parametrize("counts", [True, False])
def test_a_half_of_a_quad_that_does_not_count_holds_no_step_up(counts, monkeypatch):
    """What would fold at a thousandth of the step shortens it where it has a part in the energy, and only there."""
    V, F = creature(3, 0, 1, 0)
    V = V - V.mean(axis=0)
    faces = polygon_elements(V, F, face_areas(V, F), np.tile(np.arange(len(F) // 2), 2))
    none = faces.part == 0
    assert none.any() and not none.all()
    problem = SphereProblem(faces, faces.area * faces.ratio, faces.ratio, assembly_of(faces, len(V)), 3.0)
    monkeypatch.setattr(newton, "fold_shares", lambda *_: np.where(none != counts, 1e-3, np.inf))
    p = normalized(V)
    found = problem.step(p, problem.energy(p), 1.0)
    assert found.share > 0 and (found.share <= 1e-3) == counts
