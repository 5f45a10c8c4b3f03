"""Meshes cut open along seams: vertices come apart where they must, and walks stay on their side."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.cut_mesh import DETOUR, are_across_seams, cut_open, descend, on_seam, seam_points
from omt_uv.solver.mesh.topology import boundary_loops


def strip():
    """A grid with a seam along its middle column of vertices that ends one edge before the upper boundary."""
    V, F = meshes.grid(8, 8)
    middle = np.flatnonzero(np.isclose(V[:, 0], 0.5))[:-1]
    return V, F, np.column_stack([middle[:-1], middle[1:]])


def test_a_slit_doubles_its_vertices_but_the_last():
    V, F, seams = strip()
    mesh = cut_open(V, F, seams)
    assert len(np.unique(mesh.sides)) == len(V) + len(seams)
    assert mesh.seam.sum() == 2 * len(seams)
    assert len(boundary_loops(mesh.sides)) == 1
    assert mesh.star.sum() == F.size


def test_without_seams_nothing_comes_apart():
    V, F = meshes.torus(16, 8)
    mesh = cut_open(V, F, np.zeros((0, 2), np.int64))
    assert len(np.unique(mesh.sides)) == len(V) and not mesh.seam.any()


def test_points_along_seams_are_on_them():
    V, F, seams = strip()
    mesh = cut_open(V, F, seams)
    points, h = seam_points(mesh, 0.02)
    np.testing.assert_allclose(points[:, 0], 0.5)
    assert mesh.seam[h].all()
    faces = h // 3
    # The corner opposite to halfedge k is k + 2.
    b = np.full((len(h), 3), 0.5)
    b[np.arange(len(h)), (h + 2) % 3] = 0
    assert on_seam(mesh, faces, b).all()
    assert not on_seam(mesh, faces, np.full((len(h), 3), 1 / 3)).any()


@pytest.mark.parametrize("spacing", [0.01, 0.07, 5.0])
def test_points_along_seams_are_as_many_as_their_spacing_asks_for(spacing):
    """Evenly along each edge, half a step from its ends, and no farther apart than is asked."""
    V, F, seams = strip()
    mesh = cut_open(V, F, seams)
    points, h = seam_points(mesh, spacing)
    for edge in np.unique(h):
        a, b = V[F.ravel()[edge]], V[F.ravel()[edge + 1 - 3 * (edge % 3 == 2)]]
        count = max(int(np.ceil(np.linalg.norm(b - a) / spacing)), 1)
        expected = a + (np.arange(count)[:, None] + 0.5) / count * (b - a)
        np.testing.assert_allclose(points[h == edge], expected, atol=1e-12)
    assert set(h) == set(np.flatnonzero(mesh.seam))


def test_walks_do_not_cross_seams():
    V, F, seams = strip()
    mesh = cut_open(V, F, seams)
    centre = V[F].mean(axis=1)
    start = np.array([np.linalg.norm(centre - [0.3, 0.1, 0], axis=1).argmin()])
    there = np.array([[0.9, 0.1, 0.0]])
    end, distance = descend(mesh, there, start)
    assert centre[end[0], 0] < 0.5 and np.isclose(distance[0], 0.4)
    free, none = descend(cut_open(V, F, seams[:0]), there, start)
    assert np.isclose(none[0], 0, atol=1e-9)
    limit, slack = np.array([10.0]), np.array([0.0])
    assert are_across_seams(mesh, start, free, limit, slack)[0]
    assert not are_across_seams(mesh, start, end, limit, slack)[0]


@pytest.mark.parametrize("slack", [0.0, 0.05, 0.2, 0.6])
def test_a_seam_lies_between_where_the_way_around_it_is_longer_than_both_allow(slack):
    """Ways from face to face along the middles of faces, with and without a seam, vertex by vertex of that graph."""
    V, F, seams = strip()
    mesh = cut_open(V, F, seams)
    middle, edges, cut = V[F].mean(axis=1), {}, {frozenset(pair) for pair in seams.tolist()}
    for f, corners in enumerate(F.tolist()):
        for k in range(3):
            edges.setdefault(frozenset((corners[k], corners[k - 1])), []).append(f)
    free, every = np.full((2, len(F), len(F)), np.inf)
    for edge, faces in edges.items():
        if len(faces) == 2:
            length = np.linalg.norm(np.subtract(*middle[faces]))
            for table in (every,) if edge in cut else (every, free):
                table[faces[0], faces[1]] = table[faces[1], faces[0]] = length
    for table in (free, every):
        np.fill_diagonal(table, 0)
        for k in range(len(F)):
            np.minimum(table, table[:, [k]] + table[k], out=table)
    start, end = (x.ravel() for x in np.mgrid[0 : len(F) : 7, 0 : len(F) : 5])
    longer = free[start, end] > DETOUR * every[start, end] + slack
    found = are_across_seams(mesh, start, end, np.full(len(start), 50.0), np.full(len(start), slack))
    # Ways that are just as long are left to rounding.
    clear = np.abs(free[start, end] - DETOUR * every[start, end] - slack) > 1e-9
    np.testing.assert_array_equal(found[clear], longer[clear])
    assert longer.any() and not longer.all()
