"""Register everything that the extension adds to Blender, in order, and take it back in reverse."""

from __future__ import annotations

import bpy

from .blender.versions import register_command, unregister_command
from .display import colour_bar, overlay
from .links import manual
from .operators.arranging.islands import UV_OT_omt_rectify, UV_OT_omt_stack, UV_OT_omt_symmetrize
from .operators.arranging.queue import UV_OT_omt_queue, UV_OT_omt_queue_stop
from .operators.distortion import UV_OT_omt_histogram, UV_OT_omt_measure, UV_OT_omt_overlay
from .operators.inspection.checker import UV_OT_omt_checker, UV_OT_omt_checker_remove
from .operators.inspection.compare import OBJECT_OT_omt_compare
from .operators.inspection.distance import OBJECT_OT_omt_distance
from .operators.inspection.layouts import OBJECT_OT_omt_diagram, UV_OT_omt_layout_image
from .operators.inspection.regions import UV_OT_omt_attributes, UV_OT_omt_regions
from .operators.inspection.remedy import UV_OT_omt_notices, UV_OT_omt_remedy
from .operators.inspection.worst import UV_OT_omt_worst
from .operators.live import UV_OT_omt_live, UV_OT_omt_live_end
from .operators.magnify import UV_OT_omt_magnify
from .operators.preset import UV_OT_omt_preset
from .operators.refine import UV_OT_omt_refine
from .operators.regions.factors import UV_OT_omt_region_add, UV_OT_omt_region_remove
from .operators.regions.weights import OBJECT_OT_omt_weights
from .operators.remesh import OBJECT_OT_omt_remesh
from .operators.report import WM_OT_omt_copy_report, WM_OT_omt_help
from .operators.seams import UV_OT_omt_seams
from .operators.shapes.landmarks import (
    OBJECT_OT_omt_landmarks,
    OBJECT_OT_omt_landmarks_clear,
    OBJECT_OT_omt_landmarks_suggest,
)
from .operators.shapes.match import OBJECT_OT_omt_match
from .operators.shapes.partition import MESH_OT_omt_partition
from .operators.shapes.similar import OBJECT_OT_omt_similar
from .operators.shapes.strain import OBJECT_OT_omt_strain
from .operators.sphere import UV_OT_omt_sphere
from .operators.texel_density import UV_OT_omt_density_get, UV_OT_omt_density_set
from .operators.unwrap import UV_OT_omt_unwrap
from .operators.volumes.flow import OBJECT_OT_omt_flow
from .operators.volumes.uv_flow import UV_OT_omt_flow
from .operators.volumes.volume import OBJECT_OT_omt_volume
from .panels import keymap
from .panels.menus import UV_MT_omt, draw_menu, draw_remesh, menus, remesh_menus
from .panels.preferences import OMTUVPreferences, apply_soon
from .panels.sidebar import PANELS
from .panels.tools import UV_UL_omt_regions
from .panels.translations.registered import tables_of
from .session import ahead, last_run, queue
from .session.presets import register_folder, unregister_folder
from .session.region_list import OMTUVRegion, OMTUVRegionList, register_list, unregister_list

CLASSES = (
    OMTUVRegion,
    OMTUVRegionList,
    UV_OT_omt_unwrap,
    UV_OT_omt_refine,
    UV_OT_omt_magnify,
    UV_OT_omt_region_add,
    UV_OT_omt_region_remove,
    OBJECT_OT_omt_weights,
    UV_OT_omt_seams,
    UV_OT_omt_sphere,
    UV_OT_omt_live,
    UV_OT_omt_live_end,
    UV_OT_omt_measure,
    OBJECT_OT_omt_remesh,
    OBJECT_OT_omt_compare,
    OBJECT_OT_omt_match,
    OBJECT_OT_omt_landmarks,
    OBJECT_OT_omt_landmarks_suggest,
    OBJECT_OT_omt_landmarks_clear,
    OBJECT_OT_omt_similar,
    OBJECT_OT_omt_strain,
    OBJECT_OT_omt_flow,
    UV_OT_omt_flow,
    OBJECT_OT_omt_volume,
    MESH_OT_omt_partition,
    UV_OT_omt_layout_image,
    OBJECT_OT_omt_diagram,
    UV_OT_omt_overlay,
    UV_OT_omt_histogram,
    UV_OT_omt_density_get,
    UV_OT_omt_density_set,
    UV_OT_omt_stack,
    UV_OT_omt_symmetrize,
    UV_OT_omt_rectify,
    UV_OT_omt_queue,
    UV_OT_omt_queue_stop,
    UV_OT_omt_checker,
    UV_OT_omt_checker_remove,
    UV_OT_omt_worst,
    OBJECT_OT_omt_distance,
    UV_OT_omt_regions,
    UV_OT_omt_attributes,
    UV_OT_omt_remedy,
    UV_OT_omt_notices,
    UV_OT_omt_preset,
    WM_OT_omt_copy_report,
    WM_OT_omt_help,
    OMTUVPreferences,
    UV_MT_omt,
    UV_UL_omt_regions,
    *PANELS,
)
COMMAND = "omt_uv"

_undo: list[tuple] = []


def register() -> None:
    """Register all or nothing: what was registered before a failure is taken back and the failure raised."""
    try:
        for cls in CLASSES:
            bpy.utils.register_class(cls)
            _undo.append((bpy.utils.unregister_class, cls))
        register_list()
        _undo.append((unregister_list, None))
        entries = ((draw_menu, menus()), (draw_remesh, remesh_menus()))
        for draw, places in entries:
            for menu in places:
                menu.append(draw)
                _undo.append((menu.remove, draw))
        _undo.append((unregister_command, register_command(COMMAND, _command)))
        bpy.app.translations.register(__package__, tables_of())
        _undo.append((bpy.app.translations.unregister, __package__))
        bpy.utils.register_manual_map(manual)
        _undo.append((bpy.utils.unregister_manual_map, manual))
        _undo.append((_clear, None))
        keymap.register()
        register_folder()
        apply_soon()
    except Exception:
        # Whatever failed, Blender keeps no half of the extension; what it was is raised and told by Blender.
        unregister()
        raise


def unregister() -> None:
    while _undo:
        function, argument = _undo.pop()
        function(argument)


def _clear(_) -> None:
    """What lives outside of classes and menus."""
    keymap.unregister()
    overlay.forget()
    colour_bar.forget()
    last_run.forget()
    queue.forget()
    ahead.forget()
    unregister_folder()


def _command(arguments: list[str]) -> int:
    """`blender --command omt_uv`: in a second Blender, with the words that started this one."""
    import sys

    from .cli import main, program

    if "--command" not in sys.argv:
        return main(arguments)
    return program(arguments, [bpy.app.binary_path, *sys.argv[1:]])
