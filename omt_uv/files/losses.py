"""Name what a format cannot hold of the scene that is written to it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import bpy

SCENE = {"materials", "colours", "rigs", "animations", "cameras", "lights", "empties", "shape keys", "weights"}
# What of a scene each format holds; modifiers go along nowhere but in a .blend.
HOLDS = {
    ".obj": {"materials", "colours"},
    ".ply": {"colours"},
    ".stl": set(),
    ".glb": SCENE,
    ".gltf": SCENE,
    ".fbx": SCENE,
}
KINDS = {"ARMATURE": "rigs", "CAMERA": "cameras", "LIGHT": "lights", "EMPTY": "empties"}
# Light of these kinds has no counterpart.
FOREIGN_LIGHTS = {".glb": {"AREA"}, ".gltf": {"AREA"}}


def losses(suffix: str, meshes: Sequence[bpy.types.Object]) -> list[str]:
    """One warning that names and counts what is left out of a file of this format; none where nothing is.

    meshes : the mesh objects that are written
    """
    found = Counter(KINDS[obj.type] for obj in bpy.context.scene.objects if obj.type in KINDS)
    found["animations"] = len(bpy.data.actions)
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
    if not lost:
        return []
    names = ", ".join(f"{kind} ({count})" for kind, count in lost.items())
    return [f"{suffix} does not hold all of the file; left out: {names}"]
