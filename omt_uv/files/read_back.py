"""Read what an exporter wrote, by programs of our own, and count it: exporters do not tell of a disk that is full."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import bpy

import numpy as np

from ..blender.mesh import read_uv
from . import fbx_nodes
from .in_place import glb_data, gltf, obj_text, ply
from .verified import FileError


@dataclass(frozen=True)
class Counts:
    """Vertices, faces, and corners of faces with UVs; None where a format does not tell."""

    vertices: int | None
    faces: int | None
    uv_corners: int | None


def check(path: Path, suffix: str, meshes: Sequence[bpy.types.Object]) -> None:
    """Raise FileError unless a file holds at least the meshes of these objects, whole."""
    try:
        found = _COUNTERS[suffix](path)
    except (struct.error, KeyError, ValueError) as error:
        raise FileError(f"What was written cannot be read again: {error}. Is the disk full?") from error
    wished = _counts(meshes, suffix)
    for name in ("vertices", "faces", "uv_corners"):
        here, there = getattr(found, name), getattr(wished, name)
        if here is not None and there is not None and here < there:
            raise FileError(
                f"What was written has {here} {name.replace('_', ' ')} instead of {there}. Is the disk full?"
            )


def _counts(objects: Sequence[bpy.types.Object], suffix: str) -> Counts:
    """What a file has to hold; one that has instances holds each mesh once."""
    shared = suffix in (".glb", ".gltf", ".fbx")
    meshes = list({obj.data.name: obj.data for obj in objects}.values()) if shared else [obj.data for obj in objects]
    with_uv = [mesh for mesh in meshes if mesh.uv_layers]
    if suffix in (".glb", ".gltf", ".stl"):
        for mesh in meshes:
            mesh.calc_loop_triangles()
        triangles = sum(len(mesh.loop_triangles) for mesh in meshes)
        uv = sum(3 * len(mesh.loop_triangles) for mesh in with_uv)
        return Counts(None, triangles, uv)
    return Counts(
        sum(len(mesh.vertices) for mesh in meshes),
        sum(len(mesh.loops) if suffix == ".fbx" else len(mesh.polygons) for mesh in meshes),
        sum(len(mesh.loops) for mesh in with_uv),
    )


def _count_obj(path: Path) -> Counts:
    text = obj_text.read(path.read_bytes())
    return Counts(len(text.positions), int(text.is_face.sum()), int((text.corner_uv >= 0).sum()))


def _count_ply(path: Path) -> Counts:
    mesh, uv = ply.read_uv(path.read_bytes())
    return Counts(len(mesh.positions), len(mesh.face_start) - 1, 0 if uv is None else len(uv))


def _count_stl(path: Path) -> Counts:
    """The exporter writes binary files: 80 bytes, a count, 50 bytes for a triangle."""
    data = path.read_bytes()
    (count,) = struct.unpack_from("<I", data, 80)
    return Counts(None, min(count, (len(data) - 84) // 50), None)


def _count_gltf(path: Path) -> Counts:
    return _count_glb(gltf.read(path.read_bytes(), path.parent).glb)


def _count_glb(glb: glb_data.Glb) -> Counts:
    primitives = [p for mesh in glb.doc.get("meshes", []) for p in mesh["primitives"]]
    corners = [glb_data.triangles(glb, primitive).ravel() for primitive in primitives]
    uv = 0
    for primitive, index in zip(primitives, corners, strict=True):
        if "TEXCOORD_0" in primitive["attributes"] and len(index):
            uv += len(glb_data.accessor(glb, primitive["attributes"]["TEXCOORD_0"])[index])
    return Counts(None, sum(len(index) // 3 for index in corners), uv)


def _count_fbx(path: Path) -> Counts:
    found = fbx_nodes.count(path.read_bytes())
    return Counts(found.vertices, found.corners, found.uv_corners)


_COUNTERS: dict[str, Callable[[Path], Counts]] = {
    ".obj": _count_obj,
    ".ply": _count_ply,
    ".stl": _count_stl,
    ".glb": lambda path: _count_glb(glb_data.read(path.read_bytes())),
    ".gltf": _count_gltf,
    ".fbx": _count_fbx,
}


def check_blend(path: Path, objects: Sequence[bpy.types.Object]) -> None:
    """Raise FileError unless a .blend holds the meshes of these objects with their UVs, bit by bit."""
    names = list({obj.data.name: obj for obj in objects if obj.data.library is None})
    try:
        with bpy.data.libraries.load(str(path), link=True) as (_, there):
            there.meshes = list(names)
    except OSError as error:
        # Blender names the temporary file, which nobody knows.
        reason = str(error).rpartition(": ")[2].strip(" .")
        raise FileError(f"What was written cannot be read again: {reason}. Is the disk full?") from error
    libraries = {mesh.library for mesh in there.meshes if mesh is not None}
    try:
        for name, mesh in zip(names, there.meshes, strict=True):
            if mesh is None or not _same(bpy.data.meshes[name, None], mesh):
                raise FileError(f"What was written does not hold {name} as it is. Is the disk full?")
    finally:
        for library in libraries:
            bpy.data.libraries.remove(library)


def _same(mesh: bpy.types.Mesh, other: bpy.types.Mesh) -> bool:
    """Whether two meshes have as many elements, and the same UVs."""
    for kind in ("vertices", "edges", "loops", "polygons", "uv_layers"):
        if len(getattr(mesh, kind)) != len(getattr(other, kind)):
            return False
    names = [layer.name for layer in mesh.uv_layers]
    return names == [layer.name for layer in other.uv_layers] and all(
        np.array_equal(read_uv(mesh, name).view(np.int32), read_uv(other, name).view(np.int32)) for name in names
    )
