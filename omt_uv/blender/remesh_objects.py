"""Turn a mesh object into a job for remeshing, and make the new objects beside it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy

import numpy as np

from ..errors import UserError
from ..pipelines.attributes import Attributes, followed, marked_sharp, material_borders, uv_seams
from ..pipelines.carry_attributes import carry
from ..pipelines.gate import gate
from ..pipelines.remesh import LevelOfDetail, RemeshJob, Series, oriented
from ..settings import RemeshSettings
from ..solver.analysis.density import from_polygons, from_vertices
from ..solver.analysis.feature_edges import edge_union, sharp_edges
from ..solver.errors import EmptyMeshError, plural
from ..solver.mesh.surface import Surface
from . import mesh as blender_mesh
from .read_attributes import read_attributes
from .vertex_groups import group_weights
from .write_attributes import keep_chosen, write_attributes

# Modifiers that keep data for the very vertices of a mesh and are of no use on another.
BOUND = {
    "MULTIRES",
    "HOOK",
    "SURFACE_DEFORM",
    "MESH_DEFORM",
    "LAPLACIANDEFORM",
    "PARTICLE_SYSTEM",
    "CLOTH",
    "SOFT_BODY",
}


class SourceError(UserError):
    """The vertex group or attribute that should give the density is missing or of no use."""


@dataclass(frozen=True)
class Request:
    """What to remesh, what it carries, and the stretch (3,3) of its positions, see `mesh.stretch`."""

    job: RemeshJob
    attributes: Attributes
    stretch: np.ndarray
    evaluated: bool


def read_request(
    obj: bpy.types.Object, settings: RemeshSettings, depsgraph: bpy.types.Depsgraph | None = None, weld: bool = False
) -> Request:
    """Read an object in Object Mode, with its modifiers if a depsgraph is given; changes nothing.

    weld : join vertices that a file format had to split

    Raises
    ------
    SourceError : see there
    MeshError : no faces, a transformation that is not finite or flattens the object
    """
    with _mesh_of(obj, depsgraph) as mesh:
        reading = blender_mesh.read_mesh(mesh, obj)
        if weld:
            reading = blender_mesh.weld_split_vertices(replace(reading, uv=None))
        if not len(reading.surface.triangles):
            raise EmptyMeshError("The mesh has no faces", "Choose a mesh with faces")
        sides = oriented(reading.surface)
        surface = sides.surface
        names = tuple(group.name for group in obj.vertex_groups)
        attributes = read_attributes(mesh, names, settings.preserve_attributes)
        values = _density_values(obj, mesh, surface, settings)
    stretch = blender_mesh.check_stretch(obj)
    jumps = edge_union(uv_seams(attributes, surface), material_borders(attributes, surface))
    features = edge_union(_features(attributes, surface, settings), sides.joints)
    kept = followed(attributes, edge_union(features, jumps))
    job = RemeshJob(surface, features, jumps, values, sides.warnings, sides.kept)
    return Request(job, kept, stretch, depsgraph is not None)


@contextmanager
def _mesh_of(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph | None) -> Iterator[bpy.types.Mesh]:
    if depsgraph is None:
        yield obj.data
        return
    evaluated = obj.evaluated_get(depsgraph)
    try:
        yield evaluated.to_mesh(preserve_all_data_layers=True, depsgraph=depsgraph)
    finally:
        evaluated.to_mesh_clear()


def _features(attributes: Attributes, surface: Surface, settings: RemeshSettings) -> np.ndarray:
    """Edges (e,2) that the new mesh shall follow."""
    triangles = surface.corner_vertex[surface.triangles]
    kept = []
    if settings.preserve_sharp:
        kept += [
            marked_sharp(attributes),
            sharp_edges(surface.positions, triangles, settings.sharp_angle),
        ]
    if settings.preserve_seams:
        kept += [surface.seams, uv_seams(attributes, surface)]
    if settings.preserve_materials:
        kept.append(material_borders(attributes, surface))
    return edge_union(*kept)


def source_of(obj: bpy.types.Object, settings: RemeshSettings) -> str:
    """The density of settings that name a vertex group: that of the attribute where only such a one has the name."""
    named = settings.density == "weights" and settings.source not in obj.vertex_groups
    return "attribute" if named and settings.source in obj.data.attributes else settings.density


def _density_values(
    obj: bpy.types.Object, mesh: bpy.types.Mesh, surface: Surface, settings: RemeshSettings
) -> np.ndarray | None:
    """Weights or attribute (m,) per triangle, None where the density needs neither."""
    triangles = surface.corner_vertex[surface.triangles]
    if settings.density == "weights":
        weights = group_weights(obj, settings.source, mesh)
        if weights is None:
            raise SourceError(f"{obj.name}: There is no vertex group {settings.source!r}. Choose one that it has.")
        return from_vertices(weights, triangles)
    if settings.density != "attribute":
        return None
    attribute = mesh.attributes.get(settings.source)
    if attribute is None or attribute.data_type != "FLOAT" or attribute.domain not in {"POINT", "FACE"}:
        raise SourceError(
            f"{obj.name}: There is no attribute {settings.source!r} of floats on vertices or faces. "
            "Choose one that it has."
        )
    values = np.zeros(len(attribute.data), np.float32)
    attribute.data.foreach_get("value", values)
    if attribute.domain == "POINT":
        return from_vertices(values, triangles)
    return from_polygons(values, surface.triangle_face)


def alike(objects: list[bpy.types.Object], applied: bool) -> list[list[bpy.types.Object]]:
    """Objects that can have one new mesh together: they share theirs at one scale, and no modifiers are applied."""
    groups: dict = {}
    for obj in objects:
        matrix = np.array(obj.matrix_world)[:3, :3]
        # Lengths and angles of the axes, whatever way they point.
        metric = matrix.T @ matrix
        size = np.trace(metric)
        # Adding zero makes -0.0 and 0.0 the same.
        scale = f"{size:.5g}", ((metric / (size or 1)).round(5) + 0.0).tobytes()
        groups.setdefault(obj if applied else (obj.data, scale), []).append(obj)
    return list(groups.values())


def new_objects(
    group: list[bpy.types.Object], request: Request, series: Series, carried: list[Attributes]
) -> list[str]:
    """Make the objects of a series beside each object of a group that shares a mesh; returns their names."""
    single = len(series.levels) == 1
    names = []
    for k, (level, attributes) in enumerate(zip(series.levels, carried, strict=True)):
        ending = "_remesh" if single else f"_LOD{k}"
        mesh = _new_mesh(group[0], group[0].name + ending, request, level)
        new = [_new_object(obj, obj.name + ending, mesh, request.evaluated) for obj in group]
        write_attributes(new[0], attributes)
        for made, obj in zip(new, group, strict=True):
            keep_chosen(made, obj)
        for face in np.flatnonzero(level.back).tolist():
            mesh.polygons[face].flip()
        names += [obj.name for obj in new]
    # Objects that were linked but a moment ago cannot be selected, or left out of a selection.
    bpy.context.view_layer.update()
    return names


# Property of a new object: the one that it was made of, to be shown in its place.
SOURCE = "omt_uv_source"


def mark_source(group: list[bpy.types.Object], names: list[str]) -> None:
    """Let new objects, levels in turn and each for every object of the group, know what they were made of.

    Several levels stand in a collection of their own, below the first one of the object.
    """
    levels = len(names) // len(group)
    for k, name in enumerate(names):
        bpy.data.objects[name][SOURCE] = group[k % len(group)]
    if levels < 2:
        return
    home = next((c for c in group[0].users_collection if c.library is None), bpy.context.scene.collection)
    collection = bpy.data.collections.new(f"{group[0].name} LODs")
    home.children.link(collection)
    for name in names:
        obj = bpy.data.objects[name]
        for other in list(obj.users_collection):
            other.objects.unlink(obj)
        collection.objects.link(obj)
    bpy.context.view_layer.update()


def family(obj: bpy.types.Object) -> list[bpy.types.Object]:
    """The object that it was made of, and all that were made of that, the finest first; empty if there is none."""
    source = obj.get(SOURCE) or obj
    made = [other for other in bpy.data.objects if other.get(SOURCE) == source and other.type == "MESH"]
    return [source, *sorted(made, key=lambda other: -len(other.data.vertices))] if made else []


def carried_attributes(request: Request, series: Series) -> list[Attributes]:
    """What the meshes of a series carry."""
    surface = request.job.surface
    return [carry(request.attributes, surface, level.correspondence) for level in series.levels]


def _new_mesh(obj: bpy.types.Object, name: str, request: Request, level: LevelOfDetail) -> bpy.types.Mesh:
    positions = np.linalg.solve(request.stretch, level.positions.T).T
    mesh = blender_mesh.new_mesh(name, positions.tolist(), level.triangles.tolist())
    for material in obj.data.materials:
        mesh.materials.append(material)
    return mesh


def _new_object(obj: bpy.types.Object, name: str, mesh: bpy.types.Mesh, applied: bool) -> bpy.types.Object:
    new = obj.copy()
    new.name = name
    new.data = mesh
    for slot, old in zip(new.material_slots, obj.material_slots, strict=False):
        slot.link, slot.material = old.link, old.material
    _drop_modifiers(new, applied)
    blender_mesh.link_beside(new, obj)
    return new


def _drop_modifiers(new: bpy.types.Object, applied: bool) -> None:
    for modifier in list(new.modifiers):
        if applied or modifier.type in BOUND:
            new.modifiers.remove(modifier)


def lost(obj: bpy.types.Object, request: Request, carried: list[Attributes], by_hand: bool = True) -> list[str]:
    """Warnings about what the new objects do not have, or not as it was.

    by_hand : whether custom normals are somebody's work; many file formats hold normals of any mesh
    """
    texts = []
    folded = sum(attributes.folded for attributes in carried)
    if folded:
        who = plural(folded, "A face of the new mesh is", "{} faces of the new mesh are")
        texts.append(f"{who} folded in a UV map")
    if request.attributes.left:
        names = ", ".join(request.attributes.left)
        texts.append(f"Attributes of text, and those of edges that the new mesh does not follow, are left out: {names}")
    if request.attributes.custom_normals and by_hand:
        texts.append("Custom normals are left out; normals follow the new shape")
    bound = [m.name for m in obj.modifiers if m.type in BOUND]
    if bound and not request.evaluated:
        texts.append(f"Modifiers bound to the vertices of the old mesh are left out: {', '.join(bound)}")
    return texts


def carried_gate(obj: bpy.types.Object, made: list[str]) -> list[tuple[str, ...]]:
    """What the last gate says of the active UVs that each new object carries, next to those of the old one."""
    before = None
    told = []
    for name in made:
        found = gate([blender_mesh.read(bpy.data.objects[name])])
        if found.warnings() and before is None:
            before = gate([blender_mesh.read(obj)])
        told.append(tuple(f"{name}: {text}" for text in found.warnings(before)))
    return told
