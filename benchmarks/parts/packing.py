"""Pack the islands of bodies into the square, ours beside Blender's own packer, with as much room between them.

Blender's is *Pack Islands* with *Exact Shape (Concave)*: with any rotation beside *Turn to Fit*, and with none beside
upright islands. It leaves its margin on both sides of an island, and so gets half of ours. Coverage is the share of the
square; seconds are those of packing alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import bpy

import meshes
import numpy as np

from benchmarks.part import Option, Part
from benchmarks.rivals import make_object, read_uv, remove_object, write_uv
from benchmarks.tables import Table, missed
from benchmarks.timing import timed
from omt_uv.blender.mesh import read
from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import Settings
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.packing.pack_square import pack
from omt_uv.solver.packing.turning import pack_turned
from omt_uv.solver.progress import drain

MARGIN = 4  # pixels
TEXTURE = 1024
# How models are cut: in their parts, or in charts.
MODELS = {"ogre": "auto", "teapot": "auto", "suzanne": "auto", "bunny": "charts", "homer": "charts"}
PRIMITIVES = {
    "plane": {},
    "cube": {},
    "circle": {"fill_type": "NGON"},
    "uv_sphere": {},
    "ico_sphere": {},
    "cylinder": {},
    "cone": {},
    "torus": {},
}
# Where no model is at hand.
STAND_IN = "primitives"
COLUMNS = {"bodies": 12, "islands": 7, "upright": 8, "seconds": 8, "Blender's": 9, "its seconds": 11, "turned": 8,
           "seconds ": 8, "Blender's ": 10, "its seconds ": 12, "missed goals": 20}  # fmt: skip
FIGURES = tuple(COLUMNS)[2:-1]
BODIES = Option("islands", None, "of these bodies, default all", {"nargs": "+", "metavar": "NAME"})


@dataclass(frozen=True)
class Islands:
    """UVs (n_i,2) and triangles (m_i,3) of islands at one texel density."""

    uv: Sequence[np.ndarray]
    triangles: Sequence[np.ndarray]


def islands_of(name: str) -> Islands:
    """The islands of a model, or of Blender's primitives."""
    if name == STAND_IN:
        jobs, seams = [UnwrapJob(_primitive(kind)) for kind in PRIMITIVES], "auto"
    else:
        jobs, seams = [UnwrapJob(meshes.polygon_surface(*meshes.load_polygons(name)))], MODELS.get(name, "auto")
    layout = drain(lay_out(jobs, Settings(seams=seams, max_shear=0.0, pack=False)))
    pairs = [pair for found in layout.maps for pair in zip(found.charts, found.maps, strict=True)]
    return Islands([one.uv for _, one in pairs], [chart.triangles for chart, _ in pairs])


def _primitive(kind: str):
    """The surface of one of Blender's primitives."""
    getattr(bpy.ops.mesh, f"primitive_{kind}_add")(**PRIMITIVES[kind])
    obj = bpy.context.active_object
    surface = read(obj).surface
    remove_object(obj)
    return surface


def blender_packed(islands: Islands, rotate: bool) -> tuple[float, float]:
    """Coverage and processor seconds of Blender's packer, with any rotation or with none."""
    first = np.cumsum([0, *map(len, islands.uv)])[:-1]
    uv = np.concatenate(list(islands.uv))
    F = np.concatenate([t + k for t, k in zip(islands.triangles, first, strict=True)])
    obj = make_object(np.column_stack([uv, np.zeros(len(uv))]), F, name="islands")
    write_uv(obj, uv[F])
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    room = {"margin_method": "FRACTION", "margin": MARGIN / TEXTURE / 2}
    _, seconds = timed(lambda: bpy.ops.uv.pack_islands(rotate=rotate, shape_method="CONCAVE", **room))
    bpy.ops.object.mode_set(mode="OBJECT")
    placed = read_uv(obj)
    remove_object(obj)
    area = np.abs(signed_areas(placed.reshape(-1, 2), np.arange(3 * len(F)).reshape(-1, 3))).sum()
    return float(area / max(np.ptp(placed, axis=(0, 1)).max() + MARGIN / TEXTURE, 1.0) ** 2), seconds


def packing_table(args) -> Table:
    """One row for every set of islands, and the means."""
    table = Table(f"Islands in the square, {MARGIN} pixels of {TEXTURE} between them", COLUMNS)
    names = args.islands or [*(name for name in MODELS if meshes.model_path(name)), STAND_IN]
    rows = []
    for name in names:
        islands = islands_of(name)
        given = islands.uv, islands.triangles, MARGIN, TEXTURE
        row: list[float] = []
        for way, rotate in ((pack, False), (pack_turned, True)):
            packing, seconds = timed(lambda way=way, given=given: drain(way(*given)))
            row += [packing.coverage, seconds, *blender_packed(islands, rotate)]
        rows.append(row)
        _add(table, name, len(islands.uv), row)
    means = np.mean(rows, axis=0)
    _add(table, "mean", "", means, upright=means[0] < means[2], turned=means[4] < means[6])
    return table


def _add(table: Table, name: str, count, row, **below) -> None:
    figures = {key: f"{value:.{3 - k % 2}f}" for k, (key, value) in enumerate(zip(FIGURES, row, strict=True))}
    late = row[1] > row[3] or row[5] > row[7]
    table.add(
        bodies=name, islands=count, **figures, **missed(time=bool(late), **{k: bool(v) for k, v in below.items()})
    )


PARTS = (Part("packing", "islands packed beside Blender's own packer", packing_table, (BODIES,), by_default=False),)
