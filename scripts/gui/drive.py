"""Runs inside Blender, in a window: a story of clicks and keys, screenshots of it, and what became of the mesh.

usage: blender --factory-startup --python drive.py -- STORY OUT      (see run.py, which prepares the window)
"""

from __future__ import annotations

import faulthandler
import importlib
import importlib.util
import json
import math
import os
import shutil
import subprocess
import sys
import time
import traceback
from pathlib import Path

import bpy

sys.path.append(str(Path(__file__).resolve().parent))
from widgets import Finder

bpy.context.preferences.view.show_splash = False
# Without a graphics card most of a story's time is drawing: no smoothing of edges, no flights of the view.
bpy.context.preferences.system.viewport_aa = "OFF"
bpy.context.preferences.view.smooth_view = 0
# A sidebar beside its view instead of upon it: what is looked at does not draw the view anew.
bpy.context.preferences.system.use_region_overlap = False
# A drag ends where the mouse was told to go: Blender otherwise takes the pointer elsewhere meanwhile.
bpy.context.preferences.inputs.use_mouse_continuous = False
PATIENCE = 240.0
# Seconds between two turns of a story, and between two looks whether something is done: looking takes time from it.
TURN = 0.02
LOOK_EVERY = 0.1
T0 = time.monotonic()
# The package as Blender knows it: an extension that was installed, or an add-on of a folder of scripts.
ADDON = os.environ.get("OMT_UV_ADDON", "omt_uv")


class Story:
    """What a story can do. Its steps are generators that yield, seconds if they like, while Blender lives on."""

    def __init__(self, out: Path):
        self.out = out
        self.facts: dict = {}
        self.clicks = 0

    def pause(self, seconds=0.3):
        """Let Blender go on for some seconds."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            yield min(left, LOOK_EVERY)

    def until(self, condition, patience=PATIENCE):
        """Let Blender go on until a condition holds; the seconds that took."""
        begin = time.monotonic()
        while not condition():
            if time.monotonic() - begin > patience:
                yield from self.shoot("waited_in_vain")
                raise TimeoutError(f"waited {patience} s in vain")
            yield LOOK_EVERY
        return time.monotonic() - begin

    def log(self, *words):
        """A line for whoever looks for what went wrong."""
        print("STORY", f"{time.monotonic() - T0:.1f} s {time.process_time():.1f} cpu", *words, flush=True)

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
        # On a busy machine, a press and a move that come together are a click, which edits the number as text.
        yield from self.pause(0.5)
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

    def drop(self, path, x, y):
        """Drop a file there, as from a file manager."""
        drop = Path(__file__).resolve().parent / "drop.py"
        process = subprocess.Popen(["python3", str(drop), str(path), str(x), str(y)])
        while process.poll() is None:
            yield
        if process.returncode:
            raise OSError("the file was not taken")

    def theme(self, word):
        """The theme whose file has a word in its name; Blender's own dark one without."""
        if not word:
            bpy.ops.preferences.reset_default_theme()
        elif not choose_theme(word):
            raise LookupError(f"no theme is {word}")

    def shoot(self, name, region=None):
        """A screenshot of the whole window, or of a region of it, mouse pointer aside."""
        self.log("SHOOT", name)
        yield from self.pause(0.4)
        if shutil.which("import"):
            # What the screen shows, whatever Blender thinks of it: 5.2 draws nothing into screenshots of its own here.
            part = [] if region is None else ["-crop", self._crop(region), "+repage"]
            process = subprocess.Popen(["import", "-window", "root", *part, str(self.out / f"{name}.png")])
            while process.poll() is None:
                yield
            return
        window = bpy.context.window_manager.windows[0]
        with bpy.context.temp_override(window=window, screen=window.screen, area=window.screen.areas[0]):
            bpy.ops.screen.screenshot(filepath=str(self.out / f"{name}.png"))
        yield from self.pause(0.1)

    def _crop(self, region):
        """A region as ImageMagick names it."""
        window = bpy.context.window_manager.windows[0]
        top = window.height - region.y - region.height
        return f"{region.width}x{region.height}+{region.x}+{top}"

    def package(self, name):
        """A module of the package, such as "session.run"."""
        return importlib.import_module(f"{ADDON}.omt_uv.{name}")

    def running(self):
        """The run in the window, or None."""
        return self.package("session.run").current

    def following(self):
        """The live session in the window, or None."""
        return self.package("session.following").current

    def said(self):
        """What the panel says about the last run: title and rows, None before the first."""
        summary = self.package("session.last_run").state.summary
        return None if summary is None else [summary.title, *summary.rows]

    def forget(self):
        """Let the panel say nothing."""
        self.package("session.last_run").forget()

    def figures(self, obj):
        """Area error, shear and folds of the active UVs, by the add-on's own measure."""
        reading = self.package("blender.mesh").read(obj)
        found = self.package("pipelines.distortion").measure_readings([reading])
        return {name: getattr(found, name) for name in ("area_l1", "angle_mean", "folds", "overlap")}

    def tab(self, kind):
        """The add-on's tab in the sidebar of an editor, opened; finds and clicks its buttons."""
        area, finder = self.area(kind), Finder(self, kind)
        area.spaces.active.show_region_ui = True
        yield from self.pause(0.5)
        region = finder.region
        if hasattr(region, "active_panel_category") and bpy.app.version >= (5, 0, 0):
            region.active_panel_category = "OMT"
            area.tag_redraw()
            yield from self.pause(0.5)
            return finder
        # Tabs stand at the right edge, one below the other: the one that brings our button is ours.
        window = bpy.context.window_manager.windows[0]
        for y in range(region.height - 20, region.height // 4, -24):
            yield from self.x("mousemove", region.x + region.width - 8, window.height - (region.y + y))
            yield from self.x("click", 1)
            yield from self.pause(0.25)
            for row in (40, 58):
                call = yield from finder.under(region.width // 2, region.height - row)
                if "omt_unwrap" in call:
                    return finder
        raise LookupError(f"no tab of {kind} is ours")

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


def choose_theme(word):
    """One of Blender's own themes, by a word of its name; whether there is one."""
    for folder in bpy.utils.preset_paths("interface_theme"):
        for path in Path(folder).glob(f"*{word}*.xml"):
            bpy.ops.script.execute_preset(filepath=str(path), menu_idname="USERPREF_MT_interface_theme_presets")
            return True
    return False


def main():
    """Play the story, step by step from a timer, and write what it found."""
    story_path, out = map(Path, sys.argv[sys.argv.index("--") + 1 :])
    out.mkdir(parents=True, exist_ok=True)
    # Blender's own handler has no Python of other threads; the file stays open as long as Blender lives.
    faulthandler.enable((out / "stacks.log").open("w"))
    if "OMT_UV_SITE" in os.environ:
        sys.path.append(os.environ["OMT_UV_SITE"])
        bpy.ops.preferences.addon_enable(module=ADDON)
    if os.environ.get("OMT_UV_THEME"):
        choose_theme("Light")
    spec = importlib.util.spec_from_file_location("story", story_path)
    story_module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(story_module)
    story = Story(out)
    told = story_module.tell(story)
    story.log("READY")

    def go_on():
        try:
            return next(told) or TURN
        except StopIteration:
            story.facts["finished"] = True
        except Exception:  # noqa: BLE001, whatever a story stumbles over is told, and an end that is no success
            story.facts["error"] = traceback.format_exc()
        (out / "facts.json").write_text(json.dumps(story.facts, indent=1))
        os._exit(0 if "finished" in story.facts else 1)

    bpy.app.timers.register(go_on, first_interval=1.5)


try:
    main()
except Exception:  # noqa: BLE001, it is told, where Blender would stay open with nothing to play
    out = Path(sys.argv[-1])
    out.mkdir(parents=True, exist_ok=True)
    (out / "facts.json").write_text(json.dumps({"error": traceback.format_exc()}))
    os._exit(1)
