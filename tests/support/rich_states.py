"""Files in which there is something for every operator to take for something else: two objects that are turned, scaled
unevenly and away from the middle, with two of everything, of which the second is active; others beside them that share
a mesh, are linked from another file, not selected, or out of the view layer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import bpy

import dressed_bodies
import numpy as np
import scenes

# Faces that are selected in Edit Mode.
CHOSEN = {"A": [0, 1, 4, 5, 6], "B": [1, 2, 5, 6, 7]}


def begin(make: Callable, folder: Path) -> None:
    """A file that holds what a state makes; quicker than to open one."""
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    data = bpy.data
    kinds = (data.objects, data.meshes, data.curves, data.images, data.materials, data.collections, data.node_groups,
             data.libraries, data.actions, data.shape_keys)  # fmt: skip
    data.batch_remove([item for kind in kinds if kind is not data.shape_keys for item in kind])
    scene = bpy.context.scene
    scene.unit_settings.scale_length = 0.5
    scene.frame_set(5)
    scene.tool_settings.mesh_select_mode = (True, False, False)
    _images()
    make(folder)
    bpy.context.view_layer.update()


def library(folder: Path) -> None:
    """A file with an object to be linked."""
    begin(lambda _: _patch("Linked", 2, 3, 2), folder)
    bpy.data.libraries.write(str(folder / "library.blend"), {bpy.data.objects["Linked"]})


def _images() -> None:
    """Two pictures, one of them larger and half transparent."""
    for name, width, height in (("Picture", 24, 16), ("Detail", 32, 20)):
        image = bpy.data.images.new(name, width, height, alpha=name == "Detail")
        y, x = np.mgrid[0:height, 0:width]
        rgba = np.stack([x / width, y / height, (x + 2 * y) % 5 / 5, 1 - 0.5 * (x > 9)], axis=-1)
        image.pixels.foreach_set(rgba.astype(np.float32).ravel())
        image.pack()


def _material(name: str) -> bpy.types.Material:
    """A material; the first one shows a picture."""
    found = bpy.data.materials.get(name) or bpy.data.materials.new(name)
    # Before Blender 5.0 a material has no nodes by itself.
    if found.node_tree is None:
        found.use_nodes = True
    if name == "one" and not any(node.type == "TEX_IMAGE" for node in found.node_tree.nodes):
        node = found.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images["Picture"]
    return found


def _dress(obj, seed: int) -> None:
    """Groups, landmarks, materials, seams, marks, attributes, keys and properties."""
    mesh, n = obj.data, len(obj.data.vertices)
    rng = np.random.default_rng(seed)
    for group, rows in (("none", []), ("part", [1, 2, 6, 7]), ("second", [n - 1, n - 2, n - 7]),
                        ("LM_0", [0]), ("LM_1", [n - 1]), ("LM_2", [n // 2]), ("LM_10", [n // 3]),
                        ("pole", [n - 1]), ("meridian", [2]), ("east", [4]),
                        ("corners", [0, 4, n - 5, n - 1])):  # fmt: skip
        made = obj.vertex_groups.new(name=group)
        for k in rows:
            made.add([k], 1.0 if group not in ("part", "second") else 0.6 + 0.3 * rng.random(), "REPLACE")
    obj.vertex_groups.active_index = 1 + seed % 2
    for name in ("one", None, "two"):
        mesh.materials.append(_material(name) if name else None)
    faces, corners = len(mesh.polygons), len(mesh.loops)
    mesh.polygons.foreach_set("material_index", np.arange(faces) * 2 % 3)
    mesh.edges[3 + seed].use_edge_sharp = mesh.edges[6].use_edge_sharp = True
    layers = (("crease_edge", "FLOAT", "EDGE", np.linspace(0, 1, len(mesh.edges))),
              ("height", "FLOAT", "POINT", 0.5 + np.abs(np.sin(np.arange(n)))),
              ("zone", "INT", "FACE", np.arange(faces) % 3),
              (".sculpt_face_set", "INT", "FACE", 1 + np.arange(faces) % 2),
              ("flag", "BOOLEAN", "FACE", np.arange(faces) % 4 == 0))  # fmt: skip
    for name, kind, domain, values in layers:
        mesh.attributes.new(name, kind, domain).data.foreach_set("value", values)
    for name, kind in (("byte", "BYTE_COLOR"), ("float", "FLOAT_COLOR")):
        colours = mesh.color_attributes.new(name, kind, "CORNER")
        colours.data.foreach_set("color", rng.random(4 * corners).astype(np.float32))
    mesh.color_attributes.active_color_index = 1
    obj["mine"], mesh["of the mesh"] = 7, "text"
    obj.color, obj.pass_index = (0.1, 0.2, 0.3, 1.0), 7
    for vertex in mesh.vertices:
        vertex.select = vertex.index in (1 + seed, 2, n - 3)


def _keyed(obj) -> None:
    obj.shape_key_add(name="Basis")
    points = np.array([v.co for v in obj.data.vertices])
    for k, name in enumerate(("Smile", "Frown")):
        key = obj.shape_key_add(name=name, from_mix=False)
        key.data.foreach_set("co", (points * [1, 1.1 - 0.3 * k, 1.2]).astype(np.float32).ravel())
        key.value = 0.5 * k
    obj.active_shape_key_index = 2


def _patch(name: str, seed: int, columns: int = 4, rows: int = 3):
    """A curved patch of two islands, one of them beside the other, with two UV maps of which the second is active and
    the first rendered."""
    obj = scenes.bump(columns, rows, 0.4 + 0.1 * seed, name)
    mesh = obj.data
    mesh.transform(_stretched())
    above = scenes.seen_from_above(obj)
    middle = np.array([face.center[0] for face in mesh.polygons])
    right = np.repeat(middle > above[:, 0].mean(), 4)
    scenes.set_uv(obj, 0.2 + 0.3 * above[:, ::-1], "First")
    scenes.set_uv(
        obj, 0.3 * above + 0.05 * above**2 + np.where(right[:, None], [0.1, 0.3 - 0.1 * seed], [0.02, 0.05]), "Second"
    )
    mesh.uv_layers["First"].active_render = True
    mesh.uv_layers.active = mesh.uv_layers["Second"]
    scenes.pin(obj, [0, 2], "Second")
    sides = {}
    for face in mesh.polygons:
        for key in face.edge_keys:
            sides.setdefault(key, set()).add(bool(right[face.loop_start]))
    for edge in mesh.edges:
        edge.use_seam = len(sides[edge.key]) == 2
    _dress(obj, seed)
    return obj


def _stretched():
    from mathutils import Matrix

    return Matrix.Diagonal((1.5, 1.0, 0.8, 1.0))


def _placed(A, B) -> None:
    A.location, A.rotation_euler, A.scale = (0.3, -0.2, 0.5), (0.3, 0.5, 0.2), (1.2, 0.8, 1.5)
    B.location, B.rotation_euler, B.scale = (2.5, 0.4, -0.3), (-0.2, 0.1, 1.2), (-1.1, 1.4, 0.7)


def _others(A, B, folder: Path) -> None:
    """What stands around two objects: a collection that is out of the view layer, a double, a child, a curve, places
    where things may go, and what is linked."""
    scene = bpy.context.scene
    out, inner = bpy.data.collections.new("Out"), bpy.data.collections.new("Inner")
    scene.collection.children.link(out)
    scene.collection.children.link(inner)
    _patch("Outside", 0, 3, 2)
    double = bpy.data.objects.new("Double", A.data)
    child = scenes.add([(0, 0, 3), (1, 0, 3), (0, 1, 3.2), (1, 1, 3)], [(0, 1, 3, 2)], "Child")
    curve = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
    places = [bpy.data.objects.new(name, None) for name in ("go", "go.to", "part.to", "Wall.to")]
    for k, obj in enumerate((double, curve, *places)):
        scene.collection.objects.link(obj)
        obj.location = (0.4 + 0.1 * k, 0.3, 0.6 + 0.1 * k)
    child.parent = A
    for obj in (B,):
        for each in obj.users_collection:
            each.objects.unlink(obj)
        inner.objects.link(obj)
    outside = bpy.data.objects["Outside"]
    outside.users_collection[0].objects.unlink(outside)
    out.objects.link(outside)
    with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (_, wished):
        wished.objects = ["Linked"]
    linked = bpy.data.objects["Linked"]
    scene.collection.objects.link(linked)
    bpy.context.view_layer.layer_collection.children["Out"].exclude = True
    row = B.omt_uv_regions.rows.add()
    row.group, row.factor = "second" if B.vertex_groups.active_index == 1 else "part", 1.2


def _two_patches(folder: Path, selected: str = "A B", active: str = "B"):
    A, B = _patch("A", 0), _patch("B", 1, 5, 2)
    _placed(A, B)
    _keyed(B)
    A.modifiers.new("Smooth", "SUBSURF").levels = 1
    B.modifiers.new("Bent", "SIMPLE_DEFORM").angle = 0.3
    _others(A, B, folder)
    _choose(selected, active)
    return A, B


def _choose(selected: str, active: str) -> None:
    objects = bpy.context.view_layer.objects
    for obj in objects:
        obj.select_set(obj.name in selected.split())
    objects.active = objects[active]


def _edited(folder: Path) -> None:
    A, B = _two_patches(folder)
    scenes.edit(B, A, faces=[])
    bpy.ops.object.mode_set(mode="OBJECT")
    for obj in (A, B):
        for polygon in obj.data.polygons:
            polygon.select = polygon.index in CHOSEN[obj.name]
    bpy.ops.object.mode_set(mode="EDIT")


def _bodies(folder: Path) -> None:
    """Two closed bodies that are alike, with landmarks, around which there is a wall."""
    found = [dressed_bodies.body(name, 6, 5) for name in "AB"]
    for k, obj in enumerate(found):
        mesh = obj.data
        for name in ("of mine", "Colour", "crease_edge"):
            mesh.attributes.remove(mesh.attributes[name])
        obj.vertex_groups.clear()
        for vertex in mesh.vertices:
            vertex.co.z *= 1 + 0.15 * k * vertex.co.z
            vertex.co.x += 0.1 * k * vertex.co.y**2
        turn = np.array([vertex.co for vertex in mesh.vertices])[[loop.vertex_index for loop in mesh.loops]]
        uv = np.stack([np.arctan2(turn[:, 1], turn[:, 0]) / 7 + 0.5, turn[:, 2] / 3 + 0.5], axis=1)
        for layer in ("first", dressed_bodies.LAYER):
            scenes.set_uv(obj, uv if layer == "first" else 0.8 * uv**1.2, layer)
        mesh.uv_layers["first"].active_render = True
        for edge in mesh.edges:
            edge.use_seam = edge.index in (7, 13, 20)
        _dress(obj, k)
    A, B = found
    _placed(A, B)
    _keyed(A)
    B.modifiers.new("Smooth", "SUBSURF").levels = 1
    corners = [[3.0 * x, 3.0 * y, 3.0 * z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    wall = scenes.add(corners, sides, "Wall")
    wall.location = (1.0, 0.0, 0.0)
    _others(A, B, folder)
    _choose("A B", "B")


def _with_values_of_faces(folder: Path) -> None:
    """The active object is not selected, and what is a number of vertices elsewhere is one of faces."""
    A, _ = _two_patches(folder, "A Double Curve", "B")
    mesh = A.data
    mesh.attributes.remove(mesh.attributes["height"])
    values = np.arange(len(mesh.polygons)) % 6 == 1
    mesh.attributes.new("height", "FLOAT", "FACE").data.foreach_set("value", values.astype(np.float32))


STATES: dict[str, Callable] = {
    "patches": _two_patches,
    "edited": _edited,
    "bodies": _bodies,
    "active not selected": _with_values_of_faces,
    "one linked": lambda folder: _two_patches(folder, "A Linked", "A"),
}
