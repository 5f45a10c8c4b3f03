"""Fix what a map of a disk leaves open, by markers: a vertex in the middle, one at the right, or three on the circle.

A conformal map of the disk is one of a family of three parameters, the Moebius maps of the disk: Zhengyu Su 2015 fixes
three boundary vertices at 1, i and -1 (algorithm 3), or one vertex at 0 and one of the boundary at 1 (section 5.3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import LandmarkError, plural
from ..mesh.charts import Chart
from ..mesh.geometry import as_complex, as_points
from ..mesh.topology import boundary_loops

# Where three markers of the boundary go, counter-clockwise.
THREE_PLACES = np.array([1, 1j, -1])


@dataclass(frozen=True)
class MapMarkers:
    """Vertices of a surface that fix its maps: centre (k,) goes to the middle, start (k,) to the right, corners (k,)
    into the corners of a rectangle, four of an island, or to 1, i and -1 on a disk, three. Empty for none."""

    centre: np.ndarray
    start: np.ndarray
    corners: np.ndarray

    @property
    def any(self) -> bool:
        """Whether there are markers at all."""
        return bool(len(self.centre) or len(self.start) or len(self.corners))


@dataclass(frozen=True)
class ChartMarkers:
    """Vertices of a chart: centre and start, -1 for none; corners (4,) of its boundary in order, or (3,), or (0,)."""

    centre: int = -1
    start: int = -1
    corners: tuple[int, ...] = ()

    def in_disk(self, uv: np.ndarray, loop: np.ndarray) -> np.ndarray:
        """A map uv (n,2) to the unit disk, boundary loop (b,) on the circle, after the Moebius map of the markers.

        >>> square = np.array([[1, 0], [0, 1], [-1, 0], [0, -1], [0.1, 0.2]])
        >>> ChartMarkers(centre=4, start=1).in_disk(square, np.arange(4)).round(3)[[4, 1], 0].tolist()
        [0.0, 1.0]
        """
        w = as_complex(uv).copy()
        if len(self.corners) == 3:
            w = _three_points(w, w[list(self.corners)])
        elif self.centre >= 0:
            middle = w[self.centre]
            if abs(middle) >= 1:
                raise _misplaced("The marker of the centre lies on the boundary", [self.centre])
            w = (w - middle) / (1 - np.conj(middle) * w)
        if self.start >= 0 and len(self.corners) != 3:
            w = w * (np.conj(w[self.start]) / abs(w[self.start]))
        w[loop] /= np.abs(w[loop])
        return as_points(w)

    def turned(self, uv: np.ndarray) -> np.ndarray:
        """A map uv (n,2) turned about 0 until the start lies to the right of the centre, of 0 without one."""
        if self.start < 0:
            return uv
        w = as_complex(uv)
        way = w[self.start] - (w[self.centre] if self.centre >= 0 else 0)
        return uv if way == 0 else as_points(w * (np.conj(way) / abs(way)))


def markers_of_chart(markers: MapMarkers | None, chart: Chart) -> ChartMarkers:
    """The markers of a surface that a chart has; corners come in the order of its boundary, from the start if it is one
    of them.

    Raises
    ------
    LandmarkError : an island with several centres or starts, a start off the boundary, or corners that are not three
        or four of its boundary
    """
    if markers is None or not markers.any:
        return ChartMarkers()
    loop = boundary_loops(chart.disk)[0]
    centre = _single(np.flatnonzero(np.isin(chart.vertex_ids, markers.centre)), "centre", chart)
    outer = chart.vertex_ids[loop]
    # A vertex of a seam is several times on the boundary: the first time counts.
    start = loop[_firsts(outer, markers.start)]
    if len(start) == 0 and np.isin(chart.vertex_ids, markers.start).any():
        raise _misplaced("The start is no vertex of the boundary", markers.start)
    first = _single(start, "start", chart)
    place = _firsts(outer, markers.corners)
    inside = np.isin(chart.vertex_ids, markers.corners).any()
    if (inside or len(place)) and len(place) not in (3, 4):
        cause = f"Markers of corners stand at {plural(len(place), 'one vertex', '{} vertices')} of a boundary"
        raise _misplaced(cause, chart.vertex_ids[loop[place]])
    corners = loop[place]
    if first in corners:
        corners = np.roll(corners, -int(np.flatnonzero(corners == first)[0]))
    return ChartMarkers(centre, first, tuple(corners.tolist()))


def _firsts(outer: np.ndarray, marked: np.ndarray) -> np.ndarray:
    """Places (k,), in order, where vertices `marked` stand for the first time among outer (b,)."""
    _, first = np.unique(outer, return_index=True)
    return np.sort(first[np.isin(outer[first], marked)])


def _single(found: np.ndarray, name: str, chart: Chart) -> int:
    if len(found) > 1:
        raise _misplaced(
            f"An island has {plural(len(found), 'one vertex', '{} vertices')} marked as its {name}",
            chart.vertex_ids[found],
        )
    return int(found[0]) if len(found) else -1


def _misplaced(cause: str, vertices) -> LandmarkError:
    remedy = "Mark one centre, one start on the boundary, and three or four corners on it"
    return LandmarkError(cause, remedy, "vertex", vertices)


def _three_points(w: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Complex numbers (n,) after the Moebius map that takes points (3,) to 1, i, -1."""
    found = np.linalg.inv(_to_standard(THREE_PLACES)) @ _to_standard(points)
    return (found[0, 0] * w + found[0, 1]) / (found[1, 0] * w + found[1, 1])


def _to_standard(points: np.ndarray) -> np.ndarray:
    """The matrix (2,2) of the Moebius map that takes points (3,) to 0, 1 and infinity."""
    a, b, c = points
    return np.array([[b - c, -a * (b - c)], [b - a, -c * (b - a)]])
