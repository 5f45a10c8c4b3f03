"""Every section of the tab by itself, in the dark and in the light theme, and some in German: nothing is cut off."""

from __future__ import annotations

import bpy

# Pixels: narrower than Blender makes it.
WIDTH = 280
# Sections from the last one upwards: what stands above the open one does not move.
SECTIONS = ("volume", "flow", "match", "sphere", "partition", "remesh", "magnify", "arrange", "inspect", "result", "")
# Sections that stand in others, from the last one upwards, too.
INSIDE = {
    "magnify": ("magnify_image", "magnify_more", "weights"),
    "inspect": ("density",),
    "": ("queue", "seams", "refine", "more"),
}
IN_GERMAN = ("match", "remesh", "magnify", "inspect", "")


def tell(story):
    """In an editor that has little to draw."""
    obj = story.head(12)
    obj.vertex_groups.new(name="Nose")
    window = bpy.context.window_manager.windows[0]
    area = story.area("VIEW_3D")
    area.ui_type = "UV"
    yield from story.pause(0.5)
    with bpy.context.temp_override(window=window, area=area):
        bpy.ops.screen.screen_full_area()
    yield from story.pause(0.5)
    with bpy.context.temp_override(window=window):
        bpy.ops.uv.omt_unwrap("EXEC_DEFAULT")
    tab = yield from story.tab("IMAGE_EDITOR")
    yield from narrow(story, tab)
    story.facts["width"] = tab.region.width
    story.facts["sections"] = []
    yield from tab.open("result")
    yield from tab.toggle("result")
    yield from tab.find_sections()
    for name in SECTIONS:
        yield from tab.open(name)
        yield from look(story, tab, name)
        for inner in INSIDE.get(name, ()):
            place = yield from tab.toggle(inner)
            yield from look(story, tab, inner)
            yield from tab.click_at(*place)


def narrow(story, tab):
    """The sidebar as wide as WIDTH, its tabs included: its left edge is dragged there."""
    region, window = tab.region, bpy.context.window_manager.windows[0]
    start, y = region.x, window.height - (region.y + region.height // 8)
    yield from story.drag((start, y), (start + region.width - WIDTH, y), steps=4)
    yield from story.pause(0.5)


def look(story, tab, name):
    """The section in both themes."""
    story.facts["sections"].append(name)
    title = name or "unwrap"
    yield from story.shoot(f"{title}_dark", tab.region)
    story.theme("Light")
    yield from story.shoot(f"{title}_light", tab.region)
    story.theme("")
    if name in IN_GERMAN:
        yield from in_german(story, tab, title)


def in_german(story, tab, title):
    """Words are longer there."""
    view = bpy.context.preferences.view
    if "de_DE" not in [item.identifier for item in view.bl_rna.properties["language"].enum_items]:
        return
    before = view.language
    view.language, view.use_translate_interface = "de_DE", True
    yield from story.shoot(f"{title}_german", tab.region)
    view.language = before
