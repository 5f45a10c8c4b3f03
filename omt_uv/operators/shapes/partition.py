"""Divide meshes into cells of equal area, or of equal painted density: mesh.omt_partition."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, IntProperty, StringProperty

from ...session import run
from ...session.language import counted
from ...settings import CELL_WRITES, DEFAULT_CELL_WRITE, DEFAULT_CELLS, DEFAULT_RELAX, PartitionSettings
from ..base import SolverOperator, check_all_local, complaints, read_objects, select_alone, warn
from ..properties import choose_group

NEW_OBJECTS = ("MESH", "POINTS")


class MESH_OT_omt_partition(SolverOperator, bpy.types.Operator):
    """Divide the mesh, or its selected faces, into cells of exactly the same area, or of the same painted density"""

    bl_idname = "mesh.omt_partition"
    bl_label = "Partition Area Preserving"
    bl_options = {"REGISTER", "UNDO", "PRESET"}

    cells: IntProperty(
        name="Cells",
        description="How many. Every separate part of a mesh has whole cells, and at least one",
        default=DEFAULT_CELLS,
        min=1,
        max=1_000_000,
        soft_max=2000,
    )
    capacity_group: StringProperty(
        name="Density",
        description="Vertex group that says where cells are smaller: all cells get the same integral of its weights. "
        "Empty: the same area",
    )
    relax: IntProperty(
        name="Relax",
        description="How often every site moves to the mean of its cell. 0: cells may be long; 5: round and even",
        default=DEFAULT_RELAX,
        min=0,
        max=100,
        soft_max=20,
    )
    write: EnumProperty(
        name="Write", description="What the cells become", items=CELL_WRITES, default=DEFAULT_CELL_WRITE
    )
    seed: IntProperty(name="Seed", description="Other sites to begin with give other cells", default=0, min=0)

    def draw(self, _context: bpy.types.Context) -> None:
        draw_settings(self.layout, self)

    def settings(self) -> PartitionSettings:
        return PartitionSettings(self.cells, self.relax, self.write.lower(), self.seed)

    def steps(self, context: bpy.types.Context):
        from ...blender.mesh import check_stretch
        from ...blender.shapes.cell_faces import check_cells
        from ...blender.shapes.cell_objects import read_carried
        from ...blender.vertex_groups import avoided
        from ...pipelines.layout import in_turn
        from ...pipelines.shapes.partition import partition_surface

        pairs = read_objects(context)
        if self.write not in NEW_OBJECTS:
            check_all_local(pairs)
        objects = [obj for obj, _ in pairs]
        carried = []
        for obj in objects:
            with complaints(obj):
                check_cells(obj, self.write.lower())
                if self.write in NEW_OBJECTS:
                    check_stretch(obj)
                carried.append(read_carried(obj) if self.write == "MESH" else None)
        with complaints(objects=objects):
            weights = avoided(objects, self.capacity_group)
            dividing = [
                partition_surface(reading.surface, reading.faces, mine, self.settings())
                for (_, reading), mine in zip(pairs, weights, strict=True)
            ]
            found = yield from run.aside(in_turn(dividing))
        return list(zip(pairs, carried, found, strict=True))

    def finish(self, context: bpy.types.Context, result) -> None:
        from ...blender.shapes.cell_faces import write_cells
        from ...blender.shapes.cell_objects import new_cell_mesh, new_points

        made = []
        for (obj, reading), carried, partition in result:
            if self.write == "MESH":
                made.append(new_cell_mesh(obj, reading.surface, reading.faces, partition, carried))
            elif self.write == "POINTS":
                made.append(new_points(obj, partition))
            else:
                write_cells(obj, partition, self.write.lower())
        if made and context.mode == "OBJECT":
            select_alone(context, made)
        found = [partition for *_, partition in result]
        self.said = _figures([partition.figures for partition in found], self.write)
        objects = [obj for (obj, _), *_ in result]
        warn(self, objects, [(k, text) for k, partition in enumerate(found) for text in partition.warnings])
        total = sum(partition.figures["cells"] for partition in found)
        what = f": {', '.join(obj.name for obj in made)}" if made else ""
        self.report({"INFO"}, counted(total, "Made {} cell", "Made {} cells") + what)


def _figures(figures: list[dict], write: str) -> tuple[tuple[str, str], ...]:
    """Rows for the panel: how exact the cells are, and how even their sites."""
    error = max(f["error"] for f in figures)
    rows = [("Cells", f"{sum(f['cells'] for f in figures)}"), ("Area error", f"{100 * error:.2g} %")]
    if write not in NEW_OBJECTS:
        rows.append(("Of whole faces", f"{100 * max(f['error_of_faces'] for f in figures):.2g} %"))
    rows.append(("Least distance", f"{min(f['least_distance'] for f in figures):.2f} of the mean"))
    return tuple(rows)


def draw_settings(layout: bpy.types.UILayout, properties) -> None:
    """The settings of the operator, for the redo panel and the sidebar."""
    layout.use_property_split = True
    layout.use_property_decorate = False
    layout.prop(properties, "cells")
    choose_group(layout, properties, "capacity_group")
    layout.prop(properties, "write")
    column = layout.column(align=True)
    column.prop(properties, "relax")
    column.prop(properties, "seed")
