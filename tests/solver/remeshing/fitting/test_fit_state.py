"""A state moves vertices towards the surface, leaves fixed ones alone, and takes patches over from another one."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint, ClosestPointTracker
from omt_uv.solver.mesh.topology import twins
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.fitting.closest_pairs import DENSE, Pairing
from omt_uv.solver.remeshing.fitting.fit_state import TETHER, FitState, PatchSource
from omt_uv.solver.remeshing.relaxation.surface_samples import area_samples, select_samples


def state_of(fixed=()):
    V, F = meshes.icosphere(4)
    P, Q = meshes.icosphere(2)
    index = ClosestPoint(V, F, 0.28)
    samples = area_samples(index, 6 * len(P), np.ones(len(F)))
    mesh = WorkingMesh(P, Q, np.isin(np.arange(len(P)), fixed), np.zeros(0, np.int64))
    return FitState(mesh, Pairing(index, samples), np.ones(len(F)), ClosestPointTracker(6))


def test_a_step_halves_the_distance_of_a_sphere():
    state = state_of(fixed=[0, 1])
    before = state.pairs().rms
    assert state.step() and state.recent.rms == pytest.approx(before)
    assert state.pairs().rms < 0.6 * before
    np.testing.assert_array_equal(state.points[:2], state.start.points[:2])
    assert np.linalg.norm(state.points - state.on.points, axis=1).max() <= TETHER * 0.28 * (1 + 1e-9)
    np.testing.assert_array_equal(state.twin, twins(state.triangles))
    assert state.mesh.points is state.points and state.mesh.locked is state.start.locked


def test_more_samples_are_paired_from_then_on():
    state = state_of()
    first = state.pairs()
    extra = select_samples(state.pairing.samples, np.arange(5))
    state.add_samples(extra, DENSE)
    pairs = state.pairs()
    assert pairs.sample_count == first.sample_count + 5 and pairs.place_count == len(DENSE) * len(state.triangles)
    np.testing.assert_allclose(pairs.distance[-5 - pairs.place_count - len(state.points) :][:5], first.distance[:5])


def test_patches_of_another_state_replace_ones_own():
    one, other = state_of(), state_of()
    pairs = one.pairs()
    other.place(1.02 * other.points)
    other.pairs()
    faces = np.flatnonzero((one.triangles == 5).any(axis=1))
    source = PatchSource(np.array([5]), np.array([5]), faces, faces, one.triangles[faces])
    points, on = one.points.copy(), one.on.points.copy()
    one.take_over(other, source, pairs)
    changed = np.flatnonzero((one.points != points).any(axis=1))
    np.testing.assert_array_equal(changed, [5])
    np.testing.assert_array_equal(one.points[5], other.points[5])
    np.testing.assert_array_equal(one.on.points[5], other.on.points[5])
    np.testing.assert_array_equal(np.delete(one.on.points, 5, axis=0), np.delete(on, 5, axis=0))
    np.testing.assert_array_equal(one.twin, twins(one.triangles))
