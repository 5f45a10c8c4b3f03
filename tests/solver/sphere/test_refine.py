"""Refinement on the sphere: folds straightened, rotations kept, one map from any start."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from sphere_shapes import blob, creature, lopsided, random_rotation, random_sphere

from omt_uv.solver.linalg.sparse import Factor, minimum_degree
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import normalized, signed_volumes, spherical_areas
from omt_uv.solver.progress import Progress, drain
from omt_uv.solver.sphere import newton, refine
from omt_uv.solver.sphere.multilevel import multilevel_start
from omt_uv.solver.sphere.refine import _equilateral, _renumbered, relax, sphere_refine
from omt_uv.solver.sphere.sphere_map import sphere_map


def test_both_starts_lead_to_the_same_shear():
    V, F = blob(2)
    area = face_areas(V, F)
    found = drain(sphere_map(V, F, quality="exact"))
    start, _ = drain(multilevel_start(V, F, area))
    other = drain(sphere_refine(V, F, start, area, quality="exact"))
    u, _, v = np.linalg.svd(found.positions.T @ other.positions)
    assert np.abs(found.positions @ u @ v - other.positions).max() < 0.05


@pytest.mark.parametrize("by", ["spots", "all at once"])
def test_folds_are_straightened(by, monkeypatch):
    """Spot by spot or, where that fails, by steps of all vertices."""
    if by == "all at once":
        monkeypatch.setattr(refine, "RINGS", ())
    V, F = blob()
    p = normalized(V)
    rng = np.random.default_rng(0)
    tangled = normalized(p + 0.05 * rng.normal(size=p.shape) * (rng.random((len(p), 1)) < 0.1))
    assert not (signed_volumes(tangled, F) > 0).all()
    found = drain(sphere_refine(V, F, tangled, face_areas(V, F)))
    assert (found.untangling > 0) == (by == "all at once") and (signed_volumes(found.positions, F) > 0).all()


def test_a_start_that_is_turned_leads_to_the_map_turned():
    P, F = random_sphere(200)
    target, R = lopsided(P, F, 1.0), random_rotation()
    found, turned = (drain(sphere_refine(P, F, start, target)) for start in (P, P @ R.T))
    np.testing.assert_allclose(turned.positions, found.positions @ R.T, atol=1e-7)
    assert turned.iterations == found.iterations


def test_units_of_length_and_of_area_do_not_count():
    P, F = random_sphere(200)
    target = lopsided(P, F, 1.0)
    found, other = (drain(sphere_refine(s * P, F, P, s * target)).positions for s in (1.0, 4.0))
    np.testing.assert_allclose(other, found, atol=1e-9)


def test_the_error_that_is_reported_is_that_of_the_map():
    P, F = random_sphere(200)
    target = lopsided(P, F, 1.0)
    found = drain(sphere_refine(P, F, P, target))
    share = target / target.sum()
    ratio = spherical_areas(found.positions, F) / (4 * np.pi * share)
    error = max(share @ np.abs(ratio - 1), np.sqrt(share @ (ratio - 1) ** 2))
    np.testing.assert_allclose(found.area_error, error, rtol=1e-9)
    assert found.status == "converged" and found.untangling == 0


def test_relaxing_folds_nothing_and_brings_areas_nearer():
    P, F = random_sphere(200)
    target = lopsided(P, F, 1.0)
    relaxed, steps = drain(relax(P, F, P, target))
    share = target / target.sum()
    before, after = (np.abs(spherical_areas(p, F) / (4 * np.pi) - share).sum() for p in (P, relaxed))
    assert steps > 0 and after < before and signed_volumes(relaxed, F).min() > 0


@pytest.mark.parametrize("balance", [-0.1, 1.1, np.nan])
def test_a_balance_lies_between_0_and_1(balance):
    P, F = random_sphere(60)
    with pytest.raises(ValueError, match="balance"):
        drain(sphere_refine(P, F, P, spherical_areas(P, F), balance=balance))


@pytest.mark.parametrize("balance, error, share, free", [
    (0.0, 0.5, 0.9, True), (0.0, 0.5, 0.0, False), (0.5, 0.5, 0.9, False), (0.0, 1e-9, 0.9, False)])  # fmt: skip
def test_a_symmetric_map_without_its_areas_gives_way_to_a_free_one_that_has_them(
    monkeypatch, balance, error, share, free
):
    P, F = random_sphere(200)
    plain = drain(sphere_refine(P, F, P, lopsided(P, F, 1.0), balance=balance))

    def symmetric(*_):
        yield Progress("Refinement", 0.5)
        return replace(plain, area_error=error, status="symmetric"), 7

    monkeypatch.setattr(refine, "find_symmetry", lambda *_: SimpleNamespace(images=None))
    monkeypatch.setattr(refine, "_symmetric", symmetric)
    monkeypatch.setattr(refine, "MUCH_LESS", 1e9 if share == 0 else refine.MUCH_LESS)
    found = drain(sphere_refine(P, F, P, lopsided(P, F, 1.0), balance=balance))
    assert (found.status != "symmetric") == free and found.untangling >= 7


def test_equilateral_faces_have_the_areas_and_gradients_of_such():
    V, F = meshes.icosphere(1)
    target = np.linspace(1, 3, len(F))
    problem, _ = _renumbered(V * [1, 2, 3], F, target)
    faces = _equilateral(problem)
    share = problem.target / problem.target.sum()
    np.testing.assert_allclose(faces.area, share)
    # The gradient of a hat function is one over the height, root(3) / 2 times the side.
    side = np.sqrt(problem.target)
    np.testing.assert_allclose(np.abs(faces.gradient), np.repeat(1 / (np.sqrt(0.75) * side)[:, None], 3, axis=1))
    np.testing.assert_allclose(faces.gradient.sum(axis=1), 0, atol=1e-12 * np.abs(faces.gradient).max())
    turn = faces.gradient[:, 1] / faces.gradient[:, 0]
    np.testing.assert_allclose(turn, np.exp(2j * np.pi / 3))
    np.testing.assert_array_equal(faces.triangles, problem.faces.triangles)


def test_factors_of_quads_are_as_sparse_as_an_order_of_their_own_makes_them(monkeypatch):
    """Ordered by triangles alone, what parts them along their diagonals parts no quads, and factors fill."""
    V, F = creature(12, 2, 2, 3)
    V = V - V.mean(0) + 0.1 * np.sin(V @ np.random.default_rng(1).normal(size=(3, 3)))
    filled = []

    def factor(matrix, order):
        vertices = minimum_degree(matrix[::2, ::2])
        found, least = Factor(matrix, order), Factor(matrix, (2 * vertices[:, None] + np.arange(2)).ravel())
        filled.append(found.entries / least.entries)
        return found

    start, _ = drain(multilevel_start(V, F, face_areas(V, F)))
    monkeypatch.setattr(newton, "Factor", factor)
    polygons = np.tile(np.arange(len(F) // 2), 2)
    drain(sphere_refine(V, F, start, face_areas(V, F), polygons=polygons, quality="draft"))
    assert filled and max(filled) < 1.5
