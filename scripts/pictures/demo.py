"""Do the main job on one real mesh: unwrap it, measure it beside Blender's own unwraps, and show it.

Writes a .blend with one object per method, pictures and a table to build/demo. The mesh is a published model where
OMT_UV_MODELS has it, a procedural head otherwise.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import numpy as np
from plates import area_colours
from renders import VIEWS, View, checker_material, render_checker, render_colours
from textures import checker, equal_density

from benchmarks.cases import load_case, meshes, our_uv
from benchmarks.parts.clicks import one_click, uv_of
from benchmarks.rivals import METHODS, make_object, unwrap, write_uv
from benchmarks.tables import Table
from benchmarks.timing import timed
from omt_uv.solver.maps.distortion import distortion, face_distortion
from omt_uv.solver.mesh.surface import triangle_surface

ONE_CLICK = "OMT UV one click"  # as *Unwrap* does, with nothing else set
# Along the seams that are there, as Blender's own.
OURS = {
    "OMT UV free": ("free", "standard"),
    "OMT UV free exact": ("free", "exact"),
    "OMT UV disk": ("disk", "standard"),
    "OMT UV square": ("square", "standard"),
}
COLUMNS = {"area_l1": 8, "area_sd": 8, "angle_mean": 10, "folds": 5, "overlap": 8, "seconds": 8}
CELLS = 300  # checker cells on the model
SHOWN = ("Blender Angle Based", "Blender Minimum Stretch 50", ONE_CLICK)  # in pictures


def all_maps(case):
    """Corner UVs (m,3,2) and processor seconds by method, Blender's first."""
    for method in METHODS:
        found = unwrap(case.V, case.F, case.seams, method)
        yield f"Blender {method}", found.uv, found.processor_seconds
    yield ONE_CLICK, *by_one_click(case)
    for name, (boundary, quality) in OURS.items():
        (uv, _), seconds = timed(lambda b=boundary, q=quality: our_uv(case, b, q))
        yield name, uv, seconds


def by_one_click(case):
    """Corner UVs (m,3,2) with seams that are found, and processor seconds."""
    surface = triangle_surface(case.V, case.F, case.seams)
    layout, seconds = one_click(surface)
    return uv_of(surface, layout)[surface.triangles], seconds


def add_objects(case, maps, material, up):
    """One object per method, side by side and upright, each with its map in the unit square."""
    step = 1.2 * np.ptp(case.V, axis=0)[0]
    for k, (name, uv) in enumerate(maps.items()):
        obj = make_object(case.V, case.F, case.seams, name)
        low, high = uv.reshape(-1, 2).min(0), uv.reshape(-1, 2).max(0)
        write_uv(obj, (uv - low) / (high - low).max())
        obj.data.materials.append(material)
        obj.data.shade_smooth()
        obj.location.x = k * step
        obj.rotation_euler.x = np.pi / 2 if up == "Y" else 0


def show_textures():
    """Let every 3D view of the file show the checker as it opens."""
    for area in (a for screen in bpy.data.screens for a in screen.areas if a.type == "VIEW_3D"):
        area.spaces.active.shading.color_type = "TEXTURE"
    bpy.ops.file.pack_all()


def slug(name):
    """The name of a method as part of a file's name."""
    return name.lower().replace(" ", "_")


def measured(case, folder):
    """Corner UVs (m,3,2) by method, and their figures as a table, printed and written."""
    table = Table(f"{case.name}, {len(case.F)} triangles: distortion", {"method": 28} | COLUMNS)
    maps = {}
    for name, uv, seconds in all_maps(case):
        figures = distortion(case.V, case.F, uv)
        table.add(method=name, seconds=seconds, **{c: getattr(figures, c) for c in COLUMNS if c != "seconds"})
        maps[name] = uv
    print("area_l1: share of texture in the wrong place, 0 is exact; angle_mean: shear s1/s2, 1 is conformal")
    table.write(folder / "distortion.tsv")
    return maps


def draw(case, maps, view, folder, texture):
    """Pictures of a few maps: the checker, and the area as colours."""
    for name in SHOWN:
        scaled = equal_density(case.V, case.F, maps[name], CELLS)
        render_checker(case.V, case.F, scaled, view, folder / f"checker_{slug(name)}.png", texture)
        colours = area_colours(face_distortion(case.V, case.F, maps[name])[0])
        render_colours(case.V, case.F, colours, view, folder / f"area_{slug(name)}.png")


def main():
    """Unwrap, measure, draw, and write the .blend."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="lion" if meshes.model_path("lion") else "head")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "demo")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)

    case = load_case(args.model)
    view = VIEWS.get(args.model, View())
    maps = measured(case, args.out)
    texture = checker(args.out / "checker.png")
    draw(case, maps, view, args.out, texture)
    add_objects(case, maps, checker_material(texture), view.up)
    show_textures()
    blend = args.out / f"{args.model}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=True)
    print(f"written: {blend} (one object per method) and the pictures in {args.out}")


if __name__ == "__main__":
    main()
