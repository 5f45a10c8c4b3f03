"""What every operator makes of a mesh is the same in either mode, in whichever UV layer, beside a twin that shares the
mesh, whatever things are called, and what is hidden or not chosen stays."""

from __future__ import annotations

import bpy

import numpy as np
import operator_runs
import pytest
import scenes
from operator_runs import RUNS, Scene
from renumbered import alike

STRANGE = " of mine, nº 1 "


@pytest.fixture(scope="module")
def uvs(package):
    return operator_runs.some_uvs()


@pytest.fixture(scope="module")
def plain(uvs):
    """What each operator makes of two bodies in Object Mode, once."""
    made: dict = {}

    def of(name):
        if name not in made:
            found = operator_runs.bodies(uvs)
            operator_runs.call(name)
            made[name] = {letter: body.told() for letter, body in found.items()}
        return made[name]

    return of


def check(first, found, names=lambda key: key):
    """What is told of bodies is what was told of others, but for names."""
    for letter, one in first.items():
        two = {names(key): value for key, value in found[letter].told().items()}
        assert one.keys() == two.keys(), letter
        for key in one:
            assert alike(one[key], two[key], key), (letter, key)


def flags(obj):
    """What is selected and hidden of a mesh: vertices, edges and faces."""
    mesh = obj.data
    parts = (mesh.vertices, mesh.edges, mesh.polygons)
    return [[(item.select, item.hide) for item in part] for part in parts]


# These work in Object Mode alone, or write what Blender shows there alone.
IN_EDIT_MODE = [name for name in RUNS if name != "attributes"]


@pytest.mark.parametrize("name", IN_EDIT_MODE)
def test_either_mode_gives_the_same_and_keeps_what_is_selected(uvs, plain, name):
    first, found = plain(name), operator_runs.bodies(uvs)
    scenes.edit(*(body.obj for body in found.values()))
    before = (bpy.context.mode, tuple(bpy.context.tool_settings.mesh_select_mode))
    operator_runs.call(name)
    assert (bpy.context.mode, tuple(bpy.context.tool_settings.mesh_select_mode)) == before
    scenes.leave_edit()
    for body in found.values():
        assert all(selected and not hidden for part in flags(body.obj) for selected, hidden in part)
    check(first, found)


@pytest.mark.parametrize("name", RUNS)
def test_names_are_names(uvs, plain, name):
    strange = Scene("", False, f"group{STRANGE}", f"layer{STRANGE}", (STRANGE, f"B{STRANGE}"))
    first, found = plain(name), operator_runs.bodies(uvs, strange)
    operator_runs.call(name, f"group{STRANGE}")
    check(first, found, lambda key: key.replace(f"layer{STRANGE}", "UVMap").replace(f"group{STRANGE}", "region"))


@pytest.mark.parametrize("name", RUNS)
def test_the_layer_that_is_read_is_the_one_that_is_written(uvs, plain, name):
    first, found = plain(name), operator_runs.bodies(uvs, Scene("", False, "region", "middle"))
    others = {}
    for body in found.values():
        mesh, rng = body.obj.data, np.random.default_rng(1)
        uv = scenes.uv_of(body.obj)
        for layer in ("first", "last"):
            others[layer] = rng.random(uv.shape)
            scenes.set_uv(body.obj, others[layer], layer)
        scenes.set_uv(body.obj, others["first"], "middle")
        # The one of the middle is where the first was.
        mesh.uv_layers["first"].name = "x"
        mesh.uv_layers["middle"].name = "first"
        mesh.uv_layers["x"].name = "middle"
        scenes.set_uv(body.obj, uv, "middle")
        mesh.uv_layers.active = mesh.uv_layers["middle"]
        mesh.uv_layers["last"].active_render = True
        assert [layer.name for layer in mesh.uv_layers] == ["first", "middle", "last"]
    operator_runs.call(name)
    for body in found.values():
        layers = body.obj.data.uv_layers
        assert layers.active.name == "middle" and [layer.active_render for layer in layers] == [False, False, True]
        for layer, uv in others.items():
            np.testing.assert_array_equal(scenes.uv_of(body.obj, layer), uv.astype(np.float32))
            layers.remove(layers[layer])
    check(first, found, lambda key: key.replace("middle", "UVMap"))


@pytest.mark.parametrize("name", RUNS)
def test_a_twin_that_shares_the_mesh_changes_nothing(uvs, plain, name):
    first, found = plain(name), operator_runs.bodies(uvs)
    twins = [body.obj.copy() for body in found.values()]
    for twin in twins:
        bpy.context.collection.objects.link(twin)
        twin.location.y = 5
    scenes.select([*twins, *(body.obj for body in found.values())])
    operator_runs.call(name)
    check(first, found)
    assert [twin.data for twin in twins] == [body.obj.data for body in found.values()]
    assert len(bpy.data.meshes) == 2


@pytest.mark.parametrize("name", RUNS)
def test_what_is_hidden_counts_in_object_mode_and_stays_hidden(uvs, plain, name):
    first, found = plain(name), operator_runs.bodies(uvs)
    for body in found.values():
        for face in body.obj.data.polygons:
            face.hide, face.select = face.index % 3 == 0, face.index % 2 == 0
    before = [flags(body.obj) for body in found.values()]
    operator_runs.call(name)
    assert [flags(body.obj) for body in found.values()] == before
    check(first, found)


@pytest.mark.parametrize("name", RUNS)
def test_an_object_that_is_not_chosen_and_one_that_is_no_mesh_change_nothing(uvs, plain, name):
    first, found = plain(name), operator_runs.bodies(uvs)
    other = scenes.bump()
    scenes.set_uv(other, scenes.seen_from_above(other))
    other.vertex_groups.new(name="region").add([0, 1, 2], 1.0, "REPLACE")
    before = scenes.state(other)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    bpy.context.collection.objects.link(lamp)
    scenes.select([*(body.obj for body in found.values()), lamp])
    operator_runs.call(name)
    assert scenes.state(other) == before
    check(first, found)
