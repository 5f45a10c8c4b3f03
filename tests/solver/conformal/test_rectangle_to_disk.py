"""Rectangles to disks: the circle, the corners, the symmetries of a rectangle."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal.rectangle_to_disk import MAX_ASPECT, centre_in_disk, centred_sites, rectangle_to_disk
from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.mesh.geometry import halfedge_lengths
from omt_uv.solver.mesh.topology import boundary_loops

HEIGHTS = [0.3, 1.0, 2.5]


def points(height, count=200):
    return np.random.default_rng(0).random((count, 2)) * [1, height]


@pytest.mark.parametrize("height", HEIGHTS)
def test_the_boundary_goes_to_the_circle_and_the_inside_inside(height):
    t = np.linspace(0, 1, 50)
    sides = np.concatenate([np.column_stack([t, 0 * t]), np.column_stack([0 * t, t]), np.column_stack([t, 0 * t + 1])])
    np.testing.assert_allclose(np.linalg.norm(rectangle_to_disk(sides * [1, height], height), axis=1), 1, atol=1e-12)
    assert (np.linalg.norm(rectangle_to_disk(points(height), height), axis=1) < 1).all()


@pytest.mark.parametrize("height", HEIGHTS)
def test_half_a_turn_of_the_rectangle_is_half_a_turn_of_the_disk(height):
    p = points(height)
    np.testing.assert_allclose(rectangle_to_disk([1, height] - p, height), -rectangle_to_disk(p, height), atol=1e-12)


@pytest.mark.parametrize("height", HEIGHTS)
def test_mirror_images_stay_mirror_images(height):
    """All four mirrored images of a point are as far from the middle."""
    p = points(height)
    mirrored = [p, p * [-1, 1] + [1, 0], p * [1, -1] + [0, height]]
    radii = [np.linalg.norm(rectangle_to_disk(q, height), axis=1) for q in mirrored]
    np.testing.assert_allclose(radii[1], radii[0], atol=1e-12)
    np.testing.assert_allclose(radii[2], radii[0], atol=1e-12)


def test_corners_of_a_square_are_a_quarter_of_the_circle_apart():
    corners = rectangle_to_disk(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), 1.0) @ [1, 1j]
    np.testing.assert_allclose(np.roll(corners, -1) / corners, 1j, atol=1e-12)


@pytest.mark.parametrize("height", [1.01 * MAX_ASPECT, 0.99 / MAX_ASPECT])
def test_long_rectangles_are_an_error(height):
    with pytest.raises(PrecisionError, match="The conformal map leaves double precision"):
        rectangle_to_disk(points(height), height)


def test_centring_brings_the_mean_to_0_and_keeps_the_circle_and_cross_ratios():
    random = np.random.default_rng(1)
    turn = random.uniform(0, 2, 40)
    p = np.concatenate([np.column_stack([np.cos(turn), np.sin(turn)]), 0.5 * random.random((40, 2))])
    mass = random.random(80)
    moved = centre_in_disk(p, mass)
    np.testing.assert_allclose(mass @ moved, 0, atol=1e-8)
    np.testing.assert_allclose(np.linalg.norm(moved[:40], axis=1), 1, atol=1e-12)
    ratio = [
        (z[0] - z[50]) * (z[1] - z[60]) / ((z[0] - z[60]) * (z[1] - z[50])) for z in (p @ [1, 1j], moved @ [1, 1j])
    ]
    assert ratio[0] == pytest.approx(ratio[1])


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_sites_are_centred_only_where_the_nearest_of_them_stay_far_enough_apart(share):
    sites, F = meshes.polar(lambda r: r, lambda r: 0 * r)
    sites, loop = sites[:, :2] / np.linalg.norm(sites, axis=1).max(), boundary_loops(F)[0]
    mass = 0.1 + (sites[:, 0] > 0.3)
    centred = centred_sites(sites, mass, F, loop, 0.0)
    assert np.linalg.norm(mass @ centred) < 1e-6 < 1 < np.linalg.norm(mass @ sites)
    np.testing.assert_allclose(np.linalg.norm(centred[loop], axis=1), 1, atol=1e-12)
    least = share * halfedge_lengths(centred, F).min()
    np.testing.assert_array_equal(centred_sites(sites, mass, F, loop, least), centred if share < 1 else sites)
