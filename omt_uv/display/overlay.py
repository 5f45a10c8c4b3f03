"""Show distortion as colours: an attribute in the 3D View, filled faces in the UV editor; nothing stays behind."""

from __future__ import annotations

from dataclasses import dataclass, field

import bpy

from .shading import view_spaces

# In the UV editor, so that the outlines of the faces are seen through the colours.
OPACITY = 0.65
OUTLINE = (0.0, 0.0, 0.0, 0.35)


@dataclass
class _Shown:
    """kind: NONE, AREA, SHEAR or OTHER; what is drawn in the UV editor; how the 3D Views were shaded, by pointer."""

    kind: str = "NONE"
    places: list = field(default_factory=list)
    colours: list = field(default_factory=list)
    batch: object = None
    edges: list = field(default_factory=list)
    outlines: object = None
    shading: dict = field(default_factory=dict)
    handle: object = None


_shown = _Shown()


def kind() -> str:
    """What is shown: NONE, AREA, SHEAR, or OTHER, colours that others wrote."""
    return _shown.kind


def show(context: bpy.types.Context, pairs: list, figure: str) -> None:
    """Colour objects, pairs of object and Reading, by a figure, AREA or SHEAR.

    Raises
    ------
    MeshError : see `solver.maps.distortion.distortion`
    """
    import numpy as np

    from ..blender import colour_attributes
    from ..pipelines.distortion import polygon_outlines, triangles_of
    from ..solver.maps.distortion import face_distortion
    from .colormaps import area_colours, shear_colours

    found = triangles_of([reading for _, reading in pairs])
    octaves, shear = face_distortion(found.positions, found.triangles, found.uv, found.polygons)
    rgb = area_colours(octaves) if figure == "AREA" else shear_colours(shear)
    _paint_views(context)
    start = 0
    for obj, reading in pairs:
        corners = reading.surface.triangles[reading.faces[reading.surface.triangle_face]]
        mine = np.repeat(rgb[start : start + len(corners)], 3, axis=0)
        colour_attributes.write_colours(obj, corners.ravel(), mine)
        start += len(corners)
    rgba = np.concatenate([np.repeat(rgb, 3, axis=0), np.full((3 * len(rgb), 1), OPACITY)], axis=1)
    _shown.kind, _shown.places, _shown.colours = figure, found.uv.reshape(-1, 2).tolist(), rgba.tolist()
    _shown.edges = polygon_outlines([reading for _, reading in pairs]).reshape(-1, 2).tolist()
    _shown.batch = _shown.outlines = None
    if _shown.handle is None and not bpy.app.background:
        _shown.handle = bpy.types.SpaceImageEditor.draw_handler_add(_draw, (), "WINDOW", "POST_VIEW")
    for kind, function in _handlers():
        if function not in kind:
            kind.append(function)
    redraw(context)


def show_written(context: bpy.types.Context) -> None:
    """Let the 3D Views show colours that others wrote into the attribute; `hide` takes them back as well."""
    _paint_views(context)
    if _shown.handle is not None:
        bpy.types.SpaceImageEditor.draw_handler_remove(_shown.handle, "WINDOW")
        _shown.handle = None
    _shown.kind = "OTHER"
    for kind, function in _handlers():
        if function not in kind:
            kind.append(function)
    redraw(context)


def hide(context: bpy.types.Context) -> None:
    """Take everything back: attributes, shading, drawing."""
    from ..blender import colour_attributes

    for obj in bpy.data.objects:
        if obj.type == "MESH" and obj.data.library is None and colour_attributes.has_colours(obj.data):
            colour_attributes.remove_colours(obj)
    for space in view_spaces(context):
        kept = _shown.shading.get(space.as_pointer())
        if kept is not None and space.shading.type == "SOLID" and space.shading.color_type == "VERTEX":
            space.shading.type, space.shading.color_type = kept
    forget()
    redraw(context)


def forget() -> None:
    """Stop drawing; also when the add-on goes."""
    if _shown.handle is not None:
        bpy.types.SpaceImageEditor.draw_handler_remove(_shown.handle, "WINDOW")
    for kind, function in _handlers():
        if function in kind:
            kind.remove(function)
    _shown.__init__()  # type: ignore[misc]


def refresh(context: bpy.types.Context, pairs: list) -> None:
    """Colour anew what is shown, after the UVs changed."""
    if _shown.kind in {"AREA", "SHEAR"}:
        show(context, pairs, _shown.kind)


def _handlers() -> list:
    """Blender's lists of handlers, and what each shall call."""
    handlers = bpy.app.handlers
    return [(handlers.undo_post, _after_undo), (handlers.redo_post, _after_undo), (handlers.load_pre, _before_load)]


def _after_undo(*_) -> None:
    """Where undo took the attribute away, shading and drawing go with it."""
    from ..blender.colour_attributes import has_colours

    if not any(map(has_colours, bpy.data.meshes)):
        hide(bpy.context)


def _before_load(*_) -> None:
    """Stop drawing: the file whose faces are drawn goes."""
    forget()


def _paint_views(context: bpy.types.Context) -> None:
    """Let every 3D View show the attribute, and keep how it was shaded."""
    for space in view_spaces(context):
        key = space.as_pointer()
        if key not in _shown.shading:
            _shown.shading[key] = (space.shading.type, space.shading.color_type)
        space.shading.type, space.shading.color_type = "SOLID", "VERTEX"


def redraw(context: bpy.types.Context) -> None:
    """Draw the 3D Views and image editors of all windows anew."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type in {"VIEW_3D", "IMAGE_EDITOR"}:
                area.tag_redraw()


def _shows_uvs(context: bpy.types.Context) -> bool:
    """Whether an editor is one of UVs: in Object Mode, too, where Blender itself shows none."""
    space, area = context.space_data, context.area
    return bool(getattr(space, "show_uvedit", False) or getattr(area, "ui_type", "") == "UV")


def _draw() -> None:
    """Fill the faces in the UV editor; Blender draws their outlines over them."""
    import gpu
    from gpu_extras.batch import batch_for_shader

    from ..blender.versions import SMOOTH_COLOUR_SHADER, UNIFORM_COLOUR_SHADER

    if not _shows_uvs(bpy.context):
        return
    shader = gpu.shader.from_builtin(SMOOTH_COLOUR_SHADER)
    if _shown.batch is None:
        _shown.batch = batch_for_shader(shader, "TRIS", {"pos": _shown.places, "color": _shown.colours})
    gpu.state.blend_set("ALPHA")
    _shown.batch.draw(shader)  # type: ignore[attr-defined]
    if bpy.context.mode == "OBJECT":
        # Blender draws no outlines there.
        lines = gpu.shader.from_builtin(UNIFORM_COLOUR_SHADER)
        if _shown.outlines is None:
            _shown.outlines = batch_for_shader(lines, "LINES", {"pos": _shown.edges})
        lines.bind()
        lines.uniform_float("color", OUTLINE)
        _shown.outlines.draw(lines)  # type: ignore[attr-defined]
    gpu.state.blend_set("NONE")
