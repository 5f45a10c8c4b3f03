"""Read what objects carry for a match, and write its results: attributes, a shape key, colours."""

from __future__ import annotations

from dataclasses import dataclass, replace

import bpy

import numpy as np

from ...errors import UserError
from ...pipelines.attributes import Attributes, Layer, is_uv, material_borders, uv_seams
from ...pipelines.reading import check_places
from ...pipelines.remesh import oriented
from ...pipelines.shapes.landmark_pairs import Pairs
from ...pipelines.shapes.match import MatchJob, MatchResult
from ...solver.analysis.feature_edges import edge_union
from ...solver.errors import EmptyMeshError
from ...solver.mesh.surface import Surface
from ...solver.mesh.topology import pair_keys
from ...solver.registration.results import RegistrationOptions
from .. import mesh as blender_mesh
from ..read_attributes import get, read_attributes
from ..vertex_groups import write_group
from ..write_attributes import fresh_attribute, write_layer

# Attribute with the colours that show what corresponds.
CHECKER = "OMT Match"
# Squares of the checker along the longest side of the source.
SQUARES = 14
WHITE_SHARE = 0.55
MOST_UV_MAPS = 8


class MatchError(UserError):
    """An object that cannot take what a match would write."""


@dataclass(frozen=True)
class Carried:
    """What was read of an object: its surface, what it carries, the stretch (3,3) of its positions, and warnings."""

    surface: Surface
    attributes: Attributes
    stretch: np.ndarray
    materials: tuple[str, ...]
    warnings: tuple[str, ...]


def read_carrier(obj: bpy.types.Object) -> Carried:
    """Read an object in Object Mode; changes nothing. Raises MeshError: no faces, coordinates
    that are no numbers, or a scale that flattens it."""
    reading = blender_mesh.read_mesh(obj.data, obj)
    if not len(reading.surface.triangles):
        raise EmptyMeshError("The mesh has no faces", "Choose a mesh with faces")
    check_places(reading.surface)
    sides = oriented(reading.surface)
    stretch = blender_mesh.stretch(obj)
    if blender_mesh.is_flattened(stretch):
        raise MatchError(f"{obj.name}: The scale of the object is zero along an axis. Clear or fix its scale.")
    names = tuple(group.name for group in obj.vertex_groups)
    attributes = read_attributes(obj.data, names)
    materials = tuple(slot.material.name if slot.material else "" for slot in obj.material_slots)
    told = tuple(f"{found}; turned over for the match" for found in (sides.wrong, sides.odd) if found)
    return Carried(sides.surface, attributes, stretch, materials, told)


def match_job(source: Carried, target: Carried, pairs: Pairs, options: RegistrationOptions) -> MatchJob:
    """What to match, and the edges of the source across which values jump."""
    jumps = edge_union(
        source.surface.seams,
        uv_seams(source.attributes, source.surface),
        material_borders(source.attributes, source.surface),
    )
    return MatchJob(source.surface, target.surface, pairs, options, jumps)


def check_room(obj: bpy.types.Object, attributes: Attributes, kinds: set[str]) -> None:
    """Raise MatchError or TargetError if an object cannot take what is to be transferred."""
    blender_mesh.check_local(obj)
    mesh = obj.data
    if "uv" in kinds:
        new = {layer.name for layer in attributes.layers if is_uv(layer)} - set(mesh.uv_layers.keys())
        if len(mesh.uv_layers) + len(new) > MOST_UV_MAPS:
            raise MatchError(f"{obj.name} would have more than {MOST_UV_MAPS} UV maps. Remove some first.")
    if "groups" in kinds:
        locked = [g.name for g in obj.vertex_groups if g.lock_weight and g.name in attributes.groups]
        if locked:
            raise MatchError(f"{obj.name}: The vertex group {locked[0]!r} is locked. Unlock it.")


def write_onto(
    obj: bpy.types.Object, carried: Carried, attributes: Attributes, kinds: set[str], prefix: str = ""
) -> list[str]:
    """Give an object what a match carried onto it; names of what was written.

    kinds : words of `choices.TRANSFERS`; prefix : of vertex groups that are landmarks, which stay as they are
    """
    mesh, written = obj.data, []
    for layer in attributes.layers:
        if _kind(layer) in kinds and _fits(mesh, layer):
            if is_uv(layer) and layer.name in mesh.uv_layers:
                values = np.ascontiguousarray(layer.values, np.float32)
                blender_mesh.write_uv(obj, layer.name, np.arange(len(values)), values)
            else:
                write_layer(mesh, layer)
            written.append(layer.name)
    if "uv" in kinds:
        _write_seams(mesh, attributes)
    if "materials" in kinds and carried.materials:
        _write_materials(obj, carried.materials, attributes.material_index)
        written.append("materials")
    if "groups" in kinds:
        active = obj.vertex_groups.active_index
        for k, name in enumerate(attributes.groups):
            if prefix and name.startswith(prefix):
                continue
            write_group(obj, name, np.where(attributes.member[:, k], attributes.weights[:, k], 0))
            written.append(name)
        obj.vertex_groups.active_index = max(active, 0)
    if "shape_keys" in kinds:
        written += _write_keys(obj, attributes, np.linalg.inv(blender_mesh.stretch(obj)))
    mesh.update()
    return written


def _kind(layer: Layer) -> str:
    """The word of `choices.TRANSFERS` that a layer belongs to."""
    if is_uv(layer):
        return "uv"
    if layer.name == ".sculpt_face_set":
        return "face_sets"
    return "colours" if layer.data_type in ("FLOAT_COLOR", "BYTE_COLOR") else "attributes"


def _fits(mesh: bpy.types.Mesh, layer: Layer) -> bool:
    """Whether a mesh has no attribute of the name, or one that holds the same."""
    there = mesh.attributes.get(layer.name)
    return there is None or (there.domain == layer.domain and there.data_type == layer.data_type)


def _write_seams(mesh: bpy.types.Mesh, attributes: Attributes) -> None:
    """Mark the edges where islands end, beside those that are marked."""
    marks = attributes.marks
    if not marks.seam.any():
        return
    e = len(mesh.edges)
    ends = get(mesh.edges, "vertices", e, width=2).astype(np.int64)
    seam = get(mesh.edges, "use_seam", e, bool)
    edges = marks.edges[marks.seam]
    seam |= np.isin(pair_keys(ends[:, 0], ends[:, 1]), pair_keys(edges[:, 0], edges[:, 1]))
    mesh.edges.foreach_set("use_seam", seam)


def _write_materials(obj: bpy.types.Object, names: tuple[str, ...], index: np.ndarray) -> None:
    """Materials by name, one slot each, and the slot of every polygon."""
    obj.data.materials.clear()
    for name in names:
        material = (bpy.data.materials.get(name) or bpy.data.materials.new(name)) if name else None
        obj.data.materials.append(material)
    obj.data.polygons.foreach_set("material_index", np.clip(index, 0, len(names) - 1).astype(np.int32))


def _write_keys(obj: bpy.types.Object, attributes: Attributes, inverse: np.ndarray) -> list[str]:
    """Shape keys but for the basis, relative to that of the object; inverse (3,3) of its stretch."""
    keys = attributes.keys[1:]
    if not keys:
        return []
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    blocks = obj.data.shape_keys.key_blocks
    base = get(blocks[0].data, "co", len(obj.data.vertices), np.float32, 3)
    names = [key.name for key in attributes.keys]
    for key in keys:
        block = blocks.get(key.name)
        if block is None or block == blocks[0]:
            block = obj.shape_key_add(name=key.name, from_mix=False)
        block.data.foreach_set("co", (base + key.offsets @ inverse.T).astype(np.float32).ravel())
        relative = names[key.relative_to] if key.relative_to else ""
        block.relative_key = blocks.get(relative) or blocks[0]
        for name, value in key.settings.items():
            setattr(block, name, value)
    return [key.name for key in keys]


def stretched_offsets(carried: Carried) -> Carried:
    """With offsets of shape keys in the space of the surface: the scale of the object applied."""
    keys = tuple(replace(key, offsets=key.offsets @ carried.stretch.T) for key in carried.attributes.keys)
    return replace(carried, attributes=replace(carried.attributes, keys=keys))


def write_wrap(
    source: bpy.types.Object, target: bpy.types.Object, result: MatchResult, name: str, value: float
) -> bpy.types.ShapeKey:
    """A shape key of the source in the shape, and the place, of the target."""
    stretch = blender_mesh.stretch(target)
    local = np.linalg.solve(stretch, result.wrapped.T)
    world = np.array(target.matrix_world)
    matrix = np.linalg.inv(np.array(source.matrix_world)) @ world
    positions = (matrix[:3, :3] @ local).T + matrix[:3, 3]
    if source.data.shape_keys is None:
        source.shape_key_add(name="Basis", from_mix=False)
    blocks = source.data.shape_keys.key_blocks
    block = blocks.get(name) or source.shape_key_add(name=name, from_mix=False)
    block.data.foreach_set("co", positions.astype(np.float32).ravel())
    block.value = value
    source.active_shape_key_index = blocks.find(block.name)
    source.data.update()
    return block


def write_colours(source: bpy.types.Object, target: bpy.types.Object, job: MatchJob, result: MatchResult) -> None:
    """Colours on both objects that are the same where they correspond: places in the source, and a checker of them."""
    place = job.source.positions
    low, size = place.min(axis=0), max(float(np.ptp(place, axis=0).max()), 1e-300)
    triangles = job.source.corner_vertex[job.source.triangles]
    there = np.einsum("kc,kcd->kd", result.source_barycentric, place[triangles[result.source_faces]])
    for obj, at in ((source, place), (target, there)):
        _write_colour(obj.data, (at - low) / size)


def _write_colour(mesh: bpy.types.Mesh, place: np.ndarray) -> None:
    """A colour attribute of the vertices, the active one, from places (n,3) in a unit box."""
    square = np.floor(SQUARES * place + 1e-6).astype(np.int64).sum(axis=1) % 2
    colour = np.column_stack([np.clip(place, 0, 1), np.ones(len(place))])
    colour[:, :3] = np.where(square[:, None] == 1, colour[:, :3], WHITE_SHARE + (1 - WHITE_SHARE) * colour[:, :3])
    layer = fresh_attribute(mesh, CHECKER, "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", colour.astype(np.float32).ravel())
    mesh.attributes.active_color_name = CHECKER
    mesh.update()
