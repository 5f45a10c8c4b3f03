"""Make the sidebar's tab OMT of its sections, in the 3D View and the UV editor.

Panels only draw. A click runs an operator with the settings shown there, which are the operator's own last ones.
A new section is a module beside this one and a line of SECTIONS.
"""

from __future__ import annotations

import bpy

from .. import links
from ..session import ahead
from ..settings import CONTEXT
from . import arrange, inspect, match, partition, result, tools, unwrap, volumes
from .section import Section, class_of
from .welcome import TAB

WITH_PRESETS = ("uv.omt_unwrap", "uv.omt_sphere", "uv.omt_magnify", "object.omt_remesh")
EDITORS = {"VIEW3D": "VIEW_3D", "IMAGE": "IMAGE_EDITOR"}

# In the order of use; a section stands behind the one that it is part of.
SECTIONS = (
    unwrap.SECTION,
    unwrap.OPTIONS,
    unwrap.REFINE,
    unwrap.SEAMS,
    arrange.QUEUE_SECTION,
    result.SECTION,
    inspect.SECTION,
    inspect.DENSITY,
    arrange.SECTION,
    tools.MAGNIFY,
    tools.WEIGHTS,
    tools.MAGNIFY_MORE,
    tools.MAGNIFY_IMAGE,
    tools.REMESH,
    partition.SECTION,
    tools.SPHERE,
    match.SECTION,
    volumes.FLOW,
    volumes.VOLUME,
)


class TabPanel:
    """A section of the tab as a panel of one editor."""

    bl_category = TAB
    bl_region_type = "UI"
    section: Section
    layout: bpy.types.UILayout

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return not cls.section.operators or any(map(class_of, cls.section.operators))

    def draw(self, context: bpy.types.Context) -> None:
        self.section.draw(self.layout, context)

    def draw_header_preset(self, _context: bpy.types.Context) -> None:
        if links.page():
            self.layout.emboss = "NONE"
            button = self.layout.operator("wm.omt_help", text="", icon="HELP")
            button.operator = (self.section.operators or ("uv.omt_measure",))[0]
            button.section = self.section.name


class MainPanel(TabPanel):
    """The first section, with presets in its header. Whoever sees it may click soon."""

    def draw(self, context: bpy.types.Context) -> None:
        ahead.begin()
        TabPanel.draw(self, context)

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        self.layout.emboss = "NONE"
        row = self.layout.row()
        row.menu("UV_MT_omt_presets", text="", icon="PRESET")
        TabPanel.draw_header_preset(self, context)


class UV_MT_omt_presets(bpy.types.Menu):
    bl_idname = "UV_MT_omt_presets"
    bl_label = "OMT Presets"

    def draw(self, _context: bpy.types.Context) -> None:
        from ..session.presets import files

        every = ((operator, files(operator)) for operator in filter(class_of, WITH_PRESETS))
        for k, (operator, paths) in enumerate((operator, paths) for operator, paths in every if paths):
            if k:
                self.layout.separator()
            for path in paths:
                entry = self.layout.operator("uv.omt_preset", text=path.stem.replace("_", " "), translate=False)
                entry.operator, entry.filepath = operator, str(path)


def _panels() -> list[type]:
    """Every section once for each editor."""
    return [_panel(prefix, space, place) for prefix, space in EDITORS.items() for place in range(len(SECTIONS))]


def _panel(prefix: str, space: str, place: int) -> type:
    section = SECTIONS[place]
    name = _name(prefix, section.name)
    body: dict[str, object] = {
        "bl_idname": name,
        "bl_space_type": space,
        "bl_label": section.title,
        "bl_translation_context": CONTEXT,
        "bl_options": set() if section.is_open else {"DEFAULT_CLOSED"},
        "bl_order": place,
        "section": section,
    }
    if section.parent is not None:
        body["bl_parent_id"] = _name(prefix, section.parent)
    return type(name, (TabPanel if section.name else MainPanel, bpy.types.Panel), body)


def _name(prefix: str, section: str) -> str:
    return f"{prefix}_PT_omt_uv" + (f"_{section}" if section else "")


PANELS = (UV_MT_omt_presets, *_panels())
