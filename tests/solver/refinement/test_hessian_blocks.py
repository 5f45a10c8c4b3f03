"""Blocks of triangles and quads: the matrix is that of the rows, whichever way it is put together."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp

from omt_uv.solver.maps.energy import area_forms_of, face_derivatives
from omt_uv.solver.maps.mirror_symmetry import mirror_symmetry
from omt_uv.solver.maps.polygon_elements import polygon_elements, with_convex_quads
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.refinement import hessian_blocks as hessian_blocks_module
from omt_uv.solver.refinement.hessian_blocks import EAGERNESS, assembly_of, corners_of_quads, hessian_blocks


def patch(count=4):
    """Quads, and a pentagon at the end: vertices, triangles, the polygon of each."""
    x, y = np.meshgrid(np.arange(count + 1.0), np.arange(count + 1.0), indexing="ij")
    V = np.stack([x, y, 0.3 * np.sin(x + 2 * y)], axis=-1).reshape(-1, 3)
    corner = ((count + 1) * np.arange(count)[:, None] + np.arange(count)).ravel()
    Q = np.column_stack([corner, corner + count + 1, corner + count + 2, corner + 1])
    faces = np.repeat(np.arange(len(Q)), 2)
    faces[-4:] = faces[-1]  # two quads make a hexagon
    return V, Q[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), faces


@pytest.mark.parametrize("convex", [False, True])
def test_the_matrix_is_the_sum_of_the_squares_of_all_rows(convex):
    V, T, polygons = patch()
    w, n = V[:, :2] @ [1, 1j] * (1 + 0.05 * V[:, 0]), len(V)
    faces = polygon_elements(V, T, face_areas(V, T), polygons)
    faces = with_convex_quads(faces, w) if convex else faces
    frame, free = np.exp(1j * np.arange(n)), np.ones((n, 2))
    free[3] = [1, 0]
    found = hessian_blocks(faces, w, 20.0, 0.5, (frame, free))
    matrix = assembly_of(faces, n).matrix(found.triangles, np.zeros(2 * n), found.quads) + found.rest
    local = face_derivatives(faces, w, 20.0, 0.5, EAGERNESS / 2)
    rows = [(faces.triangles[i], r) for i in range(len(faces.triangles)) for r in local.rows[i]]
    forms = area_forms_of(faces, *faces.derivatives(w), 20.0, EAGERNESS / 2)
    dense = np.zeros((len(rows) + len(faces.area), 2 * n))
    for k, (vertices, row) in enumerate(rows):
        for v, value in zip(vertices, row * frame[vertices], strict=True):
            dense[k, 2 * v : 2 * v + 2] += [value.real, -value.imag]
    for i, vertices in enumerate(faces.triangles):
        for v, value in zip(vertices, forms[i] * frame[vertices], strict=True):
            dense[len(rows) + faces.polygon[i], 2 * v : 2 * v + 2] += [value.real, -value.imag]
    dense *= free.ravel()
    np.testing.assert_allclose(sp.csr_matrix(matrix).toarray(), dense.T @ dense, atol=1e-12 * found.scale)


def test_corners_of_quads_go_around():
    V, T, polygons = patch()
    faces = polygon_elements(V, T, face_areas(V, T), polygons)
    a, b, c, d = V[corners_of_quads(faces)][:, :, :2].transpose(1, 0, 2) @ np.array([1, 1j])
    assert (((c - a).conj() * (d - b)).imag > 0).all()


@pytest.mark.parametrize("polygons", [False, True])
def test_large_meshes_have_the_same_matrix_in_less_memory(polygons, monkeypatch):
    """Blocks some polygons at a time, and no list of where each number of a block belongs."""
    V, T, owner = patch(7)
    w, n = V[:, :2] @ [1, 1j] * (1 + 0.05 * V[:, 0]), len(V)
    faces = polygon_elements(V, T, face_areas(V, T), owner if polygons else None)
    axes, weight = (np.exp(1j * np.arange(n)), np.ones((n, 2))), np.linspace(1, 20, len(faces.area))
    results = []
    for at_once, pairs in ((hessian_blocks_module.AT_ONCE, hessian_blocks_module.MOST_PAIRS), (5, 0)):
        monkeypatch.setattr(hessian_blocks_module, "AT_ONCE", at_once)
        monkeypatch.setattr(hessian_blocks_module, "MOST_PAIRS", pairs)
        found = hessian_blocks(faces, w, weight, 0.5, axes)
        matrix = assembly_of(faces, n).matrix(found.triangles, np.arange(2.0 * n), found.quads)
        matrix = matrix if found.rest is None else matrix + found.rest
        results.append((matrix.toarray(), found.gradient, found.scale))
    for whole, parts in zip(*results, strict=True):
        np.testing.assert_allclose(parts, whole, rtol=1e-12, atol=1e-12 * np.abs(whole).max())


def test_blocks_of_quads_keep_no_others():
    """What comes back refers to no memory but its own: blocks of all triangles of quads take twice as much."""
    V, T, owner = patch(7)
    faces = polygon_elements(V, T, face_areas(V, T), owner)
    n = len(V)
    found = hessian_blocks(faces, V[:, :2] @ [1, 1j], 3.0, 0.5, (np.ones(n, complex), np.ones((n, 2))))
    kept = found.triangles.base
    assert kept is None or kept.nbytes <= 2 * found.triangles.nbytes


def test_blocks_of_followers_are_those_of_their_representatives():
    """Forms carried to the vertices that others follow, and turned there, have the same squares."""
    x, y = np.meshgrid(np.arange(5.0), np.arange(-2.0, 3.0), indexing="ij")
    V = np.stack([x, y, 0.2 * x * y**2], axis=-1).reshape(-1, 3)
    corner = (5 * np.arange(4)[:, None] + np.arange(4)).ravel()
    T = np.column_stack([corner, corner + 5, corner + 6, corner, corner + 6, corner + 1]).reshape(-1, 3)
    n, phase = len(V), np.exp(0.4j)
    image = np.arange(n).reshape(5, 5)[:, ::-1].ravel()
    symmetry = mirror_symmetry(image[None], phase)
    w = symmetry.spread(np.sqrt(phase) * (V[:, :2] @ [1, 1j] * (1 + 0.02 * V[:, 0])))
    faces = polygon_elements(V, T, face_areas(V, T))
    frame, free = np.exp(1j * np.arange(n)), np.ones((n, 2))
    free[[2, 7]] = [1, 0]
    found = hessian_blocks(faces, w, 20.0, 0.3, (frame, free), symmetry)
    matrix = assembly_of(faces, n, symmetry=symmetry).matrix(found.triangles, np.zeros(2 * n))
    local = face_derivatives(faces, w, 20.0, 0.3, EAGERNESS * 0.7)
    vertices, rows = symmetry.carried(T, local.rows)
    dense = np.zeros((rows.shape[0] * rows.shape[1], 2 * n))
    place = np.arange(len(dense)).reshape(rows.shape[:2])
    for k in range(3):
        turned = rows[:, :, k] * frame[vertices[:, k]][:, None]
        for axis, part in enumerate((turned.real, -turned.imag)):
            np.add.at(dense, (place, 2 * vertices[:, k, None] + axis), part)
    dense *= free.ravel()
    np.testing.assert_allclose(matrix.toarray(), dense.T @ dense, atol=1e-12 * found.scale)


@pytest.mark.parametrize("n", [6, 7, 18, 19, 400])
def test_corners_are_added_at_their_vertices_among_few_and_among_many(n):
    """Three triangles, nine corners: up to twice as many vertices all are summed, and the same is found beyond."""
    rng = np.random.default_rng(n)
    T = np.array([[5, 0, 2], [2, 0, n - 1], [n - 1, 3, 5]])
    corner = rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3))
    total = rng.normal(size=n) + 1j * rng.normal(size=n)
    expected = total.copy()
    for triangle, values in zip(T, corner, strict=True):
        for vertex, value in zip(triangle, values, strict=True):
            expected[vertex] += value
    hessian_blocks_module._add_at_vertices(total, SimpleNamespace(triangles=T), corner)
    np.testing.assert_allclose(total, expected, rtol=1e-13)
