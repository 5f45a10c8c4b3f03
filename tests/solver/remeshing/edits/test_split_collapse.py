"""Splits keep the surface, collapses its topology."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.remeshing.edits.split_collapse import (
    collapse_edges,
    independent_splits,
    interior_edges,
    split_edges,
)

CASES = {"disk": meshes.bumpy, "sphere": lambda: meshes.icosphere(2), "torus": meshes.torus, "annulus": meshes.annulus}


@pytest.mark.parametrize("name", CASES)
def test_splits_keep_area_and_topology(name):
    V, F = CASES[name]()
    tail, head = halfedges(F)
    h = np.flatnonzero((t := twins(F)) < np.arange(len(t)))
    h = h[np.argsort(-np.linalg.norm(V[tail[h]] - V[head[h]], axis=1), kind="stable")]
    chosen = independent_splits(F, h)
    touched = np.concatenate([chosen // 3, t[chosen][t[chosen] >= 0] // 3])
    assert chosen[0] == h[0] and len(np.unique(touched)) == len(touched)
    edit = split_edges(V, F, chosen)
    assert len(edit.points) == len(V) + len(chosen) and topology(edit.triangles) == topology(F)
    assert face_areas(edit.points, edit.triangles).sum() == pytest.approx(face_areas(V, F).sum(), rel=1e-12)
    new = edit.origin < 0
    np.testing.assert_array_equal(edit.points[new], V[edit.split_ends].mean(axis=1))
    np.testing.assert_array_equal(edit.points[edit.new_number], V)


@pytest.mark.parametrize("name", CASES)
def test_collapses_keep_the_topology_and_what_is_fixed(name):
    V, F = CASES[name]()
    fixed = np.arange(len(V)) % 7 == 0
    h = interior_edges(F, np.zeros(0, np.int64))
    edit = collapse_edges(V, F, h, fixed, 20)
    gone = len(V) - len(edit.points)
    assert 0 < gone <= 20 and topology(edit.triangles) == topology(F)
    assert len(F) - len(edit.triangles) == 2 * gone
    np.testing.assert_array_equal(edit.points[edit.new_number[fixed]], V[fixed])
    np.testing.assert_array_equal(edit.new_number[edit.origin], np.arange(len(edit.points)))


def test_a_tetrahedron_does_not_collapse():
    V = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    F = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    edit = collapse_edges(V, F, interior_edges(F, np.zeros(0, np.int64)), np.zeros(4, dtype=bool), 1, -2.0)
    assert len(edit.points) == 4


def test_locked_and_boundary_edges_are_no_interior_ones():
    V, F = meshes.quad_patch()
    assert len(interior_edges(F, np.zeros(0, np.int64))) == 1
    assert len(interior_edges(F, np.array([0 << 32 | 2]))) == 0
