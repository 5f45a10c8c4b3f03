"""Moser's flow: fluxes balance, masses are carried exactly, and rotations do not count."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import icosphere
from sphere_shapes import lopsided, random_rotation, random_sphere

from omt_uv.solver.mesh.spherical_geometry import spherical_areas
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere import moser_flow
from omt_uv.solver.sphere.moser_flow import advect_points, edge_fluxes, moser_map


def test_fluxes_leave_one_face_as_they_enter_the_next():
    P, F = random_sphere()
    gain = lopsided(P, F) - spherical_areas(P, F)
    flux = edge_fluxes(P, F, gain)
    assert np.allclose(flux.sum(axis=1), gain, atol=1e-13)
    # Of halfedge k + 1 the flux across the side opposite to corner k.
    out = np.empty(3 * len(F))
    out[3 * np.arange(len(F))[:, None] + [1, 2, 0]] = flux
    assert np.allclose(out, -out[twins(F)], atol=1e-13)


def test_points_spread_by_mass_arrive_spread_by_area():
    """The flow is exact for every face: what is left is the noise of a sample."""
    P, F = random_sphere(300)
    first, last = lopsided(P, F), spherical_areas(P, F)
    rng, count = np.random.default_rng(0), 40_000
    face = rng.choice(len(F), count, p=first / first.sum())
    cut = np.sort(rng.random((count, 2)), axis=1)
    weights = np.column_stack([cut[:, 0], cut[:, 1] - cut[:, 0], 1 - cut[:, 1]])
    flux = edge_fluxes(P, F, first - last)
    face, weights, rounds, stuck = drain(advect_points(F, flux, first, last, face, weights))
    assert stuck == 0 and rounds > 1
    assert (weights >= 0).all() and np.allclose(weights.sum(axis=1), 1)
    expected = count * last / last.sum()
    chi = ((np.bincount(face, minlength=len(F)) - expected) ** 2 / expected).sum()
    # Mean m - 1, variance 2 (m - 1): five standard deviations.
    assert abs(chi - len(F)) < 5 * np.sqrt(2 * len(F))


@pytest.mark.parametrize("make", [random_sphere, lambda: icosphere(3)])
def test_nothing_moves_where_nothing_has_to(make):
    P, F = make()
    moved = drain(moser_map(P, F, spherical_areas(P, F))).positions
    assert np.abs(moved - P).max() < 1e-9


def test_a_density_of_the_latitude_has_a_closed_solution():
    """Density 1 + a z: circles of latitude move to where as much lies below them."""
    P, F = icosphere(4)
    a = 0.8
    z = P[F].mean(axis=1)[:, 2]
    mass = spherical_areas(P, F) * (1 + a * z)
    moved = drain(moser_map(P, F, mass)).positions
    exact = P[:, 2] + a * (P[:, 2] ** 2 - 1) / 2
    assert np.abs(moved[:, 2] - exact).max() < 0.01
    # Along the meridians: no turning about the axis.
    turn = np.cross(P[:, :2], moved[:, :2]) / np.maximum(np.linalg.norm(P[:, :2], axis=1), 0.2) ** 2
    assert np.abs(turn).max() < 0.02


def test_moser_turns_with_the_sphere():
    P, F = random_sphere()
    mass, R = lopsided(P, F), random_rotation(3)
    assert np.allclose(
        drain(moser_map(P @ R.T, F, mass)).positions, drain(moser_map(P, F, mass)).positions @ R.T, atol=1e-9
    )


@pytest.mark.parametrize("most", [0, 1, 3])
def test_points_that_cross_too_many_faces_are_counted(most, monkeypatch):
    P, F = random_sphere(100)
    first, last = lopsided(P, F), spherical_areas(P, F)
    flux = edge_fluxes(P, F, first - last)
    start, middle = np.arange(len(F)), np.full((len(F), 3), 1 / 3)
    whole = drain(advect_points(F, flux, first, last, start, middle))
    monkeypatch.setattr(moser_flow, "CROSSINGS", most)
    face, weights, rounds, stuck = drain(advect_points(F, flux, first, last, start, middle))
    assert rounds == most < whole[2] and whole[3] == 0 < stuck <= len(F)
    assert stuck == len(F) or most > 0
    assert most > 0 or (np.array_equal(face, start) and np.array_equal(weights, middle))
