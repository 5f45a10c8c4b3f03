"""Layouts of several objects, and previews, show areas by one scale for all, as they share a texture."""

from __future__ import annotations

import numpy as np
import pytest
import scenes
from readings import reading

from omt_uv.display import colormaps, preview
from omt_uv.display.textures import layouts

SQUARE = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


def placed(side, corner, width):
    """A square of this side, and a square of the texture from this corner on."""
    uv = (SQUARE[HALVES].reshape(-1, 3)[:, :2] * width + corner).astype(np.float32)
    return preview.Placed(reading(side * SQUARE, HALVES, uv), np.eye(3), np.zeros(3))


@pytest.mark.parametrize("widths", [(0.4, 0.4), (0.2, 0.4), (0.4, 0.1)])
@pytest.mark.parametrize("sides", [(1.0, 1.0), (1.0, 3.0)])
def test_faces_have_the_colours_of_their_shares_of_all(widths, sides):
    corners = [np.array([0.05, 0.05]), np.array([0.55, 0.55])]
    objects = [placed(*each) for each in zip(sides, corners, widths, strict=True)]
    picture = layouts.layout_picture(objects, "area", 64)
    flat, space = np.square(widths), np.square(sides)
    octaves = np.log2(flat / flat.sum() / (space / space.sum()))
    np.testing.assert_allclose(preview._drawn(objects).octaves, np.repeat(octaves, 2), atol=1e-6)
    for corner, width, expected in zip(corners, widths, colormaps.area_colours(octaves), strict=True):
        u, v = corner + width / 2
        np.testing.assert_allclose(picture[int(64 * (1 - v)), int(64 * u)], expected, atol=1e-6)


def test_the_picture_has_the_colours_that_the_3d_view_has(package):
    """Of objects of different densities, and with shear."""
    import bpy

    found = []
    for k, scale in enumerate((0.2, 0.45)):
        obj = scenes.bump(2, 2, height=0.3 * k, name=f"Bump {k}", offset=2.0 * k)
        uv = scenes.seen_from_above(obj) - [2.0 * k, 0]
        scenes.set_uv(obj, uv * [scale, 0.7 * scale] + 0.5 * k)
        found.append(obj)
    scenes.select(found)
    mesh = package("blender.mesh")
    for kind in ("AREA", "SHEAR"):
        assert bpy.ops.uv.omt_overlay(show=kind) == {"FINISHED"}
        items = [preview.Placed(mesh.read(obj), *mesh.place_of(obj)) for obj in found]
        picture = layouts.layout_picture(items, kind.lower(), 128)
        for obj in found:
            uv, layer = scenes.uv_of(obj).astype(float), obj.data.color_attributes.active_color
            colours = np.zeros(4 * len(obj.data.loops), np.float32)
            layer.data.foreach_get("color_srgb", colours)
            for face in obj.data.polygons:
                u, v = uv[list(face.loop_indices)].mean(axis=0)
                shown = picture[int(128 * (1 - v)), int(128 * u)]
                np.testing.assert_allclose(shown, colours.reshape(-1, 4)[face.loop_start, :3], atol=0.02)
        bpy.ops.uv.omt_overlay(show="NONE")


@pytest.mark.parametrize("kind", ["AREA", "SHEAR"])
def test_the_uv_editor_is_filled_with_every_face_where_it_lies_in_its_colour(package, kind):
    """What is drawn there, by plain formulas: places of triangles, colours of their faces, and the sides of these."""
    import bpy

    overlay = package("display.overlay")
    found = [scenes.bump(3, 2, name="One"), scenes.bump(2, 2, height=0.2, name="Two", offset=2.0)]
    for k, obj in enumerate(found):
        uv = scenes.seen_from_above(obj) - [2.0 * k, 0]
        scenes.set_uv(obj, uv * [0.2 + 0.2 * k, 0.3] + 0.02 * np.sin(9 * uv[:, ::-1]) + 0.5 * k)
    scenes.select(found)
    try:
        assert bpy.ops.uv.omt_overlay(show=kind) == {"FINISHED"}
        shown = overlay._shown
        places, colours = np.array(shown.places).reshape(-1, 3, 2), np.array(shown.colours).reshape(-1, 3, 4)
        edges = np.array(shown.edges).reshape(-1, 2, 2)
    finally:
        bpy.ops.uv.omt_overlay(show="NONE")
    space, flat = (np.concatenate(x) for x in zip(*map(scenes.polygon_areas, found), strict=True))
    octaves = np.log2(flat / flat.sum() / (space / space.sum()))
    polygons = [scenes.uv_of(obj)[list(face.loop_indices)] for obj in found for face in obj.data.polygons]
    sides = {
        tuple(map(tuple, (a, b))) for quad in polygons for a, b in zip(quad, np.roll(quad, -1, axis=0), strict=True)
    }
    assert {tuple(map(tuple, side)) for side in edges.astype(np.float32)} == sides and len(edges) == len(sides)
    assert len(places) == 2 * len(polygons) and np.ptp(colours, axis=1).max() == 0
    seen = np.zeros(len(polygons))
    for triangle, colour in zip(places, colours[:, 0], strict=True):
        (mine,) = [
            k for k, quad in enumerate(polygons) if all((np.abs(quad - c).max(axis=1) < 1e-6).any() for c in triangle)
        ]
        u, v = triangle[1] - triangle[0], triangle[2] - triangle[0]
        seen[mine] += (u[0] * v[1] - u[1] * v[0]) / 2
        if kind == "AREA":
            np.testing.assert_allclose(colour[:3], colormaps.area_colours(octaves[[mine]])[0], atol=1e-5)
    np.testing.assert_allclose(seen, flat, rtol=1e-5)
    if kind == "SHEAR":
        # All triangles of a face have one colour.
        of = [
            min(range(len(polygons)), key=lambda k: np.abs(polygons[k].mean(axis=0) - t.mean(axis=0)).sum())
            for t in places
        ]
        assert all(np.ptp(colours[np.array(of) == k, 0], axis=0).max() == 0 for k in set(of))
