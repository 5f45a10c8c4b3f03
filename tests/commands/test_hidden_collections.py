"""Meshes in collections that are hidden, left out or not to be selected are written, and once, in any format."""

from __future__ import annotations

import bpy

import pytest
import scenes


def _hidden(collection, layer, obj):
    collection.hide_viewport = True


def _not_selectable(collection, layer, obj):
    collection.hide_select = True


def _left_out(collection, layer, obj):
    layer.exclude = True


def _hidden_itself(collection, layer, obj):
    obj.hide_viewport = obj.hide_select = True


WAYS = (_hidden, _not_selectable, _left_out, _hidden_itself)
IMPORTERS = {
    "obj": lambda path: bpy.ops.wm.obj_import(filepath=path),
    "ply": lambda path: bpy.ops.wm.ply_import(filepath=path),
    "stl": lambda path: bpy.ops.wm.stl_import(filepath=path),
    "glb": lambda path: bpy.ops.import_scene.gltf(filepath=path),
    "fbx": lambda path: bpy.ops.import_scene.fbx(filepath=path),
}


def triangles():
    """Triangles of all meshes of the scene."""
    return sum(
        len(p.vertices) - 2 for obj in bpy.context.scene.objects if obj.type == "MESH" for p in obj.data.polygons
    )


@pytest.fixture(params=WAYS, ids=lambda way: way.__name__)
def half_hidden(request, tmp_path):
    """A file of two meshes of 24 and 40 triangles, the second of them hidden in some way."""
    scenes.bump(4, 3, name="Seen")
    other = scenes.bump(5, 4, name="Hidden", offset=3.0)
    collection = bpy.data.collections.new("Aside")
    bpy.context.scene.collection.children.link(collection)
    for mine in list(other.users_collection):
        mine.objects.unlink(other)
    collection.objects.link(other)
    request.param(collection, bpy.context.view_layer.layer_collection.children["Aside"], other)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    return tmp_path / "in.blend"


@pytest.mark.parametrize("suffix", IMPORTERS)
def test_all_of_a_file_is_written_once(package, half_hidden, suffix, capfd):
    out = half_hidden.with_name(f"out.{suffix}")
    assert package("cli").main(["unwrap", str(half_hidden), "-o", str(out), "--quality", "draft"]) == 0, (
        capfd.readouterr()
    )
    scenes.open_empty()
    IMPORTERS[suffix](str(out))
    assert triangles() == 64
