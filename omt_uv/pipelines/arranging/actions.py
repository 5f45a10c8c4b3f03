"""The one path of stacking, symmetrizing and rectifying: from readings to the UVs that are written."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...solver.arranging.halves import halves
from ...solver.arranging.quad_grid import rectangle
from ...solver.arranging.stacks import stacks
from ...solver.editing.uv_islands import Island
from ...solver.errors import GridError, MeshError, plural
from ...solver.mesh.geometry import signed_areas
from ...solver.mesh.polygon_areas import polygon_areas
from ..layout import Refusal
from ..reading import Reading
from .found import Arranged, arranged, islands_of


def stack_islands(readings: Sequence[Reading], mirrored: bool) -> Arranged:
    """Islands of equal shape in space on one another, over all readings; see `solver.arranging.stacks`.

    Raises
    ------
    Refusal : with the index of the reading, see `islands_of`
    """
    found = islands_of(readings)
    done = stacks([(f.island.chart.vertices, f.island.chart.triangles, f.island.uv) for f in found], mirrored)
    warnings = [] if done.moved else [(-1, "No two islands have the same shape")]
    return arranged(len(readings), found, done.uv, done.moved, warnings)


def symmetrize_islands(readings: Sequence[Reading], axis: int, on_one_another: bool) -> Arranged:
    """Equal UVs on both sides of the middle of each object across an axis, 0 to 2.

    Raises
    ------
    Refusal : with the index of the reading, see `islands_of` and `solver.arranging.halves`
    """
    found = islands_of(readings)
    uv, changed, alone = [f.island.uv for f in found], 0, 0
    normal = np.eye(3)[axis]
    for k, reading in enumerate(readings):
        mine = [i for i, f in enumerate(found) if f.owner == k]
        if not mine:
            continue
        heights = reading.surface.positions[reading.surface.corner_vertex] @ normal
        at = float(heights.min() + heights.max()) / 2
        jobs = [(found[i].island.chart.vertices, found[i].island.chart.triangles, found[i].island.uv) for i in mine]
        try:
            done = halves(jobs, normal, at, on_one_another)
        except MeshError as error:
            raise Refusal(k, error) from error
        for i, new in zip(mine, done.uv, strict=True):
            uv[i] = new
        changed += int((done.partner >= 0).sum())
        alone += int((done.partner < 0).sum())
    who = plural(alone, "An island has no image on the other side, and stays", "{} islands have none there, and stay")
    warnings = [(-1, f"{who} as before")] if alone else []
    return arranged(len(readings), found, uv, changed, warnings, apart=not on_one_another)


def rectify_islands(readings: Sequence[Reading]) -> Arranged:
    """Islands that are grids of quads as rectangles, upright where they lie, with the UV area that they have.

    Raises
    ------
    Refusal : no island is a grid; with the index of the first reading, see also `islands_of`
    """
    found = islands_of(readings)
    uv, changed, last = [], 0, GridError("No island is a grid of quads")
    for each in found:
        try:
            uv.append(_rectified(readings[each.owner], each.island))
            changed += 1
        except GridError as error:
            uv.append(each.island.uv)
            last = error
    if not changed:
        raise Refusal(0, last)
    left = len(found) - changed
    who = plural(left, "An island is no grid of quads, and stays", "{} islands are no grids of quads, and stay")
    warnings = [(-1, f"{who} as before")] if left else []
    return arranged(len(readings), found, uv, changed, warnings, apart=True)


def _rectified(reading: Reading, island: Island) -> np.ndarray:
    """UVs (n,2) of an island of quads as a rectangle."""
    surface, chart = reading.surface, island.chart
    faces = np.unique(chart.faces)
    starts = np.asarray(surface.face_start)
    if (np.diff(starts)[faces] != 4).any():
        raise GridError("An island has faces that are no quads", kind="face", elements=faces)
    local = np.full(len(surface.corner_vertex), -1)
    local[chart.corners.ravel()] = chart.triangles.ravel()
    quads = local[starts[faces][:, None] + np.arange(4)]
    if (quads < 0).any():
        raise GridError("An island has faces without area", kind="face", elements=faces)
    areas = polygon_areas(chart.vertices, chart.triangles, chart.faces)
    of_faces = np.bincount(np.searchsorted(faces, chart.faces), areas, len(faces))
    return _placed(rectangle(chart.vertices, quads, of_faces).uv, island.uv, chart.triangles)


def _placed(uv: np.ndarray, before: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """A rectangle (n,2) with middle, area and side up of the UVs before, by the nearest quarter turn."""
    old, new = (float(signed_areas(x, triangles).sum()) for x in (before, uv))
    w = (uv - uv.mean(axis=0)) @ [1, 1j]
    if old * new < 0:
        w = -np.conj(w)
    target = before - before.mean(axis=0)
    w = w * np.sqrt(abs(old / new))
    turned = [w * 1j**k for k in range(4)]
    best = min(turned, key=lambda z: float(np.abs(z - target @ [1, 1j]).sum()))
    return np.column_stack([best.real, best.imag]) + before.mean(axis=0)
