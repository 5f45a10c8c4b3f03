"""Moebius maps: they stay on the sphere, invert each other, and keep cross-ratios."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal.moebius import boost, centre_on_sphere, to_plane, to_sphere
from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.mesh.spherical_geometry import signed_volumes


@pytest.fixture
def points():
    p = np.random.default_rng(0).normal(size=(100, 3))
    return p / np.linalg.norm(p, axis=1)[:, None]


def ratios(points):
    """Absolute cross-ratios by chords, which Moebius maps keep."""
    a, b, c, d = points[:100].reshape(4, 25, 3)
    ab, cd, ac, bd = (np.linalg.norm(x - y, axis=1) for x, y in ((a, b), (c, d), (a, c), (b, d)))
    return ab * cd / (ac * bd)


def test_the_plane_and_the_sphere_are_inverse(points):
    z = to_plane(points)
    np.testing.assert_allclose(to_sphere(z), points, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(to_sphere(1e8 * z), axis=1), 1)
    np.testing.assert_array_equal(to_sphere(np.zeros(1, complex)), [[0, 0, -1]])


def test_an_inversion_of_the_plane_turns_the_sphere_over(points):
    np.testing.assert_allclose(to_sphere(1 / to_plane(points).conj()), points * [1, 1, -1], atol=1e-12)


def test_boosts_keep_cross_ratios_and_there_and_back_is_nothing(points):
    centre = np.array([0.3, -0.5, 0.2])
    moved = boost(points, centre)
    np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 1)
    np.testing.assert_allclose(ratios(moved), ratios(points))
    np.testing.assert_allclose(boost(moved, -centre), points, atol=1e-12)
    np.testing.assert_allclose(boost(points, np.zeros(3)), points, atol=1e-15)


def test_centring_brings_the_mean_to_0(points):
    mass = np.random.default_rng(1).random(100) ** 4
    centred = centre_on_sphere(boost(points, np.array([0, 0, 0.9])), mass)
    np.testing.assert_allclose(mass @ centred / mass.sum(), 0, atol=1e-13)
    np.testing.assert_allclose(ratios(centred), ratios(points))


def test_what_is_centred_stays(points):
    even = np.concatenate([points, -points])
    np.testing.assert_array_equal(centre_on_sphere(even, np.ones(200)), even)


def test_half_of_the_mass_in_one_point_has_no_centre(points):
    with pytest.raises(PrecisionError, match="The map gathers half of the surface in one"):
        centre_on_sphere(points, np.where(np.arange(100) == 3, 200.0, 1.0))


@pytest.mark.parametrize("far", [0.5, 0.9, 0.99, 0.999])
@pytest.mark.parametrize("way", [[0, 0, 1.0], [0.6, 0, -0.8]])
def test_what_is_centred_is_not_turned_inside_out(far, way):
    """Wherever nearly all of it was gathered: a map beyond the ball would see it from inside."""
    V, F = meshes.icosphere(2)
    gathered = boost(V, far * np.array(way))
    mass = np.random.default_rng(2).uniform(0.5, 2, len(V))
    centred = centre_on_sphere(gathered, mass)
    np.testing.assert_allclose(mass @ centred / mass.sum(), 0, atol=1e-12)
    assert (signed_volumes(centred, F) > 0).all()
