"""The flow of Dominitz and Tannenbaum: Moser's map carries measures exactly, and the descent keeps them."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import icosphere
from scipy.spatial import ConvexHull

from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.dominitz_tannenbaum import flow_map, reduce_cost
from omt_uv.solver.sphere.moser_flow import advect_points, edge_fluxes, moser_map
from omt_uv.solver.sphere.stream_functions import advect, best_flow, bump_basis, bump_pairs, velocity


def random_sphere(count=500, seed=0):
    P = np.random.default_rng(seed).normal(size=(count, 3))
    P /= np.linalg.norm(P, axis=1, keepdims=True)
    F = ConvexHull(P).simplices.astype(np.int64)
    inward = signed_volumes(P, F) < 0
    F[inward] = F[inward][:, [0, 2, 1]]
    return P, F


def lopsided(P, F, contrast=2.0):
    """Masses (m,) of the faces, 4 pi in all, many times larger on one side."""
    mass = spherical_areas(P, F) * np.exp(contrast * P[F].mean(axis=1) @ [0.2, 0.5, 0.8])
    return mass * (4 * np.pi / mass.sum())


def turned(seed=3):
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


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
    mass, R = lopsided(P, F), turned()
    assert np.allclose(
        drain(moser_map(P @ R.T, F, mass)).positions, drain(moser_map(P, F, mass)).positions @ R.T, atol=1e-9
    )


def test_stream_functions_move_along_the_sphere_and_keep_areas():
    basis = bump_basis(60)
    coefficients = 0.03 * np.random.default_rng(0).normal(size=60)
    P, _ = random_sphere(400)
    v = velocity(P, basis, bump_pairs(P, basis), coefficients)
    assert np.abs((v * P).sum(axis=1)).max() < 1e-12
    corners = P[:, None] + 1e-5 * np.random.default_rng(1).normal(size=(len(P), 3, 3))
    corners = (corners / np.linalg.norm(corners, axis=2, keepdims=True)).reshape(-1, 3)
    moved = advect(corners, basis, bump_pairs(corners, basis), coefficients)
    assert np.linalg.norm(moved - corners, axis=1).max() > 0.02
    tiny = np.arange(len(corners)).reshape(-1, 3)
    before, after = (signed_volumes(x, tiny) for x in (corners, moved))
    assert np.abs(after / before - 1)[np.abs(before) > 1e-11].max() < 1e-2


def test_the_best_flow_finds_a_flow_and_no_gradient():
    P, F = icosphere(4)
    basis = bump_basis(60)
    mass = np.bincount(F.ravel(), np.repeat(spherical_areas(P, F) / 3, 3))
    pairs = bump_pairs(P, basis)
    target = velocity(P, basis, pairs, np.random.default_rng(0).normal(size=60))
    found = velocity(P, basis, pairs, best_flow(P, mass, target, basis, pairs))
    assert np.linalg.norm(found - target) < 0.1 * np.linalg.norm(target)
    gradient = np.array([0, 0, 1.0]) - P[:, 2:] * P
    found = velocity(P, basis, pairs, best_flow(P, mass, gradient, basis, pairs))
    assert np.linalg.norm(found) < 1e-2 * np.linalg.norm(gradient)


def test_the_descent_undoes_a_stir():
    """Of a map that is optimal but for a flow without divergence, most of the cost of that flow comes back."""
    P, F = icosphere(4)
    basis = bump_basis(24)
    stirred = advect(P, basis, bump_pairs(P, basis), 0.03 * np.random.default_rng(0).normal(size=24))
    weight = np.bincount(F.ravel(), np.repeat(spherical_areas(P, F) / 3, 3))
    found, costs = drain(reduce_cost(stirred, P, F, weight))
    assert (np.diff(costs) < 0).all()
    assert costs[-1] < 0.1 * costs[0]
    assert np.linalg.norm(found - P, axis=1).mean() < 0.35 * np.linalg.norm(stirred - P, axis=1).mean()
    drift = np.abs(spherical_areas(found, F) - spherical_areas(stirred, F)).sum() / (4 * np.pi)
    assert drift < 0.02


def test_the_whole_flow_gives_faces_their_masses():
    P, F = random_sphere(900)
    mass = lopsided(P, F, 3.0)
    found = drain(flow_map(P, F, mass))
    share = spherical_areas(found.positions, F) / (4 * np.pi)
    before = np.abs(spherical_areas(P, F) / (4 * np.pi) - mass / mass.sum()).sum()
    assert np.abs(share - mass / mass.sum()).sum() < 0.15 * before
    assert found.drift < 0.05 and (np.diff(found.costs) < 0).all()
    assert np.allclose(np.linalg.norm(found.positions, axis=1), 1)
