"""Where else an artist looks: the search by "omt" and by what shall be done, the U menu, and the preferences."""

from __future__ import annotations

import bpy

ADDON = "bl_ext.user_default.omt_uv"
# What is typed, and whether the first thing found is run.
SEARCHES = (("omt", False), ("area preserving", False), ("unwrap area", True))


def tell(story):
    """Search, and run what was found; open the menu; read the preferences."""
    obj = story.head(16)
    window, view = bpy.context.window_manager.windows[0], story.area("VIEW_3D")
    bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").max_shear = 0
    story.look_at_it(view)
    for text, run in SEARCHES:
        yield from searched(story, window, view, text)
        yield from story.shoot(f"search_{text.replace(' ', '_')}")
        yield from story.key("Return" if run else "Escape")
        if not run:
            # The first one empties the field, the second one leaves it.
            yield from story.key("Escape")
    yield from story.until(lambda: not story.running() and obj.data.uv_layers, 60)
    story.facts["found and run"] = story.figures(obj)
    yield from menu(story, window, view)
    yield from preferences(story, view)


def searched(story, window, view, text):
    """A text typed into Blender's search."""
    region = story.window_region(view)
    yield from story.move(region.x + region.width // 2, window.height - (region.y + region.height // 2))
    with bpy.context.temp_override(window=window, area=view, region=region):
        bpy.ops.wm.search_menu("INVOKE_DEFAULT")
    yield from story.pause(0.5)
    yield from story.x("type", "--delay", 40, text)
    yield from story.pause(0.5)


def menu(story, window, view):
    """U in Edit Mode."""
    region = story.window_region(view)
    with bpy.context.temp_override(window=window, area=view, region=region):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
    yield from story.move(region.x + region.width // 2, window.height - (region.y + region.height // 2))
    yield from story.key("u")
    yield from story.shoot("u_menu")
    yield from story.key("Escape")


def preferences(story, view):
    """The add-on's own page, opened: what sessions start with, links, keys."""
    view.ui_type = "PREFERENCES"
    bpy.context.preferences.active_section = "ADDONS"
    bpy.context.window_manager.addon_search = "OMT"
    bpy.ops.preferences.addon_expand(module=ADDON)
    yield from story.pause(1)
    yield from story.shoot("preferences")
    config = bpy.context.window_manager.keyconfigs.user
    keys = [k for m in config.keymaps for k in m.keymap_items if "omt" in k.idname or mine(k)]
    story.facts["keys, all off"] = [len(keys), any(key.active for key in keys)]


def mine(key):
    """Whether a key opens the submenu."""
    return getattr(key.properties, "name", "") == "UV_MT_omt"
