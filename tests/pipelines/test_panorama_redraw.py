"""Images of the sphere from one layout to another."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.pipelines.panorama_redraw import _pixels, redraw
from omt_uv.solver.globe.projections import EQUIRECT, LAMBERT, OCTAHEDRAL, PROJECTIONS, SINUSOIDAL, to_sphere
from omt_uv.solver.progress import drain


def picture(layout, rows=64, columns=128):
    """A smooth function of the sphere, as an image in a layout."""
    v, u = (np.arange(n) + 0.5 for n in (rows, columns))
    points = to_sphere(np.stack(np.meshgrid(u / columns, v / rows), axis=-1), layout)
    return 0.5 + 0.3 * points + 0.2 * points[..., [1, 2, 0]] * points[..., [2, 0, 1]]


@pytest.mark.parametrize("source", PROJECTIONS)
@pytest.mark.parametrize("target", PROJECTIONS)
def test_a_smooth_picture_comes_out_as_if_drawn_in_the_other_layout(source, target):
    expected = picture(target, 64, 64)
    result = drain(redraw(picture(source, 256, 256), source, target, (64, 64)))
    assert np.abs(result - expected).mean() < 2e-3
    assert np.abs(result - expected).max() < 0.08


def test_equal_area_pixels_keep_the_mean_over_the_sphere():
    """In an equal-area layout the plain mean is the mean over the sphere, of a picture of noise as well."""
    noise = np.random.default_rng(0).random((32, 64, 1))
    latitude = np.cos(np.pi * ((np.arange(32) + 0.5) / 32 - 0.5))
    mean = (noise[..., 0] * latitude[:, None]).sum() / (64 * latitude.sum())
    for target in (LAMBERT, OCTAHEDRAL):
        assert drain(redraw(noise, EQUIRECT, target, (256, 256))).mean() == pytest.approx(mean, abs=2e-3)


def test_one_colour_stays_that_colour_and_the_seam_does_not_show():
    flat = np.full((16, 32, 4), 0.25, np.float32)
    result = drain(redraw(flat, EQUIRECT, OCTAHEDRAL))
    assert result.shape == (23, 23, 4) and result.dtype == np.float32
    assert (result == 0.25).all()
    image = picture(EQUIRECT)
    for target in (EQUIRECT, LAMBERT):
        result = drain(redraw(image, EQUIRECT, target))
        assert result.shape == image.shape
        across = np.abs(result[:, 0] - result[:, -1]).max()
        assert across < 2 * np.abs(np.diff(result, axis=1)).max()


@pytest.mark.parametrize("shape", [(0, 4, 3), (4, 4)])
def test_no_pixels_no_picture(shape):
    with pytest.raises(ValueError, match="an image needs"):
        drain(redraw(np.zeros(shape), EQUIRECT, LAMBERT))


def test_a_flat_picture_is_nowhere_pinched():
    """Stripes along its columns are as wide at 60 degrees as at the equator, and its middle stays."""
    ramp = np.broadcast_to((np.arange(512) + 0.5)[None, :, None] / 512, (256, 512, 1)).copy()
    result = drain(redraw(ramp, SINUSOIDAL, EQUIRECT, (256, 512)))[..., 0]
    slope = np.gradient(result, axis=1)[:, 200:300].mean(axis=1) * 512
    assert slope[128] == pytest.approx(1, abs=0.01) and slope[128 + 256 // 3] == pytest.approx(0.5, abs=0.02)
    assert result[:, 255:257].mean(axis=1) == pytest.approx(0.5, abs=1e-3)
    with pytest.raises(ValueError, match="projection"):
        drain(redraw(ramp, EQUIRECT, SINUSOIDAL))


@pytest.mark.parametrize("size", [(4, 4), (6, 6), (7, 7), (4, 8), (7, 3)])
def test_beyond_a_side_of_the_octahedral_square_it_goes_on_where_that_side_is_glued_to(size):
    """Every side is glued to itself about its midpoint: what is as far inside at the image of a point in it follows."""
    rows, columns = size
    along = np.linspace(0, 1, 9)
    for side in (np.zeros(9), np.ones(9)):
        for uv in (np.column_stack([along, side]), np.column_stack([side, along])):
            np.testing.assert_allclose(to_sphere(uv, OCTAHEDRAL), to_sphere(uv, OCTAHEDRAL)[::-1], atol=1e-9)
    image = np.stack(np.meshgrid(np.arange(rows), np.arange(columns), indexing="ij"), axis=-1)
    down, across = np.arange(rows), np.arange(columns)
    for i, j in ((-1, across), (rows, across), (down, -1), (down, columns)):
        i, j = np.broadcast_arrays(i, j)
        at = np.stack([i, j], axis=-1)
        # The midpoint of the side, in pixels whose centres are whole numbers.
        middle = np.where(at < 0, -0.5, np.where(at >= size, np.array(size) - 0.5, (np.array(size) - 1) / 2))
        found = _pixels(image, OCTAHEDRAL, i, j)
        np.testing.assert_array_equal(found, 2 * middle - at)


def noise(rows, columns):
    """A picture no column of which is as another one."""
    return np.random.default_rng(1).random((rows, columns, 3))


@pytest.mark.parametrize("source", ["equirect", "lambert"])
@pytest.mark.parametrize("target", ["equirect", "lambert"])
@pytest.mark.parametrize("turn", [1, 5, 12])
def test_a_globe_that_is_turned_about_its_axis_is_redrawn_turned(source, target, turn):
    """Where a picture ends it goes on from its other side."""
    image = noise(12, 24)
    plain, turned = (drain(redraw(picture, source, target)) for picture in (image, np.roll(image, turn, axis=1)))
    np.testing.assert_allclose(turned, np.roll(plain, turn, axis=1), atol=1e-12)


@pytest.mark.parametrize("source", ["equirect", "lambert", "octahedral", "sinusoidal"])
@pytest.mark.parametrize("target", ["equirect", "lambert", "octahedral"])
def test_a_globe_that_is_mirrored_is_redrawn_mirrored(source, target):
    image = noise(16, 16)
    plain, mirrored = (drain(redraw(picture, source, target)) for picture in (image, image[:, ::-1]))
    np.testing.assert_allclose(mirrored, plain[:, ::-1], atol=1e-9)


@pytest.mark.parametrize("source", ["equirect", "lambert"])
def test_a_quarter_of_a_turn_turns_the_octahedral_square(source):
    image = noise(12, 24)
    plain, turned = (drain(redraw(picture, source, "octahedral")) for picture in (image, np.roll(image, 6, axis=1)))
    assert min(np.abs(turned - np.rot90(plain, k)).max() for k in (1, 3)) < 1e-9
