"""Find the UV islands of readings, and the way back to their corners."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...solver.editing.uv_islands import Island, uv_islands
from ...solver.errors import EmptyMeshError, MeshError
from ..layout import PlacedIsland, Refusal, corner_uvs, grown_together
from ..reading import Reading


@dataclass(frozen=True)
class PlacedUV:
    """Island `island` of reading `owner`."""

    owner: int
    island: Island


@dataclass(frozen=True)
class Arranged:
    """Corners (k,) and their UVs (k,2) of each reading; changed: of how many islands; warnings as in `Layout`."""

    corners: list[np.ndarray]
    uv: list[np.ndarray]
    changed: int
    warnings: list[tuple[int, str]]


def islands_of(readings: Sequence[Reading]) -> list[PlacedUV]:
    """Whole islands that contain chosen polygons, of all readings in turn.

    Raises
    ------
    Refusal : with the index of the reading, see `uv_islands`
    """
    found = []
    for k, reading in enumerate(readings):
        try:
            if reading.uv is None:
                raise EmptyMeshError("There are no UVs to arrange", remedy="Unwrap the mesh first")
            found += [PlacedUV(k, each) for each in uv_islands(reading.surface, reading.uv, reading.faces).islands]
        except MeshError as error:
            raise Refusal(k, error) from error
    return found


def arranged(
    count: int, found: Sequence[PlacedUV], uv: Sequence[np.ndarray], changed: int, warnings=(), apart: bool = False
) -> Arranged:
    """What is written to `count` readings, of new UVs (n_i,2) of their islands.

    apart : islands are to lie beside one another; a warning says where they do not any more
    """
    placed = [
        PlacedIsland(owner=each.owner, chart=each.island.chart, uv=new, before=each.island.uv)
        for each, new in zip(found, uv, strict=True)
    ]
    corners, values = corner_uvs(count, placed)
    warning = grown_together(placed) if apart else ""
    return Arranged(corners, values, changed, [*warnings, *([(-1, warning)] if warning else [])])
