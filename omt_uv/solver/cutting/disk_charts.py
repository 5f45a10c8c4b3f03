"""Make disk charts of any mesh an artist has: repaired, cut and filled, all for the map only."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import DISSOLVE, ZeroAreaFaceError, plural
from ..mesh.charts import Chart, charts_of, check_disks, strict_charts
from ..mesh.repair import charts_without_area, repaired_gluing, with_area
from ..mesh.surface import Surface, chosen_triangles, strict_gluing
from ..progress import Steps, drain
from .cuts import MOST_EXTREMITIES, Cuts, SeamFinder, cut_gluing, sieved
from .hole_filling import fill_holes as fill_holes_of

SEAMS = ("existing", "auto")


@dataclass(frozen=True)
class DiskCharts:
    """Charts, each a disk; the cuts (None where only existing seams were allowed) and what was repaired."""

    charts: list[Chart]
    cuts: Cuts | None
    warnings: tuple[str, ...]


def cut_to_disks(surface: Surface, faces: np.ndarray | None = None, **options) -> DiskCharts:
    """Disk charts of the polygons `faces` (f,) bool, at once; options and errors are those of `disk_charts`."""
    return drain(disk_charts(surface, faces, **options))


def disk_charts(
    surface: Surface,
    faces: np.ndarray | None = None,
    *,
    seams: str = "auto",
    fill_holes: bool = False,
    sieve: int | None = None,
    avoid: np.ndarray | None = None,
    extremities: int = MOST_EXTREMITIES,
    search: SeamFinder | None = None,
) -> Steps[DiskCharts]:
    """Disk charts of the polygons `faces` (f,) bool, all by default.

    Parameters
    ----------
    seams : "existing" splits along the seams of the surface alone and refuses what is no disk, or broken;
        "auto" repairs and cuts, for the map only
    fill_holes : fill all boundaries of a component but the longest, for the map only, instead of cutting to them; such
        charts have `patches`
    sieve : fill the holes of a component that has more than so many; with "auto" it is then cut to its extremities, and
        one that has many handles comes apart, see `handle_partition.partition_pairs`
    avoid : (n,) in [0,1], vertices to keep free of seams
    extremities : tips that a surface is cut open through, at most, where "auto" cuts; 0 for the fastest cuts
    search : finds the seams of components that "auto" may cut, and that have no net

    Raises
    ------
    MeshError : see `charts.strict_charts`; with "auto" only EmptyMeshError, NonFiniteError, and ZeroAreaFaceError or
        NonManifoldEdgeError where no repair helps
    """
    if seams not in SEAMS:
        raise ValueError(f"seams must be one of {', '.join(SEAMS)}, not {seams!r}")
    if seams == "existing":
        return _existing(surface, faces, fill_holes, sieve)
    faces, triangles, owner = chosen_triangles(surface, faces)
    if _all_lines(surface.positions[surface.corner_vertex[triangles]]):
        raise ZeroAreaFaceError("No face has an area", kind="face", elements=np.unique(owner))
    repaired = repaired_gluing(surface, faces, triangles, owner)
    options: dict[str, Any] = {
        "avoid": avoid,
        "fill": fill_holes,
        "sieve": sieve,
        "extremities": extremities,
        "search": search,
    }
    found = yield from cut_gluing(surface, repaired, **options)
    charts, flat = _sound(charts_of(found.surface, found.gluing), found.extent)
    warnings = list(found.cuts.warnings)
    if flat:
        who = plural(flat, "A face has", "{} faces have")
        warnings.append(f"{who} no area and got a little for the map; {DISSOLVE}")
    return DiskCharts(charts, found.cuts, tuple(warnings))


def _all_lines(points: np.ndarray) -> bool:
    """No triangle (m,3,3) spans an area, for example under an object scale of 0 along two axes."""
    side = points / 2 - points[:, :1] / 2
    size = np.abs(side).max(axis=(1, 2), initial=0.0)
    side = side / np.where(size > 0, size, 1)[:, None, None]
    return not (np.linalg.norm(np.cross(side[:, 1], side[:, 2]), axis=1) > 0).any()


def _existing(surface: Surface, faces: np.ndarray | None, fill: bool, sieve: int | None) -> DiskCharts:
    if not fill and sieve is None:
        return DiskCharts(strict_charts(surface, faces), None, ())
    gluing = strict_gluing(surface, faces)
    filled = fill_holes_of(surface, gluing, np.zeros(len(gluing.triangles), dtype=bool), None if fill else sieve)
    if not fill and not filled.holes:
        return DiskCharts(strict_charts(surface, faces), None, ())
    positions = surface.positions[surface.corner_vertex[gluing.triangles]] / 2
    # Faces have areas, but what fills a hole that is a line has none.
    charts, _ = _sound(charts_of(filled.surface, filled.gluing), 2 * float(np.ptp(positions, axis=(0, 1)).max()))
    return DiskCharts(charts, None, () if fill else (sieved(filled.holes),))


def _sound(charts: list[Chart], extent: float) -> tuple[list[Chart], int]:
    """Charts of a mesh of some extent, checked to be disks, with no triangle without area, and how many had none."""
    check_disks(charts)
    flat = charts_without_area(charts)
    found = {k: with_area(charts[k], extent) for k in np.flatnonzero(flat)}
    return [found[k][0] if flat[k] else chart for k, chart in enumerate(charts)], sum(n for _, n in found.values())
