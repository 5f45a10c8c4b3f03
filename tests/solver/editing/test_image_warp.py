"""Images warped from one layout to another."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing.image_warp import warp_image


def square(n=20):
    V, F = meshes.grid(n, n)
    return V[:, :2].copy(), F


def test_pixels_beyond_the_margin_stay():
    picture = np.random.default_rng(0).integers(0, 255, (64, 64, 3), dtype=np.uint8)
    uv, F = square(4)
    after = warp_image(picture, 0.25 * uv[F], 0.25 * uv[F] + 0.5, margin=2)
    assert after.dtype == np.uint8
    np.testing.assert_array_equal(after[:28], picture[:28])
    np.testing.assert_array_equal(after[34:46, 34:46], picture[2:14, 2:14])


def test_transparent_pixels_do_not_darken_what_is_beside_them():
    picture = np.zeros((32, 32, 4))
    picture[:, 16:] = [0.8, 0.6, 0.4, 1.0]
    uv, F = square(8)
    after = warp_image(picture, uv[F], 0.93 * uv[F] + 0.03, straight=True)
    seen = after[..., 3] > 0
    assert (after[..., 3][seen] < 1).any()
    np.testing.assert_allclose(after[seen][:, :3], np.tile([0.8, 0.6, 0.4], (seen.sum(), 1)), atol=1e-12)


@pytest.mark.parametrize("alpha", [0.0, 0.25, 1.0])
def test_colours_are_warped_alike_by_whatever_alpha_they_have_all_over(alpha):
    """What cannot be seen now may be seen once its alpha is changed."""
    picture = np.random.default_rng(0).random((32, 32, 4))
    picture[..., 3] = alpha
    uv, F = square(8)
    moved = uv[F] * 0.93 + 0.03
    straight, plain = (warp_image(picture, uv[F], moved, straight=way) for way in (True, False))
    np.testing.assert_allclose(straight, plain, atol=1e-12)


@pytest.mark.parametrize("shift", [(3, 0), (0, -5), (64, 0)])
def test_a_shift_by_whole_pixels_is_exact_and_repeats(shift):
    picture = np.random.default_rng(0).random((64, 64, 3))
    uv, F = square(4)
    after = warp_image(picture, uv[F] + np.array(shift) / 64, uv[F], margin=0)
    expected = np.roll(picture, (-shift[1], -shift[0]), axis=(0, 1))
    np.testing.assert_allclose(after, expected, atol=1e-12)


def test_constants_stay_what_they_are():
    picture = np.full((32, 48, 4), 0.3)
    uv, F = square(6)
    moved = uv + 0.05 * np.sin(7 * uv[:, ::-1])
    np.testing.assert_allclose(warp_image(picture, uv[F], moved[F]), picture, atol=1e-12)
