"""Read the Subdivision Surface modifier of an object, and tell which other modifiers change its areas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy

import numpy as np

from ..pipelines.reading import Reading
from ..solver.subdivision.modifier import SubdivisionModifier

# OpenSubdiv's sharpness of a crease of 1, by its square.
CREASE = 10.0
# Modifiers that leave the areas of the faces alone, or are about something else.
HARMLESS = {
    *("ARRAY", "MIRROR", "SUBSURF", "TRIANGULATE", "EDGE_SPLIT", "WEIGHTED_NORMAL", "NORMAL_EDIT", "DATA_TRANSFER"),
    *("UV_PROJECT", "UV_WARP", "VERTEX_WEIGHT_EDIT", "VERTEX_WEIGHT_MIX", "VERTEX_WEIGHT_PROXIMITY", "MASK"),
    *("PARTICLE_SYSTEM", "COLLISION", "MESH_SEQUENCE_CACHE", "MESH_CACHE"),
}


def modifier_of(obj: bpy.types.Object, mesh: bpy.types.Mesh) -> SubdivisionModifier | None:
    """The first Subdivision Surface modifier of an object that is shown or rendered, at the level of the render.

    mesh : that of the object, or a copy of it, in no Edit Mode; its creases count where the modifier uses them
    """
    modifier = _first_of(obj)
    if modifier is None:
        return None
    found = SubdivisionModifier(
        levels=_levels(modifier),
        uv_smooth=modifier.uv_smooth,
        keep_corners=modifier.boundary_smooth == "PRESERVE_CORNERS",
        simple=modifier.subdivision_type == "SIMPLE",
        limit=modifier.use_limit_surface,
    )
    return _with_creases(found, mesh) if modifier.use_creases else found


def why_not_applied(objects: Sequence[bpy.types.Object]) -> str:
    """Why a level of the modifiers of objects cannot be applied, in a sentence; empty where it can."""
    for obj in objects:
        modifier = _first_of(obj)
        if modifier is None:
            continue
        if obj.data.shape_keys is not None:
            return f"{obj.name}: a mesh with shape keys takes no level of its modifier. Apply or remove the shape keys."
        if obj.data.users > 1:
            return f"{obj.name}: other objects share its mesh. Make it a single user (Object > Relations) first."
        if obj.modifiers[0] != modifier:
            return f"{obj.name}: modifiers come before {modifier.name}. Apply those first."
    return ""


def apply_level(obj: bpy.types.Object) -> int:
    """Apply one level of the Subdivision Surface modifier of an object, where `why_not_applied` is empty, with its UVs,
    seams and groups; how many modifiers lost a level."""
    modifier = _first_of(obj)
    if modifier is None:
        return 0
    mode = obj.mode
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    level = obj.modifiers.new("OMT Level", "SUBSURF")
    for name in ("subdivision_type", "uv_smooth", "boundary_smooth", "use_creases"):
        setattr(level, name, getattr(modifier, name))
    # Vertices at their limits would be smoothed again by the levels that are left.
    level.use_limit_surface = False
    level.levels = level.render_levels = 1
    obj.modifiers.move(len(obj.modifiers) - 1, 0)
    with bpy.context.temp_override(object=obj, active_object=obj):
        bpy.ops.object.modifier_apply(modifier=level.name)
    modifier = _first_of(obj)
    modifier.levels, modifier.render_levels = (max(0, n - 1) for n in (modifier.levels, modifier.render_levels))
    if mode != "OBJECT":
        bpy.ops.object.mode_set(mode=mode)
    return 1


def _first_of(obj: bpy.types.Object):
    """The first Subdivision Surface modifier of an object that is shown or rendered; None without one."""
    return next((m for m in obj.modifiers if m.type == "SUBSURF" and _levels(m)), None)


def with_levels(reading: Reading, levels: int) -> Reading:
    """The reading with so many levels of subdivision, with the settings of its modifier if it has one; 0 for none."""
    if levels == 0:
        return replace(reading, subdivision=None)
    if reading.subdivision is None:
        return replace(reading, subdivision=SubdivisionModifier(levels))
    return replace(reading, subdivision=replace(reading.subdivision, levels=levels))


def subdivision_warnings(objects: Sequence[bpy.types.Object]) -> list[tuple[int, str]]:
    """Pairs of index and text, for objects with modifiers that change areas and that nobody looks at."""
    warnings = []
    for index, obj in enumerate(objects):
        others = [m.name for m in obj.modifiers if (m.show_viewport or m.show_render) and m.type not in HARMLESS]
        if others:
            verb = "changes" if len(others) == 1 else "change"
            warnings.append((index, f"Areas are those before the modifiers: {', '.join(others)} {verb} them"))
    return warnings


def _levels(modifier) -> int:
    """Levels in the render, or in the viewport where it is not rendered; 0 for a modifier that is off."""
    if modifier.show_render:
        return modifier.render_levels
    return modifier.levels if modifier.show_viewport else 0


def _with_creases(found: SubdivisionModifier, mesh: bpy.types.Mesh) -> SubdivisionModifier:
    edges, vertices = (_sharpness(mesh, *place) for place in (("crease_edge", "EDGE"), ("crease_vert", "POINT")))
    if edges is not None:
        ends = np.zeros(2 * len(mesh.edges), np.int32)
        mesh.edges.foreach_get("vertices", ends)
        sharp = np.flatnonzero(edges > 0)
        found = replace(found, ends=ends.reshape(-1, 2)[sharp].astype(np.int64), sharpness=edges[sharp])
    return found if vertices is None else replace(found, corner_sharpness=vertices)


def _sharpness(mesh: bpy.types.Mesh, name: str, domain: str) -> np.ndarray | None:
    """Sharpness (k,) of the edges or vertices by their crease, None where there is none."""
    attribute = mesh.attributes.get(name)
    if attribute is None or attribute.domain != domain or attribute.data_type != "FLOAT":
        return None
    crease = np.zeros(len(attribute.data), np.float32)
    attribute.data.foreach_get("value", crease)
    return CREASE * crease.astype(float) ** 2
