"""A surface seen in a plane is found by its places up to rounding, in every unit and order, and no other is."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.arranging.congruence import TOLERANCE, matching, mirrored_match
from omt_uv.solver.arranging.stacks import stacks


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e5])
@pytest.mark.parametrize("seed", range(3))
def test_the_image_in_a_plane_is_found_with_the_vertex_of_each(unit, seed):
    rng = np.random.default_rng(seed)
    V, F = meshes.bumpy(6, 5)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    at = float(rng.normal())
    new = rng.permutation(len(V))
    other = np.empty_like(V)
    other[new] = V - 2 * (V @ normal - at)[:, None] * normal
    extent = np.ptp(V, axis=0).max()
    for share, found in ((0.0, True), (0.9, True), (1.5, False)):
        off = np.zeros_like(V)
        off[new[3]] = share * TOLERANCE * extent * normal
        match = mirrored_match(unit * V, F, unit * (other + off), new[F][:, ::-1], normal, unit * at)
        assert (match is not None) == found
        if found:
            np.testing.assert_array_equal(match, new)
    assert mirrored_match(unit * V, F, unit * other, new[F][:, ::-1], normal, unit * (at + 0.1)) is None
    assert (
        mirrored_match(V, F, other[:-1], F, normal, at) is None
        and mirrored_match(V, F, other, F[1:], normal, at) is None
    )
    assert mirrored_match(V[:0], F[:0], V[:0], F[:0], normal, at) is None


@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("mirror", [1, -1])
def test_shapes_are_told_apart_alike_in_every_unit(unit, mirror):
    """A vertex may be off by a share of the extent, and by no more, however long a metre is."""
    V, F = meshes.bumpy(6, 5)
    extent, rng = np.ptp(V, axis=0).max(), np.random.default_rng(1)
    turned = V @ np.linalg.qr(rng.normal(size=(3, 3)))[0] * [1, 1, mirror] + [5, -3, 1]
    for share, found in ((0.0, True), (0.3, True), (30.0, False)):
        off = np.zeros_like(V)
        off[3, 2] = share * TOLERANCE * extent
        other = unit * (turned + off)
        assert (matching(unit * V, F, other, F) is not None) == found
        islands = [(unit * V, F, V[:, :2]), (other, F, V[:, :2] + 3)]
        assert stacks(islands).moved == int(found)


@pytest.mark.parametrize("height", [0.0, 1.0])
def test_what_a_motion_takes_to_another_is_not_mirrored_although_a_reflection_does_so_too(height):
    """A flat island, and one that is its own mirror image: neither is lost where mirror images do not count."""
    V = np.array([[3, 0, 0], [-1, 1, 0], [-1, -1, 0], [0, 0, height], [1, 0, -0.4 * height]])
    F = np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 4, 1], [0, 2, 4]])[: 3 if height == 0 else 5]
    V = V[: F.max() + 1]
    turned = V @ np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0] + [4, 5, 6]
    for other in (turned, turned * [1, 1, -1]):
        found = matching(V, F, other, F)
        assert not found.mirrored and found.vertices[[0, 3]].tolist() == [0, 3]
        islands = [(V, F, V[:, :2]), (other, F, V[:, :2] + 3)]
        assert stacks(islands, mirrored=False).moved == 1
    lopsided = V + np.arange(len(V))[:, None] * [0, 0.1 * height, 0]
    assert matching(lopsided, F, lopsided * [1, -1, 1], F).mirrored == (height > 0)


@pytest.mark.parametrize("seed", range(3))
def test_every_vertex_is_that_of_one_alone_also_where_several_lie_in_one_place(seed):
    """As at seams that were never joined: nobody could tell which of them is which."""
    V, F = meshes.bumpy(6, 5)
    rng = np.random.default_rng(seed)
    doubled, faces = np.concatenate([V, V[:3]]), np.concatenate([F, [[len(V), len(V) + 1, len(V) + 2]]])
    turned = doubled @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    for match in (matching(doubled, faces, turned, faces), matching(V, F, turned[: len(V)], F)):
        assert match is None or len(np.unique(match.vertices)) == len(match.vertices)
    assert match is not None
    image = mirrored_match(doubled, faces, doubled * [1, 1, -1], faces[:, ::-1], np.array([0, 0, 1.0]), 0.0)
    assert image is None or len(np.unique(image)) == len(doubled)
