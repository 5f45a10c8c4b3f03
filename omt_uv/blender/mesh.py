"""Read Blender meshes as arrays and write UVs back, in bulk.

Edit Mode is read from a copy of the flushed mesh, in bulk, and written through BMesh, which touches nothing
but the corners it is told to.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import bpy

import bmesh
import numpy as np

from ..errors import UserError
from ..pipelines.reading import Reading
from ..solver.analysis.facing import SceneAxes
from ..solver.errors import MeshError, NonFiniteError
from ..solver.mesh.geometry import places
from ..solver.mesh.repair import flat_triangles, joined_vertices
from ..solver.mesh.surface import Surface, duplicate_faces, with_joined_vertices
from ..solver.mesh.topology import first_of
from .subdivision import modifier_of
from .versions import uv_values

UV_LAYER_NAME = "UVMap"
UV_LAYER_NAME_BYTES = 63


class TargetError(UserError):
    """The UVs cannot be written where the user wants them."""


def read(obj: bpy.types.Object, layer: str = "") -> Reading:
    """Read a mesh object with its scale applied, whatever mode it is in.

    UVs and pins are those of `layer`, of the active layer where there is none of this name.

    Object Mode works on every polygon, Edit Mode on the selected ones that are not hidden. Loose vertices and
    edges are in no polygon and play no part.

    Raises
    ------
    NonFiniteError : the transformation of the object is not finite
    """
    if obj.mode != "EDIT":
        return read_mesh(obj.data, obj, layer)
    obj.update_from_editmode()
    with readable(obj.data) as copy:
        return read_mesh(copy, obj, layer, edit_mode=True)


def read_mesh(mesh: bpy.types.Mesh, obj: bpy.types.Object, layer: str = "", edit_mode: bool = False) -> Reading:
    """Read a mesh that is in no Edit Mode with the scale of an object applied; see `read`."""
    mesh.calc_loop_triangles()
    f = len(mesh.polygons)
    starts = np.append(_get(mesh.polygons, "loop_start", f), len(mesh.loops))
    ends = _get(mesh.edges, "vertices", 2 * len(mesh.edges)).reshape(-1, 2)
    surface = Surface(
        positions=_stretched(_get(mesh.vertices, "co", 3 * len(mesh.vertices), np.float32).reshape(-1, 3), obj),
        corner_vertex=_get(mesh.loops, "vertex_index", len(mesh.loops)),
        face_start=starts,
        triangles=_get(mesh.loop_triangles, "loops", 3 * len(mesh.loop_triangles)).reshape(-1, 3),
        triangle_face=_get(mesh.loop_triangles, "polygon_index", len(mesh.loop_triangles)),
        seams=ends[_get(mesh.edges, "use_seam", len(mesh.edges), bool)],
        sharp=ends[_get(mesh.edges, "use_edge_sharp", len(mesh.edges), bool)],
    )
    faces = np.ones(f, dtype=bool)
    if edit_mode:
        faces = _get(mesh.polygons, "select", f, bool) & ~_get(mesh.polygons, "hide", f, bool)
    source, modifier = mesh.uv_layers.get(layer) or mesh.uv_layers.active, modifier_of(obj, mesh)
    if source is None:
        return Reading(surface, faces, None, None, modifier, axes_of(obj))
    return Reading(surface, faces, read_uv(mesh, source.name), read_pinned(mesh, source.name), modifier, axes_of(obj))


def _get(collection, name: str, count: int, dtype=np.int32) -> np.ndarray:
    values = np.zeros(count, dtype)
    if count:
        collection.foreach_get(name, values)
    return values.astype(np.int64) if dtype is np.int32 else values


def _stretched(positions: np.ndarray, obj: bpy.types.Object) -> np.ndarray:
    # A loose vertex that is nowhere stays so, and is no reason to warn.
    with np.errstate(invalid="ignore"):
        return positions.astype(float) @ stretch(obj)


def stretch(obj: bpy.types.Object) -> np.ndarray:
    """The symmetric matrix (3,3) that stands for the scale and shear of the object, without its rotation.

    The symmetric factor of the polar decomposition M = R S has the same lengths and angles as M.

    Raises
    ------
    NonFiniteError : the transformation of the object is not finite
    """
    matrix = np.array(obj.matrix_world, dtype=float)[:3, :3]
    if not np.isfinite(matrix).all():
        raise NonFiniteError("The transformation of the object is not finite", remedy="Clear or fix its scale")
    _, stretch, axes = np.linalg.svd(matrix)
    # A rotation is stored with single precision; without this it would blur the positions for nothing.
    if np.allclose(stretch, stretch.mean(), rtol=1e-6, atol=0):
        factor = stretch.mean()
        return np.eye(3) * (1.0 if abs(factor - 1) < 1e-6 else factor)
    return (axes.T * stretch) @ axes


def is_flattened(stretch: np.ndarray) -> bool:
    """Whether no positions can be had back from those with a stretch (3,3)."""
    return bool(abs(np.linalg.det(stretch)) <= 1e-12 * np.abs(stretch).max() ** 3)


def check_stretch(obj: bpy.types.Object) -> np.ndarray:
    """The stretch (3,3) of an object; MeshError if it is flattened, so that no new mesh would get its positions."""
    found = stretch(obj)
    if is_flattened(found):
        raise MeshError("The scale of the object is zero along an axis", "Clear or fix its scale")
    return found


def place_of(obj: bpy.types.Object) -> tuple[np.ndarray, np.ndarray]:
    """Rotation (3,3) and shift (3,) that take stretched positions to their place in the world."""
    matrix = np.array(obj.matrix_world, dtype=float)
    left, _, axes = np.linalg.svd(matrix[:3, :3])
    return left @ axes, matrix[:3, 3]


def axes_of(obj: bpy.types.Object) -> SceneAxes:
    """How positions that are stretched, and not rotated, stand in the world."""
    left, _, axes = np.linalg.svd(np.array(obj.matrix_world, dtype=float)[:3, :3])
    rotation = left @ axes
    return SceneAxes(_three(rotation[2]), _three(-rotation[1]))


def _three(vector: np.ndarray) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def weld_split_vertices(reading: Reading) -> Reading:
    """Join vertices that a file format had to split: equal position and, where there are UVs, equal UV.

    The mesh stays as it is; the corners of the surface all refer to the first of the equal vertices. Faces that would
    be double then, as both sides of a leaf, keep their own, but for those of sides on which they go on in one another.
    """
    surface = reading.surface
    key = surface.positions
    if reading.uv is not None:
        uv = np.zeros((len(key), 2))
        uv[surface.corner_vertex] = reading.uv
        key = np.concatenate([key, uv], axis=1)
    same = first_of(places(key))
    whole = np.ones(len(surface.face_start) - 1, dtype=bool)
    if len(double := duplicate_faces(with_joined_vertices(surface, same), whole)[:, 0]):
        of_double = np.repeat(np.isin(np.arange(len(whole)), double), np.diff(surface.face_start))
        same = np.where(np.isin(same, same[surface.corner_vertex[of_double]]), np.arange(len(same)), same)
        apart = replace(with_joined_vertices(surface, same), positions=key)
        # A triangle without area would join both sides.
        whole[flat_triangles(apart, whole).polygons] = False
        same = joined_vertices(apart, whole, was_split=True)[same]
    return replace(reading, surface=with_joined_vertices(surface, same), was_split=True)


def read_uv(mesh: bpy.types.Mesh, layer: str) -> np.ndarray:
    """UVs (c,2) float32 of every corner of a mesh that is not in Edit Mode."""
    collection, name = uv_values(mesh, layer)
    return _get(collection, name, 2 * len(mesh.loops), np.float32).reshape(-1, 2)


def read_pinned(mesh: bpy.types.Mesh, layer: str) -> np.ndarray:
    """Which corners (c,) bool of a mesh that is not in Edit Mode are pinned.

    The attribute exists only once something was pinned; `MeshUVLoopLayer.pin` would make it in some versions.
    """
    attribute = mesh.attributes.get(f".pn.{layer}")
    if attribute is None or attribute.domain != "CORNER" or attribute.data_type != "BOOLEAN":
        return np.zeros(len(mesh.loops), bool)
    return _get(attribute.data, "value", len(mesh.loops), bool)


def one_for_each_mesh(objects: Sequence[bpy.types.Object]) -> list[bpy.types.Object]:
    """The first of the objects of each mesh data-block, in their order."""
    first = {obj.data: obj for obj in reversed(objects)}
    return [obj for obj in objects if first[obj.data] == obj]


def linked(obj: bpy.types.Object) -> str:
    """Why changes of the mesh of an object are not saved with this file, or an empty text."""
    if obj.library is not None or obj.data.library is not None:
        return "is linked from a library"
    # Of an override, Blender saves the properties that it knows to be overridden; UVs and groups are none.
    return "is a library override" if obj.data.override_library is not None else ""


def check_local(obj: bpy.types.Object) -> None:
    """Raise TargetError if what is written to the mesh of an object would not be saved."""
    if linked(obj):
        raise TargetError(f"{obj.name} {linked(obj)}. Make it and its mesh local first.")


def check_target(obj: bpy.types.Object, name: str) -> None:
    """Raise TargetError if UVs cannot be written to the layer `name` (the active one if empty) of an object's mesh."""
    check_local(obj)
    mesh = obj.data
    if len(name.encode()) > UV_LAYER_NAME_BYTES:
        raise TargetError(f"The UV layer name {name!r} is too long. Use at most {UV_LAYER_NAME_BYTES} bytes.")
    missing = name not in mesh.uv_layers if name else len(mesh.uv_layers) == 0
    if missing and name in _attribute_names(mesh):
        raise TargetError(f"{mesh.name} has an attribute {name!r} that is no UV layer. Choose another name.")
    if missing and len(mesh.uv_layers) >= 8:
        raise TargetError(f"{mesh.name} has 8 UV layers, the most a mesh can hold. Remove one first.")


def _attribute_names(mesh: bpy.types.Mesh) -> set[str]:
    """Names of all attributes; Edit Mode hides those that every mesh has, as positions."""
    with readable(mesh) as whole:
        return {*mesh.attributes.keys(), *whole.attributes.keys()}


@contextmanager
def readable(mesh: bpy.types.Mesh) -> Iterator[bpy.types.Mesh]:
    """A mesh whose attributes can be read: itself, or in Edit Mode, where they tell no values, a copy for as long."""
    if not mesh.is_editmode:
        yield mesh
        return
    copy = mesh.copy()
    try:
        yield copy
    finally:
        bpy.data.meshes.remove(copy)


def target_layer(obj: bpy.types.Object, name: str) -> str:
    """Name of the UV layer to write: the active one, or `name`, made and made active as needed.

    A new layer starts as a copy of the active one, so that faces that are not unwrapped keep their UVs.
    """
    check_target(obj, name)
    mesh = obj.data
    if not name and mesh.uv_layers.active:
        return mesh.uv_layers.active.name
    name = name or UV_LAYER_NAME
    if name not in mesh.uv_layers:
        # In Edit Mode, Blender 5.2 makes the layer and returns None.
        mesh.uv_layers.new(name=name)
    if name not in mesh.uv_layers:
        raise TargetError(f"{mesh.name} does not take another UV layer.")
    mesh.uv_layers.active = mesh.uv_layers[name]
    return name


def corner_uvs(obj: bpy.types.Object, layer: str, corners: np.ndarray, face_start: np.ndarray) -> np.ndarray:
    """UVs (k,2) of a few corners (k,) of an object in Edit Mode; face_start (f+1,) as in Surface."""
    edit = bmesh.from_edit_mesh(obj.data)
    edit.faces.ensure_lookup_table()
    uv_layer = edit.loops.layers.uv[layer]
    faces = np.searchsorted(face_start, corners, side="right") - 1
    places = zip(faces.tolist(), (corners - face_start[faces]).tolist(), strict=True)
    return np.array([edit.faces[f].loops[k][uv_layer].uv[:] for f, k in places], float).reshape(-1, 2)


def uvs_at(obj: bpy.types.Object, layer: str, corners: np.ndarray, face_start: np.ndarray) -> np.ndarray:
    """UVs (k,2) of a few corners (k,), in any mode; face_start (f+1,) as in Surface."""
    return corner_uvs(obj, layer, corners, face_start) if obj.mode == "EDIT" else read_uv(obj.data, layer)[corners]


def hold(obj: bpy.types.Object) -> bmesh.types.BMesh | None:
    """Keep the corners of an object in Edit Mode in their place as long as somebody has the result; else None.

    The first element that Python sees gives a mesh a layer for it, and the last one takes that away again: both move
    all corners in memory, and whoever drags UVs meanwhile goes on writing to where they were, which is others by then.
    """
    if obj.mode != "EDIT":
        return None
    edit = bmesh.from_edit_mesh(obj.data)
    # A face brings its corners, these its edges and vertices: each kind has a layer of its own.
    for loop in (loop for face in edit.faces[:1] for loop in face.loops):
        _ = loop.vert, loop.edge
    return edit


def touched_faces(obj: bpy.types.Object) -> np.ndarray:
    """Polygons (f,) bool of an object in Edit Mode with a selected vertex, that are not hidden."""
    edit = bmesh.from_edit_mesh(obj.data)
    return np.array([not f.hide and any(v.select for v in f.verts) for f in edit.faces], bool)


def write_uv(obj: bpy.types.Object, layer: str, corners: np.ndarray, uv: np.ndarray) -> None:
    """Write uv (k,2) to the given corners (k,) of an existing layer; every other corner keeps its bits."""
    if obj.mode == "EDIT":
        _write_bmesh(obj.data, layer, corners, uv)
        return
    values = read_uv(obj.data, layer)
    values[corners] = uv
    collection, name = uv_values(obj.data, layer)
    collection.foreach_set(name, values.ravel())
    obj.data.update()


def _write_bmesh(mesh: bpy.types.Mesh, layer: str, corners: np.ndarray, uv: np.ndarray) -> None:
    edit = bmesh.from_edit_mesh(mesh)
    uv_layer = edit.loops.layers.uv[layer]
    values: list = [None] * (int(corners.max(initial=-1)) + 1)
    for corner, value in zip(corners.tolist(), uv.tolist(), strict=True):
        values[corner] = value
    # Faces and their loops come in the order in which update_from_editmode numbers them.
    for value, loop in zip(values, (loop for face in edit.faces for loop in face.loops), strict=False):
        if value is not None:
            loop[uv_layer].uv = value
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)


def select_elements(obj: bpy.types.Object, kind: str, elements: np.ndarray) -> None:
    """Select exactly the vertices, edges (k,2) or faces an error speaks of, and the select mode that shows them."""
    if not kind or not len(elements):
        return
    if obj.mode == "EDIT":
        _select_bmesh(obj.data, kind, elements)
    else:
        _select_mesh(obj.data, kind, elements)


def select_mode(kind: str) -> tuple[bool, bool, bool]:
    """Value of `ToolSettings.mesh_select_mode` that shows elements of a kind."""
    return (kind == "vertex", kind == "edge", kind == "face")


def _select_bmesh(mesh: bpy.types.Mesh, kind: str, elements: np.ndarray) -> None:
    edit = bmesh.from_edit_mesh(mesh)
    for sequence in (edit.faces, edit.edges, edit.verts):
        for element in sequence:
            element.select = False
    edit.select_mode = {{"vertex": "VERT", "edge": "EDGE", "face": "FACE"}[kind]}
    edit.verts.ensure_lookup_table()
    edit.faces.ensure_lookup_table()
    if kind == "edge":
        pairs = ((edit.verts[a], edit.verts[b]) for a, b in elements.tolist())
        chosen = [edge for edge in map(edit.edges.get, pairs) if edge]
    else:
        sequence = edit.verts if kind == "vertex" else edit.faces
        chosen = [sequence[i] for i in elements.tolist()]
    for element in chosen:
        element.select_set(True)
    edit.select_flush_mode()
    if hasattr(edit, "uv_select_sync_valid"):
        # Since Blender 5.0 corners keep a selection of their own, and G in the UV editor would move that of before.
        edit.uv_select_sync_valid = False
    bmesh.update_edit_mesh(mesh, loop_triangles=False, destructive=False)


def _select_mesh(mesh: bpy.types.Mesh, kind: str, elements: np.ndarray) -> None:
    ends = _get(mesh.edges, "vertices", 2 * len(mesh.edges)).reshape(-1, 2)
    vertices, edges = np.zeros(len(mesh.vertices), bool), np.zeros(len(mesh.edges), bool)
    faces = np.zeros(len(mesh.polygons), bool)
    if kind == "vertex":
        vertices[elements] = True
    elif kind == "edge":
        n = len(mesh.vertices)
        low, high = ends.min(axis=1, initial=n), ends.max(axis=1, initial=0)
        edges = np.isin(low * n + high, elements.min(axis=1) * n + elements.max(axis=1))
        vertices[ends[edges].ravel()] = True
    else:
        faces[elements] = True
        corners = np.concatenate([np.arange(p.loop_start, p.loop_start + p.loop_total) for p in _items(mesh, elements)])
        vertices[_get(mesh.loops, "vertex_index", len(mesh.loops))[corners]] = True
        edges[_get(mesh.loops, "edge_index", len(mesh.loops))[corners]] = True
    set_flags(mesh, ".select_vert", "POINT", vertices)
    set_flags(mesh, ".select_edge", "EDGE", edges)
    set_flags(mesh, ".select_poly", "FACE", faces)
    mesh.update()


def set_flags(mesh: bpy.types.Mesh, name: str, domain: str, values: np.ndarray) -> None:
    """Set a boolean attribute, such as the one behind `select`.

    Mesh.from_pydata of Blender 5.0 leaves a `.select_edge` of another type behind, and then `edge.select = ...`
    crashes; such an attribute is replaced.
    """
    attribute = mesh.attributes.get(name)
    if attribute is not None and attribute.data_type != "BOOLEAN":
        mesh.attributes.remove(attribute)
        attribute = None
    attribute = attribute or mesh.attributes.new(name, "BOOLEAN", domain)
    attribute.data.foreach_set("value", values.tolist())


def new_mesh(name: str, positions, faces, edges=()) -> bpy.types.Mesh:
    """A mesh of vertices, faces and loose edges, sequences of tuples, in this order."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(positions, edges, faces)
    set_flags(mesh, ".select_edge", "EDGE", np.ones(len(mesh.edges), bool))
    mesh.update()
    return mesh


def link_beside(new: bpy.types.Object, obj: bpy.types.Object) -> None:
    """Put a new object into the collections of another one, as far as they are of this file."""
    collections = [c for c in obj.users_collection if c.library is None] or [bpy.context.scene.collection]
    for collection in collections:
        collection.objects.link(new)


def _items(mesh: bpy.types.Mesh, elements: np.ndarray):
    return (mesh.polygons[i] for i in elements.tolist())


def select_culprits(context: bpy.types.Context, obj: bpy.types.Object, error: MeshError) -> None:
    """Select what an error complains about on the object, without leaving the mode."""
    if error.kind and len(error.elements):
        context.scene.tool_settings.mesh_select_mode = select_mode(error.kind)
        select_elements(obj, error.kind, error.elements)
