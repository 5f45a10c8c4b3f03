"""Equal islands share their texture, halves are the same, strips are rectangles; other corners keep their bits."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


def two_patches(mirror=False):
    """Two equal patches in one mesh, the second turned and elsewhere, or seen in the plane x = 0."""
    obj = scenes.bump(5, 4)
    points = np.array([v.co for v in obj.data.vertices]) + [0.3, 0, 0]
    faces = np.array([p.vertices for p in obj.data.polygons])
    bpy.data.objects.remove(obj)
    second = points * [-1, 1, 1] if mirror else points[:, [1, 2, 0]] + [4, 0, 0]
    obj = scenes.add(np.concatenate([points, second]), np.concatenate([faces, faces + len(points)]))
    uv = scenes.seen_from_above(obj)
    scenes.set_uv(obj, uv * 0.1 + np.repeat([[0, 0], [0.5, 0.5]], len(uv) // 2, axis=0))
    return obj


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("mirror", [False, True])
def test_equal_islands_are_stacked(mirror, mode):
    obj = two_patches(mirror)
    if mode == "EDIT":
        scenes.edit(obj)
    assert bpy.ops.uv.omt_stack() == {"FINISHED"}
    # A patch that is its own image has two motions that fit: the same places, whichever vertex is where.
    first, second = (np.unique(uv.round(4), axis=0) for uv in scenes.uv_of(obj).reshape(2, -1, 2))
    assert np.allclose(first, second, atol=2e-4)


@pytest.mark.parametrize("halves", ["APART", "STACKED"])
def test_halves_are_the_same(halves):
    obj = two_patches(True)
    assert bpy.ops.uv.omt_symmetrize(halves=halves) == {"FINISHED"}
    first, second = scenes.uv_of(obj).reshape(2, -1, 2)
    if halves == "STACKED":
        assert np.allclose(first, second, atol=1e-5)
    else:
        assert np.allclose(np.diff(first, axis=0), np.diff(second, axis=0) * [-1, 1], atol=1e-5)


def test_a_strip_has_its_areas_to_the_last_quad(package):
    obj = scenes.bump(9, 1)
    scenes.set_uv(obj, scenes.seen_from_above(obj) * 0.5)
    assert bpy.ops.uv.omt_rectify() == {"FINISHED"}
    found = package("pipelines.distortion").measure_readings([package("blender.mesh").read(obj)])
    assert found.area_l1 < 1e-5 and found.folds == 0
    assert len(np.unique(scenes.uv_of(obj)[:, 1].round(5))) == 2


@pytest.mark.parametrize("scale", [0.2, 1.0, 3.0])
def test_a_rectangle_has_the_area_and_the_middle_of_its_island(scale):
    obj = scenes.bump(9, 2)
    uv = scenes.seen_from_above(obj)
    scenes.set_uv(obj, scale * (uv + 0.1 * np.sin(3 * uv[:, ::-1])) + [2, 1])
    before, area = scenes.uv_of(obj), scenes.areas(obj)[1].sum()
    assert bpy.ops.uv.omt_rectify() == {"FINISHED"}
    assert scenes.areas(obj)[1].sum() == pytest.approx(area, rel=1e-4)
    after = scenes.uv_of(obj)
    assert np.abs(after.mean(axis=0) - before.mean(axis=0)).max() < 0.1 * scale


def test_the_middle_of_an_object_is_that_of_its_box():
    """However many vertices are on one side."""
    y, x = np.mgrid[0:3, 0:3] / 2.0
    flat = np.stack([x + 0.2, y + 0.3 * x * y, 0.4 * x * (1 - y)], axis=-1).reshape(-1, 3)
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    alone = flat * [0.5, 1, 1] + [0, 3, 0]
    obj = scenes.add([*flat, *(flat * [-1, 1, 1]), *alone], [*quads, *(quads[:, [0, 3, 2, 1]] + 9), *(quads + 18)])
    uv = scenes.seen_from_above(obj)
    scenes.set_uv(obj, uv + 0.05 * np.sin(5 * uv[:, ::-1]))
    assert bpy.ops.uv.omt_symmetrize(halves="STACKED") == {"FINISHED"}
    corner = np.array([loop.vertex_index for loop in obj.data.loops])
    place = {int(v): uv for v, uv in zip(corner, scenes.uv_of(obj), strict=True)}
    np.testing.assert_allclose([place[v] for v in range(9)], [place[v + 9] for v in range(9)], atol=1e-5)


def test_what_cannot_be_arranged_is_said_and_changes_nothing():
    obj = scenes.cube()
    scenes.set_uv(obj, np.random.default_rng(0).uniform(size=(len(obj.data.loops), 2)))
    bpy.context.view_layer.update()
    obj2 = scenes.add([(0, 0, 0), (1, 0, 0), (0, 1, 0.3)], [(0, 1, 2)], "Triangle")
    scenes.set_uv(obj2, scenes.seen_from_above(obj2))
    scenes.select([obj2])
    before = scenes.uv_of(obj2)
    assert "no quads" in scenes.error_of(bpy.ops.uv.omt_rectify)
    assert "image" in scenes.error_of(bpy.ops.uv.omt_symmetrize, axis="Z")
    assert (scenes.uv_of(obj2) == before).all()
    bare = scenes.bump()
    scenes.select([bare])
    for operator in (bpy.ops.uv.omt_stack, bpy.ops.uv.omt_symmetrize, bpy.ops.uv.omt_rectify):
        assert "Unwrap the mesh first" in scenes.error_of(operator)


def test_rectangles_that_cover_each_other_are_said(capfd):
    """Two bent strips lie within each other's bends; their rectangles do not fit there."""
    turn = np.pi * np.linspace(0, 1, 13)
    points, faces = [], []
    for radius, thick in ((1.0, 0.2), (0.7, 0.2)):
        first = len(points)
        for t in turn:
            points += [(r * np.cos(t), r * np.sin(t), 0.0) for r in (radius, radius - thick)]
        faces += [
            (first + 2 * k, first + 2 * k + 1, first + 2 * k + 3, first + 2 * k + 2) for k in range(len(turn) - 1)
        ]
    obj = scenes.add(points, faces)
    layer = obj.data.uv_layers.new()
    for loop in obj.data.loops:
        layer.data[loop.index].uv = obj.data.vertices[loop.vertex_index].co[:2]
    assert bpy.ops.uv.omt_rectify() == {"FINISHED"}
    assert "grew into each other" in capfd.readouterr().out
