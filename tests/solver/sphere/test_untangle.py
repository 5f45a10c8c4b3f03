"""Folds on the sphere straightened: where there are some, and nowhere else."""

from __future__ import annotations

import numpy as np
import pytest
from sphere_shapes import random_sphere

from omt_uv.solver.maps.energy import elements
from omt_uv.solver.mesh.spherical_geometry import signed_volumes, spherical_areas
from omt_uv.solver.mesh.topology import vertices_around
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.hessian_blocks import Assembly
from omt_uv.solver.sphere.untangle import RINGS, straighten_around, untangle_locally, untangle_on_sphere, untangle_spots


def folded_sphere():
    """A mesh of the sphere, and a map of it to itself in which one vertex lies beyond its neighbours."""
    P, F = random_sphere(400)
    tangled = P.copy()
    neighbours = np.setdiff1d(np.unique(F[(F == 7).any(axis=1)]), 7)
    tangled[7] = 2.2 * P[neighbours[0]] - 1.2 * P[7]
    tangled[7] /= np.linalg.norm(tangled[7])
    assert signed_volumes(tangled, F).min() < 0
    return P, F, tangled


def test_folds_are_straightened_and_all_else_stays_to_the_bit():
    P, F, tangled = folded_sphere()
    found = drain(untangle_locally(P, F, tangled))
    assert signed_volumes(found, F).min() > 0
    touched = vertices_around(F, signed_volumes(tangled, F) <= 0, len(P), RINGS)
    np.testing.assert_array_equal(found[~touched], tangled[~touched])
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1, atol=1e-14)
    np.testing.assert_allclose(spherical_areas(found, F).sum(), 4 * np.pi, rtol=1e-12)


@pytest.mark.parametrize("rings", [1, 2])
@pytest.mark.parametrize("given", [False, True])
def test_spots_are_straightened_one_without_the_other(rings, given):
    """Two spots, of which one is held, so that both at once fail: the other is straightened alone."""
    P, F, tangled = folded_sphere()
    far = int((P @ P[7]).argmin())
    neighbours = np.setdiff1d(np.unique(F[(far == F).any(axis=1)]), far)
    tangled[far] = 2.2 * P[neighbours[0]] - 1.2 * P[far]
    tangled[far] /= np.linalg.norm(tangled[far])
    near = vertices_around(F, (far == F).any(axis=1), len(P), rings + 1)
    held, area = near.copy(), spherical_areas(P, F) if given else None
    found = drain(untangle_spots(P, F, tangled, held, rings, area))
    folded, touched = signed_volumes(found, F) <= 0, vertices_around(F, signed_volumes(tangled, F) <= 0, len(P), rings)
    assert folded.any() and near[F[folded]].all()
    np.testing.assert_allclose(found[held | ~touched], tangled[held | ~touched], atol=1e-15)
    free = drain(untangle_spots(P, F, tangled, np.zeros(len(P), bool), rings, area))
    assert (signed_volumes(free, F) > 0).all()
    np.testing.assert_allclose(free[~touched], tangled[~touched], atol=1e-15)


def test_only_free_vertices_move():
    P, F, tangled = folded_sphere()
    free = np.arange(len(P)) == 7
    found = drain(straighten_around(P, F, tangled, spherical_areas(P, F), free))
    np.testing.assert_array_equal(found[~free], P[~free])
    assert signed_volumes(found, F).min() > 0


def test_without_folds_nothing_is_done():
    P, F = random_sphere(100)
    area = spherical_areas(P, F)
    found, steps = drain(untangle_on_sphere(elements(P, F, area), Assembly(F, len(P)), P))
    assert steps == 0 and found is P


def test_rings_grow_by_neighbours():
    _, F = random_sphere(400)
    distance = np.full(400, 99)
    distance[F[0]] = 0
    for _ in range(400):
        np.minimum.at(distance, F.ravel(), np.repeat(distance[F].min(axis=1) + 1, 3))
    for rings in (0, 1, 4):
        found = vertices_around(F, np.arange(len(F)) == 0, 400, rings)
        np.testing.assert_array_equal(found, distance <= rings)
