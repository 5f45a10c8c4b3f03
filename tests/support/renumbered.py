"""One mesh with its vertices, faces and corners in another order, and what it holds told in the first one."""

from __future__ import annotations

from dataclasses import dataclass

import bpy

import numpy as np
import scenes


@dataclass(frozen=True)
class Order:
    """Which vertex (n,) and which face (f,) of the first mesh each of the other is, how far the corners of each face
    are rolled (f,), and whether it is the mirror image along x, whose faces go around the other way."""

    vertices: np.ndarray
    faces: np.ndarray
    rolled: np.ndarray
    mirrored: bool = False

    @classmethod
    def of(cls, kind: str, n: int, f: int) -> Order:
        """One of `KINDS`, always the same."""
        rng = np.random.default_rng(11)
        vertices = rng.permutation(n) if kind in ("vertices", "all") else np.arange(n)
        faces = rng.permutation(f) if kind in ("faces", "all") else np.arange(f)
        rolled = rng.integers(0, 3, f) if kind in ("corners", "all") else np.zeros(f, int)
        return cls(vertices, faces, rolled, kind == "mirrored")

    def corners(self, face: int, count: int) -> list[int]:
        """Places in a face of the first mesh of the corners of its twin."""
        found = np.roll(np.arange(count), self.rolled[face]).tolist()
        return found[::-1] if self.mirrored else found


KINDS = ("vertices", "faces", "corners", "all", "mirrored")


def add(V, faces, order: Order, name: str) -> bpy.types.Object:
    """An object in another order."""
    back = np.argsort(order.vertices)
    loops = [[int(back[faces[f][k]]) for k in order.corners(f, len(faces[f]))] for f in order.faces.tolist()]
    return scenes.add(V[order.vertices] * [-1 if order.mirrored else 1, 1, 1], loops, name)


def set_uv(obj, faces, order: Order, uv, layer: str = "UVMap") -> None:
    """Write UVs (c,2) of the corners of the first mesh; a mirror image has them mirrored."""
    scenes.set_uv(obj, (uv * [-1, 1] + [1, 0] if order.mirrored else uv)[_corners(faces, order)], layer)


def _corners(faces, order: Order) -> np.ndarray:
    """The corner (c,) of the first mesh that each one is."""
    start = np.cumsum([0, *(len(face) for face in faces)])
    return np.array([start[f] + k for f in order.faces.tolist() for k in order.corners(f, len(faces[f]))])


def told(obj, faces, order: Order) -> dict:
    """Arrays and sets of all that an object holds, by the numbers of the first mesh: positions, weights, UVs, seams,
    and attributes of vertices, faces and corners."""
    mesh = obj.data
    if len(mesh.polygons) != len(faces) or len(mesh.vertices) != len(order.vertices):
        return {"faces": len(mesh.polygons), "vertices": len(mesh.vertices)}
    back = {
        "POINT": np.argsort(order.vertices),
        "FACE": np.argsort(order.faces),
        "CORNER": np.argsort(_corners(faces, order)),
    }
    found: dict = {}
    for attribute in mesh.attributes:
        if attribute.domain in back and (not attribute.name.startswith(".") or attribute.name == ".sculpt_face_set"):
            key, width, dtype = scenes._VALUE[attribute.data_type]
            if dtype is bool:
                continue
            values = np.zeros(len(attribute.data) * width, dtype)
            attribute.data.foreach_get(key, values)
            found[attribute.name] = values.reshape(-1, width)[back[attribute.domain]].astype(float)
    if order.mirrored:
        found["position"] *= [-1, 1, 1]
    for group in obj.vertex_groups:
        weights = [sum(g.weight for g in v.groups if g.group == group.index) for v in mesh.vertices]
        found[f"group {group.name}"] = np.array(weights)[back["POINT"]]
    names = order.vertices.tolist()
    found["seams"] = {frozenset(names[v] for v in edge.vertices) for edge in mesh.edges if edge.use_seam}
    return found


def sides(uv, faces) -> np.ndarray:
    """Lengths (c,) of the sides of faces in UVs (c,2): the same wherever islands lie, and on which side."""
    start, found = 0, []
    for face in faces:
        mine = uv[start : start + len(face)]
        found.append(np.linalg.norm(np.roll(mine, -1, axis=0) - mine, axis=1))
        start += len(face)
    return np.concatenate(found)


def alike(one, other, key: str, mirrored: bool = False) -> bool:
    """Whether two values of one name in what is told are those of one thing. Directions of stretch have no sign."""
    if isinstance(one, set):
        return one == other
    if key == "OMT UV Stretch":
        other = other * ([-1, 1, 1] if mirrored else 1)
        other = other * np.sign(np.sum(one * other, axis=1, keepdims=True))
    return bool(np.abs(one - other).max() < 2e-5)
