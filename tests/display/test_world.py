"""The world's picture: what lies inside an outline, circles of one size on the globe, a graticule."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.display.textures import world


def turns(points, outline):
    """How often outlines (k,2) go around points (n,2), by the sum of the angles."""
    to = outline[None] - points[:, None]
    z = to[..., 0] + 1j * to[..., 1]
    return np.rint(np.angle(np.roll(z, -1, axis=1) / z).sum(axis=1) / (2 * np.pi))


@pytest.mark.parametrize("seed", range(3))
def test_points_are_inside_as_the_outline_goes_around_them(seed):
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 12))
    outline = rng.uniform(1, 3, (12, 1)) * np.column_stack([np.cos(angle), np.sin(angle)])
    outline[3, 1] = outline[4, 1]
    points = rng.uniform(-3, 3, (600, 2))
    found = world._inside(points[:, 0].reshape(20, 30), points[:, 1].reshape(20, 30), outline)
    np.testing.assert_array_equal(found.ravel(), turns(points, outline) % 2 == 1)
    assert 0.1 < found.mean() < 0.7


def test_circles_have_one_radius_on_the_globe():
    """Around each middle all points of the sphere nearer than the radius are tinted, and no others are."""
    rng = np.random.default_rng(0)
    latitude, longitude = np.arcsin(rng.uniform(-1, 1, 4000)), rng.uniform(-np.pi, np.pi, 4000)
    picture = np.full((4000, 1, 3), 0.5)
    world._draw_circles(picture, longitude[:, None], latitude[:, None])
    at = np.column_stack([np.cos(latitude) * np.cos(longitude), np.cos(latitude) * np.sin(longitude), np.sin(latitude)])
    nearest = np.full(4000, np.inf)
    for y in range(-60, 61, world.STEP):
        count = round(360 / world.STEP * np.cos(np.radians(y)))
        for k in range(count):
            b = np.radians(-180 + (k + 0.5) * 360 / count)
            middle = np.array(
                [np.cos(np.radians(y)) * np.cos(b), np.cos(np.radians(y)) * np.sin(b), np.sin(np.radians(y))]
            )
            nearest = np.minimum(nearest, np.degrees(np.arccos(np.clip(at @ middle, -1, 1))))
    tinted = (picture != 0.5).any(axis=(1, 2))
    np.testing.assert_array_equal(tinted, nearest < world.RADIUS)
    assert 0.05 < tinted.mean() < 0.9
