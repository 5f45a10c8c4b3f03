"""What every section of the tab is made of: `Section`, and how the settings of an operator are drawn.

A section is a module of this folder with a constant SECTION, or several; `sidebar.SECTIONS` has them in the order of
use, and makes a panel of each in both editors. Panels only draw.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Section:
    """A panel of the tab.

    name : behind the panel's identifier, `VIEW3D_PT_omt_uv_NAME`; title : its header
    draw : draws it, called with layout and context
    operators : those that it offers; the section is absent where none of them is registered
    parent : name of the section that it stands in; is_open : at first
    """

    name: str
    title: str
    draw: Callable[[bpy.types.UILayout, bpy.types.Context], None]
    operators: tuple[str, ...] = ()
    parent: str | None = None
    is_open: bool = False


def operator_section(
    name: str, title: str, operator: str, icon: str, parent: str | None = None, button: str = ""
) -> Section:
    """A section of one operator: its settings, as its module draws them, and below them its button.

    button : what it says where the operator's name, by which the search finds it, would say more than is needed
    """

    def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
        draw_settings(layout.column(), operator, settings_of(context, operator))
        big_button(layout, operator, icon, button)

    return Section(name, title, draw, (operator,), parent)


def class_of(operator: str):
    """The class of an operator by its name, None where it is not registered."""
    group, verb = operator.split(".")
    return getattr(bpy.types, f"{group.upper()}_OT_{verb}", None)


def settings_of(context: bpy.types.Context, operator: str):
    """What the operator would start from."""
    return context.window_manager.operator_properties_last(operator)


def big_button(layout: bpy.types.UILayout, operator: str, icon: str, text: str = "", height: float = 1.2) -> None:
    """A button as wide as the panel; its text is the operator's unless one is given."""
    row = layout.row()
    row.scale_y = height
    if text:
        row.operator(operator, text=text, icon=icon)
    else:
        row.operator(operator, icon=icon)


def draw_settings(layout: bpy.types.UILayout, operator: str, properties) -> None:
    """As the operator's own module draws them; one below the other where it does not."""
    draw = getattr(sys.modules[class_of(operator).__module__], "draw_settings", None)
    if draw is not None:
        draw(layout, properties)
        return
    split(layout)
    for prop in properties.bl_rna.properties:
        if prop.identifier != "rna_type" and not prop.is_hidden:
            layout.prop(properties, prop.identifier)


def split(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """Names of settings to the left of their values; the layout itself."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    return layout
