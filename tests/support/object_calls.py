"""Calls of every function of `omt_uv.blender` that asks for objects, meshes, and names and numbers of theirs alone, on
objects in many states; and what each gives, and changes in the file, as a few figures."""

from __future__ import annotations

import importlib
import inspect
import itertools
import pkgutil
import zlib
from collections.abc import Callable, Iterator

import bpy

import numpy as np
import recorded_calls
import scenes
from mathutils import Matrix

import omt_uv.blender
from omt_uv.blender import read_attributes

# What is given for parameters of these names, each in turn; functions that ask for anything else are left out.
NAMES = ("part", "none", "gone")
GIVEN: dict[str, Callable] = {
    "obj": lambda: bpy.data.objects["A"],
    "like": lambda: bpy.data.objects["A"],
    "mesh": lambda: bpy.data.objects["A"].data,
    "objects": lambda: [bpy.data.objects["A"], bpy.data.objects["B"]],
    "context": lambda: bpy.context,
    "depsgraph": lambda: bpy.context.evaluated_depsgraph_get(),
    "elements": lambda: np.array([0, 2]),
    "edges": lambda: np.array([[0, 1], [1, 2]]),
    "names": lambda: ("A", "B"),
    "groups": lambda: {"centre": "part"},
    "corners": lambda: np.array([1, 2]),
    "uv": lambda: np.array([[0.1, 0.2], [0.3, 0.4]], np.float32),
    "weights": lambda: np.linspace(0, 1, len(bpy.data.objects["A"].data.vertices)),
    "material": lambda: next(iter(bpy.data.objects["A"].data.materials), None),
    "factor": lambda: 2.0,
    "size": lambda: 0.5,
    "count": lambda: 2,
    "everything": lambda: True,
    "edit_mode": lambda: False,
    "applied": lambda: False,
    "pole": lambda: "part",
    "meridian": lambda: "second",
    "side": lambda: "",
    "place": lambda: 0.25,
}
SEVERAL = {
    "name": NAMES, "group": NAMES, "keep": NAMES, "layer": ("", "Second"), "prefix": ("LM_", ""), "key": ("", "Smile"),
    "kind": ("vertex", "edge", "face"), "levels": (1,), "group_names": (("part", "none"),),
    "write": ("MATERIALS", "MESH"),
}  # fmt: skip
SEVERAL |= dict.fromkeys(("attribute", "a layer"), ())
# Of these there is one for every attribute of a mesh.
LAYERS = ("UVMap", "Second", "zone", "height", "byte_color", "float_color", "sharp_edge", "material_index", "position")
# What asks Blender for a window, or changes how it starts.
LEFT_OUT = {
    "versions.settle_context",
    "versions.open_empty",
    "versions.register_command",
    "versions.unregister_command",
}


def _objects() -> None:
    """Two patches with two layers of UVs, pins, groups, landmarks, keys, materials, seams and attributes."""
    for k, name in enumerate("AB"):
        obj = scenes.bump(3, 2, 0.4 + 0.1 * k, name, offset=1.5 * k)
        mesh, faces = obj.data, len(obj.data.polygons)
        scenes.set_uv(obj, 0.3 * scenes.seen_from_above(obj, shift=(0.1, 0.2 * k)))
        scenes.set_uv(obj, 0.5 * scenes.seen_from_above(obj), "Second")
        scenes.pin(obj, [0, 3 + k])
        for group, rows, weight in (("part", [0, 1, 5, 6], 0.8), ("second", [2 + k], 1.0), ("none", [], 1.0),
                                    ("LM_0", [4], 1.0), ("LM_1", [7 + k], 0.4), ("of LM_0", [8], 1.0)):  # fmt: skip
            obj.vertex_groups.new(name=group).add(rows, weight, "REPLACE")
        mesh.attributes.new("zone", "INT", "FACE").data.foreach_set("value", np.arange(faces) % 3)
        mesh.attributes.new("height", "FLOAT", "POINT").data.foreach_set("value", [v.co.z for v in mesh.vertices])
        for kind in ("BYTE_COLOR", "FLOAT_COLOR"):
            colours = mesh.color_attributes.new(kind.lower(), kind, "CORNER")
            colours.data.foreach_set("color", np.linspace(0, 1, 4 * len(mesh.loops)))
        for material in ("one", "two"):
            mesh.materials.append(bpy.data.materials.get(material) or bpy.data.materials.new(material))
        mesh.polygons.foreach_set("material_index", np.arange(faces) % 2)
        mesh.edges[3].use_seam = mesh.edges[5].use_edge_sharp = True
        for vertex in mesh.vertices:
            vertex.select = vertex.index in (1, 4)
    scenes.select(list(bpy.data.objects))


def _with(change: Callable) -> Callable:
    """Objects of which A is changed."""

    def make() -> None:
        _objects()
        change(bpy.data.objects["A"])
        bpy.context.view_layer.update()

    return make


def _keyed(obj) -> None:
    obj.shape_key_add(name="Basis")
    key = obj.shape_key_add(name="Smile", from_mix=False)
    for k, point in enumerate(key.data):
        point.co.z += 0.1 * np.sin(1.0 + k)
    key.value = 0.5


def _smooth(obj) -> None:
    obj.modifiers.new("Smooth", "SUBSURF").levels = 2
    crease = obj.data.attributes.new("crease_edge", "FLOAT", "EDGE")
    crease.data.foreach_set("value", np.linspace(0, 1, len(obj.data.edges)))


def _turned(obj) -> None:
    obj.matrix_world = Matrix.Translation((1, 2, 3)) @ Matrix.Rotation(0.6, 4, "Y") @ Matrix.Diagonal((-1, 2, 0.7, 1))


def _bare(obj) -> None:
    obj.vertex_groups.clear()
    obj.data.materials.clear()
    while obj.data.uv_layers:
        obj.data.uv_layers.remove(obj.data.uv_layers[0])


def _edited() -> None:
    _objects()
    scenes.edit(*bpy.data.objects, faces=[1, 2])


STATES: dict[str, Callable] = {
    "plain": _objects,
    "edited": _edited,
    "keyed": _with(_keyed),
    "smooth": _with(_smooth),
    "turned": _with(_turned),
    "bare": _with(_bare),
    "without faces": _with(lambda obj: obj.data.clear_geometry()),
    "not finite": _with(lambda obj: setattr(obj.data.vertices[3].co, "x", float("inf"))),
}


def functions() -> Iterator[tuple[str, Callable, list[str]]]:
    """Names, functions and parameters of all that can be called."""
    package = omt_uv.blender
    for info in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        module = importlib.import_module(info.name)
        short = info.name.removeprefix(f"{package.__name__}.")
        for name, function in sorted(vars(module).items()):
            if getattr(function, "__module__", "") != info.name or not inspect.isfunction(function):
                continue
            asked = [p.name if "Layer" not in str(p.annotation) else "a layer"
                     for p in inspect.signature(function).parameters.values() if p.default is p.empty]  # fmt: skip
            known = all(each in GIVEN or each in SEVERAL for each in asked)
            if asked and known and f"{short}.{name}" not in LEFT_OUT:
                yield f"{short}.{name}", function, asked


def choices(asked: list[str]) -> Iterator[dict]:
    """What a function is called with: a value of each that has several."""
    several = [name for name in asked if name in SEVERAL]
    for values in itertools.product(*(SEVERAL[name] or LAYERS for name in several)):
        yield dict(zip(several, values, strict=True))


def _plain(value, depth: int = 0):
    """A value in which what is Blender's stands by its name."""
    if isinstance(value, bpy.types.ID):
        return f"{type(value).__name__} {value.name}"
    if inspect.isgenerator(value):
        return _plain(list(value), depth)
    if isinstance(value, dict):
        return {str(key): _plain(item, depth + 1) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item, depth + 1) for item in value]
    if isinstance(value, bpy.types.bpy_struct):
        return f"{type(value).__name__} {getattr(value, 'name', '')}"
    return value


def left() -> int:
    """A figure of what there is in the file: numbers of things, the mode, and all of the objects, to four places."""
    found: list = [[len(getattr(bpy.data, kind)) for kind in ("objects", "meshes", "images", "materials")]]
    found.append(bpy.context.mode)
    for obj in (o for o in bpy.data.objects if o.type == "MESH"):
        for key, value in scenes.state(obj).items():
            if isinstance(value, tuple) and "FLOAT" in str(value[1]):
                rounded = np.round(np.frombuffer(value[-1], np.float32).astype(float), 4) + 0.0
                value = (*value[:-1], np.nan_to_num(rounded).tobytes())
            found.append((key, value))
        mesh = obj.data
        picked = [np.flatnonzero([item.select for item in items]).tolist()
                  for items in (mesh.vertices, mesh.edges, mesh.polygons)]  # fmt: skip
        found += [picked, [group.name for group in obj.vertex_groups], len(mesh.materials)]
    return zlib.crc32(repr(found).encode())


def _given(name: str, chosen: dict):
    """What stands for a parameter."""
    if name in ("attribute", "a layer"):
        attribute = bpy.data.objects["A"].data.attributes[chosen[name]]
        return attribute if name == "attribute" else read_attributes._layer(attribute)
    return chosen[name] if name in chosen else GIVEN[name]()


def outcome(function: Callable, asked: list[str], chosen: dict) -> np.ndarray:
    """Figures (2,) of what a call gives, or of why it refuses."""
    try:
        given = [_given(name, chosen) for name in asked]
        found = _plain(function(*given))
    except Exception as error:  # noqa: BLE001, which one it is counts
        found = error
    return recorded_calls.figures(recorded_calls.told_leaves(found, errors=True))
