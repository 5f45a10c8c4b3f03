"""Keep what is chosen once for all files: Edit > Preferences > Add-ons > OMT UV."""

from __future__ import annotations

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, StringProperty

from .. import links
from ..session import run
from ..settings import (
    BOUNDARIES,
    DEFAULT_BALANCE,
    DEFAULT_BOUNDARY,
    DEFAULT_MARGIN,
    DEFAULT_MAX_SHEAR,
    DEFAULT_QUALITY,
    DEFAULT_TEXTURE_SIZE,
    QUALITIES,
)
from . import keymap, welcome

# The package that Blender knows as the add-on contains this one.
PACKAGE = __package__.rpartition(".")[0]
ADDON = PACKAGE.rpartition(".")[0] or PACKAGE
DEFAULTS = ("boundary", "quality", "balance", "max_shear", "margin", "texture_size", "keep_free")
OPERATORS = (
    *("UV_OT_omt_unwrap", "UV_OT_omt_refine", "UV_OT_omt_magnify", "UV_OT_omt_sphere", "UV_OT_omt_seams"),
    "UV_OT_omt_density_set",
)


# How often, and after how many seconds, the tab is looked for where it does not exist yet.
LOOKS = 300
LOOK_AGAIN = 0.2


def _changed(self, context: bpy.types.Context) -> None:
    apply(self, context)


class OMTUVPreferences(bpy.types.AddonPreferences):
    """What operators start with in a new session, and on how many cores they solve."""

    bl_idname = ADDON

    boundary: EnumProperty(
        name="Boundary",
        description="Outline of every island that operators start with",
        items=BOUNDARIES,
        default=DEFAULT_BOUNDARY,
        update=_changed,
    )
    quality: EnumProperty(
        name="Quality",
        description="How exact the areas become that operators start with",
        items=QUALITIES,
        default=DEFAULT_QUALITY,
        update=_changed,
    )
    balance: FloatProperty(
        name="Area - Angle",
        description="Balance that operators start with, from 0, exact areas, to 1, least shear",
        default=DEFAULT_BALANCE,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        update=_changed,
    )
    max_shear: FloatProperty(
        name="Max Shear",
        description="Mean shear above which unwrapping adds seams. 0: none but those that are needed",
        default=DEFAULT_MAX_SHEAR,
        min=0.0,
        soft_max=3.0,
        update=_changed,
    )
    margin: IntProperty(
        name="Margin",
        description="Least distance between islands that operators start with, in pixels of the texture",
        default=DEFAULT_MARGIN,
        min=0,
        max=1024,
        soft_max=64,
        subtype="PIXEL",
        update=_changed,
    )
    keep_free: StringProperty(
        name="Keep Free", description="Vertex group that new cuts avoid, where a mesh has it", update=_changed
    )
    texture_size: IntProperty(
        name="Texture Size",
        description="Width of your textures, in pixels: margins and texel densities refer to it",
        default=DEFAULT_TEXTURE_SIZE,
        min=16,
        max=65536,
        subtype="PIXEL",
        update=_changed,
    )
    own_thread: BoolProperty(
        name="Solve on a Second Core",
        description="Keep the window fluid during a run. Without it Blender pauses for every large linear system",
        default=True,
        update=_changed,
    )

    tab_was_shown: BoolProperty(
        name="Tab Was Shown",
        description="The sidebar was opened at the tab once, after the installation",
        default=False,
        options={"HIDDEN"},
    )

    def draw(self, context: bpy.types.Context) -> None:
        layout = self.layout
        layout.use_property_split = True
        layout.label(text="New sessions start with")
        for name in DEFAULTS:
            layout.prop(self, name)
        layout.separator()
        layout.prop(self, "own_thread")
        row = layout.row()
        row.operator("wm.omt_help", text="Documentation", icon="HELP")
        if links.BUGS:
            row.operator("wm.url_open", text="Report a Bug", icon="URL").url = links.BUGS
        row.operator("wm.omt_copy_report", icon="COPYDOWN")
        layout.separator()
        layout.use_property_split = False
        layout.label(text="Keys: off until you turn them on")
        keymap.draw(layout.column(), context)


def get(context: bpy.types.Context) -> OMTUVPreferences | None:
    """The preferences; None where the package is used without the add-on."""
    addon = context.preferences.addons.get(ADDON)
    return addon.preferences if addon else None


def apply(preferences, context: bpy.types.Context) -> None:
    """Let operators start from the preferences, as if they had been chosen in the panel."""
    run.threads = preferences.own_thread
    for name in OPERATORS:
        if not hasattr(bpy.types, name):
            continue
        group, _, verb = name.partition("_OT_")
        chosen = context.window_manager.operator_properties_last(f"{group.lower()}.{verb}")
        for setting in DEFAULTS:
            if setting in chosen.bl_rna.properties and _is_same(chosen, preferences, setting):
                setattr(chosen, setting, getattr(preferences, setting))


def _is_same(chosen, preferences, setting: str) -> bool:
    """Whether a setting comes with one default in both: Magnify has a bound of the shear of its own."""
    mine, theirs = (each.bl_rna.properties[setting].default for each in (preferences, chosen))
    return mine == theirs


def apply_soon() -> None:
    """Once Blender is up: an add-on that is being registered has no window manager yet."""
    if not bpy.app.background:
        bpy.app.timers.register(_apply, first_interval=0.0)


def _apply() -> None:
    preferences = get(bpy.context)
    if preferences is not None:
        apply(preferences, bpy.context)
        if not preferences.tab_was_shown:
            looks = iter(range(LOOKS))
            bpy.app.timers.register(lambda: show_once(looks), first_interval=LOOK_AGAIN)


def show_once(looks) -> float | None:
    """Open the tab, as soon as it exists, and never again; seconds until the next look."""
    preferences = get(bpy.context)
    if preferences is None or next(looks, None) is None:
        return None
    if not welcome.show_tab():
        return LOOK_AGAIN
    preferences.tab_was_shown = True
    bpy.context.preferences.is_dirty = True
    return None
