"""Copies of patches are as the mesh at first; what is put back is the best copy, and nothing else changes."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint, ClosestPointTracker
from omt_uv.solver.mesh.topology import halfedges, pair_keys
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.fitting.closest_pairs import Pairing
from omt_uv.solver.remeshing.fitting.fit_state import FitState
from omt_uv.solver.remeshing.fitting.local_trials import (
    NORM,
    TrialBatch,
    acceptable,
    distance_norms,
    find_peaks,
    patch_shapes,
    put_best_back,
)
from omt_uv.solver.remeshing.fitting.ring_patches import cut_patches, spaced_faces
from omt_uv.solver.remeshing.relaxation.surface_samples import area_samples

COPIES = 3


@pytest.fixture
def setting():
    V, F = meshes.icosphere(4)
    P, Q = meshes.icosphere(3)
    index = ClosestPoint(V * [1, 1, 1.3], F, 0.15)
    samples = area_samples(index, 6 * len(P), np.ones(len(F)))
    mesh = WorkingMesh(P * [1, 1, 1.3], Q, np.zeros(len(P), dtype=bool), np.zeros(0, np.int64))
    state = FitState(mesh, Pairing(index, samples), np.ones(len(F)), ClosestPointTracker(6))
    pairs = state.pairs()
    middle = spaced_faces(Q, np.arange(len(Q)), len(P), 4, 5)
    return state, pairs, cut_patches(Q, middle, len(P), 1)


def test_peaks_are_the_largest_distances(setting):
    state, pairs, patches = setting
    peaks = find_peaks(state, pairs, patches)
    largest = pairs.largest_distance(len(state.triangles))[patches.faces]
    for p in range(len(patches)):
        mine = patches.of_face == p
        assert mine[peaks.face[p]] and largest[peaks.face[p]] == largest[mine].max()
    assert np.isin(pairs.faces[peaks.samples], patches.faces).all()
    np.testing.assert_array_equal(patches.faces[peaks.sample_faces], pairs.faces[peaks.samples])


def test_copies_are_as_the_mesh(setting):
    state, pairs, patches = setting
    batch = TrialBatch(state, find_peaks(state, pairs, patches), COPIES)
    trial = batch.mesh()
    p, v = len(patches), len(patches.vertices)
    np.testing.assert_array_equal(
        trial.points.reshape(COPIES, v, 3), np.stack([state.points[patches.vertices]] * COPIES)
    )
    norm = distance_norms(trial.pairs(), len(batch.owner), batch.owner, COPIES * p).reshape(COPIES, p)
    np.testing.assert_allclose(norm[1:], norm[:-1])
    shape = patch_shapes(trial.points, trial.triangles, batch.owner, p)
    assert shape.angle.shape == (COPIES, p) and acceptable(shape, shape).all()


def test_features_and_edges_that_were_flipped_stay_from_then_on(setting):
    state, pairs, patches = setting
    keys = np.unique(pair_keys(*halfedges(state.triangles)))
    state = FitState(
        WorkingMesh(state.points, state.triangles, np.zeros(len(state.points), dtype=bool), keys[::3]),
        state.pairing, np.ones(len(state.pairing.index.triangles)), ClosestPointTracker(6))  # fmt: skip
    batch = TrialBatch(state, find_peaks(state, pairs, patches))
    before, edges = batch.locked, pair_keys(*halfedges(batch.triangles))
    batch.vary()
    new = np.setdiff1d(pair_keys(*halfedges(batch.triangles)), edges)
    assert len(before) and len(new)
    np.testing.assert_array_equal(batch.locked, np.union1d(before, new))


def test_the_best_copy_is_put_back_and_the_rest_stays(setting):
    state, pairs, patches = setting
    batch = TrialBatch(state, find_peaks(state, pairs, patches), COPIES)
    trial = batch.mesh()
    v = len(patches.vertices)
    free = ~patches.outer
    moved = trial.points.reshape(COPIES, v, 3).copy()
    moved[2, free] *= 1.001
    trial.place(moved.reshape(-1, 3))
    after = trial.pairs()
    best = np.full(len(patches), -1)
    best[1] = 2
    points, distance = state.points.copy(), pairs.distance.copy()
    put_best_back(batch, trial, after, pairs, best)
    mine = patches.vertices[free & (patches.of_vertex == 1)]
    np.testing.assert_array_equal(np.flatnonzero((state.points != points).any(axis=1)), np.sort(mine))
    np.testing.assert_allclose(state.points[mine], 1.001 * points[mine])
    elsewhere = ~np.isin(pairs.faces, patches.faces[patches.of_face == 1])
    np.testing.assert_array_equal(pairs.distance[elsewhere], distance[elsewhere])
    # The pairs put back are those of the mesh as it is now.
    fresh = state.pairs()
    there = np.isin(pairs.faces[: -len(points)], patches.faces[patches.of_face == 1])
    np.testing.assert_allclose(pairs.distance[: -len(points)][there], fresh.distance[: -len(points)][there], atol=1e-9)


def test_norms_are_between_the_largest_and_their_sum(setting):
    state, pairs, patches = setting
    owner = np.full(len(state.triangles), -1)
    owner[patches.faces] = patches.of_face
    norm = distance_norms(pairs, len(owner), owner, len(patches))
    largest = pairs.largest_distance(len(owner))
    for p in range(len(patches)):
        values = largest[owner == p]
        assert norm[p] == pytest.approx((values**NORM).sum() ** (1 / NORM))
