"""Pick landmarks on two objects, by clicks or by suggestion; they are empties, which can be moved and are saved."""

from __future__ import annotations

from typing import Any

import bpy
from bpy.props import BoolProperty, IntProperty, StringProperty

from ...pipelines.shapes.choices import DEFAULT_PREFIX
from ...session.language import counted, words
from ..base import NAVIGATION, Complaint, QuickOperator, complaints, tell
from .match import source_and_target

# Pixels from a landmark within which a press takes hold of it.
GRASP = 14.0
HELP = (
    "Landmarks: click the same place on both objects.    Drag: Correct    M: Mirrored pairs    Backspace: Undo"
    "    Enter: Done    Esc: Back"
)


class _OnPair(QuickOperator):
    """An operator on landmarks of the two objects of a match, in Object Mode."""

    modes = ("OBJECT",)

    prefix: StringProperty(name="Prefix", description="How the landmarks' names begin", default=DEFAULT_PREFIX)


def place(objects: tuple, obj: bpy.types.Object, prefix: str, point, mirrored: bool) -> list[bpy.types.Object]:
    """A landmark of an object at a point (3,) of the world: the other half of one that has none yet, or a new one.

    mirrored : another one as well at the mirror image across the object's YZ plane, where the surface is nearest
    """
    from mathutils import Vector

    from ...blender.shapes.landmarks import free_name, put_landmark, read_landmarks

    points = [Vector(point)]
    if mirrored:
        local = obj.matrix_world.inverted() @ points[0]
        local.x = -local.x
        found, near, _, _ = obj.closest_point_on_mesh(local)
        if found:
            points.append(obj.matrix_world @ near)
    made = []
    for position in points:
        mine = {p.name for p in read_landmarks(obj, prefix)}
        other = next(o for o in objects if o != obj)
        waiting = sorted((p.name for p in read_landmarks(other, prefix) if p.name not in mine), key=_number)
        name = waiting[0] if waiting else free_name(list(objects), prefix)
        made.append(put_landmark(obj, name, position))
    bpy.context.view_layer.update()
    return made


def _number(name: str) -> tuple[int, str]:
    digits = "".join(c for c in name if c.isdigit())
    return (int(digits) if digits else 0, name)


class OBJECT_OT_omt_landmarks(_OnPair, bpy.types.Operator):
    """Click the same places on the selected and the active object. Numbers say what belongs together; drag corrects"""

    bl_idname = "object.omt_landmarks"
    bl_label = "Pick Landmarks"
    bl_options = {"REGISTER", "UNDO"}

    mirrored: BoolProperty(
        name="Mirrored Pairs", description="Set the mirror image of every landmark, too", default=False
    )

    _objects: Any = ()
    _made: Any = ()
    _held: Any = None

    def act(self, context: bpy.types.Context) -> None:
        source_and_target(context)
        if bpy.app.background or context.area is None or context.area.type != "VIEW_3D":
            raise Complaint("Landmarks are picked in the 3D View. Click its button there.")

    def invoke(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        try:
            self.act(context)
        except Complaint as complaint:
            return tell(self, context, complaint)
        self._objects, self._made, self._held = source_and_target(context), [], None
        context.window_manager.modal_handler_add(self)
        context.workspace.status_text_set(HELP)
        return {"RUNNING_MODAL"}

    def modal(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.type in {"RET", "NUMPAD_ENTER", "ESC"} and event.value == "PRESS":
            context.workspace.status_text_set(None)
            if event.type == "ESC":
                self._take_back(len(self._made))
                return {"CANCELLED"}
            return {"FINISHED"}
        if event.type == "M" and event.value == "PRESS":
            self.mirrored = not self.mirrored
        elif event.type == "BACK_SPACE" and event.value == "PRESS":
            self._take_back(1)
        elif event.type == "LEFTMOUSE":
            return self._press(context, event)
        elif event.type == "MOUSEMOVE" and self._held is not None:
            hit = self.hit(context, event)
            if hit is not None and hit[0] == self._held.parent:
                self._held.location = hit[1]
        elif event.type in NAVIGATION:
            return {"PASS_THROUGH"}
        return {"RUNNING_MODAL"}

    def _press(self, context: bpy.types.Context, event: bpy.types.Event) -> set[str]:
        if event.value == "RELEASE":
            self._held = None
            return {"RUNNING_MODAL"}
        if event.value != "PRESS" or context.region is None or context.region.type != "WINDOW":
            return {"PASS_THROUGH"}
        self._held = self.near(context, event)
        hit = None if self._held is not None else self.hit(context, event)
        if hit is not None:
            self._made += place(self._objects, hit[0], self.prefix, hit[1], self.mirrored)
            self._held = self._made[-1] if not self.mirrored else None
        return {"RUNNING_MODAL"}

    def hit(self, context: bpy.types.Context, event: bpy.types.Event):
        """The one of the two objects that is under the mouse, and where; None where neither is."""
        from bpy_extras.view3d_utils import region_2d_to_origin_3d, region_2d_to_vector_3d

        mouse = (event.mouse_region_x, event.mouse_region_y)
        origin = region_2d_to_origin_3d(context.region, context.region_data, mouse)
        way = region_2d_to_vector_3d(context.region, context.region_data, mouse)
        found, point, _, _, obj, _ = context.scene.ray_cast(context.evaluated_depsgraph_get(), origin, way)
        obj = obj.original if found else None
        return (obj, point) if obj in self._objects else None

    def near(self, context: bpy.types.Context, event: bpy.types.Event):
        """The landmark that is drawn next to the mouse, None where none is."""
        from bpy_extras.view3d_utils import location_3d_to_region_2d

        from ...blender.shapes.landmarks import empties

        best, least = None, GRASP
        for obj in self._objects:
            for empty in empties(obj, self.prefix):
                at = location_3d_to_region_2d(context.region, context.region_data, empty.matrix_world.translation)
                if at is None:
                    continue
                away = ((at.x - event.mouse_region_x) ** 2 + (at.y - event.mouse_region_y) ** 2) ** 0.5
                if away < least:
                    best, least = empty, away
        return best

    def _take_back(self, count: int) -> None:
        for _ in range(min(count, len(self._made))):
            bpy.data.objects.remove(self._made.pop())


class OBJECT_OT_omt_landmarks_suggest(_OnPair, bpy.types.Operator):
    """Set landmarks where both objects have alike bumps and dents in alike places. Delete those that are wrong"""

    bl_idname = "object.omt_landmarks_suggest"
    bl_label = "Suggest Landmarks"
    bl_options = {"REGISTER", "UNDO"}

    most: IntProperty(name="Most", description="Landmarks to set at most", default=12, min=1, max=64)

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.mesh import read
        from ...blender.shapes.landmarks import free_name, put_landmark
        from ...solver.registration.suggestions import check_side, suggest_landmarks

        objects = source_and_target(context)
        sides = []
        for obj in objects:
            with complaints(obj):
                surface = read(obj).surface
                sides.append((surface.positions, surface.corner_vertex[surface.triangles]))
                check_side(*sides[-1])
        found = suggest_landmarks(sides[0], sides[1], self.most)
        if not len(found.source):
            raise Complaint("Nothing stands out that looks alike on both. Pick landmarks by hand.")
        for rows in zip(found.source.tolist(), found.target.tolist(), strict=True):
            name = free_name(list(objects), self.prefix)
            for obj, vertex in zip(objects, rows, strict=True):
                put_landmark(obj, name, obj.matrix_world @ obj.data.vertices[vertex].co)
            context.view_layer.update()
        count = counted(len(found.source), "{} landmark", "{} landmarks")
        self.report({"INFO"}, f"{count}; {words('delete what is wrong')}")


class OBJECT_OT_omt_landmarks_clear(_OnPair, bpy.types.Operator):
    """Delete all landmarks of the selected and the active object that are empties"""

    bl_idname = "object.omt_landmarks_clear"
    bl_label = "Clear Landmarks"
    bl_options = {"REGISTER", "UNDO"}

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.shapes.landmarks import remove_landmarks

        count = sum(remove_landmarks(obj, self.prefix) for obj in source_and_target(context))
        self.report({"INFO"}, counted(count, "{} landmark deleted", "{} landmarks deleted"))
