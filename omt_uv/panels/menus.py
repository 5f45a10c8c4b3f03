"""One submenu, OMT UV, in Blender's own menus; the search finds what is in a menu, by its name and by the menu's."""

from __future__ import annotations

import bpy

from .section import class_of

# In the order of the menu, a list for every group; those that do not exist are left out.
ENTRIES: list[list[str]] = [
    ["uv.omt_unwrap", "uv.omt_refine", "uv.omt_live", "uv.omt_seams", "uv.omt_queue"],
    ["uv.omt_stack", "uv.omt_symmetrize", "uv.omt_rectify"],
    ["uv.omt_magnify", "object.omt_weights", "object.omt_remesh", "object.omt_compare", "uv.omt_sphere"],
    ["uv.omt_checker", "uv.omt_checker_remove", "uv.omt_overlay", "uv.omt_histogram", "uv.omt_measure", "uv.omt_worst"],
    ["object.omt_distance", "uv.omt_regions", "uv.omt_attributes", "uv.omt_density_get", "uv.omt_density_set"],
    ["uv.omt_layout_image", "object.omt_diagram"],
    [
        "object.omt_match",
        "object.omt_landmarks",
        "object.omt_landmarks_suggest",
        "object.omt_landmarks_clear",
        "object.omt_strain",
        "object.omt_similar",
    ],
    ["mesh.omt_partition", "object.omt_flow", "uv.omt_flow", "object.omt_volume"],
]
# Those that work in Weight Paint.
WEIGHTS = ["object.omt_weights"]


class UV_MT_omt(bpy.types.Menu):
    bl_idname = "UV_MT_omt"
    bl_label = "OMT UV"

    def draw(self, context: bpy.types.Context) -> None:
        painting = context.mode == "PAINT_WEIGHT"
        # Buttons open what they need first: a search from any editor runs the operator as a click does.
        self.layout.operator_context = "INVOKE_DEFAULT"
        for k, group in enumerate([WEIGHTS] if painting else ENTRIES):
            if k:
                self.layout.separator()
            for name in filter(class_of, group):
                self.layout.operator(name)


def draw_menu(self, _context: bpy.types.Context) -> None:
    """Append the submenu to a menu."""
    self.layout.separator()
    self.layout.menu(UV_MT_omt.bl_idname, icon="UV")


def draw_remesh(self, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator("object.omt_remesh", icon="MOD_REMESH")


def menus() -> list:
    """Menus that get the submenu: U in both editors, UV, Object, Weights.

    Since 4.5 the UV menu of the 3D View contains the Unwrap menu of the UV editor; before, it repeats it.
    """
    names = ["IMAGE_MT_uvs_unwrap", "IMAGE_MT_uvs", "VIEW3D_MT_object", "VIEW3D_MT_paint_weight"]
    if bpy.app.version < (4, 5, 0):
        names.append("VIEW3D_MT_uv_map")
    return [getattr(bpy.types, name) for name in names]


def remesh_menus() -> list:
    """The panel that has Blender's own remeshers."""
    return [bpy.types.DATA_PT_remesh]
