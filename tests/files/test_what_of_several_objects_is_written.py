"""A file of several objects holds what files of each hold, and what a format leaves out is counted over all of them."""

from __future__ import annotations

import re
from collections import Counter
from itertools import permutations

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture(autouse=True)
def empty(package):
    scenes.open_empty()


FORMATS = (".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx")


def material(name):
    return bpy.data.materials.get(name) or bpy.data.materials.new(name)


def patches():
    """Three patches that are unlike one another: with slots in another order than their faces and an empty one, with
    faces of a slot that is not there, and with none."""
    objects = [scenes.bump(2 + k, 2, 0.3 + 0.1 * k, name, offset=2.0 * k) for k, name in enumerate(("A a", "B", "C.c"))]
    for k, obj in enumerate(objects):
        scenes.set_uv(obj, 0.3 * scenes.seen_from_above(obj, shift=(0.05, 0.1 * k)))
    for obj, slots in zip(objects, (("red", None, "sky blue"), ("sky blue",), ()), strict=True):
        for name in slots:
            obj.data.materials.append(material(name) if name else None)
    for k, obj in enumerate(objects):
        for face in obj.data.polygons:
            face.material_index = (2 - face.index) % 3 if k < 2 else 0
    return objects


def faces_of(objects, uvs=True):
    """Every face by its corners in the world, UVs and material, and how often it is there. Where a face begins is each
    format's own."""
    found: Counter = Counter()
    for obj in objects:
        uv = scenes.uv_of(obj) if uvs else np.zeros((len(obj.data.loops), 2))
        slots = [slot.material.name if slot.material else "" for slot in obj.material_slots]
        for face in obj.data.polygons:
            place = [obj.matrix_world @ obj.data.vertices[v].co for v in face.vertices]
            corners = sorted(
                tuple(np.round([*co, *uv[k]], 4) + 0.0) for co, k in zip(place, face.loop_indices, strict=True)
            )
            name = slots[face.material_index] if face.material_index < len(slots) else ""
            # What is read beside a material of that name gets a number, and one without a name is no other than none.
            name = re.sub(r"\.\d{3}$", "", name)
            found[(*corners, "" if name == "Material" else name.replace(" ", "_"))] += 1
    return found


def read_again(package, path, objects):
    """The faces of a file of these objects, and what was told of it; the objects stay."""
    told = package("files.export").export(path, path.suffix, objects, False)
    before = set(bpy.data.objects)
    if path.suffix == ".obj":
        bpy.ops.wm.obj_import(filepath=str(path), **package("files.meshes").AXES)
    elif path.suffix == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(path))
    elif path.suffix in (".glb", ".gltf"):
        bpy.ops.import_scene.gltf(filepath=str(path))
    else:
        getattr(bpy.ops.wm, f"{path.suffix[1:]}_import")(filepath=str(path), **package("files.meshes").AXES)
    new = [obj for obj in set(bpy.data.objects) - before if obj.type == "MESH"]
    bpy.context.view_layer.update()
    found = faces_of(new, path.suffix != ".stl")
    for obj in set(bpy.data.objects) - before:
        bpy.data.objects.remove(obj)
    return found, told


@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_of_several_objects_holds_what_files_of_each_hold(package, tmp_path, suffix):
    objects, alone = patches(), Counter()
    for k, obj in enumerate(objects):
        found, _ = read_again(package, tmp_path / f"{k}{suffix}", [obj])
        assert sum(found.values()) >= len(obj.data.polygons)
        alone += found
    for k, some in enumerate((objects, objects[::-1])):
        found, _ = read_again(package, tmp_path / f"all{k}{suffix}", list(some))
        assert found == alone
    if suffix == ".obj":
        # Here a face without a material stays one.
        assert alone == faces_of(objects)


# A normal that no face of a patch has.
ASKEW = (0.6, 0.0, 0.8)


@pytest.mark.parametrize("which", [[0], [1], [2], [0, 2], [0, 1, 2]])
@pytest.mark.parametrize("suffix", [".obj", ".glb", ".gltf", ".fbx"])
def test_normals_of_its_own_are_those_of_the_object_that_has_them(package, tmp_path, suffix, which):
    objects, path = patches(), tmp_path / f"made{suffix}"
    for k in which:
        objects[k].data.normals_split_custom_set([ASKEW] * len(objects[k].data.loops))
    bpy.context.view_layer.update()
    own = {}
    for k, obj in enumerate(objects):
        for corner, loop in zip(obj.data.corner_normals, obj.data.loops, strict=True):
            own.setdefault((k, loop.vertex_index), []).append(np.array(corner.vector))
        assert all(np.allclose(n, ASKEW, atol=0.01) for n in own[k, 0]) == (k in which)
    places = np.array([obj.data.vertices[v].co for obj in objects for v in range(len(obj.data.vertices))])
    normals = [own[k, v] for k, obj in enumerate(objects) for v in range(len(obj.data.vertices))]
    package("files.export").export(path, suffix, objects, False)
    before = set(bpy.data.objects)
    if suffix == ".obj":
        bpy.ops.wm.obj_import(filepath=str(path), **package("files.meshes").AXES)
    elif suffix == ".fbx":
        bpy.ops.import_scene.fbx(filepath=str(path))
    else:
        bpy.ops.import_scene.gltf(filepath=str(path))
    bpy.context.view_layer.update()
    seen = 0
    for obj in set(bpy.data.objects) - before:
        turn = np.array(obj.matrix_world)[:3, :3]
        for corner, loop in zip(obj.data.corner_normals, obj.data.loops, strict=True):
            place = np.array(obj.matrix_world @ obj.data.vertices[loop.vertex_index].co)
            normal = turn @ np.array(corner.vector)
            nearest = np.linalg.norm(places - place, axis=1).argmin()
            assert min(np.linalg.norm(normal / np.linalg.norm(normal) - n) for n in normals[nearest]) < 0.02
            seen += 1
    assert seen >= sum(len(obj.data.loops) for obj in objects)


@pytest.mark.parametrize("bare", range(4))
@pytest.mark.parametrize("suffix", FORMATS)
def test_a_file_of_objects_of_which_some_have_no_uvs_holds_them_all(package, tmp_path, suffix, bare):
    objects, path = patches(), tmp_path / f"made{suffix}"
    for obj in objects[:bare]:
        obj.data.uv_layers.remove(obj.data.uv_layers[0])
    package("files.export").export(path, suffix, objects, False)
    package("files.read_back").check(path, suffix, objects)
    if suffix in (".stl", ".ply"):
        return
    # Without those of one it is another file.
    mapped = next((obj for obj in objects if not obj.data.uv_layers), None)
    if mapped is not None:
        mapped.data.uv_layers.new(name="more")
        with pytest.raises(package("files.verified").FileError, match="uv corners"):
            package("files.read_back").check(path, suffix, objects)


@pytest.mark.parametrize("first", [(0, 0, 1, 1), (1, 1, 0, 0)], ids=str)
def test_an_object_without_materials_gets_none_of_the_one_before(package, tmp_path, first):
    """Faces of the first in the order of their materials, and in another one."""
    objects = [scenes.bump(2, 2, name=name, offset=2.0 * k) for k, name in enumerate("AB")]
    for name in ("red", "blue"):
        objects[0].data.materials.append(material(name))
    objects[0].data.polygons.foreach_set("material_index", first)
    for obj in objects:
        scenes.set_uv(obj, scenes.seen_from_above(obj, 0.2))
    assert read_again(package, tmp_path / "made.obj", objects) == (faces_of(objects), [])


def features():
    """What objects may have that some format does not hold, and what gives it to one."""

    def coloured(obj):
        obj.data.color_attributes.new("Colour", "FLOAT_COLOR", "CORNER")

    def twice_coloured(obj):
        coloured(obj)
        obj.data.color_attributes.new("Further", "FLOAT_COLOR", "CORNER")
        obj.data.color_attributes.active_color = obj.data.color_attributes["Further"]

    def keyed(obj):
        obj.shape_key_add(name="Basis")
        obj.shape_key_add(name="Smile")

    def creased(obj):
        obj.data.attributes.new("crease_edge", "FLOAT", "EDGE").data[1].value = 0.5

    def changed(obj):
        obj.modifiers.new("Smooth", "SUBSURF")
        obj.modifiers.new("Thick", "SOLIDIFY")

    return {
        "materials": lambda obj: [obj.data.materials.append(each) for each in (None, material("red"))],
        "": lambda obj: obj.data.materials.append(None),
        "colours": coloured,
        "colours beside the active ones": twice_coloured,
        "shape keys": keyed,
        "weights": lambda obj: [obj.vertex_groups.new(name=name) for name in ("one", "two")],
        "modifiers": changed,
        "UV maps beside the one written": lambda obj: [obj.data.uv_layers.new(name=name) for name in ("u", "v", "w")],
        "attributes": lambda obj: obj.data.attributes.new("of_faces", "INT", "FACE"),
        "seams": lambda obj: [setattr(edge, "use_seam", True) for edge in obj.data.edges],
        "creases": creased,
    }


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("chosen", [(0,), (2,), (0, 1), (0, 2), (0, 1, 2)], ids=str)
def test_what_is_left_out_is_counted_over_all_objects(package, suffix, chosen):
    losses = package("files.losses")
    for kind, give in features().items():
        objects = [scenes.bump(2, 2, name=name) for name in "ABC"]
        for k in chosen:
            give(objects[k])
        lost = bool(kind) and kind not in losses.HOLDS[suffix]
        for order in permutations(objects):
            said = " ".join(losses.losses(suffix, order))
            counts = dict(re.findall(r"(?:out: |, )([^(]+) \((\d+)\)", said))
            assert counts.get(kind) == (str(len(chosen)) if lost else None), (kind, said)
        for obj in objects:
            bpy.data.objects.remove(obj)


@pytest.mark.parametrize(
    "names", [("A b",), ("A b", "B"), ("A b", "A_b"), ("A b", "A_b", "C"), ("A b", "C", "A_b", "D")], ids=str
)
def test_objects_whose_materials_are_left_out_are_counted(package, tmp_path, names):
    """Those that have the name of another in the file are not told apart, and then none is."""
    objects = [scenes.bump(2, 2, name=name, offset=2.0 * k) for k, name in enumerate(names)]
    for obj in objects:
        obj.data.materials.append(material("red"))
        obj.data.materials.append(material("blue"))
        for face in obj.data.polygons:
            face.material_index = 1 - face.index % 2
    told = package("files.export").export(tmp_path / "made.obj", ".obj", objects, False)
    alike = len({name.replace(" ", "_") for name in names}) < len(names)
    assert told == ([f"Materials of {len(names)} objects were left out of the OBJ file"] if alike else [])


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_object_is_counted_when_it_is_read_back_also_one_of_several_with_one_mesh(package, tmp_path, suffix):
    """A format that holds a mesh once for all of its objects is asked for it once."""
    A, B = patches()[:2]
    for obj in (A, B):
        obj.data.materials.clear()
    C, D = A.copy(), A.copy()
    objects = [C, A, B, D]
    for k, obj in enumerate((C, D)):
        obj.name, obj.location.z = "CD"[k], 3.0 + k
        bpy.context.collection.objects.link(obj)
    bpy.context.view_layer.update()
    check, error = package("files.read_back").check, package("files.verified").FileError
    once = suffix in (".glb", ".gltf", ".fbx")
    for left_out in (None, *objects):
        some = [obj for obj in objects if obj != left_out]
        path = tmp_path / f"{len(list(tmp_path.iterdir()))}{suffix}"
        package("files.export").export(path, suffix, some, False)
        check(path, suffix, some)
        if left_out is None or (once and left_out != B):
            check(path, suffix, objects)
        else:
            with pytest.raises(error, match="instead of"):
                check(path, suffix, objects)


@pytest.mark.parametrize("order", list(permutations(range(3))), ids=str)
@pytest.mark.parametrize("far", [(1e6, 0, 0), (1e4, 1e6, 1e5), (0, 3e5, 3e6)], ids=str)
def test_what_single_precision_rounds_is_told_of_the_farthest_object(package, tmp_path, far, order):
    objects = [scenes.bump(2, 2, name=name) for name in "ABC"]
    for obj, at in zip(objects, far, strict=True):
        for vertex in obj.data.vertices:
            vertex.co.y += at
    (tmp_path / "in.obj").write_text("")
    found = package("files.loaded").compare(tmp_path / "in.obj", [objects[k] for k in order])
    step = float(np.spacing(np.float32(max(far) + 1))) / 2
    assert found.loss == step and not found.moved
    assert found.texts == (
        f"Coordinates are so far from the origin that single precision rounds them by up to {step:.2g}",
    )
