"""Write what a new mesh object shall carry."""

from __future__ import annotations

from dataclasses import replace

import bpy

import numpy as np

from ..pipelines.attributes import TYPES, Attributes, Layer, Marks, is_uv
from ..solver.mesh.topology import pair_keys
from .read_attributes import get


def write_attributes(obj: bpy.types.Object, attributes: Attributes) -> None:
    """Give a new mesh object, which is in no Edit Mode, what it shall carry."""
    mesh = obj.data
    mesh.polygons.foreach_set("material_index", attributes.material_index.astype(np.int32))
    mesh.polygons.foreach_set("use_smooth", attributes.smooth)
    _write_marks(mesh, attributes.marks)
    for layer in attributes.layers:
        write_layer(mesh, layer)
    _write_flags(mesh, attributes)
    for k, name in enumerate(attributes.groups):
        group = obj.vertex_groups.new(name=name)
        for vertex in np.flatnonzero(attributes.member[:, k]).tolist():
            group.add([vertex], float(attributes.weights[vertex, k]), "REPLACE")
    _write_keys(obj, attributes)
    mesh.update()


def keep_chosen(obj: bpy.types.Object, old: bpy.types.Object) -> None:
    """Let an object have that vertex group and shape key active which the old one has, and its groups locked."""
    for group in old.vertex_groups:
        if group.name in obj.vertex_groups:
            obj.vertex_groups[group.name].lock_weight = group.lock_weight
    active, key = old.vertex_groups.active, old.active_shape_key
    if active is not None and active.name in obj.vertex_groups:
        obj.vertex_groups.active_index = obj.vertex_groups[active.name].index
    if key is not None and obj.data.shape_keys is not None:
        obj.active_shape_key_index = max(0, obj.data.shape_keys.key_blocks.find(key.name))


def _write_marks(mesh: bpy.types.Mesh, marks: Marks) -> None:
    if not len(marks.edges):
        return
    e = len(mesh.edges)
    ends = get(mesh.edges, "vertices", e, width=2).astype(np.int64)
    key = pair_keys(ends[:, 0], ends[:, 1])
    order = np.argsort(key)
    at = order[np.searchsorted(key, pair_keys(marks.edges[:, 0], marks.edges[:, 1]), sorter=order)]
    for name, flags in (("use_seam", marks.seam), ("use_edge_sharp", marks.sharp)):
        if flags.any():
            flag = np.zeros(e, bool)
            flag[at] = flags
            mesh.edges.foreach_set(name, flag)
    if marks.crease.any():
        crease = np.zeros(e, np.float32)
        crease[at] = marks.crease
        mesh.attributes.new("crease_edge", "FLOAT", "EDGE").data.foreach_set("value", crease)
    for layer in marks.layers:
        values = np.zeros((e, *layer.values.shape[1:]), layer.values.dtype)
        values[at] = layer.values
        write_layer(mesh, replace(layer, values=values))


def fresh_attribute(mesh: bpy.types.Mesh, name: str, data_type: str, domain: str):
    """The attribute of this name, made if there is none; one of another kind gives way."""
    there = mesh.attributes.get(name)
    if there is not None and (there.data_type, there.domain) != (data_type, domain):
        mesh.attributes.remove(there)
        there = None
    return there or mesh.attributes.new(name, data_type, domain)


def write_layer(mesh: bpy.types.Mesh, layer: Layer) -> None:
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
    shape = get(obj.data.vertices, "co", len(obj.data.vertices), np.float32, 3)
    blocks = [obj.shape_key_add(name=key.name, from_mix=False) for key in attributes.keys]
    if not blocks:
        return
    obj.data.shape_keys.use_relative = attributes.keys_relative
    for block, key in zip(blocks, attributes.keys, strict=True):
        block.data.foreach_set("co", (shape + key.offsets).astype(np.float32).ravel())
        block.relative_key = blocks[key.relative_to]
        for name, value in key.settings.items():
            setattr(block, name, value)
