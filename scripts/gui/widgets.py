"""Find widgets of a panel by what they are: Blender tells the operator behind the button under the mouse.

No place of a button is written down anywhere, so that a new row in a panel moves nothing in a story.
"""

from __future__ import annotations

import bpy

# Pixels between two looks, down and across; a button is higher and wider.
DOWN = 12
PLACES = (0.5, 0.63, 0.72, 0.2, 0.77, 0.835)
TURNS_TO_SEE = 2
BESIDE = (0.2, 0.8, 0.5, 0.35, 0.65)
# Where headers have their buttons.
HEADER = (0.83, 0.78)
# Turns of the wheel that move a panel by about half of what is seen.
TURNS = 4


class Finder:
    """Buttons of the sidebar of an editor, by the call behind them; `story` moves the mouse."""

    def __init__(self, story, kind: str):
        self.story, self.kind = story, kind
        # Where buttons were seen, by their calls, in coordinates that scrolling does not change.
        self.known: dict[str, tuple[float, float]] = {}

    @property
    def area(self):
        return self.story.area(self.kind)

    @property
    def region(self):
        """The sidebar."""
        return next(r for r in self.area.regions if r.type == "UI")

    def under(self, x, y):
        """The call behind the button at a place of the region, such as bpy.ops.uv.omt_unwrap(); empty if none."""
        window, region = bpy.context.window_manager.windows[0], self.region
        manager = bpy.context.window_manager
        window.cursor_warp(region.x + x, region.y + y)
        # Blender sees the mouse at its next turn, however long that takes to draw, and the button at the one after.
        for _ in range(TURNS_TO_SEE):
            yield
        manager.clipboard = ""
        with bpy.context.temp_override(window=window, area=self.area, region=region):
            if bpy.ops.ui.copy_python_command_button.poll():
                bpy.ops.ui.copy_python_command_button()
        return manager.clipboard

    def seek(self, words, places=PLACES):
        """Coordinates in the region of a button whose call holds all the words, scrolled into sight; None if none."""
        for call, place in list(self.known.items()):
            if all(word in call for word in words):
                x, y = self.region.view2d.view_to_region(*place, clip=False)
                if 0 < y < self.region.height and (yield from self.under(x, y)) == call:
                    return x, y
        for call, (_, height) in list(self.known.items()):
            # Buttons of one operator stand beside one another as a rule.
            if words[0] in call:
                y = self.region.view2d.view_to_region(0, height, clip=False)[1]
                for share in BESIDE if 0 < y < self.region.height else ():
                    x = int(self.region.width * share)
                    found = yield from self.seen(x, y)
                    if all(word in found for word in words):
                        return x, y
        yield from self.scroll_to_top()
        for _ in range(12):
            found = yield from self.look(words, places)
            if found is not None or not (yield from self.scroll(5)):
                return found
        return None

    def look(self, words, places):
        """Coordinates of such a button in what is in sight: in the middle first, then beside buttons seen there."""
        region, rows = self.region, []
        every = range(region.height - DOWN, DOWN, -DOWN)
        for y in every:
            call = yield from self.seen(int(region.width * places[0]), y)
            if all(word in call for word in words):
                return int(region.width * places[0]), y
            if call:
                rows.append(y)
        # Rows of several buttons have one in the middle as a rule.
        for y in [*rows, *(y for y in every if y not in rows)]:
            for x in (int(region.width * share) for share in places[1:]):
                call = yield from self.seen(x, y)
                if call and all(word in call for word in words):
                    return x, y
        return None

    def seen(self, x, y):
        """As `under`, and remembered."""
        call = yield from self.under(x, y)
        if call:
            self.known[call] = self.region.view2d.region_to_view(x, y)
        return call

    def scroll(self, button):
        """Turn the wheel over the sidebar; whether it moved. 4 is up, 5 down."""
        before = self.region.view2d.region_to_view(0, 0)
        window, region = bpy.context.window_manager.windows[0], self.region
        window.cursor_warp(region.x + region.width // 2, region.y + region.height // 2)
        for _ in range(TURNS):
            yield from self.story.x("click", button)
        yield from self.story.pause(0.3)
        return self.region.view2d.region_to_view(0, 0) != before

    def scroll_to_top(self):
        """Have the first section in sight."""
        while (yield from self.scroll(4)):
            pass

    def click(self, *words, places=PLACES):
        """Find a button and click it; the place on the screen."""
        found = yield from self.seek(words, places)
        if found is None:
            raise LookupError(f"no button of {self.kind} is {' '.join(words)}")
        return (yield from self.click_at(*found))

    def click_at(self, x, y):
        """Click at a place of the region; the place on the screen."""
        window, region = bpy.context.window_manager.windows[0], self.region
        place = region.x + x, window.height - (region.y + y)
        self.story.log("click", place, (yield from self.under(x, y)))
        yield from self.story.click(*place)
        return place

    def open(self, section):
        """Open or close a section by its header: it has a button for its page of the documentation."""
        found = yield from self.seek((f"#{section}",), HEADER)
        if found is None:
            raise LookupError(f"no section of {self.kind} is {section}")
        yield from self.click_at(self.region.width // 4, found[1])
