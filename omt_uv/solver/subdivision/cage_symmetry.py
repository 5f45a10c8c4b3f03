"""Tell the mirror symmetry of the charts of a cage from their maps, so that it is kept when these are refined.

A chart is symmetric where its polygons are and its map is already; of two charts that are each other's image, one map
follows the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..maps.mirror_symmetry import MirrorSymmetry, mirror_symmetry, without_symmetry
from ..mesh.mirror import find_mirror

# How far a map may be from its mirror image, over its extent, and be symmetric.
SAME_PLACE = 1e-6
# Relative difference of the areas of mirror images up to which they are symmetric.
SAME_AREA = 1e-4


@dataclass(frozen=True)
class CageChart:
    """Vertices (n,3) and triangles (m,3) of a chart, the polygon (m,) of each triangle, and the area (n,) that the
    polygons around a vertex have on the subdivided surface."""

    vertices: np.ndarray
    triangles: np.ndarray
    polygons: np.ndarray
    area_around: np.ndarray


def cage_symmetry(
    charts: Sequence[CageChart], w: np.ndarray, partners: Mapping[int, tuple[int, np.ndarray]]
) -> tuple[MirrorSymmetry, np.ndarray]:
    """The symmetry of the maps w (n,) complex of all charts in turn, and the maps with the middle of each in 0.

    partners: of charts that are the mirror image of one before them, that one, and its vertex for each of theirs
    """
    first = np.cumsum([0, *(len(c.vertices) for c in charts)])
    rows = [np.arange(a, b) for a, b in pairwise(first)]
    centred = np.concatenate([w[mine] - w[mine].mean() for mine in rows])
    found = without_symmetry(len(w))
    for k, chart in enumerate(charts):
        if k not in partners:
            own = _symmetry_of(chart, centred[rows[k]])
            found = found if own is None else found.with_part(own, rows[k])
    for k, (j, image) in partners.items():
        mine, other = centred[rows[k]], centred[rows[j]][image]
        if np.abs(mine + other.conj()).max() <= SAME_PLACE * np.abs(other).max():
            found = _followed(found, rows[k], rows[j][image])
    return found, centred


def _symmetry_of(chart: CageChart, w: np.ndarray) -> MirrorSymmetry | None:
    """The symmetry of a chart and its map w (n,) complex about 0; None without one."""
    around = chart.area_around

    def symmetric(image: np.ndarray) -> bool:
        turn = (w[image] * w).sum()
        if not abs(turn) > 0 or (np.abs(around - around[image]) > SAME_AREA * around).any():
            return False
        return np.abs(w[image].conj() * (turn / abs(turn)) - w).max() <= SAME_PLACE * np.abs(w).max()

    faces = chart.vertices, chart.triangles, chart.polygons
    one = find_mirror(*faces, accepted=symmetric)
    if one is None:
        return None
    two = find_mirror(*faces, across=one, accepted=symmetric)
    turn = (w[one.image] * w).sum()
    return mirror_symmetry(np.array([m.image for m in (one, two) if m is not None]), turn / abs(turn))


def _followed(found: MirrorSymmetry, vertices: np.ndarray, others: np.ndarray) -> MirrorSymmetry:
    """The symmetry with the vertices (k,) at -conj(w) of others (k,)."""
    arrays = {name: getattr(found, name).copy() for name in ("representative", "flip", "factor", "line")}
    arrays["representative"][vertices] = found.representative[others]
    arrays["flip"][vertices] = ~found.flip[others]
    arrays["factor"][vertices] = -found.factor[others].conj()
    arrays["line"][vertices] = np.nan
    return replace(found, **arrays)
