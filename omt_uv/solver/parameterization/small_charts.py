"""Many small charts of a surface, mapped together."""

from __future__ import annotations

import time

import numpy as np

from ..errors import MeshError, positive_density
from ..mesh.charts import Chart
from ..progress import Steps, part_of
from ..refinement.batch_refine import BatchMaps, refine_batch
from .chart_map import ChartMap, in_place, in_unit_box

# Charts of at most SMALL triangles are solved together where there are at least MANY, about BATCH triangles at a time.
SMALL, MANY, BATCH = 1000, 8, 50_000


def small(chart: Chart) -> bool:
    """Whether a chart is small enough to be solved together with others, and has no patches over holes."""
    return len(chart.triangles) <= SMALL and not len(chart.patches)


def together(charts: list[Chart], targets: list[dict], quality: str, balance: float) -> Steps[list[ChartMap | None]]:
    """Maps with free boundaries of small charts, solved together if they are many; None where one has to go alone.

    targets : density and region of each, or nothing, see `chart_terms.chart_target`
    """
    found: list[ChartMap | None] = [None] * len(charts)
    if len(charts) < MANY:
        return found
    sizes = np.cumsum([len(c.triangles) for c in charts])
    for batch in np.split(np.arange(len(charts)), np.flatnonzero(np.diff(sizes // BATCH)) + 1):
        members = [charts[k] for k in batch]
        begin = time.perf_counter()
        done = float(sizes[batch[0]] / sizes[-1])
        try:
            boxes = [in_unit_box(c.vertices) for c in members]
            meshes = [(v, c.triangles) for (v, _), c in zip(boxes, members, strict=True)]
            maps = yield from part_of(
                refine_batch(meshes, quality, balance, **_side_by_side([targets[k] for k in batch])),
                done,
                float(sizes[batch[-1]] / sizes[-1]) - done,
            )
        except MeshError:
            continue  # one of them is to blame, and will say so alone
        seconds = (time.perf_counter() - begin) / len(members)
        pieces = np.split(maps.uv, np.cumsum([len(v) for v, _ in meshes])[:-1])
        for k, (vertices, unit), chart, uv, place in zip(batch, boxes, members, pieces, range(len(batch)), strict=True):
            if maps.solved[place]:
                uv = in_place(uv, vertices, chart.triangles, targets[k].get("density"), unit, None)
                found[k] = _of_many(maps, place, uv, seconds)
    return found


def _side_by_side(targets: list[dict]) -> dict:
    """Densities and regions of several charts as those of their union."""
    if not targets[0]:
        return {}
    density = positive_density(np.concatenate([t["density"] for t in targets]))
    regions = [t["region"] for t in targets]
    return {"density": density, "region": None if regions[0] is None else np.concatenate(regions)}


def _of_many(maps: BatchMaps, k: int, uv: np.ndarray, seconds: float) -> ChartMap:
    return ChartMap(
        uv,
        None,
        None,
        None,
        None,
        int(maps.steps[k]),
        float(maps.residual[k]),
        "converged",
        float(maps.area_l1[k]),
        float(maps.area_sd[k]),
        float(maps.angle_mean[k]),
        0,
        (),
        {"refinement": seconds},
        weight=float(maps.weight[k]),
    )
