"""Zhao et al. 2013, Area-preservation mapping using optimal mass transport: maps, cells, regions, and a city.

usage: zhao_2013.py      writes build/papers/zhao_2013
"""

from __future__ import annotations

import numpy as np
from city import city
from common import BUILD, models, saved, told

FOLDER = BUILD / "zhao_2013"
MODELS = ("lion", "face", "snail")
# Of three regions, their centres and radii in a plane, and their factors.
REGIONS = ((0.3, 0.35, 0.1, 4.0), (0.7, 0.6, 0.12, 2.5), (0.35, 0.75, 0.08, 0.5))
GRID = 80
# The city: pixels of the map, what the inset shows, how many times finer, and how many times as large it becomes.
PIXELS = 512
INSET = (0.4, 0.5, 0.6, 0.7)
FINER = 8
FACTOR = 9.0


def maps() -> list[dict]:
    """Conformal, transported and refined maps of disks, beside one another."""
    import meshes

    from omt_uv.solver.mesh.charts import strict_charts
    from omt_uv.solver.mesh.surface import triangle_surface
    from omt_uv.solver.parameterization.chart_map import map_chart
    from omt_uv.solver.parameterization.options import MapOptions
    from omt_uv.solver.progress import drain

    rows = []
    for name in models(MODELS):
        V, F = meshes.load_model(name)
        (chart,) = strict_charts(triangle_surface(V, F))
        for kind in ("conformal", "polar", "authalic"):
            found = drain(map_chart(chart, options=MapOptions(boundary="disk", kind=kind)))
            rows.append(
                {
                    "model": name,
                    "triangles": len(F),
                    "map": {"polar": "transport", "authalic": "refined"}.get(kind, kind),
                    "area error": found.area_l1,
                    "shear": found.angle_mean,
                    "Newton": found.newton_transport or 0,
                    "largest error of a cell": found.residual_transport or 0.0,
                }
            )
    return rows


def cells() -> list[np.ndarray]:
    """Power diagrams of the disk and of the sphere (figure 4)."""
    import meshes

    from omt_uv.display.textures.layouts import cells_picture
    from omt_uv.pipelines.measuring.diagrams import diagram
    from omt_uv.solver.mesh.surface import triangle_surface
    from omt_uv.solver.progress import drain

    found = []
    for name, domain in (("snail", "disk"), ("bunny_small", "sphere")):
        if meshes.model_path(name):
            surface = triangle_surface(*meshes.load_model(name))
            found.append(cells_picture(drain(diagram(surface, None, domain)), 720))
    return found


def regions() -> list[dict]:
    """Three regions of a plane with factors of their own (sections 4 and 5.1)."""
    import meshes

    from omt_uv.solver.analysis.joint_density import shares_of
    from omt_uv.solver.editing.magnify_regions import magnify_regions
    from omt_uv.solver.mesh.geometry import signed_areas
    from omt_uv.solver.progress import drain

    V, F = meshes.grid(GRID, GRID)
    middle = V[F].mean(axis=1)[:, :2]
    painted = np.array([_soft(middle, np.array([x, y]), radius) for x, y, radius, _ in REGIONS])
    found = drain(magnify_regions(V[:, :2], F, painted, [factor for *_, factor in REGIONS]))
    before, after = (shares_of(painted, np.abs(signed_areas(uv, F))) for uv in (V[:, :2], found.uv))
    return [
        {
            "region": k + 1,
            "factor": factor,
            "share before": float(before[k]),
            "share asked": float(factor * before[k]),
            "share after": float(after[k]),
            "off by %": float(100 * abs(after[k] / (factor * before[k]) - 1)),
        }
        for k, (*_, factor) in enumerate(REGIONS)
    ]


def _soft(points: np.ndarray, centre: np.ndarray, radius: float) -> np.ndarray:
    """Weights (m,) of a disk with a soft border."""
    return np.clip(1.6 - np.linalg.norm(points - centre, axis=1) / radius, 0, 1)


def city_map() -> list[np.ndarray]:
    """A city, its middle magnified: by its own pixels, and with a picture of eight times the resolution laid over."""
    import meshes

    from omt_uv.solver.editing.inset_images import InsetImage, warp_with_insets
    from omt_uv.solver.editing.magnify import magnify_region
    from omt_uv.solver.progress import drain

    V, F = meshes.grid(GRID, GRID)
    uv = V[:, :2]
    low, high = np.array(INSET[:2]), np.array(INSET[2:])
    apart = np.abs(V[F].mean(axis=1)[:, :2] - (low + high) / 2).max(axis=1) / ((high - low)[0] / 2)
    found = drain(magnify_region(uv, F, np.clip((1.3 - apart) / 0.5, 0, 1), FACTOR))
    plain = city((0, 0), (1, 1), PIXELS, PIXELS)
    pixels = round(PIXELS * FINER * float((high - low)[0]))
    inset = InsetImage(city(low, high, pixels, pixels), tuple(low.tolist()), tuple(high.tolist()))
    size = (2 * PIXELS, 2 * PIXELS)
    blurred, sharp = (warp_with_insets(plain, uv[F], found.uv[F], insets, size) for insets in ([], [inset]))
    return [plain[::-1], blurred[::-1], sharp[::-1]]


def main() -> None:
    told(FOLDER, "maps", maps())
    told(FOLDER, "regions", regions())
    saved(FOLDER / "cells.png", cells(), 480)
    saved(FOLDER / "city.png", city_map(), 640)
    print(f"\nPictures are in {FOLDER}")


if __name__ == "__main__":
    main()
