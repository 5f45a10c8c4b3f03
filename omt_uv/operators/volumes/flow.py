"""Move parts of bodies, and take the rest along without a change of volume: object.omt_flow."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import EnumProperty, FloatProperty, FloatVectorProperty, IntProperty, StringProperty

from ...pipelines.volumes.choices import (
    DEFAULT_PATH,
    DEFAULT_RADIUS,
    DEFAULT_SAMPLES,
    FLOW_HANDLES,
    FLOW_PATHS,
    FLOW_RESULTS,
    FLOW_WALLS,
)
from ...session import run
from ...solver.errors import first_of
from ..base import Complaint, SolverOperator, complaints, mesh_objects, tell, warn
from ..properties import choose_group

# Factor of the radius for a turn of the wheel while dragging.
WHEEL = 1.1


class OBJECT_OT_omt_flow(SolverOperator, bpy.types.Operator):
    """Move handles, and let the rest flow along: volumes stay, and nothing passes through itself.
    With selected vertices and no Move set, drag them in the 3D View"""

    bl_idname = "object.omt_flow"
    bl_label = "Move Incompressibly"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    handles: EnumProperty(name="Handles", description="What moves, and where to", items=FLOW_HANDLES)
    move: FloatVectorProperty(
        name="Move", description="Where the selected vertices go, in the world", size=3, subtype="TRANSLATION"
    )
    rotate: FloatVectorProperty(
        name="Rotate", description="How the selected vertices turn about their middle", size=3, subtype="EULER"
    )
    radius: FloatProperty(
        name="Radius",
        description="How far a handle reaches, as a share of the diagonal of what flows",
        default=DEFAULT_RADIUS,
        min=0.01,
        max=10.0,
        soft_max=1.0,
    )
    path: EnumProperty(name="Path", description="Which way handles go", items=FLOW_PATHS, default=DEFAULT_PATH)
    samples: IntProperty(
        name="Samples",
        description="Chords that a curved path has",
        default=DEFAULT_SAMPLES,
        min=1,
        max=1000,
        soft_max=64,
    )
    keep_group: StringProperty(name="Keep", description="Vertex group that stays where it is")
    walls: EnumProperty(name="Walls", description="What nothing passes through", items=FLOW_WALLS)
    wall_object: StringProperty(name="Wall", description="Object around which the walls are")
    result: EnumProperty(name="Result", description="Where the new positions go", items=FLOW_RESULTS)
    frames: IntProperty(
        name="Frames",
        description="Shape keys along the way, keyed to as many frames of the scene from the current one on",
        default=1,
        min=1,
        max=1000,
        soft_max=50,
    )

    # A FlowDrag while handles are dragged; Blender evaluates annotations, and knows no more names than these.
    _drag: Any = None
    _mouse = (0, 0)

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def job(self, context: bpy.types.Context) -> tuple[list, Any]:
        """The objects and their FlowJob, as the settings say."""
        from ...blender.volumes.bodies import check_keep, read_body
        from ...blender.volumes.flow_handles import scene_handles, wall_of
        from ...pipelines.volumes.flow import FlowJob
        from ...solver.flows.options import FlowOptions

        objects = mesh_objects(context)
        bodies = []
        for obj in objects:
            with complaints(obj):
                bodies.append(read_body(obj, self.keep_group))
        with complaints():
            check_keep(objects, self.keep_group)
            handles = scene_handles(self.handles.lower(), objects, bodies, self.move, self.rotate)
            domain = wall_of(self.walls.lower(), self.wall_object)
        options = FlowOptions(radius=self.radius, path=self.path.lower(), samples=self.samples)
        frames = self.frames if self.result == "KEY" else 1
        return objects, FlowJob(tuple(bodies), handles, options, domain, frames)

    def steps(self, context: bpy.types.Context):
        from ...pipelines.volumes.flow import flow_bodies

        objects, job = self.job(context)
        with complaints(objects[0] if len(objects) == 1 else None):
            found = yield from run.aside(flow_bodies(job))
        return objects, found

    def finish(self, context: bpy.types.Context, result) -> None:
        from ...blender.volumes.bodies import write_frames, write_positions

        objects, found = result
        for k, obj in enumerate(objects):
            if self.result == "KEY":
                shapes = [frame[k] for frame in found.frames]
                write_frames(obj, shapes, context.scene.frame_current, keyed=self.frames > 1)
            else:
                write_positions(obj, found.frames[-1][k])
        self.said = (
            ("Volume change", f"{100 * found.volume:.2g} %"),
            ("New intersections", f"{found.intersecting}"),
        )
        warn(self, objects, [(-1, text) for text in found.warnings])
        self._show_crossing(context, objects, found.crossing)
        self.report({"INFO"}, f"Moved {', '.join(obj.name for obj in objects)}; volume change {found.volume:.1e}")

    def _show_crossing(self, context: bpy.types.Context, objects: list, crossing: tuple) -> None:
        """Say which faces newly intersect, and have them selected when Edit Mode is entered."""
        from ...blender.mesh import select_elements, select_mode

        for k, (obj, faces) in enumerate(zip(objects, crossing, strict=True)):
            if not len(faces):
                continue
            text = f"Faces that newly pass through one another ({len(faces)}): {first_of(faces)}"
            warn(self, objects, [(k, text)])
            # In Edit Mode the selection is what moves, also in the redo panel.
            if obj.mode != "EDIT":
                context.scene.tool_settings.mesh_select_mode = select_mode("face")
                select_elements(obj, "face", faces)

    # ---- live ---------------------------------------------------------------------------------------------------

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        in_view = context.area is not None and context.area.type == "VIEW_3D" and context.region_data is not None
        still = not any(self.move) and not any(self.rotate)
        if bpy.app.background or not (in_view and still and self.handles == "SELECTED"):
            return super().invoke(context, event)
        try:
            self.begin_drag(context)
        except Complaint as complaint:
            return tell(self, context, complaint)
        self._mouse = event.mouse_region_x, event.mouse_region_y
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Move Incompressibly: drag.    Wheel: Radius    Click: Keep    Esc: Back")
        return {"RUNNING_MODAL"}

    def begin_drag(self, context: bpy.types.Context) -> None:
        """Hold the selected vertices from now on; raises Complaint."""
        from .drag import FlowDrag

        objects, job = self.job(context)
        with complaints():
            self._drag = FlowDrag(objects, job)

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self._drag is None:
            return super().modal(context, event)
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            self._drag.restore()
            return self._end(context, {"CANCELLED"})
        if event.type in {"WHEELUPMOUSE", "WHEELDOWNMOUSE"}:
            self.radius *= WHEEL if event.type == "WHEELUPMOUSE" else 1 / WHEEL
            self._drag.restore()
            self.begin_drag(context)
        if event.type in {"MOUSEMOVE", "WHEELUPMOUSE", "WHEELDOWNMOUSE"}:
            self.move = self._shift(context, event)
            self._drag.to(self._as_array())
            return {"RUNNING_MODAL"}
        if event.type in {"LEFTMOUSE", "RET", "NUMPAD_ENTER"} and event.value == "PRESS":
            self._drag.restore()
            self._end(context, {"FINISHED"})
            return self.execute(context) if any(self.move) else {"CANCELLED"}
        return {"RUNNING_MODAL"}

    def cancel(self, context: bpy.types.Context) -> None:
        if self._drag is not None:
            self._drag.restore()
            self._end(context, {"CANCELLED"})
        super().cancel(context)

    def _as_array(self):
        import numpy as np

        return np.array(self.move[:], float)

    def _shift(self, context: bpy.types.Context, event: bpy.types.Event):
        """How far the mouse has gone, in the plane of the view through the middle of the handles."""
        from bpy_extras.view3d_utils import region_2d_to_location_3d
        from mathutils import Vector

        depth = Vector(self._drag.middle)
        places = (self._mouse, (event.mouse_region_x, event.mouse_region_y))
        here, there = (region_2d_to_location_3d(context.region, context.region_data, at, depth) for at in places)
        return there - here

    def _end(self, context: bpy.types.Context, state: set[str]) -> set[str]:
        self._drag = None
        if context.workspace is not None:
            context.workspace.status_text_set(None)
        return state


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator that count as others stand, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "handles")
    if properties.handles == "SELECTED":
        layout.prop(properties, "move")
        layout.prop(properties, "rotate")
    layout.prop(properties, "radius")
    layout.prop(properties, "path")
    if properties.path != "STRAIGHT":
        layout.prop(properties, "samples")
    choose_group(layout, properties, "keep_group")
    layout.prop(properties, "walls")
    if properties.walls != "FREE":
        layout.prop_search(properties, "wall_object", bpy.data, "objects")
    layout.prop(properties, "result")
    if properties.result == "KEY":
        layout.prop(properties, "frames")
