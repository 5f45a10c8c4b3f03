"""Make objects of what a map of the inside gives: tetrahedra, shells, points, slices; and read closed bodies for it."""

from __future__ import annotations

import bpy

import numpy as np

from ...pipelines.volumes.volume import MappedVolume, VolumeBody
from ...solver.volumes.sampling import interior_points
from ...solver.volumes.shells import shell_surfaces
from ...solver.volumes.slices import dilation, plane_slice
from ...solver.volumes.tet_mesh import FACES
from ..mesh import check_local, new_mesh
from .bodies import members, read_body

PLACES = "OMT Ball"
DILATION = "OMT Dilation"
LANDMARK = "LM_"
# Binary logarithms of dilation at the ends of the colours.
FULL = 1.0


def read_volume_body(obj: bpy.types.Object) -> VolumeBody:
    """A mesh object as a closed body in the world, with vertex groups LM_... as its landmarks."""
    body = read_body(obj)
    groups = [group.name for group in obj.vertex_groups if group.name.startswith(LANDMARK)]
    inside = {name: members(obj, name) for name in groups}
    landmarks = {name: np.flatnonzero(m) for name, m in inside.items() if m is not None and m.any()}
    return VolumeBody(obj.name, body.positions, body.triangles, landmarks, body.polygons)


def _added(name: str, like: bpy.types.Object, vertices, faces) -> bpy.types.Object:
    """A new object in the collections of another one, with its materials; vertices (n,3) in the world."""
    mesh = new_mesh(name, vertices.tolist(), faces.tolist())
    obj = bpy.data.objects.new(name, mesh)
    for collection in like.users_collection or (bpy.context.scene.collection,):
        collection.objects.link(obj)
    for material in like.data.materials:
        mesh.materials.append(material)
    return obj


def _attribute(mesh: bpy.types.Mesh, name: str, kind: str, domain: str, field: str, values: np.ndarray) -> None:
    old = mesh.attributes.get(name)
    if old is not None:
        mesh.attributes.remove(old)
    mesh.attributes.new(name, kind, domain).data.foreach_set(field, values.astype(np.float32).ravel())


def tet_object(like: bpy.types.Object, found: MappedVolume) -> bpy.types.Object:
    """All faces of all tetrahedra, each once, with places in the ball at vertices and dilations of a tetrahedron at
    faces."""
    tets = found.map.tets
    every = tets[:, FACES].reshape(-1, 3)
    _, first = np.unique(np.sort(every, axis=1), axis=0, return_index=True)
    obj = _added(f"{like.name} Tetrahedra", like, found.map.points, every[first])
    _attribute(obj.data, PLACES, "FLOAT_VECTOR", "POINT", "vector", found.map.positions)
    logs = dilation(found.map.points, found.map.positions, tets)
    _attribute(obj.data, DILATION, "FLOAT", "FACE", "value", logs[first // 4])
    return obj


def shell_objects(like: bpy.types.Object, found: MappedVolume, count: int) -> list[bpy.types.Object]:
    """Surfaces that divide the body into count + 1 parts of equal volume."""
    shells = shell_surfaces(found.map.points, found.ball, found.map.tets, count)
    return [_added(f"{like.name} Shell {k + 1}", like, s.vertices, s.triangles) for k, s in enumerate(shells)]


def point_object(like: bpy.types.Object, found: MappedVolume, count: int, seed: int) -> bpy.types.Object:
    """Points inside with equal volumes around them, as a mesh without faces, with their places in the ball."""
    points = interior_points(found.map.points, found.ball, found.map.tets, count, seed)
    return _added(f"{like.name} Points", like, points, np.zeros((0, 3), int))


def slice_object(like: bpy.types.Object, found: MappedVolume, axis: int, place: float) -> bpy.types.Object:
    """A cut across an axis at `place` from 0 to 1 of the body's extent, with dilations as an attribute and as
    colours."""
    points, normal = found.map.points, np.eye(3)[axis]
    low, high = points[:, axis].min(), points[:, axis].max()
    cut = plane_slice(points, found.map.positions, found.map.tets, normal, float(low + place * (high - low)))
    obj = _added(f"{like.name} Slice", like, cut.vertices, cut.triangles)
    _attribute(obj.data, DILATION, "FLOAT", "FACE", "value", cut.dilation)
    t = np.clip(cut.dilation / FULL, -1, 1)
    white = 1 - np.abs(t)
    colours = np.stack([np.where(t > 0, 1, white), white, np.where(t < 0, 1, white), np.ones_like(t)], axis=1)
    layer = obj.data.color_attributes.new(f"{DILATION} Colour", "FLOAT_COLOR", "CORNER")
    layer.data.foreach_set("color", np.repeat(colours, 3, axis=0).astype(np.float32).ravel())
    return obj


def write_places(obj: bpy.types.Object, found: MappedVolume) -> None:
    """Places of the vertices in the domain, as an attribute of the mesh."""
    check_local(obj)
    _attribute(obj.data, PLACES, "FLOAT_VECTOR", "POINT", "vector", found.surface)
