"""Make the pictures of the README: our unwrap beside Blender's own, on the same chart at the same texel density.

Needs bpy, matplotlib and published models (OMT_UV_MODELS); a procedural head where there are none.
usage: make_pictures.py [--models NAME ...] [--circles NAME ...] [--out FOLDER]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

import magnified_graph
import numpy as np
import plates
import renders
import textures
import world_map

from benchmarks import rivals
from benchmarks.cases import load_case, meshes, our_uv
from benchmarks.parts.remesh import quadriflow, shape
from omt_uv.pipelines.globe import GlobeJob, project
from omt_uv.settings import GlobeSettings
from omt_uv.solver.analysis.density import mean_curvature_density
from omt_uv.solver.globe.rotation import along_axes
from omt_uv.solver.globe.unfolding import gather_polygons, unfold
from omt_uv.solver.maps.distortion import distortion, face_distortion
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import STRATEGIES, RemeshOptions, RemeshSource, remesh
from omt_uv.solver.sphere.figures import sphere_figures

CELLS = {"lilium": 120}  # how many checker cells cover the model
CIRCLES = {"max_planck": 260}  # likewise, in squares as large as those of the checker
RIVALS = {"Blender Angle Based": "Angle Based", "Blender Minimum Stretch": "Minimum Stretch 50"}
OURS = "OMT UV"
GLOBES = ("max_planck", "bunny")
BALANCES = (0.0, 0.25, 0.5, 1.0)
REMESHED = ("max_planck", "rocker_arm")
VERTEX_COUNT = 3000  # of remeshes
GALLERY = ("face", "lion", "lilium", "max_planck")
CHECKERS = 300  # cells on a model that CELLS does not name
PACKED = 600  # likewise of CIRCLES


def maps(case):
    """Corner UVs (m,3,2) by title."""
    found = {title: rivals.unwrap(case.V, case.F, case.seams, method).uv for title, method in RIVALS.items()}
    found[OURS] = our_uv(case, "free", "standard")[0]
    return found


def gallery(name, out, scratch, pixels):
    """Three plates of one model: the checker, the distortions as colours, and the layouts."""
    case = load_case(name)
    V, F = case.V, case.F
    view = view_of(name)
    texture = textures.checker(scratch / "checker.png")
    captions = []
    checks: list[Path] = []
    areas: list[Path] = []
    shears: list[Path] = []
    layouts: list[Path] = []
    uvs = maps(case)
    for k, uv in enumerate(uvs.values()):
        octaves, shear = face_distortion(V, F, uv)
        area_rgb, shear_rgb = plates.area_colours(octaves), plates.shear_colours(shear)
        captions.append(caption(case, uv))
        for folder, suffix in ((checks, "checker"), (areas, "area"), (shears, "shear"), (layouts, "layout")):
            folder.append(scratch / f"{name}_{k}_{suffix}.png")
        scaled = textures.equal_density(V, F, uv, CELLS.get(name, CHECKERS))
        renders.render_checker(V, F, scaled, view, checks[-1], texture, pixels)
        renders.render_colours(V, F, area_rgb, view, areas[-1], pixels)
        renders.render_colours(V, F, shear_rgb, view, shears[-1], pixels)
        plates.layout(uv, plates.lit(V, F, area_rgb), layouts[-1], pixels)
    titles, blank = list(uvs), [""] * len(uvs)
    plates.plate(out / f"{name}_checker.png", titles, [("", checks, captions, None)])
    rows = [("area", areas, blank, plates.AREA_SCALE), ("shear", shears, captions, plates.SHEAR_SCALE)]
    plates.plate(out / f"{name}_distortion.png", titles, rows)
    plates.plate(out / f"{name}_layout.png", titles, [("", layouts, captions, plates.AREA_SCALE)])


def balance_plate(name, out, scratch, pixels):
    """One plate of the slider from exact area to conformal."""
    case = load_case(name)
    texture = textures.checker(scratch / "checker.png")
    drawn, layouts, captions = [], [], []
    for balance in BALANCES:
        uv, _ = our_uv(case, "free", "standard", balance)
        captions.append(caption(case, uv))
        drawn.append(scratch / f"balance_{balance}.png")
        layouts.append(scratch / f"balance_{balance}_layout.png")
        scaled = textures.equal_density(case.V, case.F, uv, CELLS.get(name, CHECKERS))
        renders.render_checker(case.V, case.F, scaled, view_of(name), drawn[-1], texture, pixels)
        octaves, _ = face_distortion(case.V, case.F, uv)
        rgb = plates.lit(case.V, case.F, plates.area_colours(octaves))
        plates.layout(uv, rgb, layouts[-1], pixels)
    titles = [f"balance {b:g}" for b in BALANCES]
    rows = [("", drawn, captions, None), ("", layouts, [""] * len(BALANCES), plates.AREA_SCALE)]
    plates.plate(out / f"{name}_balance.png", titles, rows)


def globe_plate(names, out, scratch, pixels):
    """A map of the world on closed models, from conformal to area preserving, by their equirectangular layouts."""
    world = world_map.draw(scratch / "world.png")
    rows = []
    for name in names:
        V, F = meshes.load_model(name)
        view = view_of(name)
        turned = V @ renders.front_to_south(view).T
        drawn, captions = [], []
        for k, (points, uv) in enumerate(globe_maps(turned, F)):
            drawn.append(scratch / f"{name}_globe_{k}.png")
            renders.render_checker(V, F, uv, view, drawn[-1], world, pixels)
            captions.append(sphere_caption(V, F, points))
        rows.append((name.replace("_", " "), drawn, captions, None))
    plates.plate(out / "globes.png", ["Conformal", "Balance 0.5", "Area preserving"], rows)


def globe_maps(V, F):
    """Maps to the sphere (n,3) from conformal to area preserving, and their equirectangular UVs (m,3,2)."""
    maps = []
    for balance in (0.5, 0.0):
        settings = GlobeSettings(projection="equirect", balance=balance)
        globe = drain(project([GlobeJob(triangle_surface(V, F))], settings)).globes[0][0]
        maps.append((globe.points, globe.uv.reshape(-1, 3, 2)))
    conformal = globe.sphere.conformal @ along_axes(globe.sphere.conformal, V, F).T
    polygons, _ = gather_polygons(globe.component.corners, F, globe.component.faces)
    unfolded, _ = unfold(conformal, polygons, "equirect")
    return [(conformal, unfolded.corners()[polygons.triangles]), *maps]


def sphere_caption(V, F, points):
    """Area error and shear of a map to the sphere (n,3)."""
    figures = sphere_figures(V, F, points)
    return f"area error {figures.area_l1:.3f}   shear {figures.angle_mean:.2f}"


def circle_plate(name, out, scratch, pixels):
    """A packing of equal circles on the surface: a conformal map keeps them round, ours keeps their areas.

    As Su 2015, figure 14.
    """
    case = load_case(name)
    texture = textures.circle_packing(scratch / "circles.png")
    uvs = {"Blender Angle Based: any size": rivals.unwrap(case.V, case.F, case.seams, "Angle Based").uv}
    for balance, title in ((0.5, "OMT UV, balance 0.5"), (0.0, "OMT UV: one size")):
        uvs[title] = our_uv(case, "free", "standard", balance)[0]
    drawn, layouts, captions = [], [], []
    for k, uv in enumerate(uvs.values()):
        drawn.append(scratch / f"{name}_circles_{k}.png")
        layouts.append(scratch / f"{name}_circles_{k}_layout.png")
        captions.append(caption(case, uv))
        scaled = textures.equal_density(case.V, case.F, uv, CIRCLES.get(name, PACKED))
        renders.render_checker(case.V, case.F, scaled, view_of(name), drawn[-1], texture, pixels)
        octaves, _ = face_distortion(case.V, case.F, uv)
        plates.layout(uv, plates.lit(case.V, case.F, plates.area_colours(octaves)), layouts[-1], pixels)
    rows = [("", drawn, captions, None), ("", layouts, [""] * len(uvs), plates.AREA_SCALE)]
    plates.plate(out / f"{name}_circles.png", list(uvs), rows)


def remesh_plate(names, out, scratch, pixels):
    """Wireframes of about as many vertices: QuadriFlow's, and ours, uniform and by curvature."""
    rows = []
    for name in names:
        V, F = meshes.load_model(name)
        found = [
            quadriflow(V, F, VERTEX_COUNT)[0],
            _remeshed(V, F, None),
            _remeshed(V, F, mean_curvature_density(V, F, 2.0)),
        ]
        drawn, captions = [], []
        for k, (W, G) in enumerate([(V, F), *found]):
            drawn.append(scratch / f"{name}_wires_{k}.png")
            renders.render_wires(W, G, view_of(name), drawn[-1], pixels)
            figures = shape(W, G)
            captions.append(f"{len(np.unique(G)):,} vertices, {figures['below 30 %']:.1f} % below 30 degrees")
        rows.append((name.replace("_", " "), drawn, captions, None))
    titles = ["Input", "Blender QuadriFlow", f"{OURS}, uniform", f"{OURS}, by curvature"]
    plates.plate(out / "remesh.png", titles, rows)


def _remeshed(V, F, density):
    found = drain(remesh(RemeshSource(V, F), VERTEX_COUNT, density=density))
    return found.vertices, found.triangles


def strategies_plate(name, out, scratch, pixels):
    """Wireframes of the four pairs of maps to sample and to triangulate on (B. Gu 2018, figure 5)."""
    V, F = meshes.load_model(name)
    source, drawn, captions = RemeshSource(V, F), [], []
    for strategy in STRATEGIES:
        found = drain(remesh(source, VERTEX_COUNT, RemeshOptions(strategy=strategy)))
        drawn.append(scratch / f"{name}_{strategy}.png")
        renders.render_wires(found.vertices, found.triangles, view_of(name), drawn[-1], pixels)
        figures = shape(found.vertices, found.triangles)
        captions.append(f"angle_p1 {figures['angle_p1']:.1f}, edges vary by {figures['edge_cv']:.2f}")
    titles = [strategy.upper() for strategy in STRATEGIES]
    plates.plate(out / "strategies.png", titles, [("", drawn, captions, None)])


def caption(case, uv):
    """Area error and shear of corner UVs (m,3,2)."""
    figures = distortion(case.V, case.F, uv)
    return f"area error {figures.area_l1:.3f}   shear {figures.angle_mean:.2f}"


def view_of(name):
    """The camera of a model, or the usual one."""
    return renders.VIEWS.get(name, renders.View())


def main():
    """Make the plates whose models are at hand."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    present = [n for n in GALLERY if meshes.model_path(n)]
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
            circle_plate(name, args.out, Path(scratch), args.pixels)
        for name in args.models:
            gallery(name, args.out, Path(scratch), args.pixels)
        globes = [n for n in args.globes if meshes.model_path(n)]
        if globes:
            globe_plate(globes, args.out, Path(scratch), 5 * args.pixels // 4)
        remeshed = [n for n in args.remeshed if meshes.model_path(n)]
        if remeshed:
            remesh_plate(remeshed, args.out, Path(scratch), 5 * args.pixels // 4)
            strategies_plate(remeshed[0], args.out, Path(scratch), 5 * args.pixels // 4)
        favourite = "lion" if "lion" in args.models else next(iter(args.models), "")
        if favourite:
            balance_plate(favourite, args.out, Path(scratch), 3 * args.pixels // 4)
    magnified_graph.make(args.out / "graph_magnified.png")
    for path in sorted(args.out.glob("*.png")):
        print(f"{path} {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
