"""Dominitz, Tannenbaum 2010, Texture mapping via optimal mass transport: tables 1 and 2, figure 14.

usage: dominitz_tannenbaum_2010.py [model ...]      writes build/papers/dominitz_tannenbaum_2010
"""

from __future__ import annotations

import sys

from common import BUILD, models, told

FOLDER = BUILD / "dominitz_tannenbaum_2010"
# Models, and what the paper has of its own meshes of them: means of r + 1/r of areas and of s + 1/s of shear.
PAPER = {"max_planck": (2.007, 2.29), "stanford_bunny": (2.66, 2.76)}
METHODS = ("newton", "flow")


def spheres() -> tuple[list[dict], list[dict]]:
    """Rows of the methods of each model, and those of the costs of the flow, step by step."""
    import meshes

    from omt_uv.pipelines.globe import GlobeJob, project
    from omt_uv.settings import GlobeSettings
    from omt_uv.solver.mesh.surface import triangle_surface
    from omt_uv.solver.progress import drain
    from omt_uv.solver.sphere.figures import sphere_figures

    rows: list[dict] = []
    costs: list[dict] = []
    for name in models(sys.argv[1:] or tuple(PAPER)):
        surface = triangle_surface(*meshes.load_model(name))
        for method in METHODS:
            settings = GlobeSettings(projection="lambert", method=method, fill_holes=True)
            (globe,) = drain(project([GlobeJob(surface)], settings)).globes[0]
            component, n = globe.component, len(globe.component.vertices)
            places = {f"{method}, refined": globe.sphere.positions}
            if globe.sphere.flow is not None:
                flow = globe.sphere.flow
                places = {"conformal": globe.sphere.conformal, "Moser": flow.moser, "flow": flow.positions} | places
                costs += [{"model": name, "step": k, "cost": f"{cost:.8f}"} for k, cost in enumerate(flow.costs)]
            for title, positions in places.items():
                figures = sphere_figures(component.vertices, component.triangles, positions[:n])
                rows.append(_row(name, len(component.triangles), title, figures))
        if name in PAPER:
            rows.append(_paper(name))
    return rows, costs


def _row(name: str, triangles: int, title: str, figures) -> dict:
    return {
        "model": name,
        "triangles": triangles,
        "map": title,
        "area: mean r + 1/r": figures.symmetric_area,
        "angle: mean s + 1/s": figures.symmetric_angle,
        "area error": figures.area_l1,
        "folds": figures.folds,
    }


def _paper(name: str) -> dict:
    area, angle = PAPER[name]
    row = {"model": name, "triangles": "", "map": "the paper, of its mesh", "area: mean r + 1/r": area}
    return row | {"angle: mean s + 1/s": angle, "area error": "", "folds": ""}


def main() -> None:
    rows, costs = spheres()
    told(FOLDER, "tables", rows)
    told(FOLDER, "costs", costs)


if __name__ == "__main__":
    main()
