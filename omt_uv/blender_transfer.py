"""Everything that Blender stores on a mesh besides its shape, read as arrays, carried to a new mesh, and written.

See `blender_mesh.py`: nothing else reads or writes a mesh, and `solver/transfer.py` for how values are carried.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import bpy

import numpy as np

from .blender_attributes import TYPES
from .solver import transfer
from .solver.charts import Surface
from .solver.features import all_edges, region_borders, value_jumps
from .solver.geometry import signed_areas
from .solver.topology import pair_keys
from .solver.unfold import straightened

# What the mesh is made of, what is written otherwise, and what follows from the shape.
OWN = {"position", "material_index", "sharp_face", "sharp_edge", "uv_seam", "crease_edge", "custom_normal"}
SCULPT = {".sculpt_mask", ".sculpt_face_set"}
# UVs nearer than this share of their extent are the same.
SAME_UV = 1e-5


@dataclass(frozen=True)
class Layer:
    """An attribute: values (elements of its domain, numbers each)."""

    name: str
    domain: str
    data_type: str
    values: np.ndarray


@dataclass(frozen=True)
class ShapeKey:
    """A shape key: offsets (n,3) from the shape of the mesh, and its settings by name."""

    name: str
    offsets: np.ndarray
    relative_to: int
    settings: dict


@dataclass(frozen=True)
class Marks:
    """Edges (e,2) that carry a mark, and the marks: seam (e,) bool, sharp (e,) bool, crease (e,)."""

    edges: np.ndarray
    seam: np.ndarray
    sharp: np.ndarray
    crease: np.ndarray


@dataclass(frozen=True)
class Attributes:
    """What a mesh carries.

    groups: names of vertex groups, weights (n,g), member (n,g) bool; material_index (f,), smooth (f,) bool;
    uv_flags: active and rendered UV map; color_flags: active and rendered colour attribute; left: names of what
    cannot be carried; folded: faces that carrying left folded in a UV map
    """

    material_index: np.ndarray
    smooth: np.ndarray
    marks: Marks
    layers: tuple[Layer, ...] = ()
    groups: tuple[str, ...] = ()
    weights: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    member: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), bool))
    keys: tuple[ShapeKey, ...] = ()
    keys_relative: bool = True
    uv_flags: tuple[str, str] = ("", "")
    color_flags: tuple[str, str] = ("", "")
    left: tuple[str, ...] = ()
    folded: int = 0


def read_attributes(mesh: bpy.types.Mesh, group_names: tuple[str, ...], everything: bool = True) -> Attributes:
    """Read what a mesh carries, all of it or only materials, shading and marks; not in Edit Mode."""
    f = len(mesh.polygons)
    basic = Attributes(
        _get(mesh.polygons, "material_index", f), _get(mesh.polygons, "use_smooth", f, bool), _marks(mesh)
    )
    if not everything:
        return basic
    layers, left = _layers(mesh)
    weights, member = _groups(mesh, len(group_names))
    return replace(
        basic,
        layers=layers,
        groups=group_names,
        weights=weights,
        member=member,
        keys=_keys(mesh),
        keys_relative=mesh.shape_keys is None or mesh.shape_keys.use_relative,
        uv_flags=_uv_flags(mesh),
        color_flags=(mesh.attributes.active_color_name or "", mesh.attributes.default_color_name or ""),
        left=left,
    )


def _get(collection, name: str, count: int, dtype=np.int32, width: int = 1) -> np.ndarray:
    values = np.zeros(count * width, dtype)
    if count:
        collection.foreach_get(name, values)
    return values if width == 1 else values.reshape(count, width)


def _marks(mesh: bpy.types.Mesh) -> Marks:
    e = len(mesh.edges)
    ends = _get(mesh.edges, "vertices", e, width=2).astype(np.int64)
    seam, sharp = (_get(mesh.edges, name, e, bool) for name in ("use_seam", "use_edge_sharp"))
    layer = mesh.attributes.get("crease_edge")
    is_crease = layer is not None and layer.domain == "EDGE" and layer.data_type == "FLOAT"
    crease = _get(layer.data, "value", e, np.float32) if is_crease else np.zeros(e, np.float32)
    marked = seam | sharp | (crease > 0)
    return Marks(ends[marked], seam[marked], sharp[marked], crease[marked])


def _layers(mesh: bpy.types.Mesh) -> tuple[tuple[Layer, ...], tuple[str, ...]]:
    layers, left = [], []
    for attribute in mesh.attributes:
        name = attribute.name
        if name in OWN or (name.startswith(".") and name not in SCULPT):
            continue
        if attribute.domain == "EDGE" or attribute.data_type not in TYPES:
            left.append(name)
            continue
        key, width, dtype, _ = TYPES[attribute.data_type]
        values = _get(attribute.data, key, len(attribute.data), dtype, width)
        layers.append(Layer(name, attribute.domain, attribute.data_type, values))
    return tuple(layers), tuple(left)


def _groups(mesh: bpy.types.Mesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    n = len(mesh.vertices)
    weights, member = np.zeros((n, count)), np.zeros((n, count), bool)
    if count:
        for vertex in mesh.vertices:
            for element in vertex.groups:
                if element.group < count:
                    weights[vertex.index, element.group] = element.weight
                    member[vertex.index, element.group] = True
    return weights, member


def group_weights(mesh: bpy.types.Mesh, obj: bpy.types.Object, name: str) -> np.ndarray | None:
    """Weights (n,) of a vertex group of the object on a mesh, 0 outside of it; None if there is none of this name."""
    group = obj.vertex_groups.get(name)
    return None if group is None else _groups(mesh, group.index + 1)[0][:, group.index]


KEY_SETTINGS = ("slider_min", "slider_max", "value", "mute", "vertex_group", "interpolation")


def _keys(mesh: bpy.types.Mesh) -> tuple[ShapeKey, ...]:
    if mesh.shape_keys is None:
        return ()
    shape = _get(mesh.vertices, "co", len(mesh.vertices), np.float32, 3).astype(float)
    blocks = list(mesh.shape_keys.key_blocks)
    found = []
    for block in blocks:
        offsets = _get(block.data, "co", len(shape), np.float32, 3) - shape
        settings = {name: getattr(block, name) for name in KEY_SETTINGS}
        found.append(ShapeKey(block.name, offsets, blocks.index(block.relative_key), settings))
    return tuple(found)


def _uv_flags(mesh: bpy.types.Mesh) -> tuple[str, str]:
    active = mesh.uv_layers.active
    rendered = [layer.name for layer in mesh.uv_layers if layer.active_render]
    return (active.name if active else "", rendered[0] if rendered else "")


def marked_sharp(attributes: Attributes) -> np.ndarray:
    """Edges (k,2) that are marked sharp or creased."""
    marks = attributes.marks
    return marks.edges[marks.sharp | (marks.crease > 0)]


def is_uv(layer: Layer) -> bool:
    """Every attribute of this kind is a UV map."""
    return layer.domain == "CORNER" and layer.data_type == "FLOAT2"


def uv_seams(attributes: Attributes, surface: Surface) -> np.ndarray:
    """Edges (k,2) where islands of any UV map end."""
    triangles = surface.corner_vertex[surface.triangles]
    maps = [layer.values for layer in attributes.layers if is_uv(layer)]
    return all_edges(
        *(value_jumps(triangles, surface.triangles, uv, SAME_UV * np.ptp(uv, axis=0).max(initial=0)) for uv in maps)
    )


def material_borders(attributes: Attributes, surface: Surface) -> np.ndarray:
    """Edges (k,2) between faces of different materials."""
    triangles = surface.corner_vertex[surface.triangles]
    return region_borders(triangles, attributes.material_index[surface.triangle_face])


def carry(attributes: Attributes, surface: Surface, at: transfer.Footprint) -> Attributes:
    """The attributes of a new mesh from those of the old one; shape keys become offsets of the new shape."""
    triangles = surface.corner_vertex[surface.triangles]

    def at_vertices(values: np.ndarray) -> np.ndarray:
        return transfer.to_vertices(at, triangles, values)

    layers, folded = [], 0
    for layer in attributes.layers:
        if is_uv(layer):
            uv, left = _carried_uv(layer, surface, at)
            folded += left
            layers.append(replace(layer, values=uv))
        else:
            layers.append(replace(layer, values=_carried(layer, surface, triangles, at)))
    return replace(
        attributes,
        material_index=transfer.to_faces(at, surface.triangle_face, attributes.material_index),
        smooth=transfer.to_faces(at, surface.triangle_face, attributes.smooth),
        marks=_carried_marks(attributes.marks, triangles, at),
        layers=tuple(layers),
        weights=at_vertices(attributes.weights) if attributes.groups else attributes.weights,
        member=at_vertices(attributes.member) > 0 if attributes.groups else attributes.member,
        keys=tuple(replace(key, offsets=at_vertices(key.offsets)) for key in attributes.keys),
        folded=folded,
    )


def _carried_uv(layer: Layer, surface: Surface, at: transfer.Footprint) -> tuple[np.ndarray, int]:
    """UVs of the new corners, and how many faces are folded though the map they come from is not."""
    uv = transfer.to_corners(at, surface.triangles, layer.values, extend=True)
    area = signed_areas(layer.values.astype(float), surface.triangles)
    return straightened(at.triangles, uv, np.sign(area)[at.home])


def _carried(layer: Layer, surface: Surface, triangles: np.ndarray, at: transfer.Footprint) -> np.ndarray:
    smooth = TYPES[layer.data_type][3]
    if layer.domain == "FACE":
        return transfer.to_faces(at, surface.triangle_face, layer.values)
    if layer.domain == "CORNER":
        to_corners: Callable = transfer.to_corners if smooth else transfer.nearest_to_corners
        return to_corners(at, surface.triangles, layer.values)
    to_vertices: Callable = transfer.to_vertices if smooth else transfer.nearest_to_vertices
    return to_vertices(at, triangles, layer.values)


def _carried_marks(marks: Marks, triangles: np.ndarray, at: transfer.Footprint) -> Marks:
    """Marks of the old edges that the seams of the new mesh follow; what follows a marked edge has its marks."""
    if not len(at.seams) or not len(marks.edges):
        none = np.zeros(len(at.seams), bool)
        return Marks(at.seams, none, none, np.zeros(len(at.seams), np.float32))
    tail, head = triangles.ravel()[at.seam_origin], triangles[:, [1, 2, 0]].ravel()[at.seam_origin]
    key, own = pair_keys(tail, head), pair_keys(marks.edges[:, 0], marks.edges[:, 1])
    order = np.argsort(own)
    found = order[np.minimum(np.searchsorted(own, key, sorter=order), len(own) - 1)]
    same = own[found] == key
    return Marks(at.seams, marks.seam[found] & same, marks.sharp[found] & same, marks.crease[found] * same)


def write_attributes(obj: bpy.types.Object, attributes: Attributes) -> None:
    """Give a new mesh object, which is in no Edit Mode, what it shall carry."""
    mesh = obj.data
    mesh.polygons.foreach_set("material_index", attributes.material_index.astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", attributes.smooth)
    _write_marks(mesh, attributes.marks)
    for layer in attributes.layers:
        _write_layer(mesh, layer)
    _write_flags(mesh, attributes)
    for k, name in enumerate(attributes.groups):
        group = obj.vertex_groups.new(name=name)
        for vertex in np.flatnonzero(attributes.member[:, k]).tolist():
            group.add([vertex], float(attributes.weights[vertex, k]), "REPLACE")
    _write_keys(obj, attributes)
    mesh.update()


def _write_marks(mesh: bpy.types.Mesh, marks: Marks) -> None:
    if not len(marks.edges):
        return
    e = len(mesh.edges)
    ends = _get(mesh.edges, "vertices", e, width=2).astype(np.int64)
    key = pair_keys(ends[:, 0], ends[:, 1])
    order = np.argsort(key)
    at = order[np.searchsorted(key, pair_keys(marks.edges[:, 0], marks.edges[:, 1]), sorter=order)]
    for name, flags in (("use_seam", marks.seam), ("use_edge_sharp", marks.sharp)):
        if flags.any():
            values: np.ndarray = np.zeros(e, bool)
            values[at] = flags
            mesh.edges.foreach_set(name, values)
    if marks.crease.any():
        crease = np.zeros(e, np.float32)
        crease[at] = marks.crease
        mesh.attributes.new("crease_edge", "FLOAT", "EDGE").data.foreach_set("value", crease)


def _write_layer(mesh: bpy.types.Mesh, layer: Layer) -> None:
    key, _, dtype, _ = TYPES[layer.data_type]
    if is_uv(layer):
        mesh.uv_layers.new(name=layer.name, do_init=False)
    elif layer.name not in mesh.attributes:
        mesh.attributes.new(layer.name, layer.data_type, layer.domain)
    values: np.ndarray = np.ascontiguousarray(layer.values, dtype).ravel()
    mesh.attributes[layer.name].data.foreach_set(key, values)


def _write_flags(mesh: bpy.types.Mesh, attributes: Attributes) -> None:
    active, rendered = attributes.uv_flags
    if active in mesh.uv_layers:
        mesh.uv_layers.active = mesh.uv_layers[active]
    if rendered in mesh.uv_layers:
        mesh.uv_layers[rendered].active_render = True
    active, rendered = attributes.color_flags
    if active in mesh.attributes:
        mesh.attributes.active_color_name = active
    if rendered in mesh.attributes:
        mesh.attributes.default_color_name = rendered


def _write_keys(obj: bpy.types.Object, attributes: Attributes) -> None:
    shape = _get(obj.data.vertices, "co", len(obj.data.vertices), np.float32, 3)
    blocks = [obj.shape_key_add(name=key.name, from_mix=False) for key in attributes.keys]
    if not blocks:
        return
    obj.data.shape_keys.use_relative = attributes.keys_relative
    for block, key in zip(blocks, attributes.keys, strict=True):
        block.data.foreach_set("co", (shape + key.offsets).astype(np.float32).ravel())
        block.relative_key = blocks[key.relative_to]
        for name, value in key.settings.items():
            setattr(block, name, value)
