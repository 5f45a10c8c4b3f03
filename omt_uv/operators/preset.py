"""Take the settings of an operator from a preset file, before it runs: uv.omt_preset."""

from __future__ import annotations

from pathlib import Path

import bpy
from bpy.props import StringProperty

from ..errors import one_line


class UV_OT_omt_preset(bpy.types.Operator):
    """Take over the settings of this preset"""

    bl_idname = "uv.omt_preset"
    bl_label = "Choose Preset"
    bl_options = {"INTERNAL"}

    operator: StringProperty(name="Operator", description="Operator that gets the settings", default="uv.omt_unwrap")
    filepath: StringProperty(name="File", description="File of the preset", subtype="FILE_PATH")

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..session import presets

        path = Path(bpy.path.abspath(self.filepath))
        try:
            presets.choose(path, context.window_manager.operator_properties_last(self.operator))
        except presets.PresetError as error:
            self.report({"ERROR"}, one_line(str(error)))
            return {"CANCELLED"}
        self.report({"INFO"}, f"{path.stem}: the settings are chosen, nothing has been unwrapped yet")
        return {"FINISHED"}
