"""The main job on one real mesh: unwrap it, measure it beside Blender's own unwraps, and show it.

Writes a .blend with one object per method, pictures and a table to build/demo. The mesh is a published model where
OMT_UV_MODELS has it, a procedural head otherwise.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import bpy

import numpy as np
from cases import ROOT, Table, load_case, meshes, our_uv, timed
from pictures import VIEWS, View, area_colours, checker, checker_material, equal_density, render_checker, render_colours
from rivals import METHODS, make_object, unwrap, write_uv

from omt_uv.solver.maps.distortion import distortion, face_distortion

OURS = {
    "OMT UV free": ("free", "standard"),
    "OMT UV free exact": ("free", "exact"),
    "OMT UV disk": ("disk", "standard"),
    "OMT UV square": ("square", "standard"),
}
COLUMNS = {"area_l1": 8, "area_sd": 8, "angle_mean": 10, "folds": 5, "overlap": 8, "seconds": 8}
CELLS = 300  # checker cells on the model


def all_maps(case):
    """Corner UVs (m,3,2) and processor seconds by method, Blender's first."""
    for method in METHODS:
        found = unwrap(case.V, case.F, case.seams, method)
        yield f"Blender {method}", found.uv, found.processor_seconds
    for name, (boundary, quality) in OURS.items():
        (uv, _), seconds = timed(lambda b=boundary, q=quality: our_uv(case, b, q))
        yield name, uv, seconds


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
    return name.lower().replace(" ", "_")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", default="lion" if meshes.model_path("lion") else "head")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "demo")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)

    case = load_case(args.model)
    table = Table(f"{case.name}, {len(case.F)} triangles: distortion of one chart", {"method": 28} | COLUMNS)
    maps = {}
    for name, uv, seconds in all_maps(case):
        figures = distortion(case.V, case.F, uv)
        table.add(method=name, seconds=seconds, **{c: getattr(figures, c) for c in COLUMNS if c != "seconds"})
        maps[name] = uv
    print("area_l1: share of texture in the wrong place, 0 is exact; angle_mean: shear s1/s2, 1 is conformal")
    table.write(args.out / "distortion.tsv")

    texture = checker(args.out / "checker.png")
    view = VIEWS.get(args.model, View())
    for name in ("Blender Angle Based", "Blender Minimum Stretch 50", "OMT UV free"):
        uv = maps[name]
        scaled = equal_density(case.V, case.F, uv, CELLS)
        render_checker(case.V, case.F, scaled, view, args.out / f"checker_{slug(name)}.png", texture)
        colours = area_colours(face_distortion(case.V, case.F, uv)[0])
        render_colours(case.V, case.F, colours, view, args.out / f"area_{slug(name)}.png")
    add_objects(case, maps, checker_material(texture), view.up)
    show_textures()
    blend = args.out / f"{args.model}.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), compress=True)
    print(f"written: {blend} (one object per method) and the pictures in {args.out}")


if __name__ == "__main__":
    main()
