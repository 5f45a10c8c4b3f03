"""Read the Subdivision Surface modifier of an object, and tell which other modifiers change its areas."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import bpy

import numpy as np

from ..pipelines.reading import Reading, SubdivisionModifier

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
    for modifier in obj.modifiers:
        if modifier.type == "SUBSURF" and (levels := _levels(modifier)):
            found = SubdivisionModifier(
                levels=levels,
                uv_smooth=modifier.uv_smooth,
                keep_corners=modifier.boundary_smooth == "PRESERVE_CORNERS",
                simple=modifier.subdivision_type == "SIMPLE",
                limit=modifier.use_limit_surface,
            )
            return _with_creases(found, mesh) if modifier.use_creases else found
    return None


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
