"""Runs inside Blender, in a window: a story of clicks and keys, screenshots of it, and what became of the mesh.

usage: blender --factory-startup --python drive.py -- STORY OUT      (see run.py, which prepares the window)
"""

from __future__ import annotations

import importlib.util
import json
import os
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy

bpy.context.preferences.view.show_splash = False
PATIENCE = 60.0


class Story:
    """What a story can do. Its steps are generators that yield while Blender goes on living."""

    def __init__(self, out: Path):
        self.out = out
        self.facts: dict = {}
        self.clicks = 0

    def pause(self, seconds=0.3):
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            yield

    def until(self, condition, patience=PATIENCE):
        begin = time.monotonic()
        while not condition():
            if time.monotonic() - begin > patience:
                raise TimeoutError(f"waited {patience} s in vain")
            yield
        return time.monotonic() - begin

    def _x(self, *words):
        """xdotool, without waiting in a way that would stop the window it talks to."""
        process = subprocess.Popen(["xdotool", *map(str, words)])
        while process.poll() is None:
            yield

    def move(self, x, y):
        yield from self._x("mousemove", x, y)
        yield from self.pause(0.2)

    def click(self, x, y, button=1):
        self.clicks += 1
        yield from self.move(x, y)
        yield from self._x("click", button)
        yield from self.pause()

    def drag(self, start, end, steps=12, keep=None):
        """Press at the start, move to the end, look with `keep` at every place, and let go."""
        yield from self.move(*start)
        yield from self._x("mousedown", 1)
        for k in range(1, steps + 1):
            place = [round(a + (b - a) * k / steps) for a, b in zip(start, end, strict=True)]
            yield from self._x("mousemove", *place)
            yield from self.pause(0.15)
            if keep:
                keep()
        yield from self._x("mouseup", 1)
        yield from self.pause()

    def key(self, name):
        yield from self._x("key", name)
        yield from self.pause()

    def shoot(self, name):
        """A screenshot of the whole window, mouse pointer aside."""
        yield from self.pause(0.4)
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, screen=window.screen, area=window.screen.areas[0]):
            bpy.ops.screen.screenshot(filepath=str(self.out / f"{name}.png"))
        yield from self.pause(0.1)

    def area(self, kind):
        return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind)

    def place(self, kind, from_right, from_top):
        """Screen coordinates of a place in an area, counted from its upper right corner."""
        area, window = self.area(kind), bpy.context.window_manager.windows[0]
        return area.x + area.width - from_right, window.height - (area.y + area.height - from_top)


def main():
    story_path, out = map(Path, sys.argv[sys.argv.index("--") + 1 :])
    out.mkdir(parents=True, exist_ok=True)
    sys.path.append(os.environ["OMT_UV_SITE"])
    bpy.ops.preferences.addon_enable(module="omt_uv")
    spec = importlib.util.spec_from_file_location("story", story_path)
    story_module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(story_module)
    story = Story(out)
    told = story_module.tell(story)

    def go_on():
        try:
            next(told)
            return 0.05
        except StopIteration:
            story.facts["finished"] = True
        except Exception:  # noqa: BLE001, it is told
            story.facts["error"] = traceback.format_exc()
        (out / "facts.json").write_text(json.dumps(story.facts, indent=1))
        os._exit(0)

    bpy.app.timers.register(go_on, first_interval=1.5)


main()
