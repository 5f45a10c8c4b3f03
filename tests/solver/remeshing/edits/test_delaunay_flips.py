"""Flips keep the surface where it is flat, lead to Delaunay, and leave locked edges alone."""

from __future__ import annotations

import itertools

import meshes
import numpy as np
import pytest
from mesh_checks import angles, topology

from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import halfedges, pair_keys, twins
from omt_uv.solver.remeshing.edits.delaunay_flips import flip_if_valid, make_delaunay_embedded

NONE = np.zeros(0, np.int64)


def shaken():
    V, F = meshes.grid(12, 12)
    inner = (V[:, :2] > 0).all(axis=1) & (V[:, :2] < 1).all(axis=1)
    V[inner, :2] += np.random.default_rng(0).uniform(-0.018, 0.018, (inner.sum(), 2))
    return V, F


def test_flat_meshes_become_delaunay_and_keep_their_area():
    V, F = shaken()
    T, twin = F.copy(), twins(F)
    assert make_delaunay_embedded(V, T, twin, NONE) > 0
    np.testing.assert_array_equal(twin, twins(T))
    assert topology(T) == topology(F)
    assert face_areas(V, T).sum() == pytest.approx(1, abs=1e-12) and signed_areas(V[:, :2], T).min() > 0
    opposite = angles(V, T).ravel()
    inner = np.flatnonzero(twin >= 0)
    assert (opposite[inner] + opposite[twin[inner]]).max() < 180 + 1e-6


def test_locked_edges_stay():
    V, F = shaken()
    keys = np.unique(pair_keys(*halfedges(F)))
    locked = keys[::3]
    T, twin = F.copy(), twins(F)
    make_delaunay_embedded(V, T, twin, locked)
    assert np.isin(locked, pair_keys(*halfedges(T))).all()
    T, twin = F.copy(), twins(F)
    assert make_delaunay_embedded(V, T, twin, keys) == 0
    np.testing.assert_array_equal(T, F)


def test_outer_vertices_are_not_joined():
    V, F = shaken()
    T, twin = F.copy(), twins(F)
    assert make_delaunay_embedded(V, T, twin, NONE, outer=np.ones(len(V), dtype=bool)) == 0


def test_single_flips_are_made_only_where_faces_stay_upright():
    V = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    F = np.array([[0, 1, 2], [0, 2, 3]])
    keep, outer = np.zeros(6, dtype=bool), np.zeros(4, dtype=bool)
    T = F.copy()
    assert flip_if_valid(V, T, np.array([2]), keep, outer) == pair_keys(np.array([1]), np.array([3]))
    assert topology(T) == (1, 1) and face_areas(V, T).sum() == 1
    for V2, kept in (
        (V, np.ones(6, dtype=bool)),
        (V * [1, 1, 1] + [[0, 0, 0], [0, 0, 0], [-0.9, -0.9, 0], [0, 0, 0]], keep),
    ):
        T = F.copy()
        assert len(flip_if_valid(V2, T, np.array([2]), kept, outer)) == 0
        np.testing.assert_array_equal(T, F)


@pytest.mark.parametrize("outer", list(itertools.product([False, True], repeat=4)))
def test_a_flip_joins_any_two_vertices_but_two_outer_ones(outer):
    V = np.array([[0.0, 0, 0], [1, -0.2, 0], [1, 1, 0], [0.2, 0.9, 0]])
    F, outer = np.array([[0, 1, 2], [0, 2, 3]]), np.array(outer)
    joined = not (outer[1] and outer[3])
    assert len(flip_if_valid(V, F.copy(), np.array([2]), np.zeros(6, dtype=bool), outer)) == joined
    V[[1, 3]] = V[[1, 3]] / 4 + 0.375
    T = F.copy()
    assert make_delaunay_embedded(V, T, twins(T), NONE, outer=outer) == joined
