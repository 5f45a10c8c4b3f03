"""Put entries into Blender's own menus; the search finds only what is in a menu."""

from __future__ import annotations

import bpy

# In the order of the menu; those that do not exist are left out.
ENTRIES = (
    *(
        "uv.omt_unwrap",
        "uv.omt_refine",
        "uv.omt_magnify",
        "object.omt_weights",
        "uv.omt_sphere",
        "uv.omt_seams",
        "uv.omt_measure",
    ),
    *("object.omt_flow", "uv.omt_flow"),
    *("uv.omt_checker", "uv.omt_checker_remove", "uv.omt_worst"),
    *("uv.omt_live", "uv.omt_overlay", "uv.omt_histogram", "uv.omt_density_get", "uv.omt_density_set"),
)


def exists(operator: str) -> bool:
    """Whether there is an operator of this name."""
    group, verb = operator.split(".")
    return hasattr(bpy.types, f"{group.upper()}_OT_{verb}")


def draw_unwrap(self, _context: bpy.types.Context) -> None:
    """Append the entries to a menu; the others of these functions do so with one."""
    self.layout.separator()
    for name in filter(exists, ENTRIES):
        self.layout.operator(name)


def menus() -> list:
    """Menus that get the entries, so that every UV menu of every Blender version shows them once.

    Since 4.5 the UV menu of the 3D View contains the Unwrap menu of the UV editor; before, it repeats it.
    """
    types = [bpy.types.IMAGE_MT_uvs_unwrap, bpy.types.VIEW3D_MT_object]
    if bpy.app.version < (4, 5, 0):
        types.append(bpy.types.VIEW3D_MT_uv_map)
    return types


def draw_remesh(self, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator("object.omt_remesh", icon="MOD_REMESH")


def draw_weights(self, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator("object.omt_weights")


def weights_menus() -> list:
    """The menu of Weight Paint, where the weights are repainted."""
    return [bpy.types.VIEW3D_MT_paint_weight]


def remesh_menus() -> list:
    """The Object menu of the 3D View, and the panel that has Blender's own remeshers."""
    return [bpy.types.VIEW3D_MT_object, bpy.types.DATA_PT_remesh]
