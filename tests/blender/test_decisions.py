"""Every condition in reading and writing objects decides: attributes of every kind under a name, materials, linked
collections, groups, keys, modifiers, landmarks."""

from __future__ import annotations

from itertools import product
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes

TYPES = ("FLOAT", "INT", "BOOLEAN", "FLOAT_VECTOR", "FLOAT_COLOR")
DOMAINS = ("POINT", "EDGE", "FACE", "CORNER")


def plane(name="Plane"):
    return scenes.bump(2, 2, name=name)


def face_sets(package, obj, name):
    package("blender.shapes.cell_faces").check_cells(obj, "face_sets")


def cells(package, obj, name):
    package("blender.shapes.cell_faces").check_cells(obj, "attribute")


def distances(package, obj, name):
    package("blender.measuring.distances").write_distances(obj, np.arange(9.0))


def faces(package, obj, name):
    values = SimpleNamespace(area=np.zeros(4), shear=np.ones(4), stretch=np.zeros((4, 3)))
    package("blender.measuring.face_attributes").write_face_values(obj, values)


def weights(package, obj, name):
    assert package("blender.weights").float_attribute(obj, name) is not None


# What writes or reads an attribute, its name, the kinds that it takes, and what it raises at others.
OWNERS = {
    "face sets": (face_sets, ".sculpt_face_set", {("INT", "FACE")}),
    "cells": (cells, None, {("INT", "FACE")}),
    "distances": (distances, None, {("FLOAT", "POINT")}),
    "faces": (faces, None, {("FLOAT", "FACE")}),
    "weights": (weights, "mine", {("FLOAT", "POINT"), ("FLOAT", "FACE")}),
}


@pytest.mark.parametrize("owner", OWNERS)
@pytest.mark.parametrize(("kind", "domain"), list(product(TYPES, DOMAINS)))
def test_an_attribute_of_another_kind_is_refused_by_its_name(package, owner, kind, domain):
    """Neither the type alone nor the domain alone makes it the same."""
    act, name, takes = OWNERS[owner]
    if name is None:
        places = {
            "cells": ("settings", "CELL_ATTRIBUTE"),
            "distances": ("blender.measuring.distances", "NAME"),
            "faces": ("blender.measuring.face_attributes", "KINDS"),
        }
        module, constant = places[owner]
        name = getattr(package(module), constant)
        name = name if isinstance(name, str) else next(iter(name))
    obj = plane()
    obj.data.attributes.new(name, kind, domain)
    if owner == "faces":
        takes = {(package("blender.measuring.face_attributes").KINDS[name][0], "FACE")}
    if (kind, domain) in takes:
        act(package, obj, name)
    else:
        before = scenes.state(obj)
        with pytest.raises(package("errors").UserError, match="attribute") as caught:
            act(package, obj, name)
        assert name in str(caught.value) and obj.name in str(caught.value) and scenes.state(obj) == before


@pytest.mark.parametrize(("kind", "domain"), list(product(("FLOAT", "INT", "FLOAT_COLOR"), DOMAINS)))
def test_an_attribute_of_another_kind_gives_way_where_it_is_made_anew(package, kind, domain):
    obj = plane()
    old = obj.data.attributes.new("own", kind, domain)
    if (kind, domain) == ("FLOAT", "POINT"):
        old.data.foreach_set("value", np.full(9, 7.0))
    made = package("blender.write_attributes").fresh_attribute(obj.data, "own", "FLOAT", "POINT")
    assert (made.data_type, made.domain) == ("FLOAT", "POINT") and len(made.data) == 9
    # One of its kind stays, with its values.
    assert made.data[3].value == (7.0 if (kind, domain) == ("FLOAT", "POINT") else 0.0)


@pytest.mark.parametrize(("kind", "domain"), list(product((*TYPES, "INT8"), DOMAINS)))
def test_only_whole_numbers_and_truth_values_of_faces_are_regions(package, kind, domain):
    labels = package("blender.measuring.region_labels")
    obj, other = plane("One"), plane("Other")
    obj.data.attributes.new("part", kind, domain)
    good = other.data.attributes.new("part", "INT", "FACE")
    good.data.foreach_set("value", [2, 2, 5, 5])
    pairs = [(o, package("blender.mesh").read(o)) for o in (obj, other)]
    found = dict(labels._values(pairs, "part"))
    taken = domain == "FACE" and kind in ("INT", "INT8", "BOOLEAN")
    assert set(found) == ({"part 0"} if taken else set()) | {"part 2", "part 5"}
    assert [mask.tolist() for mask in found["part 2"]] == [[False] * 4, [True, True, False, False]]
    assert labels._values(pairs[:1], "none") == []


def test_materials_of_empty_slots_are_one_region_and_of_none_there_is_none(package):
    labels = package("blender.measuring.region_labels")
    obj, bare = plane("One"), plane("Bare")
    pairs = [(o, package("blender.mesh").read(o)) for o in (obj, bare)]
    assert labels._materials(pairs) == []
    obj.data.materials.append(bpy.data.materials.new("red"))
    obj.data.materials.append(None)
    obj.data.polygons.foreach_set("material_index", [0, 1, 0, 1])
    found = dict(labels._materials(pairs))
    assert [m.tolist() for m in found["red"]] == [[True, False, True, False], [False] * 4]
    assert [m.tolist() for m in found["no material"]] == [[False, True, False, True], [True] * 4]


@pytest.mark.parametrize("slots", [0, 1, 3])
def test_materials_come_back_after_a_checker_as_they_are_meanwhile(package, slots):
    checker = package("blender.checker")
    obj = plane()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    for k in range(slots):
        obj.data.materials.append(bpy.data.materials.new(f"own {k}") if k != 1 else None)
    assert not checker.take_off(obj) and not checker.wears_one(obj)
    assert bpy.ops.uv.omt_checker() == {"FINISHED"} and checker.wears_one(obj)
    assert [checker.has_checker(slot.material) for slot in obj.material_slots] == [True] * max(slots, 1)
    assert not checker.has_checker(None)
    if slots == 3:
        # What somebody has changed or taken away meanwhile stays so.
        mine = bpy.data.materials.new("mine")
        obj.material_slots[0].material = mine
        obj.data.materials.pop(index=2)
    assert checker.take_off(obj) and not checker.wears_one(obj)
    expected = {0: [], 1: ["own 0"], 3: ["mine", None]}[slots]
    assert [slot.material and slot.material.name for slot in obj.material_slots] == expected
    checker.tidy()
    assert not [m for m in (*bpy.data.materials, *bpy.data.images) if m.name.startswith(checker.NAME)]


def test_creases_are_read_of_their_kind_alone_and_hidden_names_stay_behind(package):
    reading = package("blender.read_attributes")
    for kind, domain in product(("FLOAT", "INT"), ("EDGE", "POINT")):
        obj = plane()
        made = obj.data.attributes.new("crease_edge", kind, domain)
        made.data.foreach_set("value", [1] * len(made.data))
        obj.data.attributes.new(".hidden", "FLOAT", "FACE")
        obj.data.attributes.new("seen", "FLOAT", "FACE")
        obj.data.attributes.new("of edges", "FLOAT", "EDGE").data.foreach_set("value", [k % 2 for k in range(12)])
        obj.data.attributes.new(".sculpt_face_set", "INT", "FACE")
        found = reading.read_attributes(obj.data, ())
        marked = (kind, domain) == ("FLOAT", "EDGE")
        assert len(found.marks.edges) == (12 if marked else 6) and found.marks.crease.any() == marked
        names = {layer.name for layer in found.layers}
        assert {"seen", ".sculpt_face_set"} <= names and ".hidden" not in names
        assert "of edges" in {layer.name for layer in found.marks.layers}
        assert reading.read_attributes(obj.data, (), False).marks.layers == ()
        assert found.color_flags == ("", "") and ".hidden" not in found.left
        bpy.data.objects.remove(obj)


def test_the_density_that_is_named_is_the_group_and_else_the_attribute(package):
    objects, settings = package("blender.remesh_objects"), package("settings").RemeshSettings
    obj = plane()
    obj.vertex_groups.new(name="both")
    for name in ("both", "attribute"):
        obj.data.attributes.new(name, "FLOAT", "POINT")
    for density, name, expected in (("weights", "both", "weights"), ("weights", "attribute", "attribute"),
                                    ("weights", "none", "weights"), ("attribute", "both", "attribute"),
                                    ("uniform", "attribute", "uniform")):  # fmt: skip
        assert objects.source_of(obj, settings(density=density, source=name)) == expected, (density, name)


@pytest.mark.parametrize(("kind", "domain"), list(product(TYPES, DOMAINS)))
def test_densities_of_a_remesh_are_floats_of_vertices_or_faces(package, kind, domain):
    objects, settings = package("blender.remesh_objects"), package("settings").RemeshSettings
    obj = plane()
    made = obj.data.attributes.new("mine", kind, domain)
    surface = package("blender.mesh").read(obj).surface
    asked = settings(density="attribute", source="mine")
    if kind == "FLOAT" and domain in ("POINT", "FACE"):
        values = np.arange(1.0, len(made.data) + 1)
        made.data.foreach_set("value", values)
        found = objects._density_values(obj, obj.data, surface, asked)
        vertices = surface.corner_vertex[surface.triangles]
        expected = values[surface.triangle_face] if domain == "FACE" else values[vertices].mean(axis=1)
        np.testing.assert_allclose(found, expected, rtol=1e-6)
    else:
        with pytest.raises(objects.SourceError, match="of floats on vertices or faces"):
            objects._density_values(obj, obj.data, surface, asked)
    with pytest.raises(objects.SourceError, match="no vertex group"):
        objects._density_values(obj, obj.data, surface, settings(density="weights", source="none"))
    assert objects._density_values(obj, obj.data, surface, settings(density="uniform")) is None


def test_objects_that_share_a_mesh_at_one_scale_have_one_new_mesh_and_are_a_family(package):
    objects = package("blender.remesh_objects")
    first = plane("First")
    others = []
    for scale, turn in (((1, 1, 1), 0.7), ((2, 2, 2), 0), ((0, 0, 0), 0), ((1, 1, 2), 0)):
        other = bpy.data.objects.new("Other", first.data)
        bpy.context.collection.objects.link(other)
        other.scale, other.rotation_euler = scale, (turn, 0.2 * bool(turn), 0)
        others.append(other)
    alone = plane("Alone")
    bpy.context.view_layer.update()
    groups = objects.alike([first, *others, alone], False)
    assert [len(group) for group in groups] == [2, 1, 1, 1, 1] and groups[0] == [first, others[0]]
    assert [len(group) for group in objects.alike([first, *others], True)] == [1] * 5
    assert objects.family(first) == []
    few, many, empty = plane("Few"), scenes.bump(4, 4, name="Many"), bpy.data.objects.new("Empty", None)
    for made in (few, many, empty):
        made[objects.SOURCE] = first
    # The source first, and the finest before the others; none but meshes.
    assert objects.family(first) == objects.family(few) == objects.family(many) == [first, many, few]
    assert objects.family(alone) == []


@pytest.mark.parametrize("evaluated", [False, True])
@pytest.mark.parametrize("bound", [False, True])
def test_what_a_new_mesh_does_not_have_is_said(package, evaluated, bound):
    objects = package("blender.remesh_objects")
    obj = plane()
    kind = sorted(objects.BOUND)[0]
    obj.modifiers.new("first", kind if bound else "SUBSURF")
    for folded, left, normals, by_hand in product((0, 1, 3), ((), ("a", "b")), (False, True), (False, True)):
        attributes = SimpleNamespace(left=left, custom_normals=normals, folded=0)
        request = SimpleNamespace(attributes=attributes, evaluated=evaluated)
        carried = [SimpleNamespace(folded=folded), SimpleNamespace(folded=0)]
        texts = objects.lost(obj, request, carried, by_hand)
        told = {"folded in a UV map": folded > 0, "left out: a, b": bool(left), "Custom normals": normals and by_hand,
                "left out: first": bound and not evaluated}  # fmt: skip
        for words, expected in told.items():
            assert any(words in text for text in texts) == expected, words
        assert len(texts) == sum(told.values())
        if folded:
            assert texts[0].startswith("A face" if folded == 1 else "3 faces")
    objects._drop_modifiers(obj, evaluated)
    assert len(obj.modifiers) == (not bound and not evaluated)


def test_landmarks_are_empties_of_the_object_with_the_mark_or_the_prefix(package):
    marks = package("blender.shapes.landmarks")
    obj = plane()

    def child(name, kind="EMPTY", mark=None, parent=obj):
        data = bpy.data.meshes.new("m") if kind == "MESH" else None
        made = bpy.data.objects.new(name, data)
        bpy.context.collection.objects.link(made)
        made.parent = parent
        if mark is not None:
            made[marks.NAME] = mark
        return made

    child("LM_1"), child("LM_2.001"), child("renamed", mark="LM_3"), child("other"), child("LM_mesh", "MESH")
    child("mesh", "MESH", "LM_4"), child("LM_5", parent=plane("Else"))
    bpy.context.view_layer.update()
    assert {e.name for e in marks.empties(obj, "LM_")} == {"LM_1", "LM_2.001", "renamed"}
    assert {marks._name_of(e) for e in marks.empties(obj, "LM_")} == {"LM_1", "LM_2", "LM_3"}
    assert marks.free_name([obj], "LM_") == "LM_4"
    assert marks.remove_landmarks(obj, "LM_") == 3 and not list(marks.empties(obj, "LM_"))
    assert "other" in bpy.data.objects and marks.free_name([obj], "LM_") == "LM_1"
    flat = scenes.add([(0, 0, 0)], [], "Point")
    assert marks.put_landmark(flat, "LM_9", (0, 0, 0)).empty_display_size == pytest.approx(marks.SIZE)


def test_the_vertex_of_a_group_is_that_nearest_to_its_weighted_mean(package):
    marks = package("blender.shapes.landmarks")
    obj = scenes.add([(x, 0, 0) for x in range(6)], [(0, 1, 2)], "Row")
    group, other, empty = (obj.vertex_groups.new(name=name) for name in ("LM_a", "plain", "LM_none"))
    for vertex, weight in ((0, 0.1), (2, 0.9), (4, 0.8), (5, 0.0)):
        group.add([vertex], weight, "REPLACE")
    other.add([1], 1.0, "REPLACE")
    empty.add([3], 0.0, "REPLACE")
    # (0.1 * 0 + 0.9 * 2 + 0.8 * 4) / 1.8 = 2.8: of those with weight, 2 is the nearest.
    assert marks._groups(obj, "LM_") == [("LM_a", 2)] and marks._groups(obj, "XX_") == []


@pytest.mark.parametrize(("viewport", "render"), list(product((False, True), (False, True))))
def test_modifiers_that_nobody_sees_change_nothing(package, viewport, render):
    subdivision = package("blender.subdivision")
    obj = plane()
    other = obj.modifiers.new("Bend", "SIMPLE_DEFORM")
    other.show_viewport, other.show_render = viewport, render
    harmless = obj.modifiers.new("Harmless", sorted(subdivision.HARMLESS - {"SUBSURF"})[0])
    assert harmless is not None
    told = subdivision.subdivision_warnings([plane("None"), obj])
    seen = viewport or render
    assert [index for index, _ in told] == [1] * seen and ("Bend changes them" in told[0][1] if seen else not told)
    surface = obj.modifiers.new("Subdivision", "SUBSURF")
    surface.levels, surface.render_levels, surface.show_viewport, surface.show_render = 1, 3, viewport, render
    assert subdivision._levels(surface) == (3 if render else 1 if viewport else 0)


@pytest.mark.parametrize(("kind", "domain"), list(product(("FLOAT", "INT"), DOMAINS)))
def test_creases_count_for_subdivision_where_they_are_floats_in_their_place(package, kind, domain):
    subdivision = package("blender.subdivision")
    obj = plane()
    made = obj.data.attributes.new("crease_edge", kind, domain)
    made.data.foreach_set("value", [1] * len(made.data))
    found = subdivision._sharpness(obj.data, "crease_edge", "EDGE")
    assert (found is not None) == ((kind, domain) == ("FLOAT", "EDGE"))
    assert found is None or (found == subdivision.CREASE).all()


def test_a_name_that_is_a_group_and_an_attribute_is_the_group_and_that_is_said(package):
    weights_of = package("blender.weights").named_weights
    obj, other = plane("One"), plane("Other")
    pairs = [(o, package("blender.mesh").read(o)) for o in (obj, other)]
    group = obj.vertex_groups.new(name="both")
    group.add([1], 0.5, "REPLACE")
    other.data.attributes.new("both", "FLOAT", "POINT").data.foreach_set("value", [1.0] * 9)
    other.data.attributes.new("alone", "FLOAT", "FACE").data.foreach_set("value", [0.25] * 4)
    found, told = weights_of(pairs, "both")
    assert [text for _, text in told] == ["Other: 'both' is a vertex group and an attribute; the vertex group was used"]
    assert found[0].values[1] == 0.5 and not found[1].values.any()
    found, told = weights_of(pairs, "alone")
    assert found[1].values.tolist() == [0.25] * 4 and found[1].kind == "face"


def test_seams_are_marked_where_there_are_edges_and_counted_where_they_are_new(package):
    mark = package("blender.seams").mark_seams
    for mode in ("OBJECT", "EDIT"):
        obj = plane()
        edges = np.array([tuple(edge.vertices) for edge in obj.data.edges])
        obj.data.edges[0].use_seam = True
        bpy.ops.object.mode_set(mode=mode)
        # The other way around, one that is marked, and one that is none.
        asked = np.concatenate([edges[:3, ::-1], [[0, 8]]])
        assert mark(obj, asked) == 2, mode
        bpy.ops.object.mode_set(mode="OBJECT")
        assert [edge.index for edge in obj.data.edges if edge.use_seam] == [0, 1, 2]


def test_new_objects_stand_in_collections_of_this_file(package):
    mesh = package("blender.mesh")
    obj = plane()
    collections = [bpy.data.collections.new(name) for name in "ab"]
    for collection in collections:
        bpy.context.scene.collection.children.link(collection)
        collection.objects.link(obj)
    bpy.context.scene.collection.objects.unlink(obj)
    new = bpy.data.objects.new("New", None)
    mesh.link_beside(new, obj)
    assert set(new.users_collection) == set(collections)
    lonely, other = bpy.data.objects.new("Lonely", obj.data), bpy.data.objects.new("Newer", None)
    mesh.link_beside(other, lonely)
    assert list(other.users_collection) == [bpy.context.scene.collection]


def test_faces_that_are_touched_are_seen(package):
    mesh = package("blender.mesh")
    obj = plane()
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="DESELECT")
    assert not mesh.touched_faces(obj).any()
    import bmesh

    edit = bmesh.from_edit_mesh(obj.data)
    edit.verts.ensure_lookup_table()
    edit.faces.ensure_lookup_table()
    edit.verts[4].select = True
    assert mesh.touched_faces(obj).all()
    edit.faces[2].hide = True
    assert mesh.touched_faces(obj).tolist() == [True, True, False, True]


def test_landmarks_of_bodies_are_groups_with_vertices_in_them(package):
    obj = scenes.cube()
    obj.vertex_groups.new(name="LM_full").add([1, 2], 1.0, "REPLACE")
    obj.vertex_groups.new(name="LM_weak").add([3], 0.2, "REPLACE")
    obj.vertex_groups.new(name="LM_empty")
    obj.vertex_groups.new(name="plain").add([4], 1.0, "REPLACE")
    found = package("blender.volumes.tet_objects").read_volume_body(obj)
    assert {name: rows.tolist() for name, rows in found.landmarks.items()} == {"LM_full": [1, 2]}


@pytest.mark.parametrize(("kind", "elements", "selected"), [
    ("face", [1, 2], [1, 2]), ("vertex", [4], []), ("", [], [0, 1, 2, 3]), ("face", [], [0, 1, 2, 3]),
])  # fmt: skip
def test_what_an_error_is_about_is_selected_and_without_elements_nothing_changes(package, kind, elements, selected):
    obj = plane()
    for polygon in obj.data.polygons:
        polygon.select = True
    error = package("solver.errors").MeshError("It is so", kind=kind, elements=elements)
    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
    package("blender.mesh").select_culprits(bpy.context, obj, error)
    assert [p.index for p in obj.data.polygons if p.select] == selected
    shown = (False, False, True) if len(elements) and kind == "face" else (True, False, False)
    assert tuple(bpy.context.scene.tool_settings.mesh_select_mode) == shown
