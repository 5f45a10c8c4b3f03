"""Draw the sidebar's tab OMT, in the 3D View and the UV editor: settings for the next run, and what the last one did.

Panels only draw. A click runs an operator with the settings shown here, which are the operator's own last ones.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import bpy

from ..blender.versions import progress_bar
from ..display import overlay
from ..operators import live
from ..operators.distortion import HISTOGRAM, KINDS
from ..operators.unwrap import draw_main, draw_more
from ..session import last_run, run

TAB = "OMT"
WITH_PRESETS = ("uv.omt_unwrap", "uv.omt_sphere", "uv.omt_magnify", "object.omt_remesh")
EDITORS = {"VIEW3D": "VIEW_3D", "IMAGE": "IMAGE_EDITOR"}


@dataclass(frozen=True)
class Section:
    """A panel of an operator below the main one; absent where there is no such operator."""

    name: str
    title: str
    operator: str
    icon: str


SECTIONS = (
    Section("refine", "Refine Area", "uv.omt_refine", "MOD_SMOOTH"),
    Section("magnify", "Magnify", "uv.omt_magnify", "VIEWZOOM"),
    Section("weights", "Weights", "object.omt_weights", "MOD_VERTEX_WEIGHT"),
    Section("sphere", "Sphere", "uv.omt_sphere", "WORLD"),
    Section("remesh", "Remesh", "object.omt_remesh", "MOD_REMESH"),
    Section("seams", "Seams", "uv.omt_seams", "EDGESEL"),
)


def class_of(operator: str):
    """The class of an operator by its name, None where it is not registered."""
    group, verb = operator.split(".")
    return getattr(bpy.types, f"{group.upper()}_OT_{verb}", None)


def settings_of(context: bpy.types.Context, operator: str):
    """What the operator would start from."""
    return context.window_manager.operator_properties_last(operator)


def draw_settings(layout: bpy.types.UILayout, operator: str, properties) -> None:
    """As the operator's own module draws them; one below the other where it does not."""
    draw = getattr(sys.modules[class_of(operator).__module__], "draw_settings", None)
    if draw is not None:
        draw(layout, properties)
        return
    layout.use_property_split = True
    layout.use_property_decorate = False
    for prop in properties.bl_rna.properties:
        if prop.identifier != "rna_type" and not prop.is_hidden:
            layout.prop(properties, prop.identifier)


class TabPanel:
    """What all panels of the tab share."""

    bl_category = TAB
    bl_region_type = "UI"
    layout: bpy.types.UILayout


class MainPanel(TabPanel):
    """The button, the slider, the main settings, and what the last run did."""

    bl_label = "OMT UV"

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        self.layout.emboss = "NONE"
        self.layout.menu("UV_MT_omt_presets", text="", icon="PRESET")

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        if run.current is not None:
            draw_run(layout, run.current)
        else:
            row = layout.row()
            row.scale_y = 1.5
            row.operator("uv.omt_unwrap", text="Unwrap", icon="UV")
        properties = settings_of(context, "uv.omt_unwrap")
        draw_live(layout, properties)
        draw_main(layout.column(), properties)
        if last_run.state.summary is not None:
            draw_summary(layout, last_run.state.summary)


class MorePanel(TabPanel):
    """Where unwrapping cuts islands, and where they go."""

    bl_label = "Unwrap Options"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        draw_more(self.layout.column(), settings_of(context, "uv.omt_unwrap"))


class SectionPanel(TabPanel):
    """The settings of one operator and its button."""

    bl_options = {"DEFAULT_CLOSED"}
    section: Section

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return class_of(cls.section.operator) is not None

    def draw(self, context: bpy.types.Context) -> None:
        section = self.section
        draw_settings(self.layout.column(), section.operator, settings_of(context, section.operator))
        row = self.layout.row()
        row.scale_y = 1.2
        row.operator(section.operator, icon=section.icon)


class DistortionPanel(TabPanel):
    """Colours, figures and histogram of distortion."""

    bl_label = "Distortion"

    def draw(self, _context: bpy.types.Context) -> None:
        layout = self.layout
        row = layout.row(align=True)
        for name, title, _, _, _ in KINDS:
            row.operator("uv.omt_overlay", text=title, depress=overlay.kind() == name).show = name
        if overlay.kind() == "AREA":
            layout.label(text="Blue: less, red: more", icon="INFO")
        elif overlay.kind() == "SHEAR":
            layout.label(text="Dark: none, yellow: 4x", icon="INFO")
        row = layout.row(align=True)
        row.operator("uv.omt_measure", text="Measure", icon="DRIVER_DISTANCE")
        row.operator("uv.omt_histogram", text="Histogram", icon="RNDCURVE")
        image = bpy.data.images.get(HISTOGRAM)
        if image is not None and image.preview is not None:
            layout.template_icon(icon_value=image.preview.icon_id, scale=7.0)


class DensityPanel(TabPanel):
    """Texel density, to get and to set."""

    bl_label = "Texel Density"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        properties = settings_of(context, "uv.omt_density_set")
        layout.prop(properties, "density")
        layout.prop(properties, "texture_size")
        layout.prop(properties, "scope")
        row = layout.row(align=True)
        row.operator("uv.omt_density_get", text="Get", icon="EYEDROPPER").texture_size = properties.texture_size
        row.operator("uv.omt_density_set", text="Set", icon="CHECKMARK")


def draw_live(layout: bpy.types.UILayout, properties) -> None:
    """The slider, and the button that makes the UVs follow it."""
    row = layout.row(align=True)
    row.prop(properties, "balance", text="Area - Angle", slider=True)
    row.operator("uv.omt_live", text="", icon="PLAY", depress=live.current is not None)


def draw_run(layout: bpy.types.UILayout, current: run.Run) -> None:
    box = layout.box().column(align=True)
    progress_bar(box, current.fraction, f"{current.stage}, {current.seconds:.1f} s")
    box.label(text="Esc or right click: cancel", icon="CANCEL")


def draw_summary(layout: bpy.types.UILayout, summary: last_run.Summary) -> None:
    box = layout.box().column(align=True)
    box.label(text=summary.title, icon="ERROR" if summary.warnings else "CHECKMARK")
    for name, value in summary.rows:
        split = box.split(factor=0.55)
        split.label(text=name)
        split.label(text=value, translate=False)
    if summary.warnings:
        count = len(summary.warnings)
        box.label(text=f"{count} warning{'' if count == 1 else 's'}: see the info editor")


class UV_MT_omt_presets(bpy.types.Menu):
    bl_idname = "UV_MT_omt_presets"
    bl_label = "OMT Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        from ..session.presets import files

        for operator in filter(class_of, WITH_PRESETS):
            for path in files(operator):
                entry = self.layout.operator("uv.omt_preset", text=path.stem.replace("_", " "), translate=False)
                entry.operator, entry.filepath = operator, str(path)
            self.layout.separator()


def _panels() -> list[type]:
    """Every panel once for each editor; the main one first, as the others are its children."""
    made = []
    for prefix, space in EDITORS.items():
        parent = f"{prefix}_PT_omt_uv"
        kinds: list[tuple[str, type, dict]] = [
            ("", MainPanel, {}),
            ("_more", MorePanel, {}),
            ("_distortion", DistortionPanel, {}),
        ]
        kinds += [(f"_{s.name}", SectionPanel, {"section": s, "bl_label": s.title}) for s in SECTIONS]
        kinds.append(("_density", DensityPanel, {}))
        for suffix, base, more in kinds:
            body = {"bl_idname": parent + suffix, "bl_space_type": space, **more}
            if suffix:
                body["bl_parent_id"] = parent
            made.append(type(parent + suffix, (base, bpy.types.Panel), body))
    return made


PANELS = (UV_MT_omt_presets, *_panels())
