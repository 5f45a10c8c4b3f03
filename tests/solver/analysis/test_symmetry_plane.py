"""Mirror planes: found wherever the body lies and however it is turned, exact or nearly; none where there is none."""

from dataclasses import replace

import meshes
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from omt_uv.solver.analysis.symmetry_plane import NEAR, SAMPLES, MirrorImages, SymmetryPlane, _cells, symmetry_plane

TURNS = [np.eye(3), *Rotation.random(1, random_state=1).as_matrix()]


def rough_head(noise=0.0):
    """A head whose mirror plane is that of y, its vertices moved at random."""
    V, F = meshes.head(30)
    return V + noise * np.random.default_rng(3).standard_normal(V.shape), F


def degrees_between(a, b):
    return np.degrees(np.arccos(min(1.0, abs(a @ b))))


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("noise", [0.0, 0.01])
def test_the_plane_turns_and_moves_with_the_body(turn, noise):
    V, F = rough_head(noise)
    shift = np.array([5.0, -6.0, 7.0])
    plane = symmetry_plane(3 * V @ turn.T + shift, F)
    assert degrees_between(plane.normal, turn[:, 1]) < 0.5
    assert abs(plane.distance(shift)) < 0.03
    assert plane.residual <= NEAR


def test_vertices_that_are_pairs_tell_the_plane_to_the_last_digit():
    """Triangles of the head run one way, so that it is no exact mirror image of itself."""
    V, F = rough_head()
    plane = symmetry_plane(V @ TURNS[1].T, F)
    assert not plane.is_exact
    np.testing.assert_allclose(np.abs(plane.normal @ TURNS[1]), [0, 1, 0], atol=1e-9)
    assert plane.nearest_images(V @ TURNS[1].T, F)[1].max() < 1e-9


def test_an_exact_mirror_pairs_vertices():
    V, F = meshes.cube()
    V = V * [1, 2, 3] + 5
    plane = symmetry_plane(V, F, np.tile(np.arange(6), 2))
    assert plane.is_exact and plane.residual == 0
    np.testing.assert_allclose(plane.reflected(V), V[plane.image], atol=1e-12)
    image, far = plane.nearest_images(V, F)
    assert (image == plane.image).all() and far.max() < 1e-12


def test_images_of_a_near_mirror_lie_near():
    V, F = rough_head(0.005)
    loose = np.array([[50.0, 50.0, 50.0]])
    V = np.concatenate([V, loose])
    plane = symmetry_plane(V, F)
    image, far = plane.nearest_images(V, F)
    assert not plane.is_exact
    assert np.median(far[:-1]) < 0.05 and image[-1] == len(V) - 1 and far[-1] == np.inf


def test_what_has_no_mirror_gets_none():
    """A ball with bumps anywhere."""
    V, F = meshes.icosphere(3)
    bumps = np.random.default_rng(1).standard_normal((6, 3))
    far = np.linalg.norm(V[:, None] - bumps / np.linalg.norm(bumps, axis=1)[:, None], axis=2)
    assert symmetry_plane(V * (1 + (np.exp(-4 * far**2)).sum(axis=1))[:, None], F) is None


def test_a_flat_disk_is_mirrored_across_and_not_in_the_plane_it_lies_in():
    plane = symmetry_plane(*meshes.random_disk(300, height=1e-3))
    assert abs(plane.normal[2]) < 0.01


@pytest.mark.parametrize("noise", [0.004, 0.01])
def test_the_plane_of_a_scan_hangs_on_places_alone(noise):
    """Neither the order of a file nor the pose decides: samples drawn by chance turned it by up to a degree."""
    V, F = rough_head(noise)
    draw, turn = np.random.default_rng(2), TURNS[1]
    plane = symmetry_plane(V, F)
    order = draw.permutation(len(V))
    shuffled = np.roll(np.argsort(order)[F], 1, axis=1)[draw.permutation(len(F))]
    for points, triangles, back in ((V[order], shuffled, np.eye(3)), (3 * V @ turn.T, F, turn)):
        found = symmetry_plane(points, triangles)
        assert degrees_between(back.T @ found.normal, plane.normal) < 1e-4
        assert found.residual == pytest.approx(plane.residual, rel=1e-6)


@pytest.mark.parametrize("side", [0, 1])
def test_of_planes_that_are_as_good_that_of_left_and_right_is_taken(side):
    """Every plane through the axis of a torus is one; its triangles run one way, so that none is exact."""
    V, F = meshes.torus()
    plane = symmetry_plane(V, F, side=np.eye(3)[side])
    assert not plane.is_exact and degrees_between(plane.normal, np.eye(3)[side]) < 0.1


def test_cells_of_triangles_are_even_and_cover_them():
    V, F = meshes.head(12)
    areas = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2
    face, corners, area = _cells(areas)
    np.testing.assert_allclose(np.bincount(face, area), areas, rtol=1e-12)
    np.testing.assert_allclose(corners.sum(axis=1), 1, rtol=1e-12)
    assert corners.min() > 0
    # Cells of one triangle are alike: their middles have its own as their mean, each a place of its own.
    for k in range(3):
        np.testing.assert_allclose(np.bincount(face, corners[:, k] * area) / areas, 1 / 3, rtol=1e-9)
    assert len(np.unique(np.round(np.column_stack([face, corners]), 9), axis=0)) == len(face)
    assert np.ptp(area[np.bincount(face)[face] > 1]) <= 2 * areas.sum() / SAMPLES


@pytest.mark.parametrize("name", ["lion", "max_planck", "spot", "bunny_small"])
def test_published_bodies(name):
    """Bodies with two like sides have a plane, wherever they look; the bunny that turns has none."""
    if meshes.model_path(name) is None:
        pytest.skip("no models")
    V, F = meshes.load_model(name)
    turn = TURNS[1]
    found = symmetry_plane(V, F), symmetry_plane(V @ turn.T, F)
    if name == "bunny_small":
        assert found == (None, None)
    else:
        assert degrees_between(turn @ found[0].normal, found[1].normal) < 1e-4
        assert max(p.residual for p in found) <= NEAR


@pytest.mark.parametrize("power", [-1000, 0, 1000, 1020])
def test_a_plane_is_carried_to_any_unit(power):
    """To the bit, but for the unit: beyond the greatest number it was nowhere, and the search for seams a defect."""
    V, F = rough_head()
    V, moved = V + 9, 3 * V + 1
    plane = symmetry_plane(V, F)
    far = plane.carried(V, np.ldexp(moved, power))
    assert far.offset == np.ldexp(plane.carried(V, moved).offset, power) != 0 and np.isfinite(far.offset)
    assert plane.carried(V, moved).distance(moved) == pytest.approx(3 * plane.distance(V), abs=1e-9)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("side", range(3))
def test_of_planes_that_are_as_good_that_across_the_side_is_taken_however_the_body_lies(side, seed):
    """A little lopsided, so that it has axes of its own, in whose frame planes are compared."""
    V, F = meshes.icosphere(3)
    rough = 1e-3 * np.random.default_rng(7).standard_normal(V.shape)
    body = V * [1.0, 0.9, 0.8] * (1 + 0.3 * (V**4).sum(axis=1, keepdims=True)) + [0.01, 0.008, 0] * V**2 + rough
    turn = Rotation.random(1, random_state=seed).as_matrix()[0]
    plane = symmetry_plane(body @ turn.T, F, side=turn[:, side])
    assert not plane.is_exact and degrees_between(plane.normal, turn[:, side]) < 2


def test_what_has_no_image_is_nobody_s_and_not_in_the_plane():
    images = MirrorImages.of(np.array([1, 0, 2, -1, -1]))
    assert images.exact.tolist() == [1, 0, 2, -1, -1] and images.nearest.tolist() == [1, 0, 2, 3, 4]
    assert images.in_plane.tolist() == [False, False, True, False, False] and images.are_exact


@pytest.mark.parametrize("unit", [1e-200, 1.0, 1e200])
def test_images_are_found_in_any_unit(unit):
    """Squares of such lengths are 0 or infinite."""
    V, F = meshes.icosphere(1)
    V = V * unit
    plane = SymmetryPlane(np.eye(3)[0], 0.0, 0.0, None)
    image, far = plane.nearest_images(V, F)
    np.testing.assert_allclose(V[image], V * [-1, 1, 1], atol=1e-12 * unit)
    assert (far <= 1e-12 * unit).all()
    known, far = replace(plane, image=image).nearest_images(V, F)
    assert (known == image).all() and (far <= 1e-12 * unit).all()
