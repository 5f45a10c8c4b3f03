"""The mirror symmetry of maps to the sphere."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial import cKDTree
from sphere_shapes import random_rotation

from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.spherical_geometry import normalized, spherical_areas
from omt_uv.solver.progress import drain
from omt_uv.solver.sphere.newton import tangents
from omt_uv.solver.sphere.sphere_map import sphere_map
from omt_uv.solver.sphere.symmetry import symmetric_map, with_mirrored_quads


def test_the_nearest_symmetric_map_in_two_mirrors():
    V, _ = meshes.icosphere(2)
    images = np.array([cKDTree(V).query(V * turn)[1] for turn in ([1, 1, -1], [-1, 1, 1])])
    turned = V @ random_rotation().T
    noisy = turned + 0.01 * np.random.default_rng(0).normal(size=V.shape)
    symmetry, found = symmetric_map(images, noisy / np.linalg.norm(noisy, axis=1, keepdims=True))
    assert len(symmetry.images) == 3 and np.abs(found - turned).max() < 0.05
    assert np.abs(symmetry.averaged(found) - found).max() < 1e-12
    assert symmetric_map(images[:1], V[np.random.default_rng(0).permutation(len(V))]) is None


@pytest.mark.parametrize("count", [0, 1, 3])
def test_a_map_is_of_no_symmetric_surface_where_a_single_vertex_is_far_from_its_image(count):
    V, _ = meshes.icosphere(3)
    image = cKDTree(V).query(V * [1, 1, -1])[1]
    moved = V.copy()
    moved[np.flatnonzero(V[:, 2] > 0.5)[:count]] *= [-1, -1, 1]
    found = symmetric_map(image[None], moved)
    assert (found is None) == (count > 0)


def test_hessians_in_the_mean_with_their_images_say_the_same_of_symmetric_motions():
    V, _ = meshes.icosphere(1)
    images = np.array([cKDTree(V).query(V * turn)[1] for turn in ([1, 1, -1], [-1, 1, 1])])
    symmetry, P = symmetric_map(images, V @ random_rotation().T)
    random, axes, n = np.random.default_rng(0), tangents(P), len(V)
    matrix = sp.csc_matrix(random.normal(size=(2 * n, 2 * n)))
    motion = symmetry.averaged(random.normal(size=(n, 3)))
    along = np.einsum("nd,nad->na", motion, axes).ravel()
    mean = symmetry.averaged_hessian(matrix, axes)
    assert np.isclose(along @ mean @ along, along @ matrix @ along)
    # What it makes of a symmetric motion is one.
    pushed = np.einsum("na,nad->nd", (mean @ along).reshape(n, 2), axes)
    np.testing.assert_allclose(symmetry.averaged(pushed), pushed, atol=1e-12)


def test_a_few_quads_cut_otherwise_than_their_images_leave_triangles_their_areas_and_maps_their_mirror():
    V, F = meshes.icosphere(3)
    other = with_another_diagonal(V, F)
    # A body that is its own mirror image in one plane alone.
    V = V * [1, 1.3, 0.7] + np.column_stack([0.3 * V[:, 1] ** 2, 0.2 * V[:, 0], 0 * V[:, 0]])
    joined = with_mirrored_quads(V, other, None)
    assert joined is not None and len(np.unique(joined)) < len(F)
    P = drain(sphere_map(V, other)).positions
    share = face_areas(V, other) / face_areas(V, other).sum()
    ratio = spherical_areas(P, other) / (4 * np.pi * share)
    assert np.sqrt(share @ (ratio - 1) ** 2) < 0.01
    image = cKDTree(V).query(V * [1, 1, -1])[1]
    _, found = symmetric_map(image[None], P)
    assert np.abs(normalized(found) - P).max() < 1e-9


def with_another_diagonal(V, F):
    """Triangles (m,3) of a ball with one pair of them in the upper half cut along the other diagonal."""
    upper = V[F].mean(axis=1)[:, 2] > 0
    shared = [(i, j) for i in np.flatnonzero(upper)[:20] for j in np.flatnonzero(upper) if len({*F[i], *F[j]}) == 4]
    i, j = shared[0]
    other = F.copy()
    (a,), (c,) = set(F[i]) - set(F[j]), set(F[j]) - set(F[i])
    k = int(np.flatnonzero(F[i] == a)[0])
    b, d = F[i][(k + 1) % 3], F[i][(k + 2) % 3]
    other[i], other[j] = [a, b, c], [a, c, d]
    return other


def test_diagonals_alone_are_no_asymmetry():
    V, F = meshes.icosphere(2)
    assert with_mirrored_quads(V, F, None) is None
    other = with_another_diagonal(V, F)
    joined = with_mirrored_quads(V, other, None)
    i, j = np.flatnonzero((other != F).any(axis=1))
    assert joined is not None and len(np.unique(joined)) == len(F) - 2 and joined[i] == joined[j]
