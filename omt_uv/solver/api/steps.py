"""Run the solvers step by step: generators of `Progress` that return what the functions of the same names return.

For progress bars and windows: step them, stop when you like, or close them to cancel. Parameters, errors and examples
stand with the functions, in `omt_uv.solver.api.functions`.
"""

from __future__ import annotations

import numpy as np

from .. import remeshing
from ..analysis.density import Target, means_of_corners, region_share
from ..analysis.region_density import target_density
from ..editing.magnify import magnify_region
from ..editing.refine_island import refine_island
from ..editing.uv_islands import uv_islands
from ..maps.distortion import distortion
from ..mesh.charts import triangle_rows
from ..mesh.geometry import signed_areas
from ..mesh.polygon_areas import polygon_areas
from ..mesh.surface import Surface
from ..parameterization import unwrap as unwrapping
from ..parameterization.chart_indices import CornerPins
from ..parameterization.options import UnwrapOptions
from ..progress import Steps, part_of
from ..remeshing import Remesh
from ..sphere import sphere_map as spheres
from ..sphere.sphere_map import SphereMap
from .arrays import (
    Faces,
    from_corners,
    marked_corners,
    of_faces,
    of_vertices,
    pairs_of,
    polygon_surface,
    to_corners,
)
from .results import MagnifiedUVs, UVs

# Room between islands that are laid side by side, over the side of a square of the same area.
GAP = 0.01


def unwrap(
    vertices: np.ndarray, faces: Faces, *, seams=(), density=None, pins=None, cuts: str = "auto", **options
) -> Steps[UVs]:
    """Unwrap polygons step by step, see `functions.unwrap`."""
    surface = polygon_surface(vertices, faces, seams)
    corner_pins = None
    if pins is not None:
        corner_pins = CornerPins(marked_corners(pins[0], surface, "pins"), to_corners(pins[1], surface))
    target = None if density is None else Target(of_faces(density, surface, "density")[surface.triangle_face], None)
    found = yield from unwrapping.unwrap(
        surface, options=UnwrapOptions(seams=cuts, **options), pins=corner_pins, target=target
    )
    corners, uv = found.corner_uv()
    corner_uv = np.zeros((len(surface.corner_vertex), 2))
    corner_uv[corners] = uv
    if pins is None:
        corner_uv = _side_by_side(corner_uv, [np.unique(chart.corners) for chart in found.charts])
    texts = [*found.warnings, *(text for chart_map in found.maps for text in chart_map.warnings)]
    return UVs(
        uv=from_corners(corner_uv, faces),
        seams=found.seams,
        figures=_figures(surface, corner_uv, density),
        warnings=tuple(dict.fromkeys(texts)),
    )


def refine(
    vertices: np.ndarray, faces: Faces, uv: np.ndarray, *, balance: float = 0.0, quality: str = "standard"
) -> Steps[UVs]:
    """Refine existing UVs step by step, see `functions.refine`."""
    surface = polygon_surface(vertices, faces)
    corner_uv = to_corners(uv, surface).copy()
    found = uv_islands(surface, corner_uv)
    texts, sizes = list(found.warnings), [len(island.chart.triangles) for island in found.islands]
    refined, covered, space = [], [], []
    for k, island in enumerate(found.islands):
        chart = island.chart
        steps = refine_island(
            chart.vertices, chart.triangles, island.uv, balance=balance, quality=quality, polygons=chart.faces
        )
        done = yield from part_of(steps, sum(sizes[:k]) / sum(sizes), sizes[k] / sum(sizes))
        refined.append(done.uv)
        covered.append(abs(signed_areas(done.uv, island.chart.triangles).sum()))
        chart = island.chart
        space.append(polygon_areas(chart.vertices, chart.triangles, chart.faces).sum())
        texts += done.warnings
    density = sum(covered) / sum(space)
    for k, island in enumerate(found.islands):
        centre = refined[k].mean(axis=0)
        place = centre + (refined[k] - centre) * np.sqrt(density * space[k] / covered[k])
        corner_uv[island.chart.corners] = place[island.chart.triangles]
    return UVs(
        uv=from_corners(corner_uv, faces),
        seams=np.zeros((0, 2), np.int64),
        figures=_figures(surface, corner_uv),
        warnings=tuple(dict.fromkeys(texts)),
    )


def magnify(
    vertices: np.ndarray, faces: Faces, uv: np.ndarray, weights: np.ndarray, factor: float = 4.0, **options
) -> Steps[MagnifiedUVs]:
    """Magnify a painted region of existing UVs step by step, see `functions.magnify`."""
    surface = polygon_surface(vertices, faces)
    corner_uv = to_corners(uv, surface).copy()
    painted = means_of_corners(of_vertices(weights, surface, "weights"), surface.corner_vertex, surface.face_start)
    painted = painted[surface.triangle_face]
    before = np.abs(signed_areas(corner_uv, surface.triangles))
    asked = target_density(painted, before, factor, options.get("exact", True))
    found = uv_islands(surface, corner_uv)
    texts, sizes = list(found.warnings), [len(island.chart.triangles) for island in found.islands]
    for k, island in enumerate(found.islands):
        region = painted[triangle_rows(surface, island.chart)]
        if np.ptp(region) > 0:
            chart = island.chart
            steps = magnify_region(island.uv, chart.triangles, region, factor, polygons=chart.faces, **options)
            done = yield from part_of(steps, sum(sizes[:k]) / sum(sizes), sizes[k] / sum(sizes))
            corner_uv[chart.corners] = done.uv[chart.triangles]
            texts += done.warnings
    after = np.abs(signed_areas(corner_uv, surface.triangles))
    return MagnifiedUVs(
        uv=from_corners(corner_uv, faces),
        figures=_figures(surface, corner_uv),
        warnings=tuple(dict.fromkeys(texts)),
        share_before=asked.share_before,
        share_asked=asked.target_share,
        share_after=region_share(painted, after),
    )


def sphere_map(vertices: np.ndarray, faces: Faces, **options) -> Steps[SphereMap]:
    """Map a closed surface to the sphere step by step, see `functions.sphere_map`."""
    surface = polygon_surface(vertices, faces)
    density = options.pop("density", None)
    if density is not None:
        density = of_faces(density, surface, "density")[surface.triangle_face]
    triangles = surface.corner_vertex[surface.triangles]
    options["polygons"] = surface.triangle_face
    return (yield from spheres.sphere_map(surface.positions, triangles, density, **options))


def remesh(vertices: np.ndarray, faces: Faces, count: int, **options) -> Steps[Remesh]:
    """Remesh a surface step by step, see `functions.remesh`."""
    surface = polygon_surface(vertices, faces)
    density, features = options.pop("density", None), options.pop("features", None)
    if density is not None:
        density = of_faces(density, surface, "density")[surface.triangle_face]
    if features is not None:
        features = pairs_of(features, len(surface.positions), "features")
    source = remeshing.RemeshSource(surface.positions, surface.corner_vertex[surface.triangles], features)
    return (yield from remeshing.remesh(source, count, remeshing.RemeshOptions(**options), density))


def _figures(surface: Surface, corner_uv: np.ndarray, density=None):
    """Distortion of the UVs (c,2) of a surface, against a density (f,) of its polygons."""
    triangles = surface.corner_vertex[surface.triangles]
    asked = None if density is None else np.asarray(density, float)[surface.triangle_face]
    return distortion(
        surface.positions,
        triangles,
        corner_uv[surface.triangles],
        density=asked,
        polygons=surface.triangle_face,
    )


def _side_by_side(corner_uv: np.ndarray, islands: list[np.ndarray]) -> np.ndarray:
    """UVs (c,2) with islands, each the corners (k,) it has, in rows of falling heights that fill about a square."""
    low = np.array([corner_uv[corners].min(axis=0) for corners in islands])
    size = np.array([np.ptp(corner_uv[corners], axis=0) for corners in islands])
    side = np.sqrt((size[:, 0] * size[:, 1]).sum())
    gap, placed = GAP * side, corner_uv.copy()
    x = y = height = 0.0
    for k in np.argsort(-size[:, 1], kind="stable"):
        if x > 0 and x + size[k, 0] > max(side, size[:, 0].max()):
            x, y, height = 0.0, y + height + gap, 0.0
        placed[islands[k]] = corner_uv[islands[k]] - low[k] + [x, y]
        x, height = x + size[k, 0] + gap, max(height, size[k, 1])
    return placed
