"""Mirror planes of meshes: found wherever the mesh lies, however polygons are cut, and never where there is none."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from polygons import slit_across

from omt_uv.solver.mesh import mirror
from omt_uv.solver.mesh.mirror import find_mirror, mirrored_quads, partial_mirror


def bump(count=8):
    x, y = np.meshgrid(np.linspace(-1, 1, count + 1), np.linspace(-1, 1, count + 1), indexing="ij")
    V = np.stack([x, y, np.exp(-2 * (x**2 + 2 * y**2))], axis=-1).reshape(-1, 3)
    corner = ((count + 1) * np.arange(count)[:, None] + np.arange(count)).ravel()
    Q = np.column_stack([corner, corner + count + 1, corner + count + 2, corner + 1])
    return V, Q


def cut(Q, other):
    """Quads as triangles, those of `other` (q,) bool along the second diagonal, and the quad of each."""
    one, two = Q[:, [[0, 1, 2], [0, 2, 3]]], Q[:, [[0, 1, 3], [1, 2, 3]]]
    return np.where(other[:, None, None], two, one).reshape(-1, 3), np.repeat(np.arange(len(Q)), 2)


def turned(V, seed):
    Q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return V @ Q.T + 7


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_found_in_any_direction_unit_and_cut(seed, scale):
    V, Q = bump()
    T, faces = cut(Q, np.random.default_rng(seed).random(len(Q)) < 0.5)
    mirror = find_mirror(scale * turned(V, seed), T, faces)
    assert mirror is not None
    np.testing.assert_array_equal(mirror.image[mirror.image], np.arange(len(V)))
    W = turned(V, seed) - turned(V, seed).mean(axis=0)
    reflected = W - 2 * (W @ mirror.normal)[:, None] * mirror.normal
    np.testing.assert_allclose(W[mirror.image], reflected, atol=1e-9)


def test_the_second_is_at_right_angles_to_the_first():
    V, Q = bump()
    T, faces = cut(Q, np.zeros(len(Q), bool))
    first = find_mirror(V, T, faces)
    second = find_mirror(V, T, faces, across=first)
    assert abs(first.normal @ second.normal) < 1e-12
    np.testing.assert_array_equal(first.image[second.image], second.image[first.image])
    assert (first.image != second.image).any()


def test_a_scar_leaves_none():
    V, Q = bump()
    V[10, 2] += 0.01
    assert find_mirror(V, *cut(Q, np.zeros(len(Q), bool))) is None


def test_vertices_that_lie_on_one_another_are_told_apart_by_their_polygons():
    """As along a seam: both halves of a tube that was cut open."""
    angle = np.linspace(0, 2 * np.pi, 13)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    V = np.concatenate([ring, ring + [0, 0, 1]])
    k = np.arange(12)
    Q = np.column_stack([k, k + 1, k + 14, k + 13])
    mirror = find_mirror(V, *cut(Q, np.zeros(12, bool)))
    assert mirror is not None and len(np.unique(mirror.image)) == len(V)


def test_the_plane_of_a_flat_mesh_moves_nothing_and_is_none():
    V = np.array([[0, 0, 0], [3, 0, 0], [1, 1, 0.0]])
    assert find_mirror(V, np.array([[0, 1, 2]])) is None


def test_no_symmetry_of_a_random_disk():
    V, F = meshes.random_disk(60)
    assert find_mirror(V, F) is None


def test_triangles_cut_along_other_diagonals_than_their_images_are_found():
    V, Q = bump()
    V = V + 0.2 * V[:, [1]] ** [9, 2, 3] * [0, 1, 1]
    x = V[Q].mean(axis=1)[:, 0]
    other = x > 0
    other[np.flatnonzero(other)[[3, 8, 20]]] = False
    T, faces = cut(Q, other)
    pairs = mirrored_quads(turned(V, 1), T)
    assert len(pairs) == 6 and (faces[pairs[:, 0]] == faces[pairs[:, 1]]).all()
    assert not len(mirrored_quads(turned(V, 1), cut(Q, x > 0)[0]))
    assert not len(mirrored_quads(turned(V, 1) + 0.01 * np.sin(V), T))


def test_what_hangs_on_one_side_of_the_plane_has_no_image_but_its_own():
    V, Q = slit_across()
    T, faces = cut(Q, np.zeros(len(Q), bool))
    assert find_mirror(V, T, faces) is None
    found = partial_mirror(V, T, faces)
    np.testing.assert_array_equal(np.flatnonzero(found.image < 0), len(V) - 3 + np.arange(3))
    known = np.flatnonzero(found.image >= 0)
    np.testing.assert_allclose(V[found.image[known]], found.reflected[known], atol=1e-9)
    np.testing.assert_allclose(found.reflected, V * [-1, 1, 1], atol=1e-9)
    np.testing.assert_array_equal(np.unique(faces[found.own]), np.arange(18, 24))


@pytest.mark.parametrize("kind", ["triangles", "quads", "a vertex used twice"])
def test_corners_are_in_the_order_of_their_polygons(kind):
    F = meshes.grid()[1]
    faces = np.random.default_rng(0).permutation(len(F))
    if kind == "quads":
        faces //= 2
    if kind == "a vertex used twice":
        F = np.vstack([F, F[:1, [0, 1, 0]]])
        faces = np.append(faces, len(faces))
    n = int(F.max()) + 1
    pairs = np.unique(np.repeat(faces, 3) * n + F.ravel())
    found = mirror._corners(F, faces, n)
    np.testing.assert_array_equal(found[0], pairs // n)
    np.testing.assert_array_equal(found[1], pairs % n)


@pytest.mark.parametrize("sides", [3, 4, 8, 9, 12])
def test_corners_of_polygons_of_any_number_of_sides_find_their_images(sides):
    """A row of polygons of their own, beside one another and beside their images across x = 0."""
    angle = 2 * np.pi * np.arange(sides) / sides
    shape = np.column_stack([np.cos(angle), np.sin(angle) * (1 + 0.3 * np.cos(angle)), 0.2 * np.cos(3 * angle)])
    right = np.concatenate([shape * [1, 1 + 0.1 * k, 1] + [2, 3.0 * k, 0.1 * k * k] for k in range(5)])
    V = np.concatenate([right, right * [-1, 1, 1]])
    fan = np.column_stack([np.zeros(sides - 2, int), np.arange(1, sides - 1), np.arange(2, sides)])
    start = sides * np.repeat(np.arange(10), sides - 2)
    F = np.tile(fan, (10, 1)) + start[:, None]
    mirror = find_mirror(V, F, start)
    half = sides * 5
    np.testing.assert_array_equal(mirror.image, np.concatenate([np.arange(half) + half, np.arange(half)]))


@pytest.mark.parametrize("doubled", [0, 1, 7])
def test_polygons_that_lie_on_one_another_are_twins_and_all_others_have_none(doubled):
    V, F = meshes.bumpy(4, 4)
    both = np.concatenate([F, F[:doubled, [1, 2, 0]]])
    expected = np.full(len(both), -1)
    expected[:doubled], expected[len(F) :] = len(F) + np.arange(doubled), np.arange(doubled)
    np.testing.assert_array_equal(mirror._Polygons(V, both, None).twins, expected)


@pytest.mark.parametrize("seed", range(4))
def test_of_two_layers_that_touch_in_some_faces_each_is_its_own_image(seed):
    """Faces in one place are told apart by what is around them."""
    V, Q = bump()
    V = V - [V[:, 0].mean(), 0, 0]
    V[:, 2] = np.cos(V[:, 0]) + 0.3 * V[:, 1]
    x = np.abs(V[:, 0]) / np.abs(V[:, 0]).max()
    lifted = V + np.outer(x > 0.3, [0, 0, 0.5])
    T = cut(Q, np.zeros(len(Q), bool))[0]
    name = np.random.default_rng(seed).permutation(2 * len(V))
    points, triangles = np.concatenate([V, lifted])[np.argsort(name)], name[np.concatenate([T, T + len(V)])]
    # Numbered by polygons of two triangles each.
    polygons = mirror._Polygons(points, triangles, np.arange(len(triangles)) // 2)
    assert 0 < (polygons.twins >= 0).sum() < len(polygons.twins)
    other = polygons.images_of_polygons(np.array([1.0, 0, 0]))
    layer = np.arange(len(other)) >= len(other) // 2
    np.testing.assert_array_equal(layer[other], layer)
