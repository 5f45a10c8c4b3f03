"""Splits keep the surface, collapses its topology."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import topology
from scipy.spatial import Delaunay
from scipy.spatial.transform import Rotation

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import halfedges, twins
from omt_uv.solver.remeshing.edits import split_collapse
from omt_uv.solver.remeshing.edits.split_collapse import (
    BANDS,
    collapse_edges,
    independent_splits,
    interior_edges,
    shortest_first,
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


@pytest.mark.parametrize("name", CASES)
def test_edits_tell_opposite_halfedges(name):
    V, F = CASES[name]()
    random = np.random.default_rng(0)
    for _ in range(3):
        t = twins(F)
        h = random.permutation(np.flatnonzero(t < np.arange(len(t))))
        edit = split_edges(V, F, independent_splits(F, h, t), t)
        np.testing.assert_array_equal(edit.twin, twins(edit.triangles))
        h = random.permutation(interior_edges(edit.triangles, np.zeros(0, np.int64)))
        edit = collapse_edges(edit.points, edit.triangles, h, np.zeros(len(edit.points), dtype=bool), len(h))
        np.testing.assert_array_equal(edit.twin, twins(edit.triangles))
        V, F = edit.points, edit.triangles
        assert topology(F) == topology(CASES[name]()[1])


def test_many_collapse_at_once_though_lengths_rise_steadily():
    """In strict order every edge but the shortest has a shorter one beside it."""
    V, F = meshes.grid(60, 60)
    V = V.copy()
    V[:, :2] = (1 + V[:, :2]) ** 3
    tail, head = halfedges(F)
    h = interior_edges(F, np.zeros(0, np.int64))
    length = np.linalg.norm(V[tail[h]] - V[head[h]], axis=1)
    order = shortest_first(length)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(h)))
    assert (length[order][1:] > length[order][:-1] / 2 ** (1 / BANDS) - 1e-12).all()
    fixed = np.zeros(len(V), dtype=bool)
    strict = collapse_edges(V, F, h[np.argsort(length)], fixed, len(V))
    assert len(V) - len(strict.points) < (len(V) - len(collapse_edges(V, F, h[order], fixed, len(V)).points)) / 1.5


def test_the_only_edge_that_may_collapse_is_found():
    """However many others come first in the order."""
    V, F = meshes.icosphere(3)
    h = interior_edges(F, np.zeros(0, np.int64))
    tail, head = halfedges(F)
    free = np.zeros(len(V), dtype=bool)
    free[tail[h[-1]]] = free[head[h[-1]]] = True
    edit = collapse_edges(V, F, h, ~free, 1)
    assert len(edit.points) == len(V) - 1


@pytest.mark.parametrize("seed", range(12))
def test_no_collapse_leaves_a_triangle_along_a_straight_line(seed):
    """A vertex over three of a line, drawn to the first one, would lay a triangle on it, whose normal is rounding."""
    places = np.array([(x, y) for y in (0, 1, 3) for x in range(7)] + [(x, 2) for x in (1, 3, 5)], dtype=float)
    F = Delaunay(places * [1, 0.7]).simplices.astype(np.int64)
    a, b = places[F[:, 1]] - places[F[:, 0]], places[F[:, 2]] - places[F[:, 0]]
    flipped = a[:, 0] * b[:, 1] < a[:, 1] * b[:, 0]
    F[flipped] = F[flipped][:, ::-1]
    V = np.column_stack([places, np.zeros(len(places))]) @ Rotation.random(random_state=seed).as_matrix()
    fixed = places[:, 1] == 1
    tail, head = halfedges(F)
    h = np.flatnonzero((twins(F) >= 0) & fixed[tail] & (places[head, 1] == 2))
    assert len(h) >= 6
    for one in h:
        edit = collapse_edges(V, F, np.array([one]), fixed, 1)
        assert face_areas(edit.points, edit.triangles).min() > 0.05


def test_a_tetrahedron_does_not_collapse():
    V = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    F = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    edit = collapse_edges(V, F, interior_edges(F, np.zeros(0, np.int64)), np.zeros(4, dtype=bool), 1, -2.0)
    assert len(edit.points) == 4


def test_locked_and_boundary_edges_are_no_interior_ones():
    V, F = meshes.quad_patch()
    assert len(interior_edges(F, np.zeros(0, np.int64))) == 1
    assert len(interior_edges(F, np.array([0 << 32 | 2]))) == 0


def test_choosing_ends_after_eight_rounds(monkeypatch):
    V, F = meshes.grid(60, 60)
    V = V.copy()
    V[:, :2] = (1 + V[:, :2]) ** 3
    tail, head = halfedges(F)
    h = interior_edges(F, np.zeros(0, np.int64))
    h, rounds = h[np.argsort(np.linalg.norm(V[tail[h]] - V[head[h]], axis=1))], []
    sound = split_collapse._sound
    monkeypatch.setattr(split_collapse, "_sound", lambda *given: rounds.append(len(given[3])) or sound(*given))
    collapse_edges(V, F, h, np.zeros(len(V), dtype=bool), len(V))
    assert len(rounds) == 8
