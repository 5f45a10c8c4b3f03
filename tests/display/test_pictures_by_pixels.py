"""Pictures pixel by pixel, and the axes and colours that they are drawn by, against loops and formulas."""

from __future__ import annotations

import colorsys
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from readings import reading
from sphere_shapes import random_rotation

from omt_uv.display import canvas, histogram, preview, raster
from omt_uv.display.textures import layouts, patterns, world


@pytest.mark.parametrize(
    "value, top",
    [
        (0, 1),
        (-3, 1),
        (1, 1),
        (1.001, 2),
        (2, 2),
        (3.9, 4),
        (5, 8),
        (8, 8),
        (8.1, 10),
        (10, 10),
        (19, 20),
        (0.011, 0.02),
        (9.9, 10),
    ],
)
def test_ends_of_axes_are_round(value, top):
    assert histogram._round_up(value) == pytest.approx(top)


@pytest.mark.parametrize(
    "end, step, places", [(2, 1, [-2, -1, 0, 1, 2]), (3, 2, [-2, 0, 2]), (5, 3, [-3, 0, 3]), (4, 2, [-4, -2, 0, 2, 4])]
)
def test_words_stand_around_the_middle(end, step, places):
    assert histogram._around(end, step) == places


@pytest.mark.parametrize(
    "far, share, end",
    [
        (3.2, 0.011, 4),
        (3.2, 0.009, 2),
        (4.0, 0.5, 4),
        (4.0000001, 0.5, 4),
        (4.01, 0.5, 5),
        (99.0, 0.5, 10),
        (0.5, 0.5, 2),
    ],
)
def test_axes_reach_over_all_but_a_hundredth_of_the_surface(far, share, end):
    assert histogram._reach(np.array([far, 0.1]), np.array([share, 1 - share]), 2) == end


def test_axes_have_words_at_their_places():
    axis = histogram.area_axis(np.array([3.4, -0.1]), np.array([0.5, 0.5]))
    assert (axis.low, axis.high) == (-4, 4) and axis.ticks == [
        (-4.0, "1/16"),
        (-2.0, "1/4"),
        (0.0, "as due"),
        (2.0, "4x"),
        (4.0, "16x"),
    ]
    np.testing.assert_allclose(axis.places(np.array([-4, 0, 2])), [0, 0.5, 0.75])
    np.testing.assert_allclose(axis.scale(np.array([0.75])), axis.colours(np.array([2.0])))
    axis = histogram.shear_axis(np.array([1.0, 0.5, 40.0]), np.array([1.0, 1.0, 1.0]))
    assert (axis.low, axis.high) == (0, 6) and [text for _, text in axis.ticks] == ["1", "4", "16", "64"]
    assert [place for place, _ in axis.ticks] == [0, 2, 4, 6]
    least = histogram.shear_axis(np.ones(3), np.ones(3))
    assert least.high == 2 and [text for _, text in least.ticks] == ["1", "2", "4"]


def triangles_of(seed, count=12, size=24):
    rng = np.random.default_rng(seed)
    return rng.uniform(-3, size + 3, (count, 3, 2)), rng.normal(size=(count, 3))


@pytest.mark.parametrize("seed", range(3))
def test_each_pixel_has_the_nearest_triangle_at_its_middle(seed):
    corners, depth = triangles_of(seed)
    found = raster.cover(corners, depth, (20, 24))
    at = {int(p): k for k, p in enumerate(found.pixels)}
    assert (np.diff(found.pixels) > 0).all()
    for row in range(20):
        for column in range(24):
            p, best = np.array([column + 0.5, row + 0.5]), None
            for t, (a, b, c) in enumerate(corners):
                weights = np.linalg.solve(np.array([[*a, 1], [*b, 1], [*c, 1]]).T, [*p, 1])
                if weights.min() >= 0 and (best is None or weights @ depth[t] > best[0]):
                    best = weights @ depth[t], t, weights
            k = at.get(row * 24 + column)
            assert (k is None) == (best is None)
            if best is not None:
                assert found.triangles[k] == best[1]
                np.testing.assert_allclose(found.weights[k], best[2], atol=1e-9)
    far = raster.edge_distances(corners, found)
    for k in range(0, len(found.pixels), 7):
        row, column = divmod(int(found.pixels[k]), 24)
        p, q = np.array([column + 0.5, row + 0.5]), corners[found.triangles[k]]
        for i in range(3):
            a, b = q[(i + 1) % 3], q[(i + 2) % 3]
            side = b - a
            assert far[k, i] == pytest.approx(abs(side[0] * (p - a)[1] - side[1] * (p - a)[0]) / np.linalg.norm(side))


def test_triangles_without_area_cover_nothing():
    corners = np.array([[[0, 0], [9, 9], [3, 3.0]]])
    assert (raster.barycentric(corners, np.array([[3.0, 3.0]])) == -1).all()
    assert len(raster.cover(corners, np.zeros((1, 3)), (9, 9)).pixels) == 0


@pytest.mark.parametrize("uv", [(0.01, 0.01), (0.07, 0.01), (0.3, 0.8), (-0.2, 1.4)])
def test_checkers_alternate_and_are_tinted_by_quarters(uv):
    u, v = uv
    (found,) = preview.checker_colours(np.array([[u, v]]))
    dark = (np.floor(16 * u) + np.floor(16 * v)) % 2
    phase = 2 * np.pi * (np.floor(4 * u) * 0.137 + np.floor(4 * v) * 0.411)
    tint = [0.5 + 0.5 * np.cos(phase + shift) for shift in (0.0, 2.1, 4.2)]
    np.testing.assert_allclose(found, [(0.95 - 0.45 * dark) * (0.72 + 0.28 * t) for t in tint])


def test_boxes_are_fitted_into_the_middle():
    flat = np.array([[[1.0, 2], [5, 2], [3, 4]]])
    found = preview._fitted(flat, (np.array([1.0, 4]), np.array([5.0, 2])), 100)
    scale = 0.88 * 100 / 4
    np.testing.assert_allclose(found[0], [[50 - 2 * scale, 50 - scale], [50 + 2 * scale, 50 - scale], [50, 50 + scale]])
    np.testing.assert_allclose(preview._fitted(flat[:, :1], (flat[0, 0], flat[0, 0]), 100), 50)


def drawn_of(space, normals=None):
    return preview._Drawn(
        space,
        np.tile([0, 0, 1.0], (len(space), 3, 1)) if normals is None else normals,
        None,
        np.ones((len(space), 3), bool),
        np.zeros(len(space)),
        np.full(len(space), -1),
    )


def test_cameras_look_down_from_the_front_and_the_right():
    # Two points: one farther to the right in the world, one higher.
    space = np.array([[[0, 0, 0], [1, 0, 0], [0, 0, 1.0]]])
    corners, depth, light = preview._seen(drawn_of(space), 100)
    a, e = np.radians(35), np.radians(20)
    towards = np.array([np.sin(a) * np.cos(e), -np.cos(a) * np.cos(e), np.sin(e)])
    right = np.array([np.cos(a), np.sin(a), 0])
    up = np.cross(towards, right)
    np.testing.assert_allclose(depth[0], space[0] @ towards)
    step = corners[0, 1] - corners[0, 0], corners[0, 2] - corners[0, 0]
    scale = np.linalg.norm(step[0]) / np.hypot(right[0], up[0])
    np.testing.assert_allclose(step[0], scale * np.array([right[0], -up[0]]))
    np.testing.assert_allclose(step[1], scale * np.array([0, -up[2]]), atol=1e-9)
    lamp = towards + 0.5 * up - 0.4 * right
    np.testing.assert_allclose(light, 0.35 + 0.65 * abs(lamp[2]) / np.linalg.norm(lamp))
    both = preview._seen(drawn_of(space, np.tile([0, 0, -2.0], (1, 3, 1))), 100)[2]
    np.testing.assert_allclose(both, light)


def test_lines_fade_where_triangles_are_small_and_diagonals_have_none():
    corners = np.array([[[0, 0], [40, 0], [0, 40.0]]])
    found = raster.cover(corners, np.zeros((1, 3)), (40, 40))
    ground = np.full((len(found.pixels), 3), 0.5)
    for real, most in ((np.array([[True, False, False]]), 0.85), (np.array([[False, True, False]]), 0.4)):
        lined = preview._lined(found, corners, real, ground, most)
        far = raster.edge_distances(corners, found)[:, real[0].argmax()]
        strength = np.clip(1.1 * preview.SAMPLES - far, 0, 1) * np.clip(40 / (7 * preview.SAMPLES), 0.12 * most, most)
        np.testing.assert_allclose(lined, 0.5 + strength[:, None] * (preview.INK - 0.5))
    small = preview._lined(found, corners / 1000, np.array([[True] * 3]), ground)
    assert np.abs(small - ground).max() < 0.85


@pytest.mark.parametrize("size", [64, 40])
def test_cells_of_the_checker_have_their_tints_and_circles(size):
    picture = patterns.labelled_checker(size)
    cell = size / 8
    assert picture.shape == (size, size, 3)
    for row, column in ((0, 0), (2, 5), (7, 6)):
        dark = (row + column) % 2 == 1
        hue = (row * 8 + column * 3) % 64 / 64
        y, x = int((row + 0.1) * cell), int((column + 0.1) * cell)
        np.testing.assert_allclose(picture[y, x], colorsys.hsv_to_rgb(hue, 0.5 if dark else 0.1, 0.58 if dark else 0.9))
    # A circle of 0.4 around each middle, in the colour of labels.
    sides = picture[int(3.5 * cell), int(3 * cell) : int(4 * cell)]
    off = np.abs(sides - picture[int(3.1 * cell), int(3.1 * cell)]).sum(axis=1)
    place = (np.arange(len(sides)) + 0.5) / cell
    if size == 64:
        assert np.abs(np.abs(place[off > 0.1] - 0.5) - 0.4).max() < 0.1 and (off > 0.1).any()


@pytest.mark.parametrize("size, named", [(256, True), (192, True), (191, False)])
def test_every_cell_of_the_checker_has_its_name_where_it_can_be_read(size, named, monkeypatch):
    drawn = {}

    def write(picture, text, x, y, height, colour, anchor):
        drawn[text] = x / cell, y / cell, height / cell, anchor
        at = int(y - 0.12 * cell), int(x)
        np.testing.assert_allclose(colour, colorsys.hsv_to_rgb(*inks(*at)), atol=1e-6)

    def inks(row, column):
        i, j = int(row / cell), int(column / cell)
        dark = (i + j) % 2 == 1
        return (i * 8 + j * 3) % 64 / 64, 0.05 if dark else 0.55, 1.0 if dark else 0.45

    cell = size / 8
    monkeypatch.setattr(patterns, "write", write)
    patterns.labelled_checker(size)
    expected = {f"{'ABCDEFGH'[i]}{j + 1}": (j + 0.5, i + 0.62, 1 / 3, "middle") for i in range(8) for j in range(8)}
    assert set(drawn) == (set(expected) if named else set())
    for name, place in drawn.items():
        assert place[3] == "middle" and place[:3] == pytest.approx(expected[name][:3])


def test_circles_touch_six_others_and_have_gaps_between():
    size = 140
    picture = patterns.circle_packing(size)
    assert picture.shape == (size, size, 3)
    x, y = np.meshgrid((np.arange(size) + 0.5) / size * 14, (np.arange(size) + 0.5) / size * 16)
    centres = [(c + 0.5 * (r % 2) + 0.25, r + 0.5, r, c) for r in range(-1, 17) for c in range(-1, 15)]
    away = np.stack([np.hypot(x - cx, (y - cy) * np.sqrt(3) / 2) for cx, cy, *_ in centres])
    nearest, far = away.argmin(axis=0), away.min(axis=0)
    np.testing.assert_allclose(picture[far > 0.52], np.broadcast_to(patterns.PAPER, (int((far > 0.52).sum()), 3)))
    # Of a finer picture the outline is seen by itself.
    fine = patterns.circle_packing(560)
    middle = fine[20:40, :40]
    assert np.abs(middle - patterns.OUTLINE).sum(axis=2).min() < 1e-9
    for k in range(0, len(centres), 37):
        _, _, row, column = centres[k]
        inside = (nearest == k) & (far < 0.4)
        if inside.any():
            hue = ((row % 16) * 5 + (column % 14) * 3) % 24 / 24
            np.testing.assert_allclose(
                picture[inside], np.tile(colorsys.hsv_to_rgb(hue, 0.42, 0.88), (inside.sum(), 1))
            )


def test_the_world_has_its_sea_its_lines_and_its_lands():
    picture = world.world_map(240)
    assert picture.shape == (120, 240, 3)

    def at(longitude, latitude):
        return picture[int((90 - latitude) / 180 * 120), int((longitude + 180) / 360 * 240)] * 255

    np.testing.assert_allclose(at(-140, 22), world.SEA)
    np.testing.assert_allclose(at(-150.5, 7), world.LINE)
    np.testing.assert_allclose(at(-140, 15.2), world.LINE)
    np.testing.assert_allclose(at(22, 8), world.LANDS["AFRICA"][0])
    np.testing.assert_allclose(at(-98, 52), world.LANDS["NORTH\nAMERICA"][0])
    np.testing.assert_allclose(at(134, -23), world.LANDS["AUSTRALIA"][0])


def test_layouts_are_lit_by_the_mean_normals_of_vertices():
    V = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1.0], [9, 9, 9]])
    F = np.array([[0, 1, 2], [0, 3, 1]])
    found = layouts._lit(V, F)
    for v in range(4):
        normal = sum(np.cross(V[b] - V[a], V[c] - V[a]) for a, b, c in F.tolist() if v in (a, b, c))
        cosine = normal @ layouts.LIGHT / np.linalg.norm(normal) / np.linalg.norm(layouts.LIGHT)
        np.testing.assert_allclose(found[v], 0.2 + 0.8 * (0.5 + 0.5 * cosine))
    np.testing.assert_allclose(found[4], 0.6)


def test_samples_are_averaged_on_paper():
    pixels = np.array([0, 1, 4, 5, 10])
    found = layouts._averaged(pixels, np.array([[0.0, 0, 0]] * 4 + [[2.0, 0.5, 0.5]]), 2)
    np.testing.assert_allclose(found[0, 0], 0)
    np.testing.assert_allclose(found[1, 1], [1, 0.875, 0.875])
    np.testing.assert_allclose(found[0, 1], layouts.PAPER)


@pytest.mark.parametrize("kind", ["area", "shear", "normals"])
def test_layouts_show_each_polygon_in_its_colour(kind):
    V = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0, 0], [2, 1, 0.0]])
    corner = np.array([0, 1, 2, 3, 1, 4, 5, 2])
    surface = SimpleNamespace(
        positions=V,
        corner_vertex=corner,
        triangles=np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]),
        triangle_face=np.array([0, 0, 1, 1]),
    )
    uv = np.array([[0.1, 0.1], [0.4, 0.1], [0.4, 0.4], [0.1, 0.4], [0.5, 0.5], [0.9, 0.5], [0.9, 0.6], [0.5, 0.6]])
    reading = SimpleNamespace(surface=surface, faces=np.ones(2, bool), uv=uv)
    picture = layouts.layout_picture([SimpleNamespace(reading=reading, rotation=np.eye(3))], kind, 40)
    one, other, nothing = picture[int(0.75 * 40), 10], picture[int(0.45 * 40), 28], picture[2, 2]
    np.testing.assert_allclose(nothing, layouts.PAPER)
    if kind == "normals":
        light = 0.2 + 0.8 * (0.5 + 0.5 * layouts.LIGHT[2] / np.linalg.norm(layouts.LIGHT))
        np.testing.assert_allclose([one, other], light)
    elif kind == "shear":
        from omt_uv.display.colormaps import shear_colours

        np.testing.assert_allclose([one, other], shear_colours(np.array([1.0, 4.0])), atol=1e-6)
    else:
        from omt_uv.display.colormaps import area_colours

        shares = np.array([0.09, 0.04]) / 0.13 / 0.5
        np.testing.assert_allclose([one, other], area_colours(np.log2(shares)), atol=1e-6)
    reading.faces = np.array([False, True])
    part = layouts.layout_picture([SimpleNamespace(reading=reading, rotation=np.eye(3))], kind, 40)
    np.testing.assert_allclose(part[int(0.75 * 40), 10], layouts.PAPER)


@pytest.mark.parametrize(
    ("reached", "end"), [(3.0, 3), (3.0 + 5e-7, 3), (3.0 + 5e-6, 4), (3.0 - 5e-7, 3), (0.1, 2), (99.0, 10)]
)
def test_what_stands_for_rounding_moves_no_end(reached, end):
    octaves = np.concatenate([np.zeros(50), np.full(50, reached)])
    assert histogram._reach(octaves, np.ones(100), 2) == end


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(
    "corner",
    [
        [(1.5, 0.5), (9.2, 3.1), (3.3, 8.7)],
        [(0, 0), (8, 0), (0, 8)],
        [(-3.5, -2), (6, 4), (2, 9)],
        [(2, 2), (30, 5), (5, 30)],
        [(1, 4), (5, 4), (9, 4)],
    ],
)
def test_samples_inside_a_triangle_are_set_and_no_others(corner, turned):
    corner = np.array(corner[::-1] if turned else corner, float)
    fine, before = np.zeros((12, 14), bool), np.zeros((12, 14), bool)
    before[11, 13] = fine[11, 13] = True
    canvas._fill(fine, corner)
    for y in range(12):
        for x in range(14):
            a = [np.linalg.det([corner[(k + 1) % 3] - corner[k], (x, y) - corner[k]]) for k in range(3)]
            # One of no area is the line between its ends.
            between = (corner.min(0) <= (x, y)).all() and ((x, y) <= corner.max(0)).all()
            expected = between and (min(a) >= -1e-9 or max(a) <= 1e-9)
            assert fine[y, x] == (expected or before[y, x]), (x, y)


def test_coverage_of_a_text_is_that_of_its_samples(monkeypatch):
    points, triangles = np.array([[0.1, -0.2], [1.3, 0.1], [0.6, 0.9]]), np.array([[0, 1, 2]])
    monkeypatch.setattr(canvas, "_outline", lambda _: (points, triangles))
    coverage, left, top = canvas._text.__wrapped__("of a test", 10.0)
    # From 1 to 13 and from -2 to 9, in pixels.
    assert (left, top, coverage.shape) == (1.0, 9.0, (11, 12))
    assert coverage.sum() == pytest.approx(50 * np.cross([1.2, 0.3, 0], [0.5, 1.1, 0])[2], rel=0.02)
    for row in range(11):
        for column in range(12):
            share = 0
            for y in (np.arange(4) + 0.5) / 4 + 9 - row - 1:
                for x in (np.arange(4) + 0.5) / 4 + 1 + column:
                    p = 10 * points
                    share += all(np.linalg.det([p[(k + 1) % 3] - p[k], (x, y) - p[k]]) >= 0 for k in range(3))
            assert coverage[row, column] == share / 16


@pytest.mark.parametrize(("cell", "labelled"), [(23, False), (24, True), (40, True)])
def test_cells_of_a_checker_have_their_names_from_24_pixels_on(monkeypatch, cell, labelled):
    """A1 to H8, each in the middle of its cell, in the ink of its circle."""
    told = []
    monkeypatch.setattr(patterns, "write", lambda picture, *given: told.append(given))
    picture = patterns.labelled_checker(patterns.CELLS * cell)
    assert len(told) == (64 if labelled else 0)
    for k, (label, x, y, size, colour, align) in enumerate(told):
        i, j = divmod(k, 8)
        assert label == f"{'ABCDEFGH'[i]}{j + 1}" and align == "middle" and size == cell / 3
        assert int(x / cell) == j and int(y / cell) == i and x / cell % 1 == 0.5 and y / cell % 1 == pytest.approx(0.62)
        mine = picture[i * cell : (i + 1) * cell, j * cell : (j + 1) * cell]
        assert np.abs(mine - colour).max(axis=2).min() < 0.05


@pytest.mark.parametrize("kind", ["area", "shear", "normals", "preview"])
def test_an_object_that_is_turned_and_moved_looks_as_one_whose_vertices_are(kind):
    V, F = meshes.bumpy(5, 4)
    turn, shift = random_rotation(4), np.array([3.0, -2.0, 5.0])

    def drawn(positions, rotation, moved):
        placed = [preview.Placed(reading(positions, F, V[:, :2]), rotation, moved)]
        return preview.preview(placed, 60) if kind == "preview" else layouts.layout_picture(placed, kind, 60)

    there = drawn(V, turn, shift)
    np.testing.assert_allclose(there, drawn(V @ turn.T + shift, np.eye(3), np.zeros(3)), atol=2e-2)
    if kind in ("normals", "preview"):
        assert np.abs(there - drawn(V, np.eye(3), shift)).max() > 0.1


def test_text_stands_where_it_begins_also_with_spaces_before_it():
    """Of a text at the left the place is that of its first letter, and not of the first ink."""

    def ink(text, align):
        picture = np.ones((60, 240, 3))
        canvas.write(picture, text, 100, 40, 30, (0, 0, 0), align)
        return np.flatnonzero((picture < 0.5).any(axis=(0, 2)))

    plain, spaced = ink("H", "left"), ink("  H", "left")
    assert plain[0] >= 100 and len(spaced) == len(plain) and spaced[0] > plain[0] + 5
    wide = [ink("HHHH", align) for align in ("left", "middle", "right")]
    assert [len(w) for w in wide] == [len(wide[0])] * 3 and wide[2][-1] < 100 <= wide[0][0]
    assert abs((wide[1][0] + wide[1][-1]) / 2 - 100) <= 1
