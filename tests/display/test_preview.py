"""Pictures that need no display: what covers a pixel, and the three tiles of a preview."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest


def test_the_nearest_triangle_covers_a_pixel_and_shared_edges_belong_to_one(package):
    raster = package("display.raster")
    square = np.array([[0, 0], [8, 0], [8, 8], [0, 8]], float)
    corners = np.stack([square[[0, 1, 2]], square[[0, 2, 3]], square[[0, 1, 2]] / 2, square[[0, 0, 1]]])
    depth = np.array([[0.0] * 3, [0.0] * 3, [1.0] * 3, [9.0] * 3])
    found = raster.cover(corners, depth, (10, 8))
    # The last one is a line.
    assert len(found.pixels) == 64 and np.bincount(found.triangles)[2:].tolist() == [10]
    points = (found.weights[:, :, None] * corners[found.triangles]).sum(1)
    row, column = np.divmod(found.pixels, 8)
    assert points == pytest.approx(np.column_stack([column, row]) + 0.5)
    again = raster.cover(corners + 100, depth, (10, 8))
    assert not len(again.pixels)


def test_chunks_draw_what_the_whole_does(package, monkeypatch):
    raster = package("display.raster")
    rng = np.random.default_rng(0)
    corners, depth = rng.random((300, 3, 2)) * 40, rng.random((300, 3))
    whole = raster.cover(corners, depth, (40, 40))
    monkeypatch.setattr(raster, "CHUNK", 500)
    parts = raster.cover(corners, depth, (40, 40))
    assert np.array_equal(whole.triangles, parts.triangles) and np.array_equal(whole.weights, parts.weights)


def test_distances_to_edges_are_those_of_the_plane(package):
    raster = package("display.raster")
    corners = np.array([[[0, 0], [40, 0], [0, 30]]], float)
    found = raster.cover(corners, np.zeros((1, 3)), (30, 40))
    x, y = (found.pixels % 40) + 0.5, (found.pixels // 40) + 0.5
    assert raster.edge_distances(corners, found)[:, 1:] == pytest.approx(np.column_stack([x, y]))


@pytest.fixture
def square(package):
    """Two polygons of a flat square, one of them a quad, with the UVs of its positions."""
    placed, preview = package("display.preview").Placed, package("display.preview").preview
    surfaces, readings = package("solver.mesh.surface"), package("pipelines.reading")
    positions = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], float)
    surface = surfaces.Surface(
        positions=positions,
        corner_vertex=np.array([0, 1, 2, 3, 1, 4, 2]),
        face_start=np.array([0, 4, 7]),
        triangles=np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6]]),
        triangle_face=np.array([0, 0, 1]),
        seams=np.zeros((0, 2), np.int64),
    )
    uv = (positions[surface.corner_vertex][:, :2] / 2).astype(np.float32)

    def draw(uv=uv, tile=64, cells=None):
        reading = readings.Reading(surface, np.ones(2, bool), uv, None)
        return preview([placed(reading, np.eye(3), np.zeros(3), cells)], tile)

    draw.uv = uv
    return draw


def test_a_preview_has_a_checker_a_layout_and_wires(square):
    picture = square()
    assert picture.shape == (64, 192, 3) and picture.min() >= 0 and picture.max() <= 1
    tiles = np.split(picture, 3, axis=1)
    drawn = [(tile < 0.999).any(2).mean() for tile in tiles]
    assert all(0.05 < share < 0.9 for share in drawn) and drawn[0] == drawn[2]
    assert square(uv=None).shape == (64, 128, 3)


def test_the_diagonal_of_a_quad_is_no_line(square):
    """Of the layout, whose colour inside is that of exact areas wherever there is no line."""
    layout = np.split(square(tile=256), 3, axis=1)[1]
    # The middle of the quad lies on its diagonal, and that of the edge between both polygons on a line.
    middle = layout[256 - 15 - 57 - 1, 15 + 57]
    size = 256 * 0.88
    edge = layout[round(256 * 0.94 - size / 4), round(256 * 0.06 + size / 2)]
    assert middle.min() > edge.min() + 0.1


def test_cells_are_shown_in_their_colours_with_uvs_and_without(square, package):
    """What is flat has one brightness, and shows as many colours as there are cells; what is in none is clay."""

    def colours(picture):
        tile = picture[:, :64].reshape(-1, 3)
        # Those of pixels at outlines are mixed with paper.
        found, count = np.unique((tile / tile.max(axis=1, keepdims=True)).round(3), axis=0, return_counts=True)
        return {tuple(c) for c, n in zip(found, count, strict=True) if n > 100}

    one, two, part = (colours(square(cells=np.array(c))) for c in ([0, 0], [0, 1], [-1, 1]))
    clay = package("display.preview").CLAY
    assert len(one) == 2 and one < two and len(two) == 3 and colours(square(uv=None, cells=np.array([0, 1]))) == two
    assert part - two == {tuple((clay / clay.max()).round(3))}


def test_a_folded_face_is_in_a_colour_of_its_own(square, package):
    uv = square.uv.copy()
    uv[5] = (0.1, 0.25)
    layout = np.split(square(uv=uv), 3, axis=1)[1]
    folded = package("display.preview").FOLDED
    assert (np.abs(layout - folded).max(2) < 0.02).any()
    assert not (np.abs(np.split(square(), 3, axis=1)[1] - folded).max(2) < 0.02).any()


def test_a_picture_is_read_back_from_its_bytes(package, tmp_path):
    import bpy

    picture = np.random.default_rng(0).random((7, 11, 3))
    (tmp_path / "p.png").write_bytes(package("display.png").png_bytes(picture))
    image = bpy.data.images.load(str(tmp_path / "p.png"))
    image.colorspace_settings.name = "Non-Color"
    read = np.array(image.pixels[:]).reshape(7, 11, 4)[::-1, :, :3]
    assert np.abs(read - picture).max() <= 0.51 / 255


def test_a_layout_is_drawn_where_every_object_has_uvs(package, monkeypatch):
    preview = package("display.preview")
    whole = [SimpleNamespace(space=np.ones((k, 3, 3)), normals=np.ones((k, 3, 3)), uv=np.full((k, 3, 2), float(k)),
                             real=np.ones((k, 3), bool), octaves=np.zeros(k), cells=np.full(k, -1))
             for k in (2, 3)]  # fmt: skip
    monkeypatch.setattr(preview, "_of_object", lambda item: item)
    found = preview._drawn(whole)
    assert found.uv[:, 0, 0].tolist() == [2, 2, 3, 3, 3] and len(found.space) == len(found.octaves) == 5
    whole[1].uv = None
    assert preview._drawn(whole).uv is None
