"""Faces that are chosen are far apart, in the order in which they are preferred."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.remeshing.fitting.ring_patches import cut_patches, spaced_faces, within_rings


def test_the_first_face_is_chosen_and_its_neighbours_are_not():
    V, F = meshes.icosphere(3)
    order = np.random.default_rng(0).permutation(len(F))
    chosen = spaced_faces(F, order, len(V), 2, 30)
    assert chosen[0] == order[0] and len(chosen) <= 30
    for face in chosen[:5]:
        near = within_rings(F, np.isin(np.arange(len(V)), F[face]), 2)
        others = np.setdiff1d(chosen, face)
        assert not near[F[others]].any()
    assert len(spaced_faces(F, order, len(V), 2, 3)) == 3


def test_rings_grow_by_one_edge_each():
    V, F = meshes.icosphere(3)
    mask = np.arange(len(V)) == 7
    one = within_rings(F, mask, 1)
    assert one.sum() == 1 + len(np.unique(F[(F == 7).any(axis=1)])) - 1
    np.testing.assert_array_equal(within_rings(F, one, 1), within_rings(F, mask, 2))


def test_patches_without_rings_are_the_stars_of_their_corners():
    V, F = meshes.icosphere(3)
    patches = cut_patches(F, np.array([10]), len(V), 0)
    np.testing.assert_array_equal(np.sort(patches.vertices[~patches.outer]), np.sort(F[10]))
    star = np.flatnonzero(np.isin(F, F[10]).any(axis=1))
    np.testing.assert_array_equal(np.sort(patches.faces), star)
