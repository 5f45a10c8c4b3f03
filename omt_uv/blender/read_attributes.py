"""Read everything that Blender stores on a mesh besides its shape, as arrays."""

from __future__ import annotations

from dataclasses import replace

import bpy

import numpy as np

from ..pipelines.attributes import TYPES, Attributes, Layer, Marks, ShapeKey

# What the mesh is made of, what is written otherwise, and what follows from the shape.
OWN = {"position", "material_index", "sharp_face", "sharp_edge", "uv_seam", "crease_edge", "custom_normal"}
SCULPT = {".sculpt_mask", ".sculpt_face_set"}
KEY_SETTINGS = ("slider_min", "slider_max", "value", "mute", "vertex_group", "interpolation")


def read_attributes(mesh: bpy.types.Mesh, group_names: tuple[str, ...], everything: bool = True) -> Attributes:
    """Read what a mesh carries, all of it or only materials, shading and marks; not in Edit Mode."""
    f = len(mesh.polygons)
    basic = Attributes(
        get(mesh.polygons, "material_index", f), get(mesh.polygons, "use_smooth", f, bool), _marks(mesh, everything)
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
        custom_normals=mesh.has_custom_normals,
    )


def get(collection, name: str, count: int, dtype=np.int32, width: int = 1) -> np.ndarray:
    values = np.zeros(count * width, dtype)
    if count:
        collection.foreach_get(name, values)
    return values if width == 1 else values.reshape(count, width)


def _marks(mesh: bpy.types.Mesh, everything: bool) -> Marks:
    e = len(mesh.edges)
    ends = get(mesh.edges, "vertices", e, width=2).astype(np.int64)
    seam, sharp = (get(mesh.edges, name, e, bool) for name in ("use_seam", "use_edge_sharp"))
    layer = mesh.attributes.get("crease_edge")
    is_crease = layer is not None and layer.domain == "EDGE" and layer.data_type == "FLOAT"
    crease = get(layer.data, "value", e, np.float32) if is_crease else np.zeros(e, np.float32)
    layers = [_layer(a) for a in mesh.attributes if a.domain == "EDGE" and _is_carried(a)] if everything else []
    marked = np.logical_or.reduce([seam, sharp, crease > 0, *(x.values.reshape(e, -1).any(axis=1) for x in layers)])
    others = tuple(replace(layer, values=layer.values[marked]) for layer in layers)
    return Marks(ends[marked], seam[marked], sharp[marked], crease[marked], others)


def _is_carried(attribute: bpy.types.Attribute) -> bool:
    name = attribute.name
    own = name in OWN or (name.startswith(".") and name not in SCULPT)
    return not own and attribute.data_type in TYPES


def _layer(attribute: bpy.types.Attribute) -> Layer:
    key, width, dtype, _ = TYPES[attribute.data_type]
    values = get(attribute.data, key, len(attribute.data), dtype, width)
    return Layer(attribute.name, attribute.domain, attribute.data_type, values)


def _layers(mesh: bpy.types.Mesh) -> tuple[tuple[Layer, ...], tuple[str, ...]]:
    """Attributes of vertices, corners and faces, and names of those, also of edges, that cannot be carried."""
    layers = tuple(_layer(a) for a in mesh.attributes if a.domain != "EDGE" and _is_carried(a))
    left = [a.name for a in mesh.attributes if a.data_type not in TYPES and not a.name.startswith(".")]
    return layers, tuple(name for name in left if name not in OWN)


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


def _keys(mesh: bpy.types.Mesh) -> tuple[ShapeKey, ...]:
    if mesh.shape_keys is None:
        return ()
    shape = get(mesh.vertices, "co", len(mesh.vertices), np.float32, 3).astype(float)
    blocks = list(mesh.shape_keys.key_blocks)
    found = []
    for block in blocks:
        offsets = get(block.data, "co", len(shape), np.float32, 3) - shape
        settings = {name: getattr(block, name) for name in KEY_SETTINGS}
        found.append(ShapeKey(block.name, offsets, blocks.index(block.relative_key), settings))
    return tuple(found)


def _uv_flags(mesh: bpy.types.Mesh) -> tuple[str, str]:
    active = mesh.uv_layers.active
    rendered = [layer.name for layer in mesh.uv_layers if layer.active_render]
    return (active.name if active else "", rendered[0] if rendered else "")
