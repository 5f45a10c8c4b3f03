"""As in `tests/solver/test_every_warning.py`: every sentence that files, and what is read of Blender, may be told with.

What commands warn of themselves is in `test_warnings`, and what clusters are told in `tests/batch`.
"""

from __future__ import annotations

import argparse
from types import SimpleNamespace

import numpy as np
import pytest
import scenes
from said import Scenes, sentences

SENTENCES = sentences("blender", "files", "commands/selection.py")
SCENES = Scenes()
says = SCENES.says
NO_WARNINGS = {
    ("blender/checker.py", "OMT UV"): "a name",
    ("blender/colour_attributes.py", "OMT UV"): "a name",
    ("blender/measuring/face_attributes.py", "OMT UV"): "a name",
    ("blender/measuring/region_labels.py", "no vertex group"): "an error",
    ("blender/mesh.py", "is "): "of an error, and of those that are left out",
    ("blender/subdivision.py", "{}: "): "an error",
    ("blender/volumes/flow_handles.py", "No "): "an error",
    ("blender/volumes/flow_handles.py", "There is no Hook"): "an error",
    ("files/losses.py", "UV maps beside"): "a kind of what is lost",
    ("files/losses.py", "colours beside"): "a kind of what is lost",
    ("files/losses.py", "curves and texts"): "a kind of what is lost",
    ("files/meshes.py", "Blender's reader fails"): "an error",
    ("files/meshes.py", "cannot be read"): "an error",
    ("files/saving.py", "cannot be written"): "an error",
}


@pytest.fixture
def scene(package, tmp_path):
    """An empty session, modules by name, and a folder."""
    scenes.open_empty()
    return SimpleNamespace(module=package, folder=tmp_path)


def test_every_sentence_has_a_scene_or_a_reason_why_not():
    assert SCENES.without(SENTENCES, NO_WARNINGS) == []


@pytest.mark.parametrize("key", SCENES.of, ids=" ".join)
def test_a_sentence_is_told_from_its_bound_on_and_only_there(key, scene, monkeypatch):
    scene.patch = monkeypatch
    SCENES.check(key, SENTENCES, scene)


SQUARE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2), (0, 2, 3)]


def modifier(name, kind, view=True, render=True):
    return SimpleNamespace(name=name, type=kind, show_viewport=view, show_render=render)


# ---- Blender -----------------------------------------------------------------------------------------------------


@says("blender/remesh_objects.py", "{} folded in a UV map")
@says("blender/remesh_objects.py", "Attributes of text")
@says("blender/remesh_objects.py", "Custom normals are left out")
@says("blender/remesh_objects.py", "Modifiers bound to")
def left_of_an_object(scene):
    lost = scene.module("blender.remesh_objects").lost
    folds = {
        0: [],
        1: ["A face of the new mesh is folded in a UV map"],
        3: ["3 faces of the new mesh are folded in a UV map"],
    }
    left_out = "Attributes of text, and those of edges that the new mesh does not follow, are left out: a, b"
    normals = "Custom normals are left out; normals follow the new shape"
    bound = "Modifiers bound to the vertices of the old mesh are left out: Mesh, Soft"
    bonds = [modifier("Mesh", "MESH_DEFORM"), modifier("Bevel", "BEVEL"), modifier("Soft", "SURFACE_DEFORM")]
    for folded in (0, 1, 3):
        for names in ((), ("a", "b")):
            for custom, by_hand in ((False, True), (True, True), (True, False)):
                for evaluated in (False, True):
                    request = SimpleNamespace(
                        attributes=SimpleNamespace(left=names, custom_normals=custom), evaluated=evaluated
                    )
                    carried = [SimpleNamespace(folded=folded // 2), SimpleNamespace(folded=folded - folded // 2)]
                    told = [*folds[folded], *[left_out] * bool(names), *[normals] * (custom and by_hand)]
                    found = lost(SimpleNamespace(modifiers=bonds), request, carried, by_hand)
                    yield found, [*told, *[bound] * (not evaluated)]


@says("blender/subdivision.py", "Areas are those before the modifiers")
def modifiers_that_change_areas(scene):
    told = scene.module("blender.subdivision").subdivision_warnings
    harmless = modifier("Weighted", "WEIGHTED_NORMAL")
    for given, text in (
        ([], ""), ([harmless], ""), ([modifier("Off", "BEVEL", False, False)], ""),
        ([harmless, modifier("Bevel", "BEVEL", True, False)], "Bevel changes"),
        ([modifier("Bevel", "BEVEL", False, True), modifier("Bend", "SIMPLE_DEFORM")], "Bevel, Bend change"),
    ):  # fmt: skip
        asked = [(1, f"Areas are those before the modifiers: {text} them")] if text else []
        found = told([SimpleNamespace(modifiers=[]), SimpleNamespace(modifiers=given)])
        assert found == asked
        yield [t for _, t in found], [t for _, t in asked]


@says("blender/weights.py", "The attribute {} reaches")
def beyond_one(scene):
    weights = scene.module("blender.weights")
    reading = SimpleNamespace(surface=SimpleNamespace(positions=np.zeros((3, 3))))
    for values, text in (
        ([0.0, 0.5, 1.0], ""), ([0.0, 0.5, 1.5], "1.5"), ([0.0, 2.0, 12.3456], "12.35"), ([0.0, 1.0, np.inf], ""),
    ):  # fmt: skip
        scene.patch.setattr(
            weights, "float_attribute", lambda obj, name, v=values: weights.Weights(np.array(v)) if obj.there else None
        )
        pairs = [(SimpleNamespace(there=there, name="x"), reading) for there in (False, True)]
        found, told = weights.attribute_weights(pairs, "mask")
        asked = [(-1, f"The attribute 'mask' reaches {text}; its values were divided by that")] if text else []
        assert told == asked and not found[0].values.any()
        np.testing.assert_allclose(found[1].values, np.array(values) / (max(values) if text else 1))
        yield [t for _, t in told], [t for _, t in asked]


@says("blender/weights.py", "{}: {} is a vertex group and an attribute")
def both_kinds(scene):
    weights = scene.module("blender.weights")
    scene.patch.setattr(weights, "region_weights", lambda pairs, name: [np.ones(2) for _ in pairs])
    scene.patch.setattr(weights, "attribute_weights", lambda pairs, name: ("attribute", []))
    for grouped, there in ((True, []), (True, ["b"]), (True, ["a", "b"]), (False, ["b"])):
        objects = [
            SimpleNamespace(
                name=name, vertex_groups=["mask"] * grouped,
                data=SimpleNamespace(attributes={"mask": 1} if name in there else {}),
            )
            for name in "ab"
        ]  # fmt: skip
        found, told = weights.named_weights([(obj, None) for obj in objects], "mask")
        assert (found == "attribute") == (not grouped)
        text = f"{', '.join(there)}: 'mask' is a vertex group and an attribute; the vertex group was used"
        yield [t for _, t in told], [text] if grouped and there else []


@says("blender/shapes/match_objects.py", "{}; turned over for the match")
def turned_for_a_match(scene):
    module = scene.module("blender.shapes.match_objects")
    points, faces = [(x, y, 0.1 * x * y) for y in range(3) for x in range(3)], []
    for k in (0, 1, 3, 4):
        faces += [(k, k + 1, k + 4), (k, k + 4, k + 3)]
    for back, who in (
        (0, ""),
        (1, "A face looks to another side than its neighbours"),
        (2, "2 faces look to another side"),
    ):
        given = [f[::-1] if k < back else f for k, f in enumerate(faces)]
        told = [f"{who}; turned over for the match"] if back else []
        yield module.read_carrier(scenes.add(points, given)).warnings, told


# ---- files -------------------------------------------------------------------------------------------------------


@says("files/export.py", "Not every object has")
def unlike_attributes(scene):
    module = scene.module("files.export")
    for kinds, left in ((("FLOAT", "FLOAT"), False), (("FLOAT", "INT"), True), (("FLOAT", None), False)):
        meshes = []
        for kind in kinds:
            mesh = scenes.add(*SQUARE).data
            if kind:
                mesh.attributes.new("heat", kind, "POINT")
            meshes.append(mesh)
        text = "Not every object has a vertex attribute of one kind named heat; it was left out"
        yield module._with_like_attributes(meshes), [text] if left else []
        assert ["heat" in mesh.attributes for mesh in meshes] == [not left] * 2


@says("files/obj_materials.py", "Materials of {} were left out of the OBJ file")
def materials_left_out(scene):
    """Of objects that have one name in the file, faces are not told apart."""
    import bpy

    module, objects = scene.module("files.export"), []
    material = bpy.data.materials.new("a")
    for names, told in ((("A b",), []), (("A b", "A_b"), ["Materials of 2 objects were left out of the OBJ file"])):
        objects = [scenes.add(*SQUARE, name) for name in names]
        for obj in objects:
            obj.name = names[objects.index(obj)]
            for slot in (material, None):
                obj.data.materials.append(slot)
            obj.data.polygons.foreach_set("material_index", (1, 0))
        yield module._write_obj(scene.folder / "a.obj", objects, False), told
        for obj in objects:
            bpy.data.objects.remove(obj)


@says("files/export.py", "STL files hold no UVs")
def left_out_of_a_format(scene):
    module = scene.module("files.export")
    obj = scenes.add(*SQUARE)
    yield module._write_obj(scene.folder / "a.obj", [obj], False), []
    stl = "STL files hold no UVs; write .blend, .obj, .ply, .glb, .gltf or .fbx to keep them"
    yield module._write_stl(scene.folder / "a.stl", [obj], False), [stl]


@says("files/in_place/glb.py", "TANGENT attributes")
def tangents(scene):
    glb = scene.module("files.in_place.glb")
    text = "TANGENT attributes are those of the UVs before. Have them made anew, or removed."
    change = SimpleNamespace(doc={}, glb=None, result=lambda: "new")
    for name, value in (("GlbChange", lambda *_: change), ("write", None), ("read", None), ("_check", None)):
        scene.patch.setattr(glb, name, value or (lambda *_: None))
    for there, changed, told in ((True, True, [text]), (False, True, []), (True, False, [])):
        part = SimpleNamespace(primitive={"attributes": {"POSITION": 0, **({"TANGENT": 1} if there else {})}})
        scene.patch.setattr(glb, "_parts", lambda *_, part=part: ([part], 0))
        scene.patch.setattr(glb, "_write_group", lambda change, group, changed=changed: group if changed else [])
        yield glb._put(None, [], False)[1], told


@says("files/in_place/imported.py", "{} place in the file")
def dropped(scene):
    told = scene.module("files.in_place.imported").dropped_warning
    how = "place in the file, and the UVs it had: invalid ones, or there twice"
    for count, text in (
        (0, ""),
        (1, "1 face that Blender drops keeps its"),
        (2, "2 faces that Blender drops keep their"),
    ):
        yield told(count), [f"{text} {how}"] if count else []


@says("files/loaded.py", "they name vertices that")
@says("files/loaded.py", "{} of {} faces {} not read")
def not_read(scene):
    told, obj = scene.module("files.loaded")._faces, scenes.add(*SQUARE)
    why = "they name vertices that do not exist, or one twice, or the file ends before them"
    for more, verb in ((0, ""), (1, "was"), (2, "were")):
        path = scene.folder / "a.obj"
        path.write_text("v 0 0 0\n" + "f 1 2 3\n" * (2 + more))
        yield told(path, [obj]), [f"{more} of {2 + more} faces {verb} not read: {why}"] if more else []


@says("files/loaded.py", "{} of its vertices have coordinates beyond")
@says("files/loaded.py", "{} of its vertices have coordinates above")
def strange_coordinates(scene):
    told, path = scene.module("files.loaded")._coordinates, scene.folder / "a.obj"
    for last, lines, texts in (
        (1.0, "1 2 3", []), (1.0, "1 1e37 3", []), (0.9e18, "1 2 3", []),
        (1.1e18, "1 2 3", ["1 of its vertices have coordinates above 1e+18"]),
        (1.0, "nan 2 3", ["1 of its vertices have coordinates beyond single precision, or none"]),
        (1.0, "1 4e38 3", ["1 of its vertices have coordinates beyond single precision, or none"]),
        (1.0, "1 3e38 3", []),
    ):  # fmt: skip
        obj = scenes.add([*SQUARE[0][:3], (last, 1, 0)], SQUARE[1])
        path.write_text(f"v 0 0 0\nv 1 0 0\nv 1 1 0\nv {lines}\nf 1 2 3\nf 1 3 4\n")
        yield told(path, [obj]), texts


@says("files/loaded.py", "Coordinates are so far from the origin")
@says("files/loaded.py", "Single precision would round coordinates")
def far_away(scene):
    compare = scene.module("files.loaded").compare
    for far in (0.0, 16.0, 64.0, 1000.0):
        exact = np.array(SQUARE[0], float) + [far + 1e-7 * far, 0, 0]
        path = scene.folder / "far.obj"
        path.write_text(
            "".join("v " + " ".join(f"{x!r}" for x in row) + "\n" for row in exact.tolist()) + "f 1 2 3\nf 1 3 4\n"
        )
        obj = scenes.add(exact.astype(np.float32), SQUARE[1])
        loss = float(np.abs(exact - exact.astype(np.float32)).max())
        found = compare(path, [obj])
        rounded = loss > 1e-6 and np.spacing(np.float32(exact.max())) / 2 > 1e-6
        place = ", ".join(f"{x:.9g}" for x in (np.float32((exact.min(0) + exact.max(0)) / 2)).astype(float))
        text = f"Single precision would round coordinates by up to {loss:.2g}: the mesh is taken relative to ({place})"
        yield [found.moved] if found.moved else [], [text] if rounded else []
        assert found.texts == ()
        # Two objects of one file cannot be told apart in it.
        others = [scenes.add(exact.astype(np.float32), SQUARE[1]) for _ in range(2)]
        step = float(np.spacing(np.float32(np.abs(exact).max()))) / 2
        text = f"Coordinates are so far from the origin that single precision rounds them by up to {step:.2g}"
        yield [t for t in compare(path, others).texts if "origin" in t], [text] if step > 1e-6 else []


@says("files/losses.py", "{} does not hold all of the file")
@says("files/losses.py", "{} ({})")
def lost_by_a_format(scene):
    told = scene.module("files.losses")._told
    yield told(".obj", {}), []
    asked = ".obj does not hold all of the file; left out: seams (1), shape keys (12)"
    yield told(".obj", {"seams": 1, "shape keys": 12}), [asked]


@says("files/obj_materials.py", "{} holds other materials")
def other_materials(scene):
    place = scene.module("files.obj_materials").place_materials
    made, target = scene.folder / "made.obj", scene.folder / "a.obj"
    made.write_text("mtllib made.mtl\n")
    made.with_suffix(".mtl").write_text("new")
    for there, name in (({}, ""), ({"a.mtl": "new"}, ""), ({"a.mtl": "old"}, "a_1"), ({"a_1.mtl": "old"}, "a_2")):
        for path, text in there.items():
            (scene.folder / path).write_text(text)
        made.write_text("mtllib made.mtl\n")
        companions = {}
        found = place(made, target, companions)
        assert made.read_text() == f"mtllib {name or 'a'}.mtl\n"
        assert companions == {made.with_suffix(".mtl"): scene.folder / f"{name or 'a'}.mtl"}
        yield found, [f"a.mtl holds other materials and was left alone; {name}.mtl has these"] if name else []


@says("files/saving.py", "{} names {}, which is not")
def left_behind(scene):
    told, there = scene.module("files.saving")._left_behind, scene.folder / "there"
    there.mkdir()
    (there / "b.mtl").write_text("")
    source, data = scene.folder / "in.obj", b"mtllib a b.mtl\nmtllib b.mtl\nmtllib a b.mtl\n"
    text = "out.obj names a b.mtl, which is not in its folder. Copy it there, with what it names"
    yield told(data, ".obj", source, there / "out.obj"), [text]
    yield told(data, ".obj", source, scene.folder / "out.obj"), []
    yield told(data, ".ply", source, there / "out.ply"), []
    doc = b'{"images": [{"uri": "a%20b.png"}, {"uri": "data:image/png;base64,"}, {}]}'
    yield told(doc, ".gltf", source, there / "out.gltf"), [text.replace("obj", "gltf").replace("mtl", "png")]


@says("files/saving.py", "What Blender does not read of an FBX")
@says("files/saving.py", "Blender does not carry all of an FBX")
@says("files/saving.py", "{} ({})")
def lost_of_an_fbx(scene):
    from collections import Counter

    saving, nodes = scene.module("files.saving"), scene.module("files.fbx_nodes")
    source, made = scene.folder / "in.fbx", scene.folder / "out.fbx"
    source.write_bytes(b"source")
    made.write_bytes(b"made")
    for before, told in (
        ({"Mesh": 2}, []), ({"Mesh": 2, "AnimationCurve": 5, "AnimationCurveNode": 1}, []),
        ({"Mesh": 3, "NurbsCurve": 2}, ["Blender does not carry all of an FBX file; lost: Mesh (1), NurbsCurve (2)"]),
        (None, ["What Blender does not read of an FBX file is lost"]),
    ):  # fmt: skip

        def count(data, before=before):
            if data == b"source" and before is None:
                raise saving.FileError("a text")
            return SimpleNamespace(kinds=Counter(before if data == b"source" else {"Mesh": 2}))

        scene.patch.setattr(nodes, "count", count)
        yield saving._lost_kinds(source, made), told


@says("files/saving.py", "{}: its UVs could not be changed in place")
def not_in_place(scene):
    saving = scene.module("files.saving")
    scene.patch.setattr(saving, "_imported", lambda obj: obj)
    scene.patch.setattr(saving, "_save_anew", lambda *_, **__: ["anew"])
    scene.patch.setattr(scene.module("files.losses"), "losses_in_place", lambda *_: ["lost"])
    how = "It was written anew, and what Blender does not hold is lost"
    for fails in (False, True):

        def put(*_, fails=fails):
            if fails:
                raise saving.InPlaceError("it is odd")
            return ["done"], ["behind"]

        scene.patch.setattr(saving, "put_uvs", put)
        told = [f"in.obj: its UVs could not be changed in place: it is odd. {how}", "anew"]
        found = saving.save_uvs(scene.folder / "out.obj", [], scene.folder / "in.obj")
        yield found, told if fails else ["done", "lost", "behind"]
        yield saving.save_uvs(scene.folder / "out.ply", [], scene.folder / "in.obj"), ["anew"]


# ---- what is read by a command -----------------------------------------------------------------------------------


@says("commands/selection.py", "Single precision rounds coordinates")
def rounded_in_another_format(scene):
    selection, loaded = scene.module("commands.selection"), scene.module("files.loaded").Loaded
    scene.patch.setattr(selection, "warn_of", lambda text: None)
    for name, moved, told in (
        ("out.obj", "moved", ["in.obj: moved"]), ("out.blend", "moved", ["in.obj: moved"]), ("out.obj", "", []),
        ("out.ply", "moved", ["in.obj: Single precision rounds coordinates by up to 0.25 in out.ply; moved"]),
    ):  # fmt: skip
        options = argparse.Namespace(
            input=scene.folder / "in.obj", output=scene.folder / name, strict=False, told=[],
        )  # fmt: skip
        selection._tell(options, loaded((), 0.25, moved))
        yield options.told, told
    strict = argparse.Namespace(input=scene.folder / "in.obj", output=scene.folder / "out.ply", strict=True, told=[])
    with pytest.raises(
        scene.module("commands.common").CommandError, match=r"rounds coordinates .* Nothing was written"
    ):
        selection._tell(strict, loaded((), 0.25, "moved"))


@says("commands/selection.py", "{} {} and is left out")
def linked_ones(scene):
    selection, mesh = scene.module("commands.selection"), scene.module("blender.mesh")
    scene.patch.setattr(mesh, "linked", lambda obj: "is linked from a library" if obj.far else "")
    said = []
    scene.patch.setattr(selection, "warn_of", said.append)
    objects = [SimpleNamespace(name=name, far=name == "b") for name in "abc"]
    for skip, told in ((False, []), (True, ["b is linked from a library and is left out"])):
        options = argparse.Namespace(input="x", scene="", object=[], skip_linked=skip, told=[])
        kept = selection._chosen(options, objects)
        assert [o.name for o in kept] == (["a", "c"] if skip else ["a", "b", "c"])
        yield options.told, told
    assert said == ["b is linked from a library and is left out"]


@says("commands/selection.py", "{} has no faces")
def without_faces(scene):
    selection, common = scene.module("commands.selection"), scene.module("commands.common")
    path, said = scene.folder / "in.blend", []
    scene.patch.setattr(selection, "warn_of", said.append)
    scene.patch.setattr(scene.module("files.loaded"), "compare", lambda *_: None)
    scene.patch.setattr(selection, "_tell", lambda *_: None)
    options = argparse.Namespace(input=path, scene="", object=[], skip_linked=False, told=[], strict=False)
    for empty in (0, 1, 2):
        scenes.open_empty()
        objects = [scenes.add(*SQUARE, name="full"), *(scenes.add(SQUARE[0], [], name=f"e{k}") for k in range(empty))]
        scene.patch.setattr(scene.module("files.meshes"), "load", lambda path, objects=objects: objects)
        said.clear()
        assert [obj.name for obj, _ in selection.read_file(options)] == ["full"]
        yield sorted(said), [f"e{k} has no faces and is left alone" for k in range(empty)]
    scene.patch.setattr(scene.module("files.meshes"), "load", lambda path: objects[1:2])
    said.clear()
    with pytest.raises(common.CommandError, match="The mesh has no faces"):
        selection.read_file(options)
    assert said == []
