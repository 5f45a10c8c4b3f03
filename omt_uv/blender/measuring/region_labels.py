"""Regions that objects name: vertex groups, materials, or the values of an attribute of faces."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

import numpy as np

from ...errors import UserError
from ...pipelines.reading import Reading
from ..mesh import readable
from ..vertex_groups import group_weights

GROUPS = "groups"
MATERIALS = "materials"
# Mean weight of a polygon's vertices from which it belongs to a group.
INSIDE = 0.5
# Different values of an attribute at most: a region for each of more would be no table.
MOST_VALUES = 1000

Pairs = Sequence[tuple[bpy.types.Object, Reading]]
Regions = list[tuple[str, list[np.ndarray]]]


class RegionError(UserError):
    """There are no such regions."""


def regions_of(pairs: Pairs, kind: str) -> Regions:
    """Pairs of a name and, for every object, its polygons (f,) bool: by vertex groups, by materials, or by the values
    of the attribute of this name on faces.

    Raises
    ------
    RegionError : no object has any
    """
    find = {GROUPS: _groups, MATERIALS: _materials}.get(kind)
    found = find(pairs) if find else _values(pairs, kind)
    found = [(name, masks) for name, masks in found if any(mask.any() for mask in masks)]
    if not found:
        names = ", ".join(obj.name for obj, _ in pairs)
        what = {GROUPS: "no vertex group with weights", MATERIALS: "no material"}.get(kind, f"no attribute {kind!r}")
        raise RegionError(f"{names}: There is {what} to tell regions by. Paint or assign one.")
    return found


def _groups(pairs: Pairs) -> Regions:
    """Polygons whose vertices have a mean weight of a half and more; these may overlap."""
    names = dict.fromkeys(group.name for obj, _ in pairs for group in obj.vertex_groups)
    found: Regions = []
    for name in names:
        masks = []
        for obj, reading in pairs:
            weights, surface = group_weights(obj, name), reading.surface
            if weights is None:
                masks.append(np.zeros(len(reading.faces), bool))
                continue
            sums = np.add.reduceat(weights[surface.corner_vertex], surface.face_start[:-1])
            masks.append(sums >= INSIDE * np.diff(surface.face_start))
        found.append((name, masks))
    return found


def _materials(pairs: Pairs) -> Regions:
    """Polygons of every material, over all objects; of empty slots together."""
    labels = []
    for obj, _ in pairs:
        index = np.zeros(len(obj.data.polygons), np.int32)
        obj.data.polygons.foreach_get("material_index", index)
        slots = [slot.material.name if slot.material else "" for slot in obj.material_slots] or [""]
        labels.append(np.array(slots, dtype=object)[np.minimum(index, len(slots) - 1)])
    if all((label == "").all() for label in labels):
        return []
    return _by_label(labels, lambda name: name or "no material")


def _values(pairs: Pairs, name: str) -> Regions:
    """Polygons of every value of an attribute of whole numbers, truth values or texts on faces."""
    labels: list[np.ndarray] = []
    there = False
    for obj, reading in pairs:
        attribute = obj.data.attributes.get(name)
        if attribute is None or attribute.domain != "FACE" or attribute.data_type not in ("INT", "INT8", "BOOLEAN"):
            labels.append(np.full(len(reading.faces), None, dtype=object))
            continue
        there = True
        labels.append(_face_values(obj, name, bool if attribute.data_type == "BOOLEAN" else np.int32).astype(object))
    if not there:
        return []
    found = _by_label(labels, lambda value: f"{name} {int(value)}")
    if len(found) > MOST_VALUES:
        raise RegionError(f"{name}: {len(found)} different values are no regions. Choose an attribute with fewer.")
    return found


def _face_values(obj: bpy.types.Object, name: str, kind: type) -> np.ndarray:
    """Values (f,) of an attribute of the faces of an object that has been read, in any mode."""
    with readable(obj.data) as mesh:
        values: np.ndarray = np.zeros(len(mesh.polygons), kind)
        mesh.attributes[name].data.foreach_get("value", values)
        return values


def _by_label(labels: list[np.ndarray], called) -> Regions:
    """A region for every label of any object but None."""
    every = sorted({value for label in labels for value in label.tolist() if value is not None})
    return [(called(value), [(label == value).astype(bool) for label in labels]) for value in every]
