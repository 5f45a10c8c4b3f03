"""Do what differs between versions of Blender, in one place.

Extensions need 4.2. Version 3.4 is kept alive for one thing: it is the Blender that Linux distributions package, so its
window can be driven in tests.
"""

from __future__ import annotations

import bpy


def uv_values(mesh: bpy.types.Mesh, layer: str) -> tuple:
    """The collection of the UVs of a layer, of a mesh that is not in Edit Mode, and the name of a UV in it.

    Writing to MeshUVLoopLayer.uv would, before Blender 5.2, change the array of the undo step as well.
    """
    if bpy.app.version < (3, 5, 0):
        return mesh.uv_layers[layer].data, "uv"
    return mesh.attributes[layer].data, "vector"


def known_options(operator, **options) -> dict:
    """Those of the options that an operator has in this version."""
    names = operator.get_rna_type().properties.keys()
    return {name: value for name, value in options.items() if name in names}


def register_command(name: str, function):
    """A handle of the command `blender --command name`, None where Blender knows no commands."""
    register = getattr(bpy.utils, "register_cli_command", None)
    return register and register(name, function)


def unregister_command(handle) -> None:
    if handle is not None:
        bpy.utils.unregister_cli_command(handle)


def progress_bar(layout: bpy.types.UILayout, fraction: float, text: str) -> None:
    """A bar in a panel, plain text before Blender 4.0."""
    if hasattr(layout, "progress"):
        layout.progress(factor=fraction, text=text)
    else:
        layout.label(text=f"{text}  {100 * fraction:.0f} %", icon="TIME")


SMOOTH_COLOUR_SHADER = "SMOOTH_COLOR" if bpy.app.version >= (4, 0, 0) else "2D_SMOOTH_COLOR"
UNIFORM_COLOUR_SHADER = "UNIFORM_COLOR" if bpy.app.version >= (4, 0, 0) else "2D_UNIFORM_COLOR"


def settle_context() -> None:
    """Make sure, once a file was loaded, that the context belongs to the scene that is open.

    Whoever reads the tool settings of the context of Blender 4.2 makes the scene of that time its owner. What is set of
    its window, as readers and writers of glTF do, is told to the owner, also when this is long gone: a crash, or memory
    that was changed, and a crash later. Read anew, they make the open scene the owner: docs/blender_4_2.md has more.
    """
    _ = bpy.context.tool_settings


def open_empty() -> None:
    """An empty file takes the place of the open one."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    settle_context()
