"""Help, and asking for it: wm.omt_help opens a page, wm.omt_copy_report copies what a bug report needs."""

from __future__ import annotations

import bpy

from .. import __version__, links
from ..session import last_run


class WM_OT_omt_copy_report(bpy.types.Operator):
    """Copy versions, mesh sizes, the last figures and the last error as text, for a bug report"""

    bl_idname = "wm.omt_copy_report"
    bl_label = "Copy OMT UV Report"
    bl_options = {"INTERNAL"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        context.window_manager.clipboard = report_text(context)
        self.report({"INFO"}, "The report is in the clipboard; paste it into the bug report")
        return {"FINISHED"}


class WM_OT_omt_help(bpy.types.Operator):
    """Open the page of the documentation about this section"""

    bl_idname = "wm.omt_help"
    bl_label = "OMT UV Documentation"
    bl_options = {"INTERNAL"}

    operator: bpy.props.StringProperty(name="Operator", description="Whose page is opened", options={"HIDDEN"})
    section: bpy.props.StringProperty(
        name="Section", description="Section of the tab that the button stands in", options={"HIDDEN"}
    )

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        return bool(links.page())

    def execute(self, _context: bpy.types.Context) -> set[str]:
        return bpy.ops.wm.url_open(url=links.page(self.operator))


def report_text(context: bpy.types.Context) -> str:
    """Lines of text; names of objects and files are left out."""
    import platform

    lines = [f"OMT UV {__version__}", f"Blender {bpy.app.version_string}", platform.platform()]
    lines += [
        f"Python {platform.python_version()}",
        *(f"{name} {_version(name)}" for name in ("numpy", "scipy", "xatlas")),
    ]
    lines.append(f"mode {context.mode}")
    for k, obj in enumerate(o for o in context.selected_objects if o.type == "MESH"):
        mesh = obj.data
        sizes = f"{len(mesh.vertices)} vertices, {len(mesh.edges)} edges, {len(mesh.polygons)} faces"
        scale = ", ".join(f"{x:.4g}" for x in obj.matrix_world.to_scale())
        lines.append(f"mesh {k + 1}: {sizes}, {len(mesh.uv_layers)} UV maps, scale {scale}")
    state = last_run.state
    if state.summary is not None:
        lines.append(f"last run: {state.summary.title}")
        lines += [f"  {name}: {value}" for name, value in state.summary.rows]
        lines += [f"  warning: {_nameless(text)}" for text in state.summary.warnings]
    lines.append(f"last error: {_nameless(state.error or 'none')}")
    return "\n".join(lines) + "\n"


def _nameless(text: str) -> str:
    """What is told of an object, without its name: that is nobody's but the artist's."""
    names = sorted((obj.name for obj in bpy.data.objects), key=len, reverse=True)
    return next((text.removeprefix(f"{name}: ") for name in names if text.startswith(f"{name}: ")), text)


def _version(name: str) -> str:
    # Slow to import, and needed here alone.
    from importlib import metadata, util

    if util.find_spec(name) is None:
        return "missing"
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return "of unknown version"
