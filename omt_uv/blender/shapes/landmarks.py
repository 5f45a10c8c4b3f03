"""Landmarks of objects: vertex groups and empties whose names begin alike, kept in the file."""

from __future__ import annotations

import re
from collections.abc import Iterator

import bpy

import numpy as np

from ...pipelines.shapes.landmark_pairs import LandmarkPoint
from ..mesh import stretch
from ..vertex_groups import GroupError

# Size of an empty over the extent of its object.
SIZE = 0.02
# Property of an empty that is a landmark: the name, which Blender's own numbers do not change.
NAME = "omt_landmark"


def read_landmarks(obj: bpy.types.Object, prefix: str) -> list[LandmarkPoint]:
    """The landmarks of an object, positions in the space of its Reading: with its scale, without its rotation."""
    found = [LandmarkPoint(name, vertex=vertex) for name, vertex in _groups(obj, prefix)]
    inverse = np.linalg.inv(np.array(obj.matrix_world))
    for empty in empties(obj, prefix):
        place = inverse @ np.append(np.array(empty.matrix_world.translation), 1)
        x, y, z = (stretch(obj) @ place[:3]).tolist()
        found.append(LandmarkPoint(_name_of(empty), position=(x, y, z)))
    return found


def disk_markers(objects: list, positions: list, names: tuple[str, str]) -> list:
    """What landmarks of two names mark on each object, as its positions (n,3) are read: the centre of a disk and the
    start of its circle, as MapMarkers. The vertex nearest to an empty, or in the middle of a vertex group; None where
    it has neither.

    Raises
    ------
    GroupError : no object has a landmark of a name
    """
    from ...pipelines.shapes.distance import markers_of

    found = [[_vertex_of(obj, at, name) for name in names] for obj, at in zip(objects, positions, strict=True)]
    for name, vertices in zip(names, zip(*found, strict=True), strict=True):
        if not any(vertices):
            every = ", ".join(obj.name for obj in objects)
            raise GroupError(f"{every}: There is no vertex group {name!r}, and no landmark. Name one that is there.")
    return [markers_of(centre, start) if centre or start else None for centre, start in found]


def _vertex_of(obj: bpy.types.Object, positions: np.ndarray, name: str) -> list[int]:
    """The vertex of the landmark of a name; none, or several of them."""
    points = [point for point in read_landmarks(obj, name) if point.name == name]
    return [
        point.vertex if point.position is None else int(((positions - point.position) ** 2).sum(axis=1).argmin())
        for point in points
    ]


def empties(obj: bpy.types.Object, prefix: str) -> Iterator[bpy.types.Object]:
    """The empties that are landmarks of an object, with names that begin so: its children."""
    for child in obj.children:
        if child.type == "EMPTY" and _name_of(child).startswith(prefix):
            yield child


def put_landmark(obj: bpy.types.Object, name: str, point) -> bpy.types.Object:
    """Make or move the empty of a landmark to a point (3,) of the world."""
    found = next((e for e in empties(obj, name) if e.get(NAME, "") == name), None)
    if found is None:
        found = bpy.data.objects.new(name, None)
        found[NAME] = name
        found.empty_display_type, found.show_name, found.show_in_front = "SPHERE", True, True
        for collection in obj.users_collection:
            collection.objects.link(found)
        found.parent = obj
        found.matrix_parent_inverse = obj.matrix_world.inverted()
    found.empty_display_size = SIZE * max(obj.dimensions) or SIZE
    found.location = point
    return found


def remove_landmarks(obj: bpy.types.Object, prefix: str) -> int:
    """Delete the empties that are landmarks of an object; how many."""
    mine = list(empties(obj, prefix))
    for empty in mine:
        bpy.data.objects.remove(empty)
    return len(mine)


def free_name(objects: list[bpy.types.Object], prefix: str) -> str:
    """The first name with a number that none of the objects has as a landmark."""
    used = {point.name for obj in objects for point in read_landmarks(obj, prefix)}
    return next(f"{prefix}{k}" for k in range(1, len(used) + 2) if f"{prefix}{k}" not in used)


def _name_of(empty: bpy.types.Object) -> str:
    return empty.get(NAME) or re.sub(r"\.\d{3,}$", "", empty.name)


def _groups(obj: bpy.types.Object, prefix: str) -> list[tuple[str, int]]:
    """Vertex groups with the prefix, and of each the vertex in the middle: that nearest to the weighted mean."""
    groups = {g.index: g.name for g in obj.vertex_groups if g.name.startswith(prefix)}
    if not groups:
        return []
    members: dict[int, list[tuple[int, float]]] = {}
    for vertex in obj.data.vertices:
        for element in vertex.groups:
            if element.group in groups and element.weight > 0:
                members.setdefault(element.group, []).append((vertex.index, element.weight))
    found = []
    for group, rows in members.items():
        index, weight = np.array([row[0] for row in rows]), np.array([row[1] for row in rows])
        place = np.array([obj.data.vertices[k].co for k in index.tolist()])
        away = np.linalg.norm(place - weight @ place / weight.sum(), axis=1)
        found.append((groups[group], int(index[away.argmin()])))
    return found
