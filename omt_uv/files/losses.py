"""Name what a format cannot hold of the scene that is written to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import bpy

import numpy as np

SCENE = {"materials", "colours", "rigs", "animations", "cameras", "lights", "empties", "shape keys", "weights"}
SCENE |= {"UV maps beside the one written", "colours beside the active ones", "curves and texts"}
# What of a scene each format holds; modifiers and seams go along nowhere but in a .blend.
HOLDS = {
    ".obj": {"materials", "colours"},
    ".ply": {"colours"},
    ".stl": set(),
    ".glb": SCENE,
    ".gltf": SCENE,
    ".fbx": SCENE | {"metaballs", "creases"},
}
KINDS = {"ARMATURE": "rigs", "CAMERA": "cameras", "LIGHT": "lights", "EMPTY": "empties", "META": "metaballs"}
KINDS |= {"CURVES": "hair curves", "LATTICE": "lattices", "SPEAKER": "speakers", "VOLUME": "volumes"}
KINDS |= {"POINTCLOUD": "point clouds", "LIGHT_PROBE": "light probes"}
KINDS |= dict.fromkeys(("GREASEPENCIL", "GPENCIL"), "grease pencils")
KINDS |= dict.fromkeys(("CURVE", "FONT", "SURFACE"), "curves and texts")
# Attributes that Blender makes by itself, or has other names for.
BUILT_IN = {"position", "sharp_face", "sharp_edge", "material_index", "custom_normal", "bevel_weight_edge"}
BUILT_IN |= {"bevel_weight_vert", "crease_edge", "crease_vert", "uv_seam", "freestyle_edge", "freestyle_face"}
# Light of these kinds has no counterpart.
FOREIGN_LIGHTS = {".glb": {"AREA"}, ".gltf": {"AREA"}}


def losses(suffix: str, meshes: Sequence[bpy.types.Object]) -> list[str]:
    """One warning that names and counts what is left out of a file of this format; none where nothing is.

    meshes : the mesh objects that are written
    """
    others = [obj.type for obj in bpy.context.scene.objects if obj.type != "MESH"]
    found = Counter(KINDS.get(kind, kind) for kind in others)
    found["animations"] = len(bpy.data.actions)
    found.update(_of_meshes(suffix, meshes))
    for obj in meshes:
        found["materials"] += any(slot.material for slot in obj.material_slots)
        found["colours"] += len(obj.data.color_attributes) > 0
        found["shape keys"] += obj.data.shape_keys is not None
        found["weights"] += len(obj.vertex_groups) > 0
        found["modifiers"] += any(modifier.type != "ARMATURE" for modifier in obj.modifiers)
    lost = {kind: count for kind, count in found.items() if count and kind not in HOLDS[suffix]}
    lights = [obj for obj in bpy.context.scene.objects if obj.type == "LIGHT"]
    foreign = sum(obj.data.type in FOREIGN_LIGHTS.get(suffix, ()) for obj in lights)
    if foreign:
        lost["area lights"] = foreign
    return _told(suffix, lost)


def losses_in_place(suffix: str, meshes: Sequence[bpy.types.Object]) -> list[str]:
    """The same of what a command has made of the meshes of a file of this format itself: UV maps and seams."""
    found = _of_meshes(suffix, meshes)
    made = ("UV maps beside the one written", "seams")
    return _told(suffix, {kind: found[kind] for kind in made if found[kind] and kind not in HOLDS[suffix]})


def _told(suffix: str, lost: dict[str, int]) -> list[str]:
    if not lost:
        return []
    names = ", ".join(f"{kind} ({count})" for kind, count in lost.items())
    return [f"{suffix} does not hold all of the file; left out: {names}"]


def _of_meshes(suffix: str, meshes: Sequence[bpy.types.Object]) -> Counter[str]:
    """How many meshes have layers, attributes, and marks of edges that not every format holds."""
    found: Counter[str] = Counter()
    for obj in meshes:
        mesh, points = obj.data, suffix == ".ply"
        colours = {layer.name for layer in mesh.color_attributes}
        uvs = {layer.name for layer in mesh.uv_layers}
        # PLY files have whatever vertices have, and of corners only the active layers.
        further = [x for x in mesh.color_attributes if not (points and x.domain == "POINT")]
        own = [
            x
            for x in mesh.attributes
            if x.name not in BUILT_IN | colours | uvs and not x.name.startswith(".") and not x.is_internal
        ]
        seam = np.zeros(len(mesh.edges), bool)
        mesh.edges.foreach_get("use_seam", seam)
        found["UV maps beside the one written"] += len(uvs) > 1
        found["colours beside the active ones"] += any(x != mesh.color_attributes.active_color for x in further)
        found["attributes"] += any(not (points and x.domain == "POINT") for x in own)
        found["seams"] += bool(seam.any())
        found["creases"] += bool({"crease_edge", "crease_vert"} & set(mesh.attributes.keys()))
    return found
