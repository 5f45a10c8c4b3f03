"""Map many small charts together, in batches."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.density import Target
from ..errors import MeshError, positive_density
from ..mesh.charts import Chart
from ..mesh.geometry import signed_areas
from ..mesh.polygon_areas import polygon_areas
from ..progress import Steps, part_of
from .chart_map import ChartMap, in_unit_box
from .options import MapOptions

if TYPE_CHECKING:
    from ..refinement.batch_refine import BatchMaps

# Most triangles of a chart that is solved together with others.
SMALL = 1000
# Fewest charts that are solved together: for less the batch does not pay.
MANY = 8
# Triangles of a batch, roughly, for memory.
BATCH = 50_000


def is_small(chart: Chart) -> bool:
    """Whether a chart is small enough to be solved together with others, and has no patches over holes."""
    return len(chart.triangles) <= SMALL and not len(chart.patches)


def batches(sizes: Sequence[int]) -> list[np.ndarray]:
    """Numbers (b,) of charts that are solved together, of all with so many triangles (c,) each; none of a few."""
    if len(sizes) < MANY:
        return []
    return np.split(np.arange(len(sizes)), np.flatnonzero(np.diff(np.cumsum(sizes) // BATCH)) + 1)


def map_together(
    charts: list[Chart], targets: list[Target | None], options: MapOptions
) -> Steps[list[ChartMap | None]]:
    """Map small charts with free boundaries side by side if they are many; None where one has to go alone.

    targets : of each chart, see `chart_indices.chart_target`
    """
    found: list[ChartMap | None] = [None] * len(charts)
    sizes = [len(c.triangles) for c in charts]
    end = np.cumsum(sizes)
    for batch in batches(sizes):
        done = float(end[batch[0]] / end[-1])
        steps = _map_batch([charts[k] for k in batch], [targets[k] for k in batch], options)
        maps = yield from part_of(steps, done, float(end[batch[-1]] / end[-1]) - done)
        for k, chart_map in zip(batch, maps, strict=True):
            found[k] = chart_map
    return found


def _map_batch(charts: list[Chart], targets: list[Target | None], options: MapOptions) -> Steps[list[ChartMap | None]]:
    """BatchMaps of the charts of one batch; None where one has to go alone."""
    from ..refinement.batch_refine import refine_batch

    begin = time.perf_counter()
    try:
        boxes = [in_unit_box(c.vertices) for c in charts]
        meshes = [(v, c.triangles) for (v, _), c in zip(boxes, charts, strict=True)]
        faces = [c.faces for c in charts]
        given = _side_by_side(targets)
        maps = yield from refine_batch(meshes, options.quality, options.balance, polygons=faces, **given)
    except MeshError:
        return [None] * len(charts)  # the one with the error has it alone, too, and says so
    seconds = (time.perf_counter() - begin) / len(charts)
    placed = _placed(charts, boxes, maps.uv, None if not given else given["density"])
    solved = maps.solved
    return [_of_many(maps, k, placed[k], seconds) if solved[k] else None for k in range(len(charts))]


def _placed(charts: list[Chart], boxes, uv: np.ndarray, density: np.ndarray | None) -> list[np.ndarray]:
    """Maps (n,2) of all charts as `chart_map.placed_chart` places each of them; boxes: see `chart_map.in_unit_box`."""
    count = len(charts)
    first = np.cumsum([0, *(len(v) for v, _ in boxes)])
    owner = np.repeat(np.arange(count), [len(c.triangles) for c in charts])
    triangles = np.concatenate([c.triangles for c in charts]) + first[owner][:, None]
    faces = np.concatenate([c.faces for c in charts])
    faces = np.unique(np.column_stack([owner, faces]), axis=0, return_inverse=True)[1].ravel()
    area = polygon_areas(np.concatenate([v for v, _ in boxes]), triangles, faces)
    target = np.bincount(owner, area if density is None else area * density, count)
    covered = signed_areas(uv, triangles)
    total = np.bincount(owner, covered, count)
    middle = covered[:, None] * uv[triangles].mean(axis=1)
    middle = np.column_stack([np.bincount(owner, middle[:, k], count) for k in range(2)]) / total[:, None]
    # A chart that is to go alone may be folded here.
    scale = np.sqrt(np.maximum(target / total, 0)) * np.array([unit for _, unit in boxes])
    of_vertex = np.repeat(np.arange(count), np.diff(first))
    return np.split((uv - middle[of_vertex]) * scale[of_vertex][:, None], first[1:-1])


def _side_by_side(targets: list[Target | None]) -> dict:
    """Densities and regions of several charts as those of their union."""
    given = [t for t in targets if t is not None]
    if not given:
        return {}
    density = positive_density(np.concatenate([t.density for t in given]))
    regions = [t.region for t in given if t.region is not None]
    return {"density": density, "region": np.concatenate(regions) if regions else None}


def _of_many(maps: BatchMaps, k: int, uv: np.ndarray, seconds: float) -> ChartMap:
    return ChartMap(
        uv=uv,
        newton_refinement=int(maps.steps[k]),
        residual_refinement=float(maps.residual[k]),
        status="converged",
        area_l1=float(maps.area_l1[k]),
        area_sd=float(maps.area_sd[k]),
        angle_mean=float(maps.angle_mean[k]),
        folds=0,
        seconds={"refinement": seconds},
        area_weight=float(maps.area_weight[k]),
    )
