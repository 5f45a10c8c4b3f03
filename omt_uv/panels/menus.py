"""Entries in Blender's own menus; the search finds only what is in a menu."""

from __future__ import annotations

import bpy

from ..operators.measure import UV_OT_omt_measure
from ..operators.refine import UV_OT_omt_refine
from ..operators.remesh import OBJECT_OT_omt_remesh
from ..operators.seams import UV_OT_omt_seams
from ..operators.unwrap import UV_OT_omt_unwrap


def draw_unwrap(self, _context: bpy.types.Context) -> None:
    self.layout.separator()
    self.layout.operator(UV_OT_omt_unwrap.bl_idname)
    self.layout.operator(UV_OT_omt_refine.bl_idname)
    self.layout.operator(UV_OT_omt_seams.bl_idname)
    self.layout.operator(UV_OT_omt_measure.bl_idname)


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
    self.layout.operator(OBJECT_OT_omt_remesh.bl_idname, icon="MOD_REMESH")


def remesh_menus() -> list:
    """The Object menu of the 3D View, and the panel that has Blender's own remeshers."""
    return [bpy.types.VIEW3D_MT_object, bpy.types.DATA_PT_remesh]
