"""Draw maps of models side by side: the checker from the front and the back with the cuts in red, and the layouts.

    python scripts/pictures/compare.py MODEL... [--methods ours smart stretch angle given] [--rows front back layout]

A row (or three) for every model, a column for every method, figures below. `given` takes FOLDER/MODEL.obj with UVs of
another program; `stretch` and `angle` are Blender's Minimum Stretch and Angle Based on the cuts of ours, or of the
given maps where their symmetric Dirichlet energy is less there. A method that some model has no map of is left out.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import plates
import renders
import rival_maps
import textures
from rival_maps import DrawnMap

from benchmarks.cases import meshes
from omt_uv.files.meshes import load
from omt_uv.pipelines.reading import Y_UP

CELLS = 400  # checker cells on a model
TITLES = {
    "smart": "Smart UV Project",
    "stretch": "Minimum Stretch",
    "angle": "Angle Based",
    "given": "OptCuts",
    "ours": "OMT UV",
}
ROWS = ("front", "back", "layout")


def maps_of(name, methods, folder=None) -> dict[str, DrawnMap]:
    """The maps of a model by method; those that are not to be had are left out."""
    path = meshes.model_path(name)
    found = {"ours": rival_maps.ours(load(path)[0], Y_UP if view_of(name).up == "Y" else None)}
    given = folder / f"{name}.obj" if folder else None
    if given and given.is_file():
        found["given"] = rival_maps.from_file(given)
    for method, blender in (("stretch", "Minimum Stretch 50"), ("angle", "Angle Based")):
        if method in methods:
            tried = [rival_maps.blender_unwrap(load(path)[0], f.cut, blender) for f in list(found.values())[:2]]
            found[method] = min(tried, key=lambda f: rival_maps.figures_of(f).energy)
    if "smart" in methods:
        found["smart"] = rival_maps.smart_project(load(path)[0])
    return {method: found[method] for method in methods if method in found}


def view_of(name):
    """The camera of a model."""
    return renders.VIEWS.get(name, renders.View())


def draw(name, maps, rows, scratch, pixels, cells=CELLS):
    """Pictures of the rows by method, as `plates.plate` takes them: (title, paths, captions, scale) for every row."""
    view = view_of(name)
    views = {"front": view, "back": replace(view, azimuth=view.azimuth + 180)}
    texture = textures.checker(scratch / "checker.png")
    figures = [rival_maps.figures_of(found).caption() for found in maps.values()]
    drawn = []
    for row in rows:
        paths = [scratch / f"{name}_{method}_{row}.png" for method in maps]
        for path, found in zip(paths, maps.values(), strict=True):
            if row == "layout":
                rgb = plates.lit(found.V, found.F, plates.shear_colours(rival_maps.shear_of(found)))
                plates.layout(found.uv, rgb, path, pixels, rival_maps.outline(found))
            else:
                uv = textures.equal_density(found.V, found.F, found.uv, cells)
                renders.render_cut(replace(found, uv=uv), views[row], path, texture, pixels)
        captions = figures if row == rows[-1] else [""] * len(paths)
        scale = plates.SHEAR_SCALE if row == "layout" else None
        title = name if row == rows[0] else row
        drawn.append((title.removeprefix("optcuts_").replace("_", " "), paths, captions, scale))
    return drawn


def draw_bodies(path, columns, maps, views, cells, pixels):
    """Write a plate of bodies that are no models: a row of checkers and one of layouts for each, maps by name and
    column, and views by name; cells : of the checker, on a body."""
    renders.VIEWS.update(views)
    with tempfile.TemporaryDirectory() as scratch:
        rows = [r for name in maps for r in draw(name, maps[name], ("front", "layout"), Path(scratch), pixels, cells)]
        plates.plate(path, columns, rows)
    print(f"{path} {path.stat().st_size // 1000} kB")


def main():
    """Map, draw, and write one plate."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("models", nargs="+")
    parser.add_argument("--methods", nargs="*", choices=TITLES, default=list(TITLES))
    parser.add_argument("--rows", nargs="*", choices=ROWS, default=list(ROWS))
    parser.add_argument("--given", type=Path, metavar="FOLDER", help="maps of another program, MODEL.obj each")
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "compare.png")
    parser.add_argument("--pixels", type=int, default=400, help="of one picture")
    args = parser.parse_args()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        rows = []
        every = {name: maps_of(name, args.methods, args.given) for name in args.models}
        methods = [m for m in args.methods if all(m in maps for maps in every.values())]
        for name, maps in every.items():
            for method, found in maps.items():
                figures = rival_maps.figures_of(found)
                print(f"{name:22} {method:8} {figures.caption()}   {figures.islands} islands, {found.seconds:.1f} s")
            rows += draw(name, {method: maps[method] for method in methods}, args.rows, Path(folder), args.pixels)
        plates.plate(args.out, [TITLES[method] for method in methods], rows)
    print(f"{args.out} {args.out.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
