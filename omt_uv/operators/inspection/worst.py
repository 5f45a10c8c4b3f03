"""Select the faces whose UVs are worst: uv.omt_worst."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, FloatProperty

from ...session.language import counted
from ..base import Complaint, QuickOperator, blaming, check_all_local, read_objects

FIGURES = (
    ("AREA", "Area", "Faces whose share of the texture is farthest from what is due to them"),
    ("SHEAR", "Shear", "Faces that pull the texture most"),
    ("FOLDS", "Folds", "Faces that are folded over, all of them"),
)


class UV_OT_omt_worst(QuickOperator, bpy.types.Operator):
    """Select the faces whose UVs are worst, in Edit Mode"""

    bl_idname = "uv.omt_worst"
    bl_label = "Select Worst UV Faces"
    bl_options = {"REGISTER", "UNDO"}

    figure: EnumProperty(name="Figure", description="What is bad about them", items=FIGURES, default="AREA")
    share: FloatProperty(
        name="Share",
        description="How much of the surface is selected, at most: the worst of it",
        default=2.0,
        min=0.01,
        max=100.0,
        soft_max=20.0,
        subtype="PERCENTAGE",
    )

    def act(self, context: bpy.types.Context) -> None:
        from ...blender.mesh import select_elements, select_mode
        from ...pipelines.distortion import worst_faces

        # What was selected before does not narrow the search: the next click finds the same faces.
        pairs = read_objects(context) if context.mode == "OBJECT" else _whole(context)
        check_all_local(pairs)
        with blaming(pairs):
            found = worst_faces([reading for _, reading in pairs], self.figure, self.share / 100)
        count = sum(map(len, found))
        if not count:
            raise Complaint("No face is folded." if self.figure == "FOLDS" else "No face stands out.")
        if context.mode == "OBJECT":
            active = context.view_layer.objects.active
            if active not in [obj for obj, _ in pairs]:
                # Of another kind, or not selected: its own Edit Mode has no faces.
                context.view_layer.objects.active = pairs[0][0]
            bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="DESELECT")
        context.scene.tool_settings.mesh_select_mode = select_mode("face")
        for (obj, _), faces in zip(pairs, found, strict=True):
            select_elements(obj, "face", faces)
        self.report({"INFO"}, counted(count, "Selected {} face", "Selected {} faces"))


def _whole(context: bpy.types.Context) -> list:
    """Objects in Edit Mode and their readings, with every face that is not hidden."""
    bpy.ops.mesh.select_all(action="SELECT")
    return read_objects(context)
