"""Flows of stream functions: tangent to the sphere, without divergence, and the best of them."""

from __future__ import annotations

import numpy as np
from meshes import icosphere
from sphere_shapes import random_sphere

from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.sphere.stream_functions import advect, best_flow, bump_basis, bump_pairs, velocity


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
