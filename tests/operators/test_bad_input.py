"""Every bad input: one error with cause, place and remedy, and not one bit of any mesh changed."""

from __future__ import annotations

import math
import re

import bpy

import numpy as np
import pytest
import scenes


def patch(extra_points=(), extra_faces=(), name="Bad"):
    """A bumpy patch with something added to it."""
    good = scenes.bump(4, 4)
    points = [tuple(v.co) for v in good.data.vertices]
    faces = [tuple(p.vertices) for p in good.data.polygons]
    bpy.data.objects.remove(good)
    return scenes.add([*points, *extra_points], [*faces, *extra_faces], name)


def non_manifold_edge():
    return patch([(0.3, 0.3, 2)], [(6, 7, 25)]), "EDGE"


def zero_area_face():
    return patch([(3, 0, 0), (4, 0, 0), (5, 0, 0)], [(25, 26, 27)]), "FACE"


def coincident_vertices():
    return patch([(3, 0, 0), (3, 0, 0), (5, 0, 0)], [(25, 26, 27)]), "FACE"


def duplicate_face():
    return patch([], [(0, 1, 6, 5)]), "FACE"


def not_a_number():
    obj = patch()
    obj.data.vertices[7].co.x = math.nan
    return obj, "VERT"


def infinite():
    obj = patch()
    # Setting the property of one vertex would clamp it.
    co = np.zeros(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", co)
    co[23] = np.inf
    obj.data.vertices.foreach_set("co", co)
    return obj, "VERT"


def wrong_orientation():
    obj = patch()
    obj.data.polygons[5].flip()
    obj.data.update()
    return obj, "EDGE"


def closed():
    obj = scenes.cube()
    for edge in obj.data.edges:
        edge.use_seam = False
    return obj, "FACE"


def several_boundaries():
    t = 2 * np.pi * np.arange(8) / 8
    rings = [np.stack([np.cos(t), np.sin(t), 0 * t + z], axis=1) for z in (0, 1)]
    return scenes.add(np.concatenate(rings), [(i, (i + 1) % 8, 8 + (i + 1) % 8, 8 + i) for i in range(8)]), "EDGE"


def handle():
    """A torus of quads without one of its faces: one boundary, one handle."""
    n = 6
    t = 2 * np.pi * np.arange(n) / n
    a, b = np.meshgrid(t, t, indexing="ij")
    points = np.stack([(2 + np.cos(b)) * np.cos(a), (2 + np.cos(b)) * np.sin(a), np.sin(b)], axis=-1).reshape(-1, 3)
    faces = [(n * i + j, n * ((i + 1) % n) + j, n * ((i + 1) % n) + (j + 1) % n, n * i + (j + 1) % n)
             for i in range(n) for j in range(n)]  # fmt: skip
    return scenes.add(points, faces[1:]), "FACE"


def zero_scale():
    obj = patch()
    obj.scale = (0, 0, 0)
    return obj, None


def flat_scale():
    """Squashed to a line: every face without area."""
    obj = patch()
    obj.scale = (1, 0, 0)
    return obj, None


BAD = [not_a_number, infinite, closed, several_boundaries, handle, zero_scale, flat_scale]


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("make", BAD)
def test_refused_with_the_culprits_selected(make, mode):
    bystander = scenes.bump(name="Good")
    obj, kind = make()
    bystander.data.uv_layers.new(name="UVMap")
    obj.data.uv_layers.new(name="UVMap")
    if mode == "EDIT":
        scenes.edit(bystander, obj)
    else:
        scenes.select([bystander, obj])
    before = scenes.state(obj), scenes.state(bystander)
    message = scenes.error_of(bpy.ops.uv.omt_unwrap, uv_layer="New", seams="EXISTING")
    assert obj.name in message
    assert len(message.strip().splitlines()) == 1
    assert message.count(". ") >= 1, "cause and remedy"
    assert bpy.context.mode == ("OBJECT" if mode == "OBJECT" else "EDIT_MESH")
    assert (scenes.state(obj), scenes.state(bystander)) == before
    if kind is None:
        return
    shown = [
        name
        for name, on in zip(("VERT", "EDGE", "FACE"), bpy.context.scene.tool_settings.mesh_select_mode, strict=True)
        if on
    ]
    assert shown == [kind]
    if mode == "OBJECT":
        scenes.select([obj])
        bpy.ops.object.mode_set(mode="EDIT")
    obj.update_from_editmode()
    counts = {"VERT": obj.data.total_vert_sel, "EDGE": obj.data.total_edge_sel, "FACE": obj.data.total_face_sel}
    assert counts[kind] > 0
    said = re.search(r"\((\d+) (vert|edge|face)", message)
    assert said and said[2].upper() == kind and int(said[1]) == counts[kind]


def test_the_right_elements_are_selected():
    obj, _ = not_a_number()
    scenes.error_of(bpy.ops.uv.omt_unwrap, seams="EXISTING")
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.object.mode_set(mode="OBJECT")
    assert {v.index for v in obj.data.vertices if v.select} == {7}


def test_only_selected_faces_count():
    """What is wrong elsewhere in the mesh does not keep selected faces from being unwrapped."""
    obj, _ = several_boundaries()
    scenes.edit(obj, faces=[2, 3, 4])
    assert bpy.ops.uv.omt_unwrap(seams="EXISTING") == {"FINISHED"}


REPAIRED = [non_manifold_edge, zero_area_face, coincident_vertices, duplicate_face, wrong_orientation]
CUT = [closed, several_boundaries, handle]


@pytest.mark.parametrize("make, where", [(m, "AUTO") for m in (*REPAIRED, *CUT)] + [(m, "EXISTING") for m in REPAIRED])
def test_repaired_and_cut_for_the_map_only(make, where):
    obj, _ = make()
    obj.data.uv_layers.new(name="UVMap")
    points, faces = [tuple(v.co) for v in obj.data.vertices], [tuple(p.vertices) for p in obj.data.polygons]
    seams = [e.use_seam for e in obj.data.edges]
    assert bpy.ops.uv.omt_unwrap(quality="DRAFT", seams=where) == {"FINISHED"}
    assert [tuple(v.co) for v in obj.data.vertices] == points
    assert [tuple(p.vertices) for p in obj.data.polygons] == faces
    assert [e.use_seam for e in obj.data.edges] == seams
    space, uv = scenes.areas(obj)
    assert np.isfinite(uv).all() and (np.abs(uv[space > 1e-9]) > 0).all()


@pytest.mark.parametrize("make", [not_a_number, infinite, zero_scale, flat_scale])
def test_what_no_repair_helps_is_refused(make):
    obj, _ = make()
    before = scenes.state(obj)
    assert obj.name in scenes.error_of(bpy.ops.uv.omt_unwrap, uv_layer="New")
    assert scenes.state(obj) == before


def test_two_fans_at_a_vertex_are_split_for_the_map():
    obj = scenes.add(
        [(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0), (1, 1, 0.5), (-1, -1, 0.5)],
        [(0, 1, 5, 2), (0, 3, 6, 4)],
    )
    assert bpy.ops.uv.omt_unwrap() == {"FINISHED"}
    space, uv = scenes.areas(obj)
    assert (uv > 0).all()


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_nothing_selected(mode):
    obj = scenes.bump()
    before = scenes.state(obj)
    if mode == "OBJECT":
        scenes.select([])
        assert "No mesh is selected" in scenes.error_of(bpy.ops.uv.omt_unwrap)
    else:
        scenes.edit(obj, faces=[])
        assert "No face is selected" in scenes.error_of(bpy.ops.uv.omt_unwrap)
    assert scenes.state(obj) == before


def test_no_mesh_among_the_selected():
    bpy.ops.object.light_add()
    assert "No mesh is selected" in scenes.error_of(bpy.ops.uv.omt_unwrap)


@pytest.mark.parametrize("edges", [[], [(0, 1)]])
def test_mesh_without_faces(edges):
    obj = scenes.add([(0, 0, 0), (1, 0, 0)] if edges else [], [], edges=edges)
    before = scenes.state(obj)
    assert "no faces" in scenes.error_of(bpy.ops.uv.omt_unwrap)
    assert scenes.state(obj) == before


def test_margin_without_room():
    obj = scenes.bump()
    before = scenes.state(obj)
    message = scenes.error_of(bpy.ops.uv.omt_unwrap, margin=64, texture_size=64)
    assert "margin" in message
    assert "texture size" in message
    assert scenes.state(obj) == before


def test_too_many_layers():
    obj = scenes.bump()
    for k in range(8):
        obj.data.uv_layers.new(name=f"Layer {k}")
    before = scenes.state(obj)
    assert "8 UV layers" in scenes.error_of(bpy.ops.uv.omt_unwrap, uv_layer="New")
    assert scenes.state(obj) == before


def test_layer_name_that_is_another_attribute():
    obj = scenes.bump()
    obj.data.attributes.new("taken", "FLOAT", "POINT")
    before = scenes.state(obj)
    assert "taken" in scenes.error_of(bpy.ops.uv.omt_unwrap, uv_layer="taken")
    assert scenes.state(obj) == before


def test_edit_mode_hides_attributes_that_layers_must_not_replace():
    obj = scenes.bump()
    scenes.edit(obj)
    before = scenes.state(obj)
    assert "no UV layer" in scenes.error_of(bpy.ops.uv.omt_unwrap, uv_layer="position")
    assert scenes.state(obj) == before


def test_measure_without_uvs():
    scenes.bump()
    assert "no UVs" in scenes.error_of(bpy.ops.uv.omt_measure)
