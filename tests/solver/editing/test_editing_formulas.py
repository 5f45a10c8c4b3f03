"""Outlines, steps and pictures of edits against plain formulas."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing.image_warp import bilinear, continued, old_places, rounded, warp_image
from omt_uv.solver.editing.inset_images import InsetImage, warp_with_insets
from omt_uv.solver.editing.magnify_regions import _direction, magnify_regions
from omt_uv.solver.editing.outline import recognise_outline
from omt_uv.solver.progress import drain


def test_directions_are_weights_from_0_to_1():
    density = np.array([0.5, 1.0, 2.0, 8.0])
    assert _direction(density) == pytest.approx([0, 0.25, 0.5, 1]) and _direction(np.full(4, 3.0)) is None


@pytest.mark.parametrize("factor", [2.0, 30.0])
def test_progress_of_several_regions_never_falls(factor):
    V, F = meshes.grid(6, 6)
    middle = V[F].mean(axis=1)[:, :2]
    regions = np.stack([np.linalg.norm(middle - p, axis=1) < 0.25 for p in ([0.3, 0.3], [0.7, 0.7])]).astype(float)
    said = []
    drain(magnify_regions(V[:, :2], F, regions, [factor, 0.8], exact=factor < 3), said.append)
    fractions = np.array([p.fraction for p in said])
    assert (np.diff(fractions) > -1e-9).all() and 0 <= fractions[0] < 0.2 and fractions.max() <= 1


@pytest.mark.parametrize(("count", "gap", "circle"), [(12, 0, True), (11, 0, False), (40, 12, True), (40, 15, False)])
def test_circles_have_a_dozen_vertices_and_no_wide_gap(count, gap, circle):
    """A gap of a third of a turn is too wide; 13 of 40 are 117 degrees."""
    points = 3 + 2 * np.exp(2j * np.pi * np.arange(count) / count)
    points = np.delete(points, np.arange(gap))
    assert (recognise_outline(points, np.arange(len(points))).kind == "circle") == circle
    # Clockwise, or twice around, it is none.
    assert recognise_outline(points[::-1], np.arange(len(points))).kind != "circle"
    off = points.copy()
    off[3] = 3 + (off[3] - 3) * 1.004
    assert recognise_outline(off, np.arange(len(off))).kind != "circle"


def test_pixels_are_covered_by_the_triangle_that_they_are_in():
    rng = np.random.default_rng(0)
    V, F = meshes.grid(3, 2)
    new = (V[:, :2] * [0.9, 0.7] + [0.02, 0.11] + 0.03 * rng.normal(size=(len(V), 2)))[F]
    old = (V[:, :2] @ [[0.3, 0.1], [-0.2, 0.4]] + 0.3)[F]
    height, width = 17, 23
    place, face = old_places(old, new, height, width)
    for row in range(height):
        for column in range(width):
            p = np.array([(column + 0.5) / width, (row + 0.5) / height])
            inside = {}
            for t, corner in enumerate(new):
                w = np.linalg.solve(np.vstack([corner.T, np.ones(3)]), np.append(p, 1))
                if (w > 1e-7).all():
                    inside[t] = w @ old[t]
            if inside:
                assert face[row, column] in inside
                np.testing.assert_allclose(place[row, column], inside[face[row, column]], atol=1e-9)
            else:
                assert face[row, column] == -1
    # Outside of the picture nothing is looked at; a picture of one pixel has one middle.
    assert (old_places(old, new + 5, 4, 4)[1] == -1).all()
    assert (
        old_places(np.array([[[0, 0], [1, 0], [0, 1.0]]]) * 9, np.array([[[0, 0], [2, 0], [0, 2.0]]]), 1, 1)[1][0, 0]
        == 0
    )


def test_islands_go_on_beyond_their_borders_as_far_as_they_may():
    face = np.full((9, 9), -1)
    face[4, 4] = 7
    place = np.zeros((9, 9, 2))
    place[4, 4] = [0.25, 0.75]
    for margin in (0, 1, 2, 3):
        there, which, known = continued(place, face, margin)
        y, x = np.mgrid[:9, :9]
        near = np.hypot(x - 4, y - 4) <= margin
        np.testing.assert_array_equal(known, near)
        assert (which[known] == 7).all() and (there[known] == [0.25, 0.75]).all()


def test_samples_between_pixels():
    picture = np.arange(12.0).reshape(3, 4, 1)

    def at(row, column):
        return picture[np.clip(row, 0, 2), np.clip(column, 0, 3)]

    uv = np.array([[0.5 / 4, 0.5 / 3], [1.5 / 4, 0.5 / 3], [1 / 4, 0.5 / 3], [0.5 / 4, 1 / 3], [2 / 4, 2 / 3]])
    assert bilinear(picture, uv, at)[:, 0] == pytest.approx([0, 1, 0.5, 2, 7.5 - 0])
    assert rounded(np.array([-3.0, 0.5, 1.5, 254.6, 300]), np.uint8).tolist() == [0, 0, 2, 255, 255]
    same = np.array([[[0, 0], [1, 0], [1, 1.0]], [[0, 0], [1, 1], [0, 1.0]]])
    for dtype in (np.uint8, np.uint16, np.float32):
        given = (np.random.default_rng(0).uniform(0, 200, (5, 6, 4))).astype(dtype)
        found = warp_image(given, same, same)
        assert found.dtype == dtype
        np.testing.assert_allclose(found, given, rtol=1e-6)


def test_an_inset_has_its_share_within_its_borders():
    picture = np.ones((4, 4, 3))
    inset = InsetImage(picture, (0.2, 0.4), (0.6, 0.8))
    local = inset.local(np.array([[0.2, 0.4], [0.6, 0.8], [0.4, 0.6], [0.5, 0.7]]))
    np.testing.assert_allclose(local, [[0, 0], [1, 1], [0.5, 0.5], [0.75, 0.75]])
    share = inset.share(np.array([[0.4, 0.6], [0.1, 0.5], [0.7, 0.5], [0.4, 0.9], [0.4, 0.3]]))
    assert share[0] == pytest.approx(1) and not share[1:].any()


def test_insets_cover_by_their_alpha_and_are_filtered_where_they_are_finer():
    whole = np.array([[[0, 0], [1, 0], [1, 1.0]], [[0, 0], [1, 1], [0, 1.0]]])
    picture = np.zeros((32, 32, 4))
    picture[..., 3] = 1
    half = InsetImage(np.full((8, 8, 4), [1.0, 0.5, 0.25, 0.5]), (0.25, 0.25), (0.75, 0.75))
    found = warp_with_insets(picture, whole, whole, [half])
    np.testing.assert_allclose(found[12:20, 12:20], np.tile([0.5, 0.25, 0.125, 1], (8, 8, 1)), atol=1e-9)
    assert not found[:8, :, :3].any() and not found[:, 24:, :3].any()
    # Stripes four times as fine as the pixels are grey, ones of three pixels are not.
    for wide, least, most in ((1, 0, 0.1), (12, 0.8, 1)):
        stripes = np.repeat((np.arange(64) // wide % 2)[None, :, None] * np.ones((64, 1, 3)), 1, axis=0)
        fine = InsetImage(stripes, (0.25, 0.25), (0.75, 0.75))
        inner = warp_with_insets(picture[..., :3], whole, whole, [fine])[11:21, 11:21]
        assert least <= np.ptp(inner) <= most
    larger = warp_with_insets(picture, whole, whole, size=(64, 48))
    assert larger.shape == (64, 48, 4) and not larger[..., :3].any()
