"""Histograms and their colours: as many percent as there is surface, pale in the middle, dark at the ends."""

from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from readings import reading

from omt_uv.display import canvas
from omt_uv.display import histogram as histograms
from omt_uv.display.colormaps import AREA_OCTAVES, SHEAR_TOP, area_colours, shear_colours
from omt_uv.display.histogram import HEIGHT, WIDTH, area_axis, histogram, shear_axis, thumbnail
from omt_uv.solver.errors import EmptyMeshError


def bump():
    V, F = meshes.bumpy(6, 6)
    return reading(V, F, V[:, :2])


def test_colours_stay_beyond_the_ends_of_the_scales():
    for colours, low, high in ((area_colours, -AREA_OCTAVES, AREA_OCTAVES), (shear_colours, 1.0, SHEAR_TOP)):
        ends = colours(np.array([low - 1, low, high, high + 1]))
        assert np.array_equal(ends[0], ends[1]) and np.array_equal(ends[2], ends[3])
        assert not np.array_equal(ends[0], ends[2]) and ends.min() >= 0 and ends.max() <= 1


def test_too_little_is_blue_too_much_is_red_and_what_is_due_is_pale():
    little, due, much = area_colours(np.array([-1.0, 0.0, 1.0]))
    assert little[2] > little[0] and much[0] > much[2] and np.ptp(due) == 0 and due[0] > 0.9


def test_the_picture_is_the_same_in_every_unit_of_length():
    V, F = meshes.bumpy(6, 6)
    one, other = (histogram([reading(s * V, F, V[:, :2])]) for s in (1.0, 4.0))
    assert one.shape == (HEIGHT, WIDTH, 3) and one.min() >= 0 and one.max() <= 1
    assert np.array_equal(one, other)


def test_two_copies_of_a_mesh_have_the_histogram_of_one(monkeypatch):
    monkeypatch.setattr(canvas, "_text", lambda text, size: (np.zeros((1, 1)), 0.0, 0.0))
    assert np.abs(histogram([bump(), bump()]) - histogram([bump()])).max() < 1e-12


def test_a_thumbnail_is_transparent_but_for_its_bars():
    picture = thumbnail([bump()], 96)
    assert picture.shape == (96, 96, 4) and set(np.unique(picture[..., 3])) == {0.0, 1.0}
    assert 0.02 < picture[..., 3].mean() < 0.9


@pytest.mark.parametrize("size", [96, 97, 128, 256])
def test_both_halves_of_a_thumbnail_have_bars_above_a_scale_and_room_around_each(size):
    drawn = thumbnail([bump()], size)[..., 3] > 0
    half, thick = size // 2, size // 24
    for top in (0, half):
        part = drawn[top : top + half]
        rows = np.flatnonzero(part.any(axis=1))
        assert rows[0] == thick and rows[-1] == half - 1 - thick, "room above and below"
        # The scale is as wide as the picture, and below the bars, which have gaps.
        scale = np.flatnonzero(part.all(axis=1))
        assert len(scale) == 2 * thick - thick // 2 and (np.diff(scale) == 1).all() and scale[-1] == rows[-1]
        assert not part[scale[0] - thick // 2 : scale[0]].any() and part[scale[0] - thick // 2 - 1].any()


def test_nothing_to_draw_is_an_error():
    with pytest.raises(EmptyMeshError):
        histogram([reading(*meshes.grid(2, 2))])


def test_axes_reach_over_the_surface_and_no_farther():
    share = np.full(200, 0.5)
    octaves = np.linspace(-1, 1, 200)
    axis = area_axis(octaves, share)
    assert (axis.low, axis.high) == (-2, 2) and [text for _, text in axis.ticks] == ["1/4", "1/2", "as due", "2x", "4x"]
    axis = area_axis(5 * octaves, share)
    assert (axis.low, axis.high) == (-5, 5) and [k for k, _ in axis.ticks] == [-3, 0, 3]
    assert area_axis(np.append(octaves, 30), np.append(share, 0.5)).high == 2
    assert area_axis(100 * octaves, share).high == 10
    axis = shear_axis(2.0 ** (3 * np.abs(octaves)), share)
    assert (axis.low, axis.high) == (0, 3) and [text for _, text in axis.ticks] == ["1", "2", "4", "8"]
    assert axis.places(np.array([0.0, 3.0])) == pytest.approx([0, 1])
    assert np.array_equal(axis.scale(np.array([1.0])), shear_colours(np.array([8.0])))


def test_ends_and_middle_of_the_scales_have_their_colours():
    first, middle, last = np.array([[68, 1, 84], [33, 144, 141], [253, 231, 37]]) / 255
    np.testing.assert_allclose(shear_colours(np.array([0.5, 1, 2, 4, 9])), [first, first, middle, last, last])
    blue, white, red = np.array([[5, 48, 97], [247, 247, 247], [103, 0, 31]]) / 255
    np.testing.assert_allclose(area_colours(np.array([-3.0, -2, 0, 2, 5])), [blue, blue, white, red, red])
    # Half an octave of shear, an octave of area: the anchors between.
    np.testing.assert_allclose(shear_colours(np.array([2**0.5]))[0], np.array([59, 81, 139]) / 255)
    np.testing.assert_allclose(area_colours(np.array([-1.0, 1.0])) * 255, [[67, 147, 195], [214, 96, 77]])


@pytest.mark.parametrize("unit", [1.0, 0.03])
def test_bars_are_as_high_as_their_shares_of_the_top(monkeypatch, unit):
    """And the numbers at the left are those of the lines."""
    told = []
    monkeypatch.setattr(histograms, "write", lambda _picture, text, x, y, *_: told.append((text, x, y)))
    axis = SimpleNamespace(places=lambda x: x, scale=lambda x: np.full((len(x), 3), 0.2), ticks=[], name="name")
    places = (np.arange(histograms.BINS) + 0.5) / histograms.BINS
    share = unit * np.linspace(0, 7, histograms.BINS)
    picture = np.ones((500, 900, 3))
    histograms._plot(picture, places, share, axis, "title")
    lines = {float(text): y - 5 for text, x, y in told if x == 70}
    assert max(lines) == pytest.approx(8 * unit if unit == 1.0 else 0.4) and min(lines) == 0 and len(lines) == 5
    high, low = lines[max(lines)], lines[0.0]
    edges = np.round(np.linspace(80, 870, histograms.BINS + 1)).astype(int)
    for k, part in enumerate(share):
        column = picture[high - 5 : low, (edges[k] + edges[k + 1]) // 2, 0]
        assert abs((column < 0.5).sum() - part / max(lines) * (low - high)) <= 1
    for value, y in lines.items():
        assert abs((low - y) - value / max(lines) * (low - high)) <= 1


def test_a_picture_that_is_not_there_after_it_was_saved_is_an_error_and_nothing_is_left(monkeypatch, tmp_path):
    images = SimpleNamespace(removed=[])
    image = SimpleNamespace(save=lambda: None)
    monkeypatch.setattr(canvas, "show", lambda *_: image)
    data = SimpleNamespace(images=SimpleNamespace(remove=images.removed.append))
    monkeypatch.setattr(canvas, "bpy", SimpleNamespace(data=data))
    with pytest.raises(OSError, match="could not be written"):
        canvas.save(tmp_path / "a.png", np.zeros((2, 2, 3)))
    assert images.removed == [image] and image.filepath_raw == str(tmp_path / "a.png")
    image.save = lambda: (tmp_path / "a.png").write_bytes(b"")
    canvas.save(tmp_path / "a.png", np.zeros((2, 2, 3)))
    assert images.removed == [image, image]


@pytest.mark.parametrize("axis_of", [area_axis, shear_axis])
def test_what_lies_beyond_an_axis_is_counted_in_its_last_bars(axis_of, monkeypatch):
    monkeypatch.setattr(histograms, "write", lambda *_: None)
    octaves = np.linspace(-3, 5, 40)
    octaves[:9] = [-40, -30, -20, 20, 30, 40, 12, -12, 11]
    share = np.full(40, 2.5)
    axis = axis_of(octaves, share) if axis_of is area_axis else axis_of(2.0**octaves, share)
    inside = np.clip(octaves, axis.low, axis.high)
    assert (octaves > axis.high).any()
    one, other = (np.ones((HEIGHT, WIDTH // 2, 3)) for _ in range(2))
    histograms._plot(one, octaves, share, axis, "")
    histograms._plot(other, inside, share, axis, "")
    assert np.array_equal(one, other)
