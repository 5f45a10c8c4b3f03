"""Push UVs about without a change of any area, as with a brush in the UV editor; pins stay: uv.omt_flow."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import FloatProperty, FloatVectorProperty

from ...session import run
from ..base import Complaint, SolverOperator, complaints, read_writable, tell, warn


class UV_OT_omt_flow(SolverOperator, bpy.types.Operator):
    """Push UVs about so that every area stays as it is and pins keep their places.
    In the UV editor, press and drag"""

    bl_idname = "uv.omt_flow"
    bl_label = "Push UVs"
    bl_options = {"REGISTER", "UNDO"}
    makes_uvs = True

    start: FloatVectorProperty(
        name="From", description="Place in the UV editor that is pushed", size=2, default=(0.5, 0.5)
    )
    move: FloatVectorProperty(name="Move", description="How far it is pushed", size=2, default=(0.05, 0.0))
    radius: FloatProperty(
        name="Radius",
        description="How far the push reaches, in units of the UV square",
        default=0.15,
        min=0.001,
        max=10.0,
    )

    # A UVDrag while the mouse is down.
    _drag: Any = None
    _pressed = False

    def stacks(self) -> bool:
        return True

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def _jobs(self, context: bpy.types.Context) -> list[tuple]:
        """Triples of object, Reading and corners (k,) of its faces to work on; raises Complaint."""
        import numpy as np

        from ...pipelines.reading import check_uvs

        objects, readings = read_writable(context)
        jobs = []
        for obj, reading in zip(objects, readings, strict=True):
            if reading.uv is None:
                raise Complaint(f"{obj.name}: There are no UVs to push. Unwrap it first.", obj)
            with complaints(obj):
                check_uvs(reading.surface, reading.uv, reading.faces)
            jobs.append((obj, reading, np.flatnonzero(np.repeat(reading.faces, np.diff(reading.surface.face_start)))))
        return jobs

    def _options(self):
        from ...solver.flows.options import STRAIGHT, FlowOptions

        return FlowOptions(radius=self.radius, path=STRAIGHT, diagonal=1.0)

    def steps(self, context: bpy.types.Context):
        jobs = self._jobs(context)
        with complaints():
            found = yield from run.aside(_push_all(jobs, self.start[:], self.move[:], self._options()))
        return jobs, found

    def finish(self, context: bpy.types.Context, result) -> None:
        from ...blender.mesh import target_layer, write_uv

        jobs, found = result
        for (obj, _, corners), pushed in zip(jobs, found, strict=True):
            write_uv(obj, target_layer(obj, ""), corners, pushed.uv)
            warn(self, [obj], [(0, text) for text in pushed.warnings])

    # ---- live ---------------------------------------------------------------------------------------------------

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if bpy.app.background or context.area is None or context.area.type != "IMAGE_EDITOR":
            return super().invoke(context, event)
        try:
            self.begin_drag(context)
        except Complaint as complaint:
            return tell(self, context, complaint)
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set("Push UVs: press and drag.    Wheel: Radius    Esc: Back")
        return {"RUNNING_MODAL"}

    def begin_drag(self, context: bpy.types.Context) -> None:
        """Hold the UVs from now on; raises Complaint."""
        from .drag import UVDrag

        self._drag = UVDrag(self._jobs(context), self._options())

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if self._drag is None:
            return super().modal(context, event)
        if event.type in {"ESC", "RIGHTMOUSE"} and event.value == "PRESS":
            self.cancel(context)
            return {"CANCELLED"}
        if event.type in {"WHEELUPMOUSE", "WHEELDOWNMOUSE"}:
            self.radius *= 1.1 if event.type == "WHEELUPMOUSE" else 1 / 1.1
            self._drag.restore()
            self.begin_drag(context)
        elif event.type == "LEFTMOUSE" and event.value == "PRESS":
            self.start, self.move, self._pressed = self._place(context, event), (0.0, 0.0), True
        elif event.type == "MOUSEMOVE" and self._pressed:
            there = self._place(context, event)
            self.move = there[0] - self.start[0], there[1] - self.start[1]
            self._show()
            context.area.tag_redraw()
        elif event.type == "LEFTMOUSE" and event.value == "RELEASE" and self._pressed:
            self._drag.restore()
            self._end(context)
            return self.execute(context) if any(self.move) else {"CANCELLED"}
        return {"RUNNING_MODAL"}

    def _show(self) -> None:
        import numpy as np

        start = np.array(self.start[:])
        self._drag.to(start, start + self.move[:])

    def cancel(self, context: bpy.types.Context) -> None:
        if self._drag is not None:
            self._drag.restore()
            self._end(context)
        super().cancel(context)

    def _end(self, context: bpy.types.Context) -> None:
        self._drag, self._pressed = None, False
        if context.workspace is not None:
            context.workspace.status_text_set(None)

    @staticmethod
    def _place(context: bpy.types.Context, event: bpy.types.Event) -> tuple[float, float]:
        return context.region.view2d.region_to_view(event.mouse_region_x, event.mouse_region_y)


def _push_all(jobs: list, start, move, options):
    """A UVFlow for every job."""
    import numpy as np

    from ...pipelines.volumes.flow import UVPlaces, flow_uvs

    here = np.array([start], float)
    found = []
    for _, reading, corners in jobs:
        at = UVPlaces.of(reading.uv[corners].astype(float), reading.pinned[corners])
        found.append((yield from flow_uvs(at, here, here + np.array([move], float), options)))
    return found


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "radius")
    layout.prop(properties, "start")
    layout.prop(properties, "move")
