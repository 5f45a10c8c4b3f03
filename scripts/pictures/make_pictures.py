"""Make the pictures of the README: our unwrap beside Blender's own, on the same chart at the same texel density.

Needs bpy, matplotlib and published models (OMT_UV_MODELS); a procedural head where there are none.
usage: make_pictures.py [--models NAME ...] [--circles NAME ...] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "docs")]

import magnified_graph
import numpy as np
import pictures
import rivals
import world_map
from cases import load_case, meshes, our_uv
from remesh import quadriflow, shape
from sphere import sphere_figures

from omt_uv.pipelines.globe import GlobeJob, project
from omt_uv.settings import GlobeSettings
from omt_uv.solver.analysis.density import mean_curvature_density
from omt_uv.solver.globe.rotation import along_axes
from omt_uv.solver.globe.unfolding import polygons_of, unfold
from omt_uv.solver.maps.distortion import distortion, face_distortion
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial.component_maps import Original
from omt_uv.solver.remeshing.initial.disk_samples import STRATEGIES
from omt_uv.solver.remeshing.remesh import remesh

CELLS = {"lilium": 120}  # how many checker cells cover the model
CIRCLES = {"max_planck": 260}  # likewise, in squares as large as those of the checker
RIVALS = {"Blender Angle Based": "Angle Based", "Blender Minimum Stretch": "Minimum Stretch 50"}
OURS = "OMT UV"
GLOBES = ("max_planck", "bunny")
BALANCES = (0.0, 0.25, 0.5, 1.0)
REMESHED, REMESHED_COUNT = ("max_planck", "rocker_arm"), 3000


def maps(case):
    """Corner UVs (m,3,2) by title."""
    found = {title: rivals.unwrap(case.V, case.F, case.seams, method).uv for title, method in RIVALS.items()}
    found[OURS] = our_uv(case, "free", "standard")[0]
    return found


def gallery(name, out, scratch, pixels):
    """Three sheets of one model: the checker, the distortions as colours, and the layouts."""
    case = load_case(name)
    V, F = case.V, case.F
    view = view_of(name)
    texture = pictures.checker(scratch / "checker.png")
    checks, areas, shears, layouts, captions = [], [], [], [], []
    uvs = maps(case)
    for k, uv in enumerate(uvs.values()):
        octaves, shear = face_distortion(V, F, uv)
        area_rgb, shear_rgb = pictures.area_colours(octaves), pictures.shear_colours(shear)
        captions.append(caption(case, uv))
        for folder, suffix in ((checks, "checker"), (areas, "area"), (shears, "shear"), (layouts, "layout")):
            folder.append(scratch / f"{name}_{k}_{suffix}.png")
        scaled = pictures.equal_density(V, F, uv, CELLS.get(name, 300))
        pictures.render_checker(V, F, scaled, view, checks[-1], texture, pixels)
        pictures.render_colours(V, F, area_rgb, view, areas[-1], pixels)
        pictures.render_colours(V, F, shear_rgb, view, shears[-1], pixels)
        pictures.layout(uv, pictures.lit(V, F, area_rgb), layouts[-1], pixels)
    titles, blank = list(uvs), [""] * len(uvs)
    pictures.sheet(out / f"{name}_checker.png", titles, [("", checks, captions, None)])
    rows = [("area", areas, blank, pictures.AREA_SCALE), ("shear", shears, captions, pictures.SHEAR_SCALE)]
    pictures.sheet(out / f"{name}_distortion.png", titles, rows)
    pictures.sheet(out / f"{name}_layout.png", titles, [("", layouts, captions, pictures.AREA_SCALE)])


def balance_sheet(name, out, scratch, pixels):
    """One sheet of the slider from exact area to conformal."""
    case = load_case(name)
    texture = pictures.checker(scratch / "checker.png")
    renders, layouts, captions = [], [], []
    for balance in BALANCES:
        uv, _ = our_uv(case, "free", "standard", balance)
        captions.append(caption(case, uv))
        renders.append(scratch / f"balance_{balance}.png")
        layouts.append(scratch / f"balance_{balance}_layout.png")
        scaled = pictures.equal_density(case.V, case.F, uv, CELLS.get(name, 300))
        pictures.render_checker(case.V, case.F, scaled, view_of(name), renders[-1], texture, pixels)
        octaves, _ = face_distortion(case.V, case.F, uv)
        rgb = pictures.lit(case.V, case.F, pictures.area_colours(octaves))
        pictures.layout(uv, rgb, layouts[-1], pixels)
    titles = [f"balance {b:g}" for b in BALANCES]
    rows = [("", renders, captions, None), ("", layouts, [""] * len(BALANCES), pictures.AREA_SCALE)]
    pictures.sheet(out / f"{name}_balance.png", titles, rows)


def globe_sheet(names, out, scratch, pixels):
    """A map of the world on closed models, from conformal to area preserving, by their equirectangular layouts."""
    world = world_map.draw(scratch / "world.png")
    rows = []
    for name in names:
        V, F = meshes.load_model(name)
        view = view_of(name)
        turned = V @ pictures.front_to_south(view).T
        renders, captions = [], []
        for k, (points, uv) in enumerate(globe_maps(turned, F)):
            renders.append(scratch / f"{name}_globe_{k}.png")
            pictures.render_checker(V, F, uv, view, renders[-1], world, pixels)
            captions.append(sphere_caption(V, F, points))
        rows.append((name.replace("_", " "), renders, captions, None))
    pictures.sheet(out / "globes.png", ["Conformal", "Balance 0.5", "Area preserving"], rows)


def globe_maps(V, F):
    """Maps to the sphere (n,3) from conformal to area preserving, and their equirectangular UVs (m,3,2)."""
    maps = []
    for balance in (0.5, 0.0):
        settings = GlobeSettings(projection="equirect", balance=balance)
        globe = drain(project([GlobeJob(triangle_surface(V, F))], settings)).globes[0][0]
        maps.append((globe.points, globe.uv.reshape(-1, 3, 2)))
    conformal = globe.sphere.conformal @ along_axes(globe.sphere.conformal, V, F).T
    polygons, _ = polygons_of(globe.part.corners, F, globe.part.faces)
    unfolded, _ = unfold(conformal, polygons, "equirect")
    return [(conformal, unfolded.corners()[polygons.triangles]), *maps]


def sphere_caption(V, F, points):
    figures = sphere_figures(V, F, points)
    return f"area error {figures['area_l1']:.3f}   shear {figures['angle_mean']:.2f}"


def circle_sheet(name, out, scratch, pixels):
    """A packing of equal circles on the surface: a conformal map keeps them round, ours keeps their areas.

    As Su 2015, figure 14.
    """
    case = load_case(name)
    texture = pictures.circle_packing(scratch / "circles.png")
    uvs = {"Blender Angle Based: any size": rivals.unwrap(case.V, case.F, case.seams, "Angle Based").uv}
    for balance, title in ((0.5, "OMT UV, balance 0.5"), (0.0, "OMT UV: one size")):
        uvs[title] = our_uv(case, "free", "standard", balance)[0]
    renders, layouts, captions = [], [], []
    for k, uv in enumerate(uvs.values()):
        renders.append(scratch / f"{name}_circles_{k}.png")
        layouts.append(scratch / f"{name}_circles_{k}_layout.png")
        captions.append(caption(case, uv))
        scaled = pictures.equal_density(case.V, case.F, uv, CIRCLES.get(name, 600))
        pictures.render_checker(case.V, case.F, scaled, view_of(name), renders[-1], texture, pixels)
        octaves, _ = face_distortion(case.V, case.F, uv)
        pictures.layout(uv, pictures.lit(case.V, case.F, pictures.area_colours(octaves)), layouts[-1], pixels)
    rows = [("", renders, captions, None), ("", layouts, [""] * len(uvs), pictures.AREA_SCALE)]
    pictures.sheet(out / f"{name}_circles.png", list(uvs), rows)


def remesh_sheet(names, out, scratch, pixels):
    """Wireframes of about as many vertices: QuadriFlow's, and ours, uniform and by curvature."""
    rows = []
    for name in names:
        V, F = meshes.load_model(name)
        found = [
            quadriflow(V, F, REMESHED_COUNT)[0],
            _remeshed(V, F, None),
            _remeshed(V, F, mean_curvature_density(V, F, 2.0)),
        ]
        renders, captions = [], []
        for k, (W, G) in enumerate([(V, F), *found]):
            renders.append(scratch / f"{name}_wires_{k}.png")
            pictures.render_wires(W, G, view_of(name), renders[-1], pixels)
            figures = shape(W, G)
            captions.append(f"{len(np.unique(G)):,} vertices, {figures['below 30 %']:.1f} % below 30 degrees")
        rows.append((name.replace("_", " "), renders, captions, None))
    titles = ["Input", "Blender QuadriFlow", f"{OURS}, uniform", f"{OURS}, by curvature"]
    pictures.sheet(out / "remesh.png", titles, rows)


def _remeshed(V, F, density):
    found = drain(remesh(V, F, REMESHED_COUNT, density=density))
    return found.vertices, found.triangles


def strategies_sheet(name, out, scratch, pixels):
    """Wireframes of the four pairs of maps to sample and to triangulate on (B. Gu 2018, figure 5)."""
    V, F = meshes.load_model(name)
    original, renders, captions = Original(V, F), [], []
    for strategy in STRATEGIES:
        found = drain(remesh(V, F, REMESHED_COUNT, strategy=strategy, original=original))
        renders.append(scratch / f"{name}_{strategy}.png")
        pictures.render_wires(found.vertices, found.triangles, view_of(name), renders[-1], pixels)
        figures = shape(found.vertices, found.triangles)
        captions.append(f"angle_p1 {figures['angle_p1']:.1f}, edges vary by {figures['edge_cv']:.2f}")
    titles = [strategy.upper() for strategy in STRATEGIES]
    pictures.sheet(out / "strategies.png", titles, [("", renders, captions, None)])


def caption(case, uv):
    figures = distortion(case.V, case.F, uv)
    return f"area error {figures.area_l1:.3f}   shear {figures.angle_mean:.2f}"


def view_of(name):
    return pictures.VIEWS.get(name, pictures.View())


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    present = [n for n in ("face", "lion", "lilium", "max_planck") if meshes.model_path(n)]
    parser.add_argument("--models", nargs="*", default=present or ["head"])
    found = [n for n in ("lion", "max_planck") if n in present]
    parser.add_argument("--circles", nargs="*", default=found or ["head"], help="models with a circle packing on them")
    parser.add_argument("--globes", nargs="*", default=GLOBES, help="closed models with a map of the world")
    parser.add_argument("--remeshed", nargs="*", default=REMESHED, help="models whose remeshes are drawn as wires")
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "pictures")
    parser.add_argument("--pixels", type=int, default=400, help="of one panel")
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        for name in args.circles:
            circle_sheet(name, args.out, Path(scratch), args.pixels)
        for name in args.models:
            gallery(name, args.out, Path(scratch), args.pixels)
        globes = [n for n in args.globes if meshes.model_path(n)]
        if globes:
            globe_sheet(globes, args.out, Path(scratch), 5 * args.pixels // 4)
        remeshed = [n for n in args.remeshed if meshes.model_path(n)]
        if remeshed:
            remesh_sheet(remeshed, args.out, Path(scratch), 5 * args.pixels // 4)
            strategies_sheet(remeshed[0], args.out, Path(scratch), 5 * args.pixels // 4)
        favourite = "lion" if "lion" in args.models else next(iter(args.models), "")
        if favourite:
            balance_sheet(favourite, args.out, Path(scratch), 3 * args.pixels // 4)
    magnified_graph.make(args.out / "graph_magnified.png")
    for path in sorted(args.out.glob("*.png")):
        print(f"{path} {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
