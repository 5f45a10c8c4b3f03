"""What holds for every operator that works on meshes: several objects, what else they hold, where they stand, undo."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
from dressed_bodies import LAYER, bodies, body, state

# Arguments of each operator, and the parts of `scenes.state` that it may change; "UV": the active layer.
RUNS: dict[str, tuple[dict, set[str]]] = {
    "uv.omt_unwrap": ({"quality": "DRAFT", "balance": 0.6}, {"UV"}),
    "uv.omt_refine": ({"quality": "DRAFT"}, {"UV"}),
    "uv.omt_magnify": ({"quality": "DRAFT", "weight_group": "painted here", "factor": 2.0}, {"UV"}),
    "uv.omt_sphere": ({"quality": "DRAFT"}, {"UV"}),
    "uv.omt_density_set": ({"density": 40.0}, {"UV"}),
    "uv.omt_seams": ({}, {"seams", "uv_seam", ".uv_seam"}),
    "uv.omt_overlay": ({}, {"OMT UV Distortion"}),
    "object.omt_weights": ({"kind": "GAUSSIAN"}, {"groups"}),
    "uv.omt_measure": ({}, set()),
    "uv.omt_histogram": ({}, set()),
    "uv.omt_density_get": ({}, set()),
    "uv.omt_layout_image": ({"size": 32}, set()),
    "object.omt_remesh": ({"target_vertices": 40}, set()),
}
# What ends something, is a setting, or has meshes of its own kind, looked at by tests beside it.
OTHERS = {"uv.omt_preset", "wm.omt_copy_report", "wm.omt_help", "uv.omt_notices", "uv.omt_checker",
          "uv.omt_checker_remove", "uv.omt_live", "uv.omt_live_end", "uv.omt_remedy", "uv.omt_worst"}  # fmt: skip


def run(name):
    module, operator = name.split(".")
    return getattr(getattr(bpy.ops, module), operator)


def session():
    """What is of the scene and not of a mesh: modes, what is selected and active, tools, frame, and all data-blocks."""
    context, scene = bpy.context, bpy.context.scene
    every = (getattr(bpy.data, name) for name in dir(bpy.data))
    blocks = {block.name_full for them in every if isinstance(them, bpy.types.bpy_prop_collection) for block in them}
    tools = scene.tool_settings
    return {
        "scene": scene.name,
        "mode": context.mode,
        "active": context.view_layer.objects.active.name,
        "selected": sorted(obj.name for obj in context.selected_objects),
        "hidden": sorted(obj.name for obj in bpy.data.objects if obj.hide_viewport or obj.hide_get()),
        "select mode": tuple(tools.mesh_select_mode),
        "sync": tools.use_uv_select_sync,
        "frame": scene.frame_current,
        "cursor": tuple(scene.cursor.location),
        "transform": scene.view_settings.view_transform,
        "blocks": blocks,
    }


# How the names of data-blocks begin that an operator leaves; what it writes with, Blender's own font, may stay.
MAKES = {"uv.omt_histogram": ("OMT UV", "Bfont"), "uv.omt_layout_image": ("OMT UV",), "object.omt_remesh": ("",)}


def check_session(name, before, after):
    """Modes, tools and the selection stay, and no image, material or scene is left behind by a detour."""
    new = after["blocks"] - before["blocks"]
    assert before["blocks"] <= after["blocks"] and all(block.startswith(MAKES.get(name, ())) for block in new), new
    if name != "object.omt_remesh":
        assert {k for k in before if k != "blocks" and before[k] != after[k]} == set()


def changed(before, after):
    return {key for key in before.keys() | after.keys() if before.get(key) != after.get(key)}


def test_every_operator_is_looked_at(package):
    classes = [c for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    # Operators of a room of their own are looked at there, but for those that are here.
    rooms = {c.bl_idname: c.__module__.split(".operators.")[1].count(".") for c in classes}
    here = {name for name, depth in rooms.items() if depth == 0 or name in RUNS}
    assert here == (set(RUNS) | OTHERS) & here and set(RUNS) <= here


@pytest.mark.parametrize("name", RUNS)
def test_several_objects_change_where_they_shall_and_nowhere_else_and_undo_is_exact(name):
    found = bodies()
    arguments, may = RUNS[name]
    before = {obj.name: state(obj) for obj in found}
    everything = len(bpy.data.objects)
    bpy.context.scene.tool_settings.mesh_select_mode = (False, True, False)
    bpy.context.scene.frame_set(7)
    bpy.ops.ed.undo_push()
    there = session()
    assert run(name)("EXEC_DEFAULT", True, **arguments) == {"FINISHED"}
    check_session(name, there, session())
    for obj in found:
        more = {"names"} if "groups" in may else set()
        # A colour attribute that is new becomes a layer of its own name.
        new = changed(before[obj.name], state(obj)) - more
        new = {key for key in new if not ("OMT UV Distortion" in may and key.startswith("OMT"))} | (
            {"OMT UV Distortion"} if any(key.startswith("OMT") for key in new) else set()
        )
        assert new <= may and bool(new) == bool(may), (name, obj.name, new)
    if name == "object.omt_remesh":
        assert len(bpy.data.objects) == everything + 2
    if not may and "remesh" not in name:
        return  # there is nothing to undo
    bpy.ops.ed.undo()
    assert len(bpy.data.objects) == everything
    for key, old in before.items():
        assert changed(old, state(bpy.data.objects[key])) == set(), (name, key)


# A transform that is scaled by three different numbers, turned, and sheared by its parent.
def sheared(obj):
    parent = bpy.data.objects.new("a parent of it", None)
    bpy.context.collection.objects.link(parent)
    parent.scale, parent.rotation_euler = (1.0, 1.7, 0.6), (0.3, 0.5, -0.4)
    obj.parent, obj.scale, obj.rotation_euler = parent, (1.4, 0.8, 1.1), (0.9, -0.2, 0.6)
    bpy.context.view_layer.update()


def apply_transform(obj):
    matrix = obj.matrix_world.copy()
    obj.parent = None
    obj.matrix_world = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    obj.data.transform(matrix)
    obj.data.update()
    bpy.context.view_layer.update()


# Globes turn with the axes of the object.
WRITES = [name for name, (_, may) in RUNS.items() if may and name not in ("uv.omt_overlay", "uv.omt_sphere")]


@pytest.mark.parametrize("name", WRITES)
def test_a_transform_of_the_object_is_as_good_as_one_of_the_mesh(name):
    results = []
    for applied in (False, True):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        obj = body("One of two", 7, 5)
        sheared(obj)
        if applied:
            apply_transform(obj)
        scenes.select([obj])
        assert bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0) == {"FINISHED"}
        # The same UVs to begin with, for what depends on these.
        if results:
            scenes.set_uv(obj, results[0][0], LAYER)
        begin = scenes.uv_of(obj)
        assert run(name)(**RUNS[name][0]) == {"FINISHED"}
        seams = [edge.use_seam for edge in obj.data.edges]
        weights = [[round(g.weight, 3) for g in v.groups] for v in obj.data.vertices]
        results.append((begin, scenes.uv_of(obj), seams, weights))
    (_, uv, seams, weights), (_, other_uv, other_seams, other_weights) = results
    assert seams == other_seams
    # Where heights cancel, an axis of the object stands for up, and the map may be turned.
    w, other = ((x - x.mean(axis=0)) @ [1, 1j] for x in (uv, other_uv))
    turn = (w.conj() * other).sum()
    # Islands that lie otherwise than before are packed a little otherwise.
    atol = 1e-3 if name == "uv.omt_magnify" else 1e-5
    np.testing.assert_allclose(other, w * turn / np.abs(turn), atol=atol)
    if name != "uv.omt_magnify":
        np.testing.assert_allclose(uv, other_uv, atol=1e-5)
    for mine, others in zip(weights, other_weights, strict=True):
        np.testing.assert_allclose(mine, others, atol=2e-3)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1.0, 1.5, 0.7), (0.5, 2.0, -1.2)], ids=str)
def test_areas_are_those_in_the_world_for_all_objects_together(scale):
    found = bodies()
    found[1].scale = scale
    bpy.context.view_layer.update()
    for name in ("uv.omt_unwrap", "uv.omt_refine"):
        arguments = {"max_shear": 0.0} if name == "uv.omt_unwrap" else {}
        assert run(name)(quality="STANDARD", **arguments) == {"FINISHED"}
        space, uv = (np.concatenate(x) for x in zip(*map(scenes.polygon_areas, found), strict=True))
        if name == "uv.omt_unwrap":
            error = np.abs(np.abs(uv) / np.abs(uv).sum() - space / space.sum()).sum()
            assert error < 0.02, scale
        for obj in found:
            space, uv = scenes.polygon_areas(obj)
            assert np.abs(np.abs(uv) / np.abs(uv).sum() - space / space.sum()).sum() < 0.02, (name, obj.name)


# What writes UVs of chosen faces in Edit Mode, with arguments; two of them need shapes of their own.
CHOSEN = {name: arguments for name, (arguments, may) in RUNS.items() if "UV" in may} | {
    "uv.omt_flow": {"start": (0.5, 0.5), "move": (0.1, 0.0), "radius": 0.5},
    "uv.omt_stack": {},
    "uv.omt_symmetrize": {},
    "uv.omt_rectify": {},
}


def twice(name):
    """An object of two equal parts, each a closed body or two patches, with UVs; and which faces are the first part."""
    if name == "uv.omt_sphere":
        one = body("One", 7, 5)
        points, faces = [v.co[:] for v in one.data.vertices], [tuple(p.vertices) for p in one.data.polygons]
        bpy.data.objects.remove(one)
        n = len(points)
        points += [(x + 4, y, z) for x, y, z in points]
        faces += [tuple(v + n for v in face) for face in faces]
    else:
        y, x = np.mgrid[0:4, 0:4] / 3.0
        flat = np.stack([x + 0.2, y + 0.3 * x * y, 0.4 * x * (1 - y)], axis=-1).reshape(-1, 3)
        quads = np.array([[r + c, r + c + 1, r + c + 5, r + c + 4] for r in (0, 4, 8) for c in range(3)])
        points = np.concatenate([flat + [0, 2 * k, 0] if side > 0 else flat * [-1, 1, 1] + [0, 2 * k, 0]
                                 for k in (0, 1) for side in (1, -1)])  # fmt: skip
        faces = [quad + 16 * k for k in range(4) for quad in (quads if k % 2 == 0 else quads[:, [0, 3, 2, 1]])]
    obj, half = scenes.add(points, faces), len(points) // 2
    obj.vertex_groups.new(name="painted here").add([*range(5), *range(half, half + 5)], 1.0, "REPLACE")
    assert run("uv.omt_unwrap")(quality="DRAFT", max_shear=0.0, margin=30) == {"FINISHED"}
    uv = scenes.uv_of(obj)
    scenes.set_uv(obj, uv + 0.02 * np.sin(9 * uv[:, ::-1]), obj.data.uv_layers.active.name)
    return obj, np.arange(len(faces)) < len(faces) // 2


@pytest.mark.parametrize("name", CHOSEN)
def test_in_edit_mode_chosen_faces_change_and_no_others_and_the_mode_stays(name):
    obj, chosen = twice(name)
    layer = obj.data.uv_layers.active.name
    before = scenes.uv_of(obj)
    corners = np.repeat(chosen, [p.loop_total for p in obj.data.polygons])
    results = []
    for faces in (chosen, ~chosen):
        scenes.set_uv(obj, before, layer)
        scenes.edit(obj, faces=faces)
        assert run(name)(**CHOSEN[name]) == {"FINISHED"}
        assert bpy.context.mode == "EDIT_MESH"
        scenes.leave_edit()
        assert [p.select for p in obj.data.polygons] == faces.tolist()
        results.append((scenes.uv_of(obj) != before).any(axis=1))
    first, second = results
    assert first[corners].any() and not first[~corners].any()
    assert second[~corners].any() and not second[corners].any()


@pytest.mark.parametrize("name", CHOSEN)
def test_uvs_of_faces_that_are_not_chosen_may_be_no_numbers(name):
    obj, chosen = twice(name)
    layer = obj.data.uv_layers.active.name
    corners = np.repeat(chosen, [p.loop_total for p in obj.data.polygons])
    broken = scenes.uv_of(obj)
    broken[~corners] = np.nan
    scenes.set_uv(obj, broken, layer)
    scenes.edit(obj, faces=chosen)
    assert run(name)(**CHOSEN[name]) == {"FINISHED"}
    scenes.leave_edit()
    after = scenes.uv_of(obj)
    assert np.isfinite(after[corners]).all() and np.isnan(after[~corners]).all()
    assert (after[corners] != broken[corners]).any()
