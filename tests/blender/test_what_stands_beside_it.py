"""What is read, chosen and written where something like it stands beside it: a second layer with pins of its own, a
scale that is nearly even, elements that were chosen before, materials of the object and of the mesh, sides turned back.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations, product

import bpy

import numpy as np
import pytest
import scenes
from mathutils import Matrix

MODES = ("OBJECT", "EDIT")
KINDS = ("vertex", "edge", "face")


@pytest.mark.parametrize(("mode", "active", "asked"), list(product(MODES, ("A", "B"), ("A", "B", "", "none"))))
def test_uvs_and_pins_are_those_of_the_layer_that_is_named_whichever_is_active(package, mode, active, asked):
    mesh = package("blender.mesh")
    obj = scenes.bump(2, 2)
    uv, pinned = {}, {}
    for k, name in enumerate("AB"):
        uv[name] = scenes.seen_from_above(obj, 0.3 + 0.2 * k)
        scenes.set_uv(obj, uv[name], name)
        pinned[name] = scenes.pin(obj, [k, 4 + k], name)
    obj.data.uv_layers.active = obj.data.uv_layers[active]
    if mode == "EDIT":
        scenes.edit(obj)
    found = mesh.read(obj, asked)
    meant = asked if asked in uv else active
    np.testing.assert_array_equal(found.uv, uv[meant])
    np.testing.assert_array_equal(found.pinned, pinned[meant])
    # What is written to one of them leaves the other one, and which is active.
    mesh.write_uv(obj, meant, np.arange(3), np.full((3, 2), 0.5))
    (other,) = {"A", "B"} - {meant}
    np.testing.assert_array_equal(scenes.uv_of(obj, other), uv[other])
    assert (scenes.uv_of(obj, meant)[:3] == 0.5).all() and obj.data.uv_layers.active.name == active


@pytest.mark.parametrize("off", [0.0, 1e-4, 1e-3, 1e-2, -0.1])
def test_a_scale_that_is_nearly_even_is_taken_as_it_is(package, off):
    obj = scenes.bump()
    obj.scale = scales = np.array([2.0, 2.0 * (1 + off), 2.0 * (1 - off / 2)])
    bpy.context.view_layer.update()
    np.testing.assert_allclose(package("blender.mesh").stretch(obj), np.diag(scales), rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("count", [6, 7, 8])
def test_a_layer_is_refused_where_there_are_eight_and_before_anything_is_made(package, count):
    mesh = package("blender.mesh")
    obj = scenes.bump(1, 1)
    for k in range(count):
        obj.data.uv_layers.new(name=f"{k}")
    mesh.check_target(obj, "")
    mesh.check_target(obj, "3")
    if count < 8:
        mesh.check_target(obj, "New")
    else:
        with pytest.raises(mesh.TargetError, match="8 UV layers, the most"):
            mesh.check_target(obj, "New")


def chosen(obj, kind):
    """Indices of the selected elements of a kind, and how many there are."""
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    elements = {"vertex": obj.data.vertices, "edge": obj.data.edges, "face": obj.data.polygons}[kind]
    return [element.index for element in elements if element.select]


@pytest.mark.parametrize(("mode", "kind", "before"), list(product(MODES, KINDS, ("all", "none", "some"))))
def test_what_an_error_is_about_is_chosen_and_nothing_of_what_was_chosen_before(package, mode, kind, before):
    obj = scenes.bump(3, 3)
    # One vertex is of no edge.
    obj.data.vertices.add(1)
    scenes.edit(obj, faces={"all": None, "none": [], "some": [8]}[before])
    if before == "all":
        bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
        bpy.ops.mesh.select_all(action="SELECT")
    bpy.context.scene.tool_settings.mesh_select_mode = (True, True, True)
    if mode == "OBJECT":
        scenes.leave_edit()
    edges = obj.data.edges
    ends = [tuple(edges[k].vertices) for k in (0, 3)]
    elements = {"vertex": np.array([0, 5]), "edge": np.array(ends), "face": np.array([0, 4])}[kind]
    package("blender.mesh").select_elements(obj, kind, elements)
    assert chosen(obj, kind) == {"vertex": [0, 5], "edge": [0, 3], "face": [0, 4]}[kind]
    expected = {
        "vertex": {0, 5},
        "edge": {v for pair in ends for v in pair},
        "face": {v for k in (0, 4) for v in obj.data.polygons[k].vertices},
    }[kind]
    assert set(chosen(obj, "vertex")) == expected
    if kind == "vertex":
        assert chosen(obj, "face") == []


@pytest.mark.parametrize("off", [0.0, 1e-4, 1e-3, 1e-2])
def test_objects_share_a_new_mesh_only_at_one_scale_along_every_axis(package, off):
    remesh = package("blender.remesh_objects")
    first = scenes.bump()
    found = [first]
    for k, axes in enumerate([(1, 1, 1), (1 + off, 1 / (1 + off), 1)]):
        obj = bpy.data.objects.new(f"{k}", first.data)
        bpy.context.collection.objects.link(obj)
        obj.matrix_world = Matrix.Rotation(0.3 + k, 4, "X") @ Matrix.Diagonal((*axes, 1))
        found.append(obj)
    bpy.context.view_layer.update()
    together = [[obj.name for obj in group] for group in remesh.alike(found, applied=False)]
    assert together == ([["Bump", "0", "1"]] if off == 0 else [["Bump", "0"], ["1"]])
    assert len(remesh.alike(found, applied=True)) == 3


@pytest.fixture(scope="module")
def remeshed(package):
    """A level of a curved patch, made once."""
    from omt_uv.solver.progress import drain

    settings = package("settings").RemeshSettings(count=30)
    scenes.open_empty()
    request = package("blender.remesh_objects").read_request(scenes.bump(), settings)
    return request, drain(package("pipelines.remesh").remesh_series(request.job, settings))


def made_of(package, remeshed, change=lambda level: level):
    remesh = package("blender.remesh_objects")
    request, series = remeshed
    series = replace(series, levels=[change(level) for level in series.levels])
    obj = scenes.bump()
    names = remesh.new_objects([obj], request, series, remesh.carried_attributes(request, series))
    return obj, [bpy.data.objects[name] for name in names]


def test_triangles_that_are_to_look_back_are_turned_over_and_no_others(package, remeshed):
    def some_back(level):
        return replace(level, back=np.arange(len(level.triangles)) % 3 == 1)

    _, (plain,) = made_of(package, remeshed)
    _, (turned,) = made_of(package, remeshed, some_back)
    normals = [np.array([p.normal[:] for p in obj.data.polygons]) for obj in (plain, turned)]
    same = (normals[0] * normals[1]).sum(axis=1)
    np.testing.assert_allclose(same, np.where(np.arange(len(same)) % 3 == 1, -1, 1), atol=1e-5)


@pytest.mark.parametrize("links", list(permutations(("DATA", "OBJECT"))), ids=str)
def test_a_new_object_has_each_material_where_the_old_one_has_it(package, remeshed, links):
    obj = scenes.bump()
    for k, link in enumerate(links):
        obj.data.materials.append(bpy.data.materials.new(f"of the mesh {k}"))
        obj.material_slots[k].link = link
        if link == "OBJECT":
            obj.material_slots[k].material = bpy.data.materials.new(f"of the object {k}")
    remesh = package("blender.remesh_objects")
    request, series = remeshed
    (name,) = remesh.new_objects([obj], request, series, remesh.carried_attributes(request, series))
    new = bpy.data.objects[name]
    assert [slot.link for slot in new.material_slots] == list(links)
    assert [slot.material for slot in new.material_slots] == [slot.material for slot in obj.material_slots]
    assert list(new.data.materials) == list(obj.data.materials)


@pytest.mark.parametrize("order", list(permutations("abc")), ids="".join)
def test_a_family_has_its_source_first_and_then_the_finest_whatever_their_names(package, order):
    remesh = package("blender.remesh_objects")
    source = scenes.bump(3, 3, name="b and a half")
    assert remesh.family(source) == []
    made = [scenes.bump(2 + k, 2, name=name) for k, name in enumerate(order)]
    for obj in made:
        obj[remesh.SOURCE] = source
    for asked in (source, *made):
        assert remesh.family(asked) == [source, *reversed(made)]


@pytest.mark.parametrize(("old", "new"), list(product((False, True), repeat=2)))
def test_folds_that_a_new_object_has_from_the_old_one_are_said_to_be(package, old, new):
    objects = []
    for name, folded in (("Old", old), ("New", new)):
        obj = scenes.bump(4, 4, name=name)
        uv = scenes.seen_from_above(obj, 0.5)
        if folded:
            # One face turned over.
            uv[:4, 0] = 0.25 - uv[:4, 0]
        scenes.set_uv(obj, uv)
        objects.append(obj)
    ((*told,),) = package("blender.remesh_objects").carried_gate(objects[0], ["New"])
    assert [text for text in told if "folded" in text] == (
        [f"New: 1 face is folded in the UVs{', as before' if old else ''}"] if new else []
    )


@pytest.mark.parametrize("there", [5, 6, 7])
@pytest.mark.parametrize("name", ["0", "New"])
def test_a_uv_map_that_is_there_already_needs_no_room(package, there, name):
    match, kinds = package("blender.shapes.match_objects"), package("pipelines.attributes")
    obj = scenes.bump(1, 1)
    for k in range(there):
        obj.data.uv_layers.new(name=f"{k}")
    layers = tuple(kinds.Layer(of, "CORNER", "FLOAT2", np.zeros((4, 2), np.float32)) for of in (name, "1"))
    none = np.zeros(0, bool)
    marks = kinds.Marks(np.zeros((0, 2), np.int64), none, none, np.zeros(0))
    given = kinds.Attributes(np.zeros(1, int), np.ones(1, bool), marks, layers)
    match.check_room(obj, given, {"uv"})
    for k in range(there, 8):
        obj.data.uv_layers.new(name=f"{k}")
    if name == "New":
        with pytest.raises(match.MatchError, match="more than 8 UV maps"):
            match.check_room(obj, given, {"uv"})
    else:
        match.check_room(obj, given, {"uv"})
