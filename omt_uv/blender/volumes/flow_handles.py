"""Find the handles of a flow in a scene: selected vertices, empties, vertex groups with goals, and hooks; and its
walls."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

import numpy as np

from ...errors import UserError
from ...pipelines.volumes.flow import FlowBody
from ...pipelines.volumes.handle_file import euler_matrix
from ...solver.flows.domain import FlowDomain, ball_domain, mesh_domain
from ...solver.flows.handles import FlowHandle
from ..vertex_groups import selected_vertices
from .bodies import members, read_body

GOAL = ".to"
Found = list[tuple[int, FlowHandle]]


class SceneHandleError(UserError):
    """There is nothing in the scene that would move, or no such wall."""


def scene_handles(
    kind: str, objects: Sequence[bpy.types.Object], bodies: Sequence[FlowBody], move, rotate
) -> tuple[tuple[int, FlowHandle], ...]:
    """Pairs of a body's number and a handle of it; `kind` of `choices.FLOW_HANDLES` in lower case.

    move (3,), rotate (3,) in radians about x, y, z : where selected vertices go

    Raises
    ------
    SceneHandleError : there are none
    """
    if kind == "selected":
        found = _selected(objects, bodies, np.asarray(move, float), np.asarray(rotate, float))
        missing = "No vertex is selected. Select the vertices that shall move"
    elif kind == "empties":
        found = _empties()
        missing = f"No object has a partner. Name one object NAME and the place where it shall go NAME{GOAL}"
    elif kind == "groups":
        found = _groups(objects, bodies)
        missing = "No vertex group has a goal. Add an empty with the name of the group where it shall go"
    else:
        found = _hooks(objects, bodies)
        missing = "There is no Hook modifier with vertices. Hook vertices to an object, and move that"
    if not found:
        raise SceneHandleError(f"{', '.join(obj.name for obj in objects)}: {missing}.")
    return tuple(found)


def _selected(objects, bodies, move: np.ndarray, rotate: np.ndarray) -> Found:
    """The selected vertices of all bodies, which turn about the middle of them all."""
    rows = [np.flatnonzero(selected_vertices(obj)) for obj in objects]
    every = np.concatenate([body.positions[r] for body, r in zip(bodies, rows, strict=True)])
    if not len(every):
        return []
    matrix = euler_matrix(rotate)
    middle = every.mean(axis=0)
    found: Found = []
    for k, (body, r) in enumerate(zip(bodies, rows, strict=True)):
        if len(r):
            start = body.positions[r]
            found.append((k, FlowHandle(start, (start - middle) @ matrix.T + middle + move, r, "the selection")))
    return found


def grip(matrix: np.ndarray, size: float) -> np.ndarray:
    """Points (7,3) by which an object with a matrix (4,4) holds what is around it: its place, and along its axes."""
    axes = _rotation(matrix).T * size
    return matrix[:3, 3] + np.concatenate([np.zeros((1, 3)), axes, -axes])


def _rotation(matrix: np.ndarray) -> np.ndarray:
    """The rotation (3,3) in a matrix (4,4), without scale and shear."""
    u, _, v = np.linalg.svd(matrix[:3, :3])
    return u @ np.diag([1, 1, np.sign(np.linalg.det(u @ v))]) @ v


def _world(obj: bpy.types.Object) -> np.ndarray:
    return np.array(obj.matrix_world, float)


def _empties() -> Found:
    """Pairs of objects NAME and NAME.to of the scene; an empty of size s holds a ball of that radius."""
    found: Found = []
    for obj in bpy.context.scene.objects:
        goal = bpy.context.scene.objects.get(obj.name + GOAL)
        if goal is None:
            continue
        size = obj.empty_display_size if obj.type == "EMPTY" else 0.0
        if size > 0:
            size *= abs(float(np.linalg.det(_world(obj)[:3, :3]))) ** (1 / 3)
        start, end = (grip(_world(x), size) for x in (obj, goal))
        found.append(
            (-1, FlowHandle(start, end, None, obj.name) if size > 0 else FlowHandle(start[:1], end[:1], None, obj.name))
        )
    return found


def _groups(objects, bodies) -> Found:
    """Vertex groups with a goal: NAME and NAME.to take it along as a rigid body, one alone takes its middle."""
    found: Found = []
    scene = bpy.context.scene.objects
    for k, (obj, body) in enumerate(zip(objects, bodies, strict=True)):
        for group in obj.vertex_groups:
            first, goal = scene.get(group.name), scene.get(group.name + GOAL)
            inside = members(obj, group.name)
            if (first is None and goal is None) or inside is None or not inside.any():
                continue
            rows = np.flatnonzero(inside)
            start = body.positions[rows]
            if first is not None and goal is not None:
                a, b = _world(first), _world(goal)
                turn = _rotation(b) @ _rotation(a).T
                end = (start - a[:3, 3]) @ turn.T + b[:3, 3]
            else:
                end = start - start.mean(axis=0) + _world(goal or first)[:3, 3]
            found.append((k, FlowHandle(start, end, rows, group.name)))
    return found


def _hooks(objects, bodies) -> Found:
    """Vertices of Hook modifiers, which go as their object has gone since it was hooked."""
    found: Found = []
    for k, (obj, body) in enumerate(zip(objects, bodies, strict=True)):
        for modifier in obj.modifiers:
            if modifier.type != "HOOK" or modifier.object is None:
                continue
            rows = np.array(list(modifier.vertex_indices), np.int64)
            if modifier.vertex_group:
                inside = members(obj, modifier.vertex_group)
                rows = rows if inside is None else np.union1d(rows, np.flatnonzero(inside))
            rows = np.unique(rows[rows < len(body.positions)])
            if not len(rows):
                continue
            # From the object's space at hooking time into the world of now.
            matrix = _world(modifier.object) @ np.array(modifier.matrix_inverse, float) @ np.linalg.inv(_world(obj))
            start = body.positions[rows]
            found.append((k, FlowHandle(start, start @ matrix[:3, :3].T + matrix[:3, 3], rows, modifier.name)))
    return found


def wall_of(kind: str, name: str) -> FlowDomain | None:
    """The walls of a flow, `kind` of `choices.FLOW_WALLS` in lower case, from an object.

    Raises
    ------
    SceneHandleError : there is no such object, or it is no mesh
    """
    if kind == "free":
        return None
    obj = bpy.data.objects.get(name)
    if obj is None:
        raise SceneHandleError(f"There is no object {name!r} that could be the wall. Choose one.")
    if kind == "mesh":
        if obj.type != "MESH" or not len(obj.data.polygons):
            raise SceneHandleError(f"{name} is no mesh with faces. Choose a closed mesh, or a ball.")
        body = read_body(obj)
        return mesh_domain(body.positions, body.triangles)
    matrix = _world(obj)
    if obj.type == "MESH" and len(obj.data.vertices):
        points = read_body(obj).positions
        middle = (points.max(axis=0) + points.min(axis=0)) / 2
        return ball_domain(middle, float(np.linalg.norm(points - middle, axis=1).max()))
    scale = float(np.abs(np.linalg.norm(matrix[:3, :3], axis=0)).max())
    return ball_domain(matrix[:3, 3], scale * (obj.empty_display_size if obj.type == "EMPTY" else 1.0))
