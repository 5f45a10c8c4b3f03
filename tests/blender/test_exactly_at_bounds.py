"""What a mesh can hold at most is taken, and the next one is refused."""

from __future__ import annotations

from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize(("name", "taken"), [("a" * 63, True), ("a" * 64, False), ("ü" * 31, True), ("ü" * 32, False)])
def test_names_of_uv_layers_are_as_long_as_blender_holds(package, name, taken):
    """In bytes, of which a letter may have several."""
    mesh, obj = package("blender.mesh"), scenes.bump()
    if taken:
        mesh.check_target(obj, name)
    else:
        with pytest.raises(mesh.TargetError, match="is too long"):
            mesh.check_target(obj, name)


@pytest.mark.parametrize(("there", "taken"), [(7, True), (8, False)])
def test_the_eighth_uv_layer_is_the_last(package, there, taken):
    mesh, obj = package("blender.mesh"), scenes.bump()
    while len(obj.data.uv_layers) < there:
        obj.data.uv_layers.new(name=f"UV {len(obj.data.uv_layers)}")
    mesh.check_target(obj, obj.data.uv_layers[0].name)
    mesh.check_target(obj, "")
    if taken:
        mesh.check_target(obj, "new")
    else:
        with pytest.raises(mesh.TargetError, match="the most a mesh can hold"):
            mesh.check_target(obj, "new")


@pytest.mark.parametrize(("brought", "taken"), [(["UV 0", "a", "b"], True), (["UV 0", "a", "b", "c"], False)])
def test_uv_maps_that_are_brought_have_room_beside_those_there(package, brought, taken):
    """Those of the same names are written over."""
    matched, kinds, obj = package("blender.shapes.match_objects"), package("pipelines.attributes"), scenes.bump()
    while obj.data.uv_layers:
        obj.data.uv_layers.remove(obj.data.uv_layers[0])
    for k in range(6):
        obj.data.uv_layers.new(name=f"UV {k}")
    corners = len(obj.data.loops)
    layers = tuple(kinds.Layer(name, "CORNER", "FLOAT2", np.zeros((corners, 2), np.float32)) for name in brought)
    attributes = SimpleNamespace(layers=layers, groups=())
    if taken:
        matched.check_room(obj, attributes, {"uv"})
    else:
        with pytest.raises(matched.MatchError, match="would have more than 8 UV maps"):
            matched.check_room(obj, attributes, {"uv"})
    matched.check_room(obj, attributes, {"materials"})


@pytest.mark.parametrize(("slots", "taken"), [(3, True), (4, False)])
def test_materials_of_cells_need_a_slot(package, monkeypatch, slots, taken):
    faces, obj = package("blender.shapes.cell_faces"), scenes.bump()
    monkeypatch.setattr(faces, "MOST_MATERIALS", 4)
    for k in range(slots):
        obj.data.materials.append(bpy.data.materials.new(f"M{k}"))
    faces.check_cells(obj, "face_sets")
    if taken:
        faces.check_cells(obj, "materials")
    else:
        with pytest.raises(package("blender.mesh").TargetError, match="material slots already"):
            faces.check_cells(obj, "materials")
