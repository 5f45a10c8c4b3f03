"""Everything that the open file holds, as Blender's own descriptions of its data tell it: value by value, by path."""

from __future__ import annotations

from contextlib import suppress
from fnmatch import fnmatchcase
from pathlib import Path

import bpy

import numpy as np
import scenes
from sphere_shapes import blob

# What a session keeps for itself, and what it can tell again of the rest.
NOT_OF_THE_FILE = {"rna_type", "id_data", "original", "users", "tag", "is_updated", "is_updated_data", "session_uid",
                   "is_evaluated", "preview", "asset_data", "override_library", "library_weak_reference",
                   "loop_triangles", "loop_triangle_polygons", "corner_normals", "polygon_normals", "vertex_normals",
                   "loops", "attributes", "vertex_colors", "texspace_location", "texspace_size", "vertex_paint_mask",
                   "depsgraph", "pixels", "is_dirty", "has_data", "bindcode", "is_runtime_data",
                   "uv_layer_clone", "uv_layer_stencil", "all_objects", "particle_edit",
                   "use_nodes"}  # fmt: skip
if bpy.app.version < (4, 3):
    # Blender 4.2 crashes when it reads the brushes of that tool; it makes layers for the others when it reads them, and
    # takes another UV map for the active one meanwhile.
    NOT_OF_THE_FILE |= {"uv_sculpt", "vertex_selection", "edge_selection", "pin"}
# Windows, tools, and what comes with Blender.
NOT_LOOKED_AT = {"screens", "workspaces", "window_managers", "brushes", "libraries", "fonts", "palettes", "linestyles"}
# Further than from the view layer of a scene to an object in the collection of a collection nothing goes.
DEEPEST = 7


def told() -> dict[str, str]:
    """Values of all properties of all data-blocks, by path."""
    found: dict[str, str] = {}
    for kind in bpy.data.bl_rna.properties:
        if kind.type == "COLLECTION" and kind.identifier not in NOT_LOOKED_AT:
            for block in getattr(bpy.data, kind.identifier):
                path = f"{kind.identifier}/{block.name_full}"
                found[path] = "there"
                _walk(block, path, found, 0)
                if isinstance(block, bpy.types.Mesh):
                    _attributes(block, path, found)
                if isinstance(block, bpy.types.Object) and block.type == "MESH":
                    found[f"{path}/active group"] = str(block.vertex_groups.active_index)
    return found


def changed(before: dict[str, str], after: dict[str, str], may: tuple[str, ...] = ()) -> list[str]:
    """Paths whose values differ, but those that fit a pattern."""
    paths = sorted(before.keys() | after.keys())
    other = [path for path in paths if before.get(path) != after.get(path)]
    return [path for path in other if not any(fnmatchcase(path, pattern) for pattern in may)]


def idle(before: dict[str, str], after: dict[str, str], may: tuple[str, ...]) -> list[str]:
    """Patterns that no path fits whose value differs."""
    paths = changed(before, after)
    return [pattern for pattern in may if not any(fnmatchcase(path, pattern) for path in paths)]


def _walk(struct, path: str, found: dict[str, str], depth: int) -> None:
    for prop in struct.bl_rna.properties:
        name = prop.identifier
        if name in NOT_OF_THE_FILE:
            continue
        here, value = f"{path}/{name}", getattr(struct, name)
        if prop.type == "POINTER":
            _follow(value, here, found, depth)
        elif prop.type == "COLLECTION":
            found[here] = str(len(value))
            for k, item in enumerate(value):
                _follow(item, f"{here}/{k}", found, depth)
        else:
            found[here] = repr(tuple(np.ravel(value)) if getattr(prop, "is_array", False) else value)
    # Not every kind can have properties of its own.
    with suppress(TypeError, AttributeError):
        found[f"{path}/own"] = repr({key: _plain(value) for key, value in sorted(struct.items())})


def _plain(value):
    """A property of somebody's own without where it lies in memory."""
    if hasattr(value, "to_dict"):
        return value.to_dict()
    if hasattr(value, "to_list"):
        return value.to_list()
    return value.name_full if isinstance(value, bpy.types.ID) else value


def _follow(value, path: str, found: dict[str, str], depth: int) -> None:
    """A data-block by its name, anything else by what it holds."""
    if isinstance(value, bpy.types.ID):
        found[path] = value.name_full
    elif value is not None and depth < DEEPEST:
        _walk(value, path, found, depth + 1)


def _attributes(mesh: bpy.types.Mesh, path: str, found: dict[str, str]) -> None:
    """Names, kinds and values of all attributes; Blender makes and drops flags that are false everywhere."""
    for attribute in mesh.attributes:
        key, width, dtype = scenes._VALUE[attribute.data_type]
        values = np.zeros(len(attribute.data) * width, dtype)
        attribute.data.foreach_get(key, values)
        if attribute.data_type != "BOOLEAN" or values.any():
            here = f"{path}/attributes/{attribute.name}"
            found[here] = f"{attribute.domain} {attribute.data_type} {values.tobytes().hex()}"


def _body(name: str, seed: int, collection: bpy.types.Collection) -> bpy.types.Object:
    """A closed body that is turned, scaled and mirrored, with whatever a mesh may hold besides."""
    V, F = blob(1, seed=seed)
    obj = scenes.add(V * [1.0, 1.3, 0.8] * (1 + 0.2 * V[:, :1]), F, name)
    bpy.context.collection.objects.unlink(obj)
    collection.objects.link(obj)
    obj.rotation_euler, obj.scale, obj.location = (0.3, 0.2 * seed, -0.5), (1.1, -0.9, 1.2), (3.0 * seed, 0.5, 0.25)
    mesh, order = obj.data, np.argsort(V[:, 2])
    for group, vertices in (("region", order[-8:]), ("second", order[:7])):
        obj.vertex_groups.new(name=group).add(vertices.tolist(), 1.0, "REPLACE")
    for layer in ("other", "UVMap"):
        scenes.set_uv(obj, np.random.default_rng(seed).random((len(mesh.loops), 2)), layer)
    mesh.uv_layers.active = mesh.uv_layers["UVMap"]
    for material in ("one", "two"):
        mesh.materials.append(bpy.data.materials.get(material) or bpy.data.materials.new(material))
    for face in mesh.polygons:
        face.material_index, face.use_smooth = face.index % 2, face.index % 3 == 0
        face.select = face.index % 5 == 0
    for edge in mesh.edges:
        edge.use_edge_sharp = edge.index % 9 == 0
    mesh.attributes.new("height", "FLOAT", "POINT").data.foreach_set("value", V[:, 2].astype(np.float32))
    colour = mesh.color_attributes.new("Colour", "BYTE_COLOR", "CORNER")
    colour.data.foreach_set("color", np.random.default_rng(seed).random(4 * len(mesh.loops)))
    obj["mine"], mesh["mine too"] = {"a": 1, "b": [2.0, 3.0]}, "text"
    obj.color, obj.pass_index = (0.1, 0.2, 0.3, 1.0), 7
    obj.modifiers.new("Bent", "SIMPLE_DEFORM").show_viewport = False
    return obj


def _halves() -> bpy.types.Object:
    """A grid of quads and its mirror image, with UVs of theirs that are not alike."""
    y, x = np.mgrid[0:3, 0:3] / 2.0
    flat = np.stack([x + 0.2, y + 0.3 * x * y, 0.4 * x * (1 - y)], axis=-1).reshape(-1, 3)
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4], [3, 4, 7, 6], [4, 5, 8, 7]])
    faces = np.concatenate([quads, quads[:, [0, 3, 2, 1]] + 9])
    obj = scenes.add(np.concatenate([flat, flat * [-1, 1, 1]]), faces, "Halves")
    uv = scenes.seen_from_above(obj)
    scenes.set_uv(obj, 0.15 * uv + 0.4 + 0.05 * np.sin(9 * uv[:, ::-1]))
    return obj


def make() -> list[bpy.types.Object]:
    """Two bodies in collections, one in the other, with all around them that a file may hold; unwrapped and selected.
    And two halves, which are not."""
    scene = bpy.context.scene
    outer, inner, out = (bpy.data.collections.new(name) for name in ("Outer", "Inner", "Out"))
    scene.collection.children.link(outer)
    outer.children.link(inner)
    scene.collection.children.link(out)
    bodies = [_body("A", 1, outer), _body("B", 2, inner)]
    scenes.select(bodies)
    assert bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0) == {"FINISHED"}
    for obj in bodies:
        uv = scenes.uv_of(obj)
        scenes.set_uv(obj, 0.8 * uv + 0.1 * uv**2)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    eye = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    place = bpy.data.objects.new("Place", None)
    outer.objects.link(lamp)
    scene.collection.objects.link(eye)
    out.objects.link(place)
    place.parent, place.hide_render = bodies[0], True
    eye.constraints.new("TRACK_TO").target = bodies[1]
    lamp.keyframe_insert("location", frame=3)
    lamp.hide_viewport = eye.hide_select = True
    bpy.context.view_layer.layer_collection.children["Out"].exclude = True
    bpy.data.texts.new("Note").write("of mine")
    bpy.data.worlds.new("Sky").use_fake_user = True
    image = bpy.data.images.new("Picture", 4, 4)
    image.pack()
    image.use_fake_user = True
    scene["mine"], scene.camera, scene.frame_end = 3, eye, 77
    scene.cursor.location, scene.unit_settings.scale_length = (1, 2, 3), 0.5
    scene.tool_settings.mesh_select_mode = (False, True, False)
    scene.frame_set(5)
    _halves().location = (0, 0, 4)
    scenes.select(bodies)
    return bodies


def save(folder: Path) -> Path:
    """The same in a file of its own, in.blend of a folder, with what commands ask for besides; the folder."""
    scenes.open_empty()
    make()
    bpy.data.images["Picture"].save(filepath=str(folder / "image.png"))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "in.blend"))
    return folder
