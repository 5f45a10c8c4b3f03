"""Everything the extension adds to Blender, in order, and its exact reverse."""

from __future__ import annotations

import bpy

from .blender_versions import register_command, unregister_command
from .operators.measure import UV_OT_omt_measure
from .operators.refine import UV_OT_omt_refine
from .operators.remesh import OBJECT_OT_omt_remesh
from .operators.seams import UV_OT_omt_seams
from .operators.unwrap import UV_OT_omt_unwrap
from .panels.menus import draw_remesh, draw_unwrap, menus, remesh_menus
from .panels.sidebar import IMAGE_PT_omt_uv, VIEW3D_PT_omt_uv

CLASSES = (
    UV_OT_omt_unwrap,
    UV_OT_omt_refine,
    UV_OT_omt_seams,
    UV_OT_omt_measure,
    OBJECT_OT_omt_remesh,
    VIEW3D_PT_omt_uv,
    IMAGE_PT_omt_uv,
)
COMMAND = "omt_uv"

_undo: list[tuple] = []


def register() -> None:
    """Register all or nothing: what was registered before a failure is taken back and the failure raised."""
    try:
        for cls in CLASSES:
            bpy.utils.register_class(cls)
            _undo.append((bpy.utils.unregister_class, cls))
        for draw, places in ((draw_unwrap, menus()), (draw_remesh, remesh_menus())):
            for menu in places:
                menu.append(draw)
                _undo.append((menu.remove, draw))
        _undo.append((unregister_command, register_command(COMMAND, _command)))
    except Exception:
        unregister()
        raise


def unregister() -> None:
    while _undo:
        function, argument = _undo.pop()
        function(argument)


def _command(arguments: list[str]) -> int:
    from .cli import main

    return main(arguments)
