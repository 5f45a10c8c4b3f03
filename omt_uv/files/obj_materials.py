"""Materials of an OBJ file that was exported: of faces in their own order, and a .mtl whose name is nobody else's."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..solver.errors import plural
from .verified import check_length

if TYPE_CHECKING:
    import bpy


def place_materials(made: Path, target: Path, companions: dict[Path, Path]) -> list[str]:
    """Name the materials of an OBJ file `made` after its target, and add them to its companions; returns warnings.

    A file of this name with other contents is somebody else's, and stays.
    """
    materials = made.with_suffix(".mtl")
    text = made.read_bytes()
    if not materials.is_file():
        return []
    place, told = target.with_suffix(".mtl"), []
    for k in range(1, 1000):
        if not place.exists() or place.read_bytes() == materials.read_bytes():
            break
        place = target.with_name(f"{target.stem}_{k}.mtl")
    if place.name != target.with_suffix(".mtl").name:
        told = [f"{target.with_suffix('.mtl').name} holds other materials and was left alone; {place.name} has these"]
    check_length(place)
    # The name may be in a remark before it, too.
    line = rb"(?m)^mtllib " + re.escape(materials.name.encode()) + rb"(?=\r?$)"
    made.write_bytes(re.sub(line, lambda _: b"mtllib " + place.name.encode(), text, count=1))
    companions[materials] = place
    return told


def name_materials(path: Path, objects: Sequence[bpy.types.Object]) -> list[str]:
    """Add the lines mtllib and usemtl to an OBJ file that was written of these objects without them, beside its .mtl;
    returns a warning of the objects whose materials are left out, since they are not told apart in the file.

    The exporter itself sorts faces by material before it writes any.
    """
    lines = path.read_bytes().decode("utf-8", "surrogateescape").split("\n")
    by_name = {obj.name.replace(" ", "_"): obj for obj in objects}
    begins = [i for i, line in enumerate(lines) if line.startswith("o ")]
    done = 0
    for begin, end in zip(begins, [*begins[1:], len(lines)], strict=True):
        obj = by_name.get(lines[begin][2:].rstrip("\r"))
        faces = [i for i in range(begin, end) if lines[i].startswith("f ")]
        if obj is None or len(by_name) < len(objects) or len(faces) != len(obj.data.polygons):
            continue
        done += 1
        index = np.zeros(len(faces), np.int32)
        obj.data.polygons.foreach_get("material_index", index)
        names = [slot.material.name.replace(" ", "_") if slot.material else "" for slot in obj.material_slots]
        for k in np.flatnonzero(np.diff(index, prepend=-1)).tolist():
            name = names[index[k]] if index[k] < len(names) else ""
            lines[faces[k]] = f"usemtl {name}\n{lines[faces[k]]}"
    if begins:
        lines[begins[0]] = f"mtllib {path.with_suffix('.mtl').name}\n{lines[begins[0]]}"
    path.write_bytes("\n".join(lines).encode("utf-8", "surrogateescape"))
    left = plural(len(begins) - done, "an object", "{} objects")
    return [f"Materials of {left} were left out of the OBJ file"] if done < len(begins) else []
