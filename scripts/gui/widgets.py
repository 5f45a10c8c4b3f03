"""Find widgets of a panel by what they are: Blender tells the operator behind the button under the mouse.

No place of a button is written down anywhere, so that a new row in a panel moves nothing in a story.
"""

from __future__ import annotations

import bpy

# Pixels between two looks downwards: less than a button is high.
DOWN = 18
# Where rows have their buttons, as shares of the width.
PLACES = (0.5, 0.72, 0.2, 0.835, 0.63, 0.77)
FEW = 3
TURNS_TO_SEE = 2
# Where headers have their buttons.
HEADER = (0.78, 0.83)
# Turns of the wheel that move a panel by about half of what is seen, and how often that is tried.
TURNS = 4
PAGES = 12


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
        window.cursor_warp(region.x + int(x), region.y + int(y))
        # Blender sees the mouse at its next turn, however long that takes to draw, and the button at the one after.
        for _ in range(TURNS_TO_SEE):
            yield
        manager.clipboard = ""
        with bpy.context.temp_override(window=window, area=self.area, region=region):
            if bpy.ops.ui.copy_python_command_button.poll():
                bpy.ops.ui.copy_python_command_button()
        return manager.clipboard

    def seen(self, x, y):
        """As `under`, and remembered."""
        call = yield from self.under(x, y)
        if call:
            self.known[call] = self.region.view2d.region_to_view(x, y)
        return call

    def seek(self, words, places=PLACES):
        """Coordinates in the region of a button whose call holds all the words, scrolled into sight; None if none.

        First where it was seen before, then beside its relatives, then in what is in sight, and then from the top.
        """
        found = (yield from self.where_it_was(words)) or (yield from self.beside_relatives(words, places))
        found = found or (yield from self.look(words, places))
        if found:
            return found
        yield from self.scroll_to_top()
        for _ in range(PAGES):
            found = yield from self.look(words, places)
            if found or not (yield from self.scroll(5)):
                return found
        return None

    def where_it_was(self, words):
        """The button where it was seen before; None if it is there no more."""
        for call, place in list(self.known.items()):
            if matches(call, words):
                x, y = self.region.view2d.view_to_region(*place, clip=False)
                if 0 < y < self.region.height and (yield from self.under(x, y)) == call:
                    return x, y
        return None

    def beside_relatives(self, words, places):
        """The button in the rows of those that share its first words, such as omt_checker of omt_checker_remove."""
        family = "_".join(words[0].rstrip("(").split("_")[:2])
        rows = {place[1] for call, place in self.known.items() if family in call}
        for height in sorted(rows, reverse=True):
            y = self.region.view2d.view_to_region(0, height, clip=False)[1]
            for share in places if 0 < y < self.region.height else ():
                x = int(self.region.width * share)
                if matches((yield from self.seen(x, y)), words):
                    return x, y
        return None

    def look(self, words, places):
        """Such a button in what is in sight: row by row where its places are few, otherwise column by column."""
        rows = range(self.region.height - DOWN // 2, 0, -DOWN)
        every = [(share, y) for share in places for y in rows]
        if len(places) <= FEW:
            every = [(share, y) for y in rows for share in places]
        for share, y in every:
            x = int(self.region.width * share)
            if matches((yield from self.seen(x, y)), words):
                return x, y
        return None

    def scroll(self, button):
        """Turn the wheel over the sidebar; whether it moved. 4 is up, 5 down."""
        before = self.region.view2d.region_to_view(0, 0)
        window, region = bpy.context.window_manager.windows[0], self.region
        window.cursor_warp(region.x + region.width // 2, region.y + region.height // 2)
        yield from self.story.x("click", "--repeat", TURNS, button)
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
        place = region.x + int(x), window.height - (region.y + int(y))
        self.story.log("click", place, (yield from self.under(x, y)))
        yield from self.story.click(*place)
        return place

    def open(self, section):
        """Open a section of its own and close all others: Ctrl and a click on its header.

        The header has a button for its page, wm.omt_help, by which it is found.
        """
        y = yield from self.header(section)
        yield from self.story.x("keydown", "ctrl")
        yield from self.click_at(self.region.width // 4, y)
        yield from self.story.x("keyup", "ctrl")
        self.forget_below(y)
        yield from self.story.pause(0.5)

    def toggle(self, section):
        """Open or close a section, and leave others as they are; the place of its header in the region."""
        y = yield from self.header(section)
        yield from self.click_at(self.region.width // 4, y)
        self.forget_below(y)
        yield from self.story.pause(0.5)
        return self.region.width // 4, y

    def header(self, section):
        """The height in the region of a section's header."""
        self.story.log("HEADER", section)
        # The first section has no name, and is the first one of its operator.
        words = (f'section="{section}"',) if section else ("omt_help(", '"uv.omt_unwrap"')
        found = yield from self.seek(words, HEADER)
        if found is None:
            raise LookupError(f"no section of {self.kind} is {section}")
        return found[1]

    def find_sections(self):
        """Look once at all headers that are in sight, to know where they are."""
        yield from self.look(("no button has this call",), HEADER[:1])

    def forget_below(self, y):
        """What stands below a header moves when it is clicked."""
        height = self.region.view2d.region_to_view(0, y)[1]
        self.known = {call: place for call, place in self.known.items() if place[1] >= height}


def matches(call: str, words) -> bool:
    """Whether a call holds all words."""
    return bool(call) and all(word in call for word in words)
