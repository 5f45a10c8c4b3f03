"""Make disk charts of any mesh an artist has: repaired, cut and filled, all for the map only."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..analysis.seam_costs import SeamCosts
from ..errors import (
    DISSOLVE,
    DuplicateFaceError,
    NonManifoldEdgeError,
    OrientationError,
    ZeroAreaFaceError,
    plural,
)
from ..mesh.charts import Chart, charts_of, check_disks
from ..mesh.geometry import cross3, extents, lengths
from ..mesh.gluing import Gluing
from ..mesh.repair import charts_without_area, repaired_gluing, with_area
from ..mesh.surface import Surface, chosen_triangles, strict_gluing
from ..progress import Steps, drain
from .cuts import MOST_EXTREMITIES, Cuts, SeamFinder, cut_gluing, uncut
from .hole_filling import fill_holes as fill_holes_of
from .hole_filling import sieved

SEAMS = ("existing", "auto")
# What is wrong with a mesh where a repair helps.
BROKEN = (ZeroAreaFaceError, DuplicateFaceError, NonManifoldEdgeError, OrientationError)
# Triangles that are asked before all of them whether one has an area.
FIRST = 100
# As "auto", for charts that fill an outline.
OUTLINED = "outlined"


@dataclass(frozen=True)
class DiskCharts:
    """Charts, each a disk; the cuts (None where only existing seams were allowed) and what was repaired."""

    charts: list[Chart]
    cuts: Cuts | None
    warnings: tuple[str, ...]

    @property
    def found_cuts(self) -> Cuts:
        """The cuts of a surface that was to be cut."""
        if self.cuts is None:
            raise ValueError("charts along existing seams alone have no cuts")
        return self.cuts


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
    seams : "existing" splits along the seams of the surface alone and refuses what is no disk; "auto" cuts, for the map
        only, "outlined" does for charts that fill a disk or a square. All repair what is broken, for the map only
    fill_holes : fill all boundaries of a component but the longest, for the map only, instead of cutting to them; such
        charts have `patches`
    sieve : fill the holes of a component that has more than so many; with "auto" it is then cut to its extremities, and
        one that has many handles comes apart, see `handle_partition.partition_pairs`
    avoid : (n,) in [0,1], vertices to keep free of seams
    extremities : tips that a surface is cut open through, at most, where "auto" cuts; 0 for the fastest cuts
    search : finds the seams of components that "auto" may cut, and that have no net; with "existing" it tells the holes
        in faces, which are filled where another boundary is left

    Raises
    ------
    MeshError : EmptyMeshError, NonFiniteError, and ZeroAreaFaceError or NonManifoldEdgeError where no repair helps;
        with "existing" NotADiskError, and OrientationError where a surface has one side only
    """
    if seams not in (*SEAMS, OUTLINED):
        raise ValueError(f"seams must be one of {', '.join((*SEAMS, OUTLINED))}, not {seams!r}")
    if seams == "existing":
        return _existing(surface, faces, fill_holes, sieve, None if search is None else search.costs)
    faces, triangles, owner = _with_some_area(surface, faces)
    repaired = repaired_gluing(surface, faces, triangles, owner)
    options: dict[str, Any] = {
        "avoid": avoid,
        "fill": fill_holes,
        "sieve": sieve,
        "extremities": extremities,
        "search": search,
        "outline": seams == OUTLINED,
    }
    found = yield from cut_gluing(surface, repaired, **options)
    charts, flat = _sound(charts_of(found.surface, found.gluing), found.extent)
    return DiskCharts(charts, found.cuts, (*found.cuts.warnings, *_of_flat(flat)))


def _with_some_area(surface: Surface, faces: np.ndarray | None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What `chosen_triangles` finds, if any of it has an area."""
    faces, triangles, owner = chosen_triangles(surface, faces)
    if _all_lines(surface.positions[surface.corner_vertex[triangles]]):
        raise ZeroAreaFaceError("No face has an area", kind="face", elements=np.unique(owner))
    return faces, triangles, owner


def _of_flat(count: int) -> list[str]:
    """The warning that so many faces have no area, if any."""
    who = plural(count, "A face has", "{} faces have")
    return [f"{who} no area and got a little for the map; {DISSOLVE}"] if count else []


def _all_lines(points: np.ndarray) -> bool:
    """No triangle (m,3,3) spans an area, for example under an object scale of 0 along two axes."""
    # Nearly always one of the first does.
    if len(points) > FIRST and not _all_lines(points[:FIRST]):
        return False
    side = points / 2 - points[:, :1] / 2
    size = np.abs(side).max(axis=(1, 2), initial=0.0)
    side = side / np.where(size > 0, size, 1)[:, None, None]
    return not (lengths(cross3(side[:, 1], side[:, 2])) > 0).any()


def _existing(
    surface: Surface,
    faces: np.ndarray | None,
    fill: bool,
    sieve: int | None,
    costs: Callable[[], SeamCosts] | None,
) -> DiskCharts:
    """Charts along the seams alone; what is broken is repaired as where seams are added, and said."""
    try:
        return _filled(surface, strict_gluing(surface, faces), fill, sieve, costs)
    except BROKEN:
        found = uncut(surface, repaired_gluing(surface, *_with_some_area(surface, faces)))
        if found is None:
            # No seam was made to open what has one side only.
            raise
        return _filled(found.surface, found.gluing, fill, sieve, costs, found.cuts.warnings)


def _filled(
    surface: Surface,
    gluing: Gluing,
    fill: bool,
    sieve: int | None,
    costs: Callable[[], SeamCosts] | None,
    told: tuple[str, ...] = (),
) -> DiskCharts:
    """Charts of a gluing that is not cut, with its holes filled, all or those of sieves, and what was said of it."""
    positions = surface.positions[surface.corner_vertex[gluing.triangles]] / 2
    extent, holes = 2 * float(extents(positions.reshape(-1, 3)).max()), 0
    if fill or sieve is not None:
        every = np.zeros(len(gluing.triangles), dtype=bool)
        filled = fill_holes_of(surface, gluing, every, None if fill else sieve, costs=costs, closing=False)
        surface, gluing, holes = filled.surface, filled.gluing, filled.holes
    charts, flat = _sound(charts_of(surface, gluing), extent)
    sieves = () if fill or not holes else (sieved(holes),)
    return DiskCharts(charts, None, (*told, *sieves, *_of_flat(flat)))


def _sound(charts: list[Chart], extent: float) -> tuple[list[Chart], int]:
    """Charts of a mesh of some extent, checked to be disks, with no triangle without area, and how many had none."""
    check_disks(charts)
    flat = charts_without_area(charts)
    found = {k: with_area(charts[k], extent) for k in np.flatnonzero(flat)}
    return [found[k][0] if flat[k] else chart for k, chart in enumerate(charts)], sum(n for _, n in found.values())
