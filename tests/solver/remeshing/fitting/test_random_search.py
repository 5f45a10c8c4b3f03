"""Random moves lower the largest distance of a patch or leave it; its ring and all else stay."""

from __future__ import annotations

import meshes
import numpy as np
from mesh_checks import angles

from omt_uv.solver.mesh.closest_point import ClosestPoint, ClosestPointTracker
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.fitting.closest_pairs import Pairing
from omt_uv.solver.remeshing.fitting.fit_state import FitState
from omt_uv.solver.remeshing.fitting.random_search import MIN_ANGLE, search_randomly
from omt_uv.solver.remeshing.fitting.ring_patches import cut_patches, spaced_faces
from omt_uv.solver.remeshing.relaxation.surface_samples import area_samples


def run(seed):
    V, F = meshes.icosphere(4)
    P, Q = meshes.icosphere(2)
    index = ClosestPoint(V, F, 0.28)
    samples = area_samples(index, 20 * len(P), np.ones(len(F)))
    mesh = WorkingMesh(P, Q, np.zeros(len(P), dtype=bool), np.zeros(0, np.int64))
    state = FitState(mesh, Pairing(index, samples), np.ones(len(F)), ClosestPointTracker(6))
    pairs = state.pairs()
    before = pairs.largest_distance(len(Q))
    patches = cut_patches(Q, spaced_faces(Q, np.arange(len(Q)), len(P), 2, 4), len(P), 0)
    better = search_randomly(state, pairs, patches, 1e-4, np.random.default_rng(seed))
    return state, pairs, before, patches, better


def test_distances_fall_where_it_says_so_and_nothing_else_moves():
    state, pairs, before, patches, better = run(0)
    assert better.any()
    moved = (state.points != state.start.points).any(axis=1)
    inner = patches.vertices[~patches.outer & better[patches.of_vertex]]
    assert moved.any() and np.isin(np.flatnonzero(moved), inner).all()
    after = pairs.largest_distance(len(before))
    for p in np.flatnonzero(better):
        mine = patches.faces[patches.of_face == p]
        assert after[mine].max() < before[mine].max() * 1.001
    np.testing.assert_array_equal(state.triangles, state.start.triangles)
    least = [angles(w, state.triangles).min(axis=1) for w in (state.start.points, state.points)]
    assert (least[1] >= np.minimum(least[0], np.degrees(MIN_ANGLE)) - 1e-9).all()


def test_the_same_seed_gives_the_same_mesh():
    np.testing.assert_array_equal(run(3)[0].points, run(3)[0].points)
