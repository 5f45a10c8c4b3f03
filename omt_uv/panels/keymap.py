"""Keys for the artist to turn on in the preferences: they are off, so that no key of Blender's changes by itself."""

from __future__ import annotations

from dataclasses import dataclass

import bpy


@dataclass(frozen=True)
class Key:
    """A key in one of Blender's key maps; menu: of the call that it makes, for `wm.call_menu`."""

    keymap: str
    space: str
    operator: str
    menu: str = ""
    key: str = "U"
    shift: bool = False
    alt: bool = False


KEYS = (
    Key("Mesh", "EMPTY", "wm.call_menu", menu="UV_MT_omt", shift=True, alt=True),
    Key("Object Mode", "EMPTY", "wm.call_menu", menu="UV_MT_omt", shift=True, alt=True),
    Key("UV Editor", "EMPTY", "wm.call_menu", menu="UV_MT_omt", shift=True, alt=True),
    Key("Mesh", "EMPTY", "uv.omt_unwrap", alt=True),
    Key("UV Editor", "EMPTY", "uv.omt_unwrap", alt=True),
    Key("UV Editor", "EMPTY", "uv.omt_live", key="L", alt=True, shift=True),
)

_made: list[tuple] = []


def register() -> None:
    """Put the keys into the add-ons' key configuration, off; nothing where there is no window."""
    config = bpy.context.window_manager.keyconfigs.addon if bpy.context.window_manager else None
    if config is None:
        return
    for each in KEYS:
        keymap = config.keymaps.new(name=each.keymap, space_type=each.space)
        item = keymap.keymap_items.new(each.operator, each.key, "PRESS", shift=each.shift, alt=each.alt)
        if each.menu:
            item.properties.name = each.menu
        item.active = False
        _made.append((keymap, item))


def unregister() -> None:
    while _made:
        keymap, item = _made.pop()
        keymap.keymap_items.remove(item)


def draw(layout: bpy.types.UILayout, context: bpy.types.Context) -> None:
    """The keys as the artist has them, to turn on and to change."""
    import rna_keymap_ui

    config = context.window_manager.keyconfigs.user
    for keymap, item in _made:
        mine = config.keymaps.get(keymap.name)
        for found in mine.keymap_items if mine else ():
            same_menu = getattr(found.properties, "name", "") == getattr(item.properties, "name", "")
            if found.idname == item.idname and same_menu:
                row = layout.column()
                row.label(text=keymap.name)
                rna_keymap_ui.draw_kmi([], config, mine, found, row, 0)
                break
