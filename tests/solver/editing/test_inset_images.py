"""Detail is laid where it belongs, as sharp as the layout asks for, and what is made smaller is filtered."""

from __future__ import annotations

from itertools import pairwise

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing.image_warp import warp_image
from omt_uv.solver.editing.inset_images import InsetImage, pyramid, sampled, warp_with_insets


def layout(columns=8):
    V, F = meshes.grid(columns, columns)
    return V[:, :2][F]


def checker(size, squares):
    y, x = np.mgrid[0:size, 0:size] * squares // size
    return np.repeat(((x + y) % 2)[..., None].astype(float), 3, axis=2)


def test_without_insets_or_a_size_it_is_the_plain_warp():
    rng = np.random.default_rng(0)
    picture = rng.random((32, 32, 3))
    old = layout()
    new = old + 0.02 * np.sin(2 * np.pi * old[..., ::-1]) * (old * (1 - old))
    plain, detailed = warp_image(picture, old, new), warp_with_insets(picture, old, new)
    assert np.abs(plain - detailed).mean() < 0.05
    assert warp_with_insets(picture, old, old) == pytest.approx(picture)


def test_an_inset_replaces_its_box_and_nothing_else():
    base, inset = np.full((64, 64, 3), 0.2), InsetImage(np.full((8, 8, 3), 0.9), (0.25, 0.5), (0.5, 0.75))
    result = warp_with_insets(base, layout(), layout(), [inset])[..., 0]
    assert result[36:44, 20:28] == pytest.approx(0.9)
    assert result[:32] == pytest.approx(0.2) and result[:, 32:] == pytest.approx(0.2)
    assert (np.diff(result[40, 16:24]) >= -1e-12).all()


@pytest.mark.parametrize("below", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("above", [0.0, 0.6, 1.0])
def test_what_is_laid_over_a_picture_covers_as_much_as_it_is_opaque_and_leaves_no_less(above, below):
    """Where the detail is whole, alpha comes nearer to its own, if that is the greater, by as much as it covers."""
    base = np.full((32, 32, 4), 0.2)
    base[..., 3] = below
    detail = np.full((8, 8, 4), 0.9)
    detail[..., 3] = above
    result = warp_with_insets(base, layout(), layout(), [InsetImage(detail, (0.25, 0.25), (0.75, 0.75))])
    np.testing.assert_allclose(result[16, 16, :3], 0.2 + above * 0.7)
    np.testing.assert_allclose(result[16, 16, 3], below + above * (max(above, below) - below))
    np.testing.assert_allclose(result[2, 2], base[2, 2])


def test_detail_stays_sharp_where_the_map_magnifies_it():
    """A quarter of the old layout fills the new one: the inset's own pixels come back, and not the base's."""
    fine = checker(256, 32)
    base = fine.reshape(64, 4, 64, 4, 3).mean(axis=(1, 3))[:32, :32].repeat(2, 0).repeat(2, 1) * 0 + 0.5
    old = 0.25 + 0.5 * layout()
    inset = InsetImage(fine, (0.0, 0.0), (1.0, 1.0))
    result = warp_with_insets(base, old, layout(), [inset], size=(128, 128))
    assert np.abs(result[20:108, 20:108] - fine[64:192, 64:192][20:108, 20:108]).mean() < 0.02
    assert np.abs(warp_with_insets(base, old, layout(), size=(128, 128)) - 0.5).max() < 1e-9


def test_what_is_made_smaller_is_filtered():
    fine = checker(256, 128)
    small = warp_with_insets(fine, layout(), layout(), size=(32, 32))
    assert small.shape == (32, 32, 3) and small == pytest.approx(0.5, abs=0.02)


def test_levels_of_a_pyramid_have_the_mean_of_the_picture():
    picture = np.random.default_rng(1).random((32, 64, 2))
    assert all(level.mean(axis=(0, 1)) == pytest.approx(picture.mean(axis=(0, 1))) for level in pyramid(picture))
    flat = sampled(pyramid(picture), np.array([[0.3, 0.6]]), np.array([1e9]), repeat=True)
    assert flat[0] == pytest.approx(picture.mean(axis=(0, 1)))


def test_types_are_kept_and_boxes_have_area():
    picture = np.full((16, 16, 3), 200, np.uint8)
    assert warp_with_insets(picture, layout(), layout()).dtype == np.uint8
    with pytest.raises(ValueError, match="no area"):
        InsetImage(picture, (0.5, 0.5), (0.5, 0.9))


@pytest.mark.parametrize("size", [(5, 4), (4, 7), (3, 3), (1, 6), (9, 1)])
def test_every_level_of_an_odd_picture_is_half_of_the_one_before_and_keeps_its_values(size):
    """The last row or column stands twice: what is constant along the other side stays what it was."""
    ramp = np.linspace(0, 1, size[0])[:, None, None] * np.ones((1, size[1], 1))
    for picture in (ramp, ramp.transpose(1, 0, 2)):
        levels = pyramid(picture)
        for a, b in pairwise(levels):
            assert b.shape[:2] == tuple(-(-n // 2) for n in a.shape[:2])
            rows, columns = (np.minimum(2 * np.arange(n)[:, None] + [0, 1], m - 1)
                             for n, m in zip(b.shape, a.shape[:2], strict=False))  # fmt: skip
            np.testing.assert_allclose(b, a[rows][:, :, columns].mean(axis=(1, 3)))
