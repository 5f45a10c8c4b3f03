"""Runs inside Blender, in a window: a story of clicks and keys, screenshots of it, and what became of the mesh.

usage: blender --factory-startup --python drive.py -- STORY OUT      (see run.py, which prepares the window)
"""

from __future__ import annotations

import faulthandler
import importlib.util
import json
import math
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
        """Let Blender go on for some seconds."""
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            yield

    def until(self, condition, patience=PATIENCE):
        """Let Blender go on until a condition holds; the seconds that took."""
        begin = time.monotonic()
        while not condition():
            if time.monotonic() - begin > patience:
                raise TimeoutError(f"waited {patience} s in vain")
            yield
        return time.monotonic() - begin

    def x(self, *words):
        """xdotool, without waiting in a way that would stop the window it talks to."""
        process = subprocess.Popen(["xdotool", *map(str, words)])
        while process.poll() is None:
            yield

    def move(self, x, y):
        """Move the mouse to a place on the screen."""
        yield from self.x("mousemove", x, y)
        yield from self.pause(0.2)

    def click(self, x, y, button=1):
        """Move there and click; clicks are counted."""
        self.clicks += 1
        yield from self.move(x, y)
        yield from self.x("click", button)
        yield from self.pause()

    def drag(self, start, end, steps=12, keep=None):
        """Press at the start, move to the end, look with `keep` at every place, and let go."""
        yield from self.move(*start)
        yield from self.x("mousedown", 1)
        for k in range(1, steps + 1):
            place = [round(a + (b - a) * k / steps) for a, b in zip(start, end, strict=True)]
            yield from self.x("mousemove", *place)
            yield from self.pause(0.15)
            if keep:
                keep()
        yield from self.x("mouseup", 1)
        yield from self.pause()

    def key(self, name):
        """Press and release a key."""
        yield from self.x("key", name)
        yield from self.pause()

    def shoot(self, name):
        """A screenshot of the whole window, mouse pointer aside."""
        yield from self.pause(0.4)
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, screen=window.screen, area=window.screen.areas[0]):
            bpy.ops.screen.screenshot(filepath=str(self.out / f"{name}.png"))
        yield from self.pause(0.1)

    def running(self):
        """The run in the window, or None."""
        from omt_uv.omt_uv.session import run

        return run.current

    def said(self):
        """What the panel says about the last run: title and rows, None before the first."""
        from omt_uv.omt_uv.session import last_run

        summary = last_run.state.summary
        return None if summary is None else [summary.title, *summary.rows]

    def forget(self):
        """Let the panel say nothing."""
        from omt_uv.omt_uv.session import last_run

        last_run.forget()

    def figures(self, obj):
        """Area error, shear and folds of the active UVs, by the add-on's own measure."""
        from omt_uv.omt_uv.blender import mesh as blender_mesh
        from omt_uv.omt_uv.pipelines import distortion as measuring

        found = measuring.measure_readings([blender_mesh.read(obj)])
        return {name: getattr(found, name) for name in ("area_l1", "angle_mean", "folds", "overlap")}

    def area(self, kind):
        """The first area of a kind, such as "VIEW_3D"."""
        return next(a for a in bpy.context.window_manager.windows[0].screen.areas if a.type == kind)

    def place(self, kind, from_right, from_top):
        """Screen coordinates of a place in an area, counted from its upper right corner."""
        area, window = self.area(kind), bpy.context.window_manager.windows[0]
        return area.x + area.width - from_right, window.height - (area.y + area.height - from_top)

    def window_region(self, area):
        """The main region of an area."""
        return next(r for r in area.regions if r.type == "WINDOW")

    def look_at_it(self, view):
        """From the front and a little above."""
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, area=view, region=self.window_region(view)):
            bpy.ops.view3d.view_axis(type="RIGHT")
            bpy.ops.view3d.view_selected()
            bpy.ops.view3d.view_orbit(type="ORBITUP")

    def open_tab(self, place):
        """The add-on's tab beside the object that was made, by a click at a place in the 3D View."""
        yield from self.pause(1)
        view = self.area("VIEW_3D")
        view.spaces.active.show_region_ui = True
        self.look_at_it(view)
        yield from self.pause(1)
        yield from self.click(*self.place("VIEW_3D", *place))

    def head(self, count):
        """A bust of quads instead of the cube, open at the neck, selected."""
        points, faces = _head(count)
        if "Cube" in bpy.data.objects:
            bpy.data.objects.remove(bpy.data.objects["Cube"])
        mesh = bpy.data.meshes.new("Head")
        mesh.from_pydata(points, [], faces)
        mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
        obj = bpy.data.objects.new("Head", mesh)
        bpy.context.collection.objects.link(obj)
        bpy.context.view_layer.objects.active = obj
        obj.select_set(True)
        return obj


def _head(count):
    points, faces = [], []
    for k in range(1, count + 1):
        for s in range(count):
            t, a = math.pi * 0.85 * k / count, 2 * math.pi * s / count
            points.append((math.sin(t) * math.cos(a), 0.8 * math.sin(t) * math.sin(a), 1.2 * math.cos(t)))
    for k in range(count - 1):
        for s in range(count):
            n = (s + 1) % count
            faces.append((k * count + s, (k + 1) * count + s, (k + 1) * count + n, k * count + n))
    faces.append(tuple(range(count)))
    for centre, amount, width in (((1, 0, 0), 0.5, 0.2), ((0, 1, 0.1), 0.4, 0.25), ((0, -1, 0.1), 0.4, 0.25)):
        for k, p in enumerate(points):
            d = sum((x - c) ** 2 for x, c in zip(p, centre, strict=True))
            factor = 1 + amount * math.exp(-d / (2 * width**2))
            points[k] = tuple(factor * x for x in p)
    return points, faces


def main():
    """Play the story, step by step from a timer, and write what it found."""
    story_path, out = map(Path, sys.argv[sys.argv.index("--") + 1 :])
    out.mkdir(parents=True, exist_ok=True)
    # Blender's own handler has no Python of other threads; the file stays open as long as Blender lives.
    faulthandler.enable((out / "stacks.log").open("w"))
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
