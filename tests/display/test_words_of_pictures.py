"""Every word that stands in a picture of figures: what it says, where, and how it is set."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from readings import reading

from omt_uv.display import canvas, distance_plots, histogram, plots

INK = (0.13, 0.13, 0.13)


@pytest.fixture
def words(monkeypatch):
    """What was written: text, x, y, size, colour, alignment; nothing is drawn."""
    told = []

    def write(_picture, text, x, y, size, colour=(0, 0, 0), align="left"):
        told.append((text, float(x), float(y), size, tuple(colour), align))

    for module in (histogram, plots, distance_plots):
        monkeypatch.setattr(module, "write", write)
    return told


def about(told, text):
    """Where a text stands, and how."""
    (found,) = [rest for said, *rest in told if said == text]
    return found


def test_histograms_say_what_they_count_in_percents_of_the_surface(words):
    V, F = meshes.bumpy(6, 6)
    picture = histogram.histogram([reading(V, F, V[:, :2])])
    figures = histogram._values([reading(V, F, V[:, :2])])[3]
    # Each half is 600 pixels wide, its plot from 80 to 570; 420 high.
    title = f"Area error {100 * figures.area_l1:.2f} %, {figures.folds} folded faces"
    assert about(words, title) == [325, 34, 22, INK, "middle"]
    title = f"Mean shear {figures.angle_mean:.3f}, 99 % within {figures.angle_p99:.2f}"
    assert about(words, title) == [325, 34, 22, INK, "middle"]
    for name in ("texture that a face gets, over what is due to it", "shear s1/s2, 1 keeps angles"):
        assert about(words, name) == [325, 406, 18, INK, "middle"]
    assert [w for w in words if w[0] == "% of the surface"] == [("% of the surface", 18, 50, 16, INK, "left")] * 2
    ticks = [w for w in words if w[2] == 378]
    assert [w[0] for w in ticks] == ["1/4", "1/2", "as due", "2x", "4x", "1", "2", "4"]
    assert [w[1] for w in ticks] == pytest.approx(
        [80 + 490 * k / 4 for k in range(5)] + [80 + 490 * k / 2 for k in range(3)]
    )
    assert all(w[3:] == (18, INK, "middle") for w in ticks)
    # Shares at five heights, from none to the top.
    shares = [w for w in words if w[5] == "right"]
    assert [w[2] for w in shares] == [round(342 - 278 * k / 4) + 5 for k in range(5)] * 2
    assert {w[1] for w in shares} == {70.0} and {w[3] for w in shares} == {18}
    tops = [float(shares[k][0]) for k in (4, 9)]
    assert [float(w[0]) for w in shares] == pytest.approx([top * k / 4 for top in tops for k in range(5)])
    assert picture.shape == (420, 1200, 3)


def test_curves_are_named_with_their_slopes_in_their_colours(words):
    points = [(10.0**k, 10.0 ** (1.5 * k)) for k in range(1, 4)]
    plots.plot({"time": points, "once": points[:1], "none": [(-1.0, 2.0)]}, "Times", below="vertices")
    assert about(words, "time  +1.50") == [840 - 224 + 14, 72, 15, plots.COLOURS[0], "left"]
    assert about(words, "once") == [630, 94, 15, plots.COLOURS[1], "left"]
    assert about(words, "none") == [630, 116, 15, plots.COLOURS[2], "left"]
    assert about(words, "Times") == [96 + 520 / 2, 32, 20, INK, "middle"]
    assert about(words, "vertices") == [356, 444, 16, INK, "middle"]
    across = [w for w in words if w[5] == "middle" and w[3] == 13]
    assert [w[0] for w in across] == ["10", "20", "50", "100", "200", "500", "1000"]
    low, high = 1 - 0.12, 3 + 0.12
    want = [round(96 + 520 * (np.log10(float(w[0])) - low) / (high - low)) for w in across]
    assert [w[1] for w in across] == want and {w[2] for w in across} == {416.0}
    up = [w for w in words if w[5] == "right"]
    low, high = 1.5 - 0.18, 4.5 + 0.18
    assert [float(w[0]) for w in up] == [50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000]
    # Numbers stand beside their lines.
    want = [round(396 - 340 * (np.log10(float(w[0])) - low) / (high - low)) + 5 for w in up]
    assert [w[2] for w in up] == want and {w[1] for w in up} == {88.0}


def test_a_plot_of_nothing_says_so(words):
    plots.plot({"a": [], "b": [(0.0, 1.0)]}, "Times")
    assert words == [("nothing to draw", 420, 230, 18, INK, "middle")]


@pytest.mark.parametrize("count", [1, 2])
def test_slopes_need_two_numbers_of_faces(count):
    points = [(2.0, 5.0), (2.0, 7.0), (0.0, 3.0), (4.0, -1.0)] + [(8.0, 80.0)] * (count - 1)
    assert np.isnan(plots.slope(points)) == (count == 1)
    assert count == 1 or plots.slope([(1.0, 3.0), (4.0, 6.0)]) == pytest.approx(0.5)


@pytest.mark.parametrize("named", [False, True])
def test_matrices_name_their_greatest_distance_and_their_classes(named, words):
    distances = np.array([[0, 3, 1], [3, 0, 2.5], [1, 2.5, np.nan]])
    classes = ["b", "a", "b"] if named else None
    picture = distance_plots.matrix_picture(distances, classes)
    assert about(words, "0 to 3") == [56 + 450, 36, 18, INK, "middle"]
    order = [1, 0, 2] if named else [0, 1, 2]
    for i in range(3):
        for j in range(3):
            at = picture[56 + 300 * i + 150, 56 + 300 * j + 150]
            value = distances[order[i], order[j]]
            assert at == pytest.approx([0.45, 0.5, 0.6] if np.isnan(value) else [value / 3] * 3)
    if named:
        assert about(words, "a") == [56 + 900 + 12, 56 + 150 + 5, 15, plots.COLOURS[0], "left"]
        assert about(words, "b") == [968, 56 + 600 + 5, 15, plots.COLOURS[1], "left"]
        assert picture[356, 500] == pytest.approx(plots.COLOURS[1]) and picture[500, 356] == pytest.approx(
            plots.COLOURS[1]
        )
        assert picture[57, 47] == pytest.approx(plots.COLOURS[0]) and picture[400, 53] == pytest.approx(
            plots.COLOURS[1]
        )
    assert len(words) == (3 if named else 1)
    assert (distance_plots.matrix_picture(np.zeros((2, 2)))[60:900, 60:900] == 0).all()


@pytest.mark.parametrize("classes", [None, ["x", "y", "x"]])
@pytest.mark.parametrize("names", [["p", "q", "r"], ["p", "p", "r"]])
def test_points_of_maps_stand_to_scale_with_their_names(names, classes, words):
    places = np.array([[0, 0], [4, 1], [2, -1.0]])
    picture = distance_plots.map_picture(places, names, classes)
    at = [(56.0, 506.0), (956.0, 281.0), (506.0, 731.0)]
    colours = [plots.COLOURS[0], plots.COLOURS[0 if classes is None else 1], plots.COLOURS[0]]
    for (x, y), colour in zip(at, colours, strict=True):
        assert picture[int(y), int(x)] == pytest.approx(colour)
    kinds = (
        []
        if classes is None
        else [("x", 1012, 56, 16, plots.COLOURS[0], "left"), ("y", 1012, 78, 16, plots.COLOURS[1], "left")]
    )
    written = classes is None or names[1] == "q"
    grey = (0.45, 0.45, 0.45)
    own = [(n, x + 8, y + 4, 11, grey, "left") for n, (x, y) in zip(names, at, strict=True)] if written else []
    assert words == kinds + own
    one = distance_plots.map_picture(np.zeros((1, 2)), ["a"])
    assert one[506, 506] == pytest.approx(plots.COLOURS[0])


@pytest.mark.parametrize(("align", "shift"), [("left", 0.0), ("middle", 0.5), ("right", 1.0)])
def test_words_begin_end_or_have_their_middle_where_they_are_put(align, shift):
    picture = np.ones((60, 200, 3))
    canvas.write(picture, "HHH", 100, 40, 24, (0.0, 0.5, 1.0), align)
    drawn = (picture < 0.99).any(axis=2)
    rows, columns = np.flatnonzero(drawn.any(axis=1)), np.flatnonzero(drawn.any(axis=0))
    width = columns[-1] - columns[0] + 1
    assert 100 - shift * width == pytest.approx(columns[0], abs=4)
    # It stands on its base line.
    assert abs(rows[-1] + 1 - 40) <= 1 and 12 < len(rows) < 24
    assert picture[drawn].min(axis=0) == pytest.approx([0.0, 0.5, 1.0], abs=0.02)


def test_dots_are_round_and_smooth_and_lines_join_them():
    picture = np.ones((40, 60, 3))
    plots.dots(picture, np.array([[20.0, 15.0], [59.0, 0.0]]), (0.2, 0.4, 0.6), 5.0)
    v, u = np.mgrid[0:40, 0:60] + 0.5
    want = np.ones((40, 60, 3))
    for x, y in ((20, 15), (59, 0)):
        cover = np.clip(5.5 - np.hypot(u - x, v - y), 0, 1)[..., None]
        want += cover * (np.array([0.2, 0.4, 0.6]) - want)
    assert picture == pytest.approx(want)
    line = np.ones((40, 60, 3))
    plots._lines(line, np.array([[10.5, 20.5], [50.5, 20.5]]), (0.0, 0.0, 0.0))
    assert (line[20, 10:51] < 0.01).all() and (line[20, :8] == 1).all() and (line[16] == 1).all()
