"""What somebody does in a window, event by event: dragging, picking, runs that are stopped, live islands, and one
operator after the other, where the second goes by what the first has left."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import bpy

import bmesh
import numpy as np
import scenes
from mathutils import Matrix
from sphere_shapes import blob
from windows import Window, event

# A story: the state it begins in, and what happens; each step is told by what has been done.
Steps = Iterator[str]
STORIES: dict[str, tuple[str, Callable[[Stage], Steps]]] = {}


class View:
    """A view from above of 200 by 100 pixels, of which 50 are a unit, as its region and itself tell of it."""

    width, height = 200, 100
    type, is_perspective, view_perspective = "WINDOW", False, "ORTHO"
    view_matrix = Matrix()
    perspective_matrix = Matrix.Diagonal((1 / 2, 1 / 1, -1 / 100, 1))
    view2d = SimpleNamespace(region_to_view=lambda x, y: (x / 200, y / 100))


class Stage:
    """A window, the operators that were begun in it, and what the last one gave back."""

    def __init__(self, package) -> None:
        self.package, self.window = package, Window(region=View, region_data=View)
        self.begun: list = []
        self.gave: set[str] = set()

    def begin(self, name: str, area: str = "VIEW_3D", at: tuple = (100, 50), **settings):
        """Click the button of an operator, with the mouse over an area of a kind."""
        self.window.area.type = area
        operator = scenes.stand_in(name, **settings)
        self.begun.append(operator)
        self.gave = operator.invoke(self.window, event("LEFTMOUSE", at=at))

    def hear(self, kind: str, value: str = "PRESS", at: tuple = (100, 50)) -> str:
        """An event that the operator which was begun last hears."""
        self.gave = self.begun[-1].modal(self.window, event(kind, value, at))
        return f"{kind} {value} {at[0]} {at[1]}"

    def ticks(self, most: int) -> str:
        """So many ticks of the timer, as long as something runs."""
        for _ in range(most):
            if "RUNNING_MODAL" in self.gave or "PASS_THROUGH" in self.gave:
                self.hear("TIMER", "NOTHING")
        return f"{most} ticks"

    def call(self, name: str, **settings) -> str:
        """An operator that a script runs, all at once."""
        operator = scenes.stand_in(name, **settings)
        self.begun.append(operator)
        self.gave = operator.execute(self.window)
        plain = [f"{key}={Path(value).name if isinstance(value, str) else value}" for key, value in settings.items()]
        return " ".join([name, *plain])

    def told(self) -> dict[str, str]:
        """What operators have said, and what the window shows."""
        found = {"gives": " ".join(sorted(self.gave)), "hint": str(self.window.hints[-1])}
        found["window"] = f"{len(self.window.timers)} {len(self.window.listeners)} {len(self.window.menus)}"
        found["clipboard"] = self.window.window_manager.clipboard.replace("\t", " ").replace("\n", " / ")
        said = [f"{min(kind)} {text}" for operator in self.begun for kind, text in operator.reports]
        return found | {f"says {k}": text for k, text in enumerate(said)}


def _story(*states: str):
    """Keep a function as the stories of its name, in some states."""

    def keep(steps: Callable) -> Callable:
        for state in states:
            STORIES[f"{state}, {steps.__name__.strip('_').replace('_', ' ')}"] = state, steps
        return steps

    return keep


def _chosen_vertices() -> None:
    """Some vertices of the two objects, in any mode, and no faces."""
    for k, name in enumerate("AB"):
        obj = bpy.data.objects[name]
        if obj.mode == "EDIT":
            edit = bmesh.from_edit_mesh(obj.data)
            for face in edit.faces:
                face.select = False
            for vertex in edit.verts:
                vertex.select = vertex.index in (6 + k, 7)
            edit.select_mode = {"VERT"}
            bmesh.update_edit_mesh(obj.data)


@_story("edited", "patches")
def _drag_of_vertices_that_is_kept(on: Stage) -> Steps:
    _chosen_vertices()
    on.begin("object.omt_flow", result="MESH", keep_group="second", radius=0.3)
    yield "begun"
    yield on.hear("MOUSEMOVE", "NOTHING", (112, 56))
    yield on.hear("WHEELUPMOUSE", at=(112, 56))
    yield on.hear("MOUSEMOVE", "NOTHING", (92, 53))
    yield on.hear("LEFTMOUSE", at=(92, 53))


@_story("edited")
def _drag_of_vertices_that_is_taken_back(on: Stage) -> Steps:
    _chosen_vertices()
    on.begin("object.omt_flow")
    on.hear("MOUSEMOVE", "NOTHING", (112, 56))
    yield on.hear("WHEELDOWNMOUSE", at=(112, 56))
    yield on.hear("RIGHTMOUSE", at=(112, 56))


@_story("edited", "patches")
def _push_that_is_kept(on: Stage) -> Steps:
    on.begin("uv.omt_flow", "IMAGE_EDITOR", radius=0.3)
    yield "begun"
    on.hear("LEFTMOUSE", at=(60, 30))
    yield on.hear("MOUSEMOVE", "NOTHING", (72, 31))
    yield on.hear("WHEELUPMOUSE", at=(72, 31))
    yield on.hear("MOUSEMOVE", "NOTHING", (70, 33))
    yield on.hear("LEFTMOUSE", "RELEASE", (70, 33))


@_story("patches")
def _push_that_is_taken_back(on: Stage) -> Steps:
    on.begin("uv.omt_flow", "IMAGE_EDITOR", radius=0.3)
    on.hear("LEFTMOUSE", at=(60, 30))
    on.hear("MOUSEMOVE", "NOTHING", (72, 31))
    yield on.hear("WHEELDOWNMOUSE", at=(72, 31))
    yield on.hear("ESC", at=(72, 31))


def _pixel(x: float, y: float) -> tuple[float, float]:
    return (100 + 50 * x, 50 + 50 * y)


def _from_above() -> None:
    """Nothing is above the two objects."""
    for name in ("Wall", "Child", "Double", "Linked"):
        bpy.data.objects[name].hide_set(True)


@_story("bodies")
def _landmarks_that_are_picked(on: Stage) -> Steps:
    _from_above()
    on.begin("object.omt_landmarks")
    yield "begun"
    yield on.hear("LEFTMOUSE", at=_pixel(0.3, 0.0))
    yield on.hear("MOUSEMOVE", "NOTHING", _pixel(0.4, -0.2))
    on.hear("LEFTMOUSE", "RELEASE")
    yield on.hear("MOUSEMOVE", "NOTHING", _pixel(0.2, -0.4))
    yield on.hear("LEFTMOUSE", at=_pixel(2.6, 0.5))
    on.hear("LEFTMOUSE", "RELEASE")
    on.hear("M")
    yield on.hear("LEFTMOUSE", at=_pixel(2.3, 0.2))
    on.hear("LEFTMOUSE", "RELEASE")
    yield on.hear("BACK_SPACE")
    yield on.hear("LEFTMOUSE", at=_pixel(9.0, 9.0))
    yield on.hear("WHEELUPMOUSE")
    yield on.hear("RET")
    yield on.call("object.omt_landmarks_clear", prefix="other")
    yield on.call("object.omt_landmarks_clear")


@_story("bodies")
def _landmarks_that_are_taken_back(on: Stage) -> Steps:
    _from_above()
    on.begin("object.omt_landmarks", mirrored=True)
    yield on.hear("LEFTMOUSE", at=_pixel(0.3, 0.0))
    yield on.hear("ESC")


@_story("patches", "edited")
def _run_that_comes_to_its_end(on: Stage) -> Steps:
    on.begin("uv.omt_unwrap", quality="DRAFT", max_shear=0.0, tile=1012, mark_seams=True)
    yield "begun"
    yield on.ticks(4)
    on.hear("MOUSEMOVE", "NOTHING")
    yield on.hear("A")
    yield on.ticks(900)


@_story("patches")
def _run_that_is_stopped(on: Stage) -> Steps:
    on.begin("uv.omt_refine", quality="DRAFT")
    on.ticks(5)
    yield on.hear("ESC")


@_story("patches")
def _run_whose_mesh_is_changed(on: Stage) -> Steps:
    on.begin("uv.omt_unwrap", quality="DRAFT", max_shear=0.0)
    on.ticks(3)
    bpy.data.objects["A"].data.vertices[3].co.x += 0.1
    bpy.context.view_layer.update()
    yield on.ticks(900)


@_story("patches", "one linked")
def _queue(on: Stage) -> Steps:
    last = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    last.quality, last.max_shear, last.tile, last.keep_free = "DRAFT", 0.0, 1003, "part"
    last.use_subdivision, last.mark_seams = False, True
    on.begin("uv.omt_queue")
    yield "begun"
    yield on.ticks(40)
    yield on.ticks(900)


@_story("bodies")
def _queue_that_is_stopped(on: Stage) -> Steps:
    last = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    last.quality, last.max_shear = "DRAFT", 0.0
    on.begin("uv.omt_queue", limit=0.0)
    queue = on.package("session.queue")
    for _ in range(900):
        if any(job.state == "DONE" for job in queue.state.jobs):
            break
        on.ticks(1)
    yield "one is done"
    on.hear("ESC")
    yield on.ticks(3)


@_story("patches")
def _queue_of_which_one_goes(on: Stage) -> Steps:
    last = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    last.quality, last.max_shear, last.pack = "DRAFT", 0.0, False
    on.begin("uv.omt_queue")
    bpy.data.objects.remove(bpy.data.objects["A"])
    yield on.ticks(900)


def _slider(balance: float) -> None:
    bpy.context.window_manager.operator_properties_last("uv.omt_unwrap").balance = balance


def _moved_pin(name: str) -> None:
    """The pins of an object in Edit Mode, put somewhere else."""
    edit = bmesh.from_edit_mesh(bpy.data.objects[name].data)
    edit.verts.ensure_lookup_table()
    layer = edit.loops.layers.uv.active
    for loop in edit.verts[2].link_loops:
        loop[layer].uv = (loop[layer].uv[0] + 0.03, loop[layer].uv[1] - 0.02)


def _live(on: Stage, end: str, **settings) -> Steps:
    last = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    last.margin, last.tile = 20, 1002
    on.begin("uv.omt_live", "IMAGE_EDITOR", **settings)
    yield "begun"
    _slider(0.9)
    yield on.ticks(12)
    if bpy.context.mode == "EDIT_MESH":
        _moved_pin("A")
        yield on.ticks(12)
    _slider(0.2)
    on.ticks(12)
    yield on.hear(end)


@_story("edited", "patches", "active not selected")
def _live_that_is_accepted(on: Stage) -> Steps:
    for obj in bpy.data.objects:
        if obj.type == "MESH" and not obj.data.is_editmode and not obj.library and obj.data.uv_layers:
            scenes.pin(obj, [], "Second")
    yield from _live(on, "RET")


@_story("edited")
def _live_of_some_faces_without_pins(on: Stage) -> Steps:
    scenes.leave_edit()
    for name in "AB":
        scenes.pin(bpy.data.objects[name], [], "Second")
    bpy.ops.object.mode_set(mode="EDIT")
    yield from _live(on, "RET")


@_story("edited")
def _live_with_soft_pins_that_is_taken_back(on: Stage) -> Steps:
    yield from _live(on, "ESC", pins="SOFT")


@_story("patches")
def _live_that_others_end(on: Stage) -> Steps:
    for way in ("KEEP", "BACK"):
        on.begin("uv.omt_live", "IMAGE_EDITOR", pack=False)
        _slider(0.7)
        on.ticks(8)
        on.gave = on.package("operators.live").UV_OT_omt_live_end.execute(SimpleNamespace(end=way), None)
        yield f"{way} {on.ticks(2)}"
    on.begin("uv.omt_live", "IMAGE_EDITOR")
    on.ticks(4)
    session = on.begun[-1]
    yield on.call("uv.omt_density_set", density=3.0)
    on.begun.append(session)
    yield on.ticks(1)


@_story("patches", "edited")
def _colours_and_checkers(on: Stage) -> Steps:
    A = bpy.data.objects["A"]
    A.material_slots[0].link = "OBJECT"
    A.material_slots[0].material = bpy.data.materials["two"]
    yield on.call("uv.omt_overlay", show="AREA")
    yield on.call("uv.omt_unwrap", quality="DRAFT", max_shear=0.0)
    yield on.call("uv.omt_overlay", show="SHEAR")
    yield on.call("uv.omt_checker", size=256, kind="UV_GRID")
    yield on.call("uv.omt_checker", size=256, kind="CIRCLES")
    if bpy.context.mode == "OBJECT":
        bpy.data.objects["B"].select_set(False)
    yield on.call("uv.omt_checker_remove")
    bpy.data.materials["two"].name = "renamed"
    yield on.call("uv.omt_checker_remove")
    yield on.call("uv.omt_overlay", show="NONE")


@_story("patches")
def _distances_in_colours(on: Stage) -> Steps:
    yield on.call("object.omt_distance")
    yield on.call("uv.omt_attributes")
    yield on.call("object.omt_strain", of="UV")
    yield on.call("uv.omt_overlay", show="NONE")


@_story("bodies")
def _landmarks_that_are_suggested(on: Stage) -> Steps:
    for k, name in enumerate("AB"):
        obj = bpy.data.objects[name]
        V, F = blob(2, seed=3)
        mesh = bpy.data.meshes.new(f"Fine {name}")
        mesh.from_pydata((V * [1.0 + 0.1 * k, 1.3, 0.8]).tolist(), [], F.tolist())
        obj.shape_key_clear()
        obj.data = mesh
    bpy.context.view_layer.update()
    yield on.call("object.omt_landmarks_suggest", most=3)
    yield on.call("object.omt_landmarks_suggest", most=1, prefix="other")
    yield on.call("object.omt_landmarks_clear", prefix="other")
    yield on.call("object.omt_landmarks_clear")


@_story("bodies")
def _globes_by_picked_vertices(on: Stage) -> Steps:
    A, B = (bpy.data.objects[name] for name in "AB")
    scenes.edit(A, B)
    bpy.ops.mesh.select_mode(type="VERT")
    for obj in (A, B):
        edit = bmesh.from_edit_mesh(obj.data)
        edit.verts.ensure_lookup_table()
        for vertex in (3, 10, 17):
            edit.select_history.add(edit.verts[vertex])
    yield on.call("uv.omt_sphere", quality="DRAFT", orientation="PICKED")


@_story("patches", "edited", "bodies")
def _one_after_the_other(on: Stage) -> Steps:
    yield on.call("uv.omt_density_get", unit="IN", texture_size=777)
    yield on.call("object.omt_weights", kind="MEAN", weight_group="part", invert=True)
    yield on.call("uv.omt_region_add")
    yield on.call("uv.omt_region_add")
    yield on.call("uv.omt_region_add")
    bpy.context.object.omt_uv_regions.active = 1
    yield on.call("uv.omt_region_remove")
    if bpy.context.mode == "PAINT_WEIGHT":
        scenes.leave_edit()
    yield on.call("uv.omt_regions", kind="MATERIALS", texture_size=777)
    yield on.call("wm.omt_copy_report")
    yield on.call("uv.omt_preset", operator="uv.omt_unwrap", filepath=str(_preset(on)))
    yield on.call("uv.omt_worst", share=30.0)
    yield on.call("uv.omt_layout_image", kind="SHEAR", size=40)


def _preset(on: Stage):
    return on.package("session.presets").files("uv.omt_unwrap")[0]


@_story("patches", "active not selected")
def _remesh_and_levels(on: Stage) -> Steps:
    yield on.call("object.omt_remesh", target_vertices=40, levels=2, ratio=0.6, strategy="CFP-CFP")
    for _ in range(4):
        yield on.call("object.omt_compare")


def _flawed() -> None:
    """Two vertices of B on one another, a face turned over, and one without an area."""
    mesh = bpy.data.objects["B"].data
    key = mesh.shape_keys
    if key is not None:
        bpy.data.objects["B"].shape_key_clear()
    points = [tuple(v.co) for v in mesh.vertices]
    edit = bmesh.new()
    edit.from_mesh(mesh)
    edit.verts.ensure_lookup_table()
    edit.faces.ensure_lookup_table()
    first, second = edit.verts[0], edit.verts[1]
    edit.verts.new(points[3])
    edit.faces.new([first, second, edit.verts.new(np.mean(points[:2], axis=0).tolist())])
    edit.faces.ensure_lookup_table()
    edit.faces[4].normal_flip()
    edit.to_mesh(mesh)
    edit.free()
    mesh.update()


@_story("patches")
def _remedies(on: Stage) -> Steps:
    _flawed()
    yield on.call("uv.omt_unwrap", quality="DRAFT")
    scenes.select([bpy.data.objects["A"]])
    yield on.call("uv.omt_notices", whole=False)
    yield on.call("uv.omt_notices", whole=False)
    on.call("uv.omt_notices")
    yield "all notices"
    for action in ("NORMALS", "MERGE", "DISSOLVE"):
        yield on.call("uv.omt_remedy", action=action)
    scenes.select([bpy.data.objects["A"], bpy.data.objects["B"]])
    yield on.call("uv.omt_unwrap", quality="DRAFT")
    bpy.data.objects["Double"].data = bpy.data.meshes["Child"]
    bpy.data.objects["A"].modifiers["Smooth"].render_levels = 2
    bpy.data.objects["A"].modifiers["Smooth"].uv_smooth = "NONE"
    yield on.call("uv.omt_remedy", action="APPLY_LEVEL")


@_story("patches")
def _figures_that_hold_no_more(on: Stage) -> Steps:
    last_run = on.package("session.last_run")
    A, B = (bpy.data.objects[name] for name in "AB")
    yield on.call("uv.omt_measure")
    for selected in ([A], [], [A, bpy.data.objects["Child"]], [A, B]):
        scenes.select(selected)
        last_run.look_again()
        yield f"selected {' '.join(obj.name for obj in selected)}"
    scenes.set_uv(A, 0.9 * scenes.uv_of(A, "Second"), "Second")
    last_run.look_again()
    yield "moved"
    bpy.data.objects.remove(B)
    last_run.look_again()
    yield "gone"
