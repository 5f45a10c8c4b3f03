"""Tell a surface in its own way: along its own axes, in its own unit, vertices and triangles in order of their places.

Edits of a mesh break ties by numbers and rounding, and what comes of one decides about the next: the same body told in
another way would become another mesh. Here both are taken away, up to a place that rounding to `STEP` tells apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from ...analysis.order_of_places import lowest_first, order_of_places, own_axes
from ...errors import MeshError
from ...mesh.geometry import bounding_box, turned_by

# Places are multiples of this share of the extent: more than what turning and moving a mesh rounds, far less than the
# last digit of single precision.
STEP = 2.0**-32
# Densities are rounded to so many bits: sums in another order differ in the last ones.
DENSITY_BITS = 32


@dataclass(frozen=True)
class OwnFrame:
    """A surface in its own frame: vertices (n,3) that its triangles (m,3) use, and features (e,2), pairs of them.

    used (n,), rows (m,): which of the given vertices and triangles each one is; turn (m,3): which of its corners.
    A given place is (centre + size * place) * axes^T, in the unit and about the middle of the box that was given.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    features: np.ndarray
    used: np.ndarray
    rows: np.ndarray
    turn: np.ndarray
    centre: np.ndarray
    size: float
    axes: np.ndarray
    box_centre: np.ndarray
    box_size: float

    def density(self, given: np.ndarray) -> np.ndarray:
        """Density (m,) of the triangles, from that of the given ones (m,)."""
        mantissa, exponent = np.frexp(given[self.rows])
        return np.ldexp(np.round(np.ldexp(mantissa, DENSITY_BITS)), exponent - DENSITY_BITS)

    def places(self, points: np.ndarray) -> np.ndarray:
        """Where points (k,3) of the frame are in space."""
        turned: np.ndarray = (points * self.size + self.centre) @ self.axes.T
        return turned * self.box_size + self.box_centre

    def on_given(self, faces: np.ndarray, barycentric: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The given triangles (k,) and barycentric coordinates (k,3) of points on these triangles (k,), (k,3)."""
        given = np.empty_like(barycentric)
        np.put_along_axis(given, self.turn[faces], barycentric, axis=1)
        return self.rows[faces], given

    @contextmanager
    def named(self) -> Iterator[None]:
        """Errors name the given vertices, pairs of vertices and triangles."""
        try:
            yield
        except MeshError as error:
            number = {"vertex": self.used, "edge": self.used, "face": self.rows}.get(error.kind)
            if number is None or not len(error.elements):
                raise
            elements = np.unique(np.sort(number[error.elements], axis=-1), axis=0)
            raise type(error)(error.cause, error.remedy, error.kind, elements) from error


def in_own_frame(vertices: np.ndarray, triangles: np.ndarray, features: np.ndarray) -> OwnFrame:
    """Tell a surface (n,3), (m,3) with features (e,2) in its own way.

    Along the axes that were given where its own are not told apart, as those of a torus. Where the vertices are not
    somewhere, or all in one place, everything stays as it is.
    """
    used, corners = np.unique(triangles, return_inverse=True)
    triangles, points = corners.reshape(-1, 3), vertices[used]
    if not len(used) or not np.isfinite(points).all() or not np.ptp(points / 2, axis=0).max() > 0:
        return _as_given(vertices, triangles, features, used)
    order = order_of_places(points, triangles)
    place, used, points = np.argsort(order), used[order], points[order]
    box_centre, box_size = bounding_box(points)
    axes = own_axes(points)
    axes = np.eye(3) if axes is None else axes
    turned = turned_by(points / box_size - box_centre / box_size, axes)
    centre, size = bounding_box(turned)
    triangles, turn = lowest_first(place[triangles])
    rows = np.lexsort(triangles.T[::-1])
    return OwnFrame(
        vertices=np.round((turned - centre) / size / STEP) * STEP,
        triangles=triangles[rows],
        features=_numbered(features, used),
        used=used,
        rows=rows,
        turn=turn[rows],
        centre=centre,
        size=size,
        axes=axes,
        box_centre=box_centre,
        box_size=box_size,
    )


def _as_given(vertices: np.ndarray, triangles: np.ndarray, features: np.ndarray, used: np.ndarray) -> OwnFrame:
    m = len(triangles)
    return OwnFrame(
        vertices=vertices[used],
        triangles=triangles,
        features=_numbered(features, used),
        used=used,
        rows=np.arange(m),
        turn=np.tile(np.arange(3), (m, 1)),
        centre=np.zeros(3),
        size=1.0,
        axes=np.eye(3),
        box_centre=np.zeros(3),
        box_size=1.0,
    )


def _numbered(pairs: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Pairs (e,2) of given vertices in the numbers that these have now, in order; those of loose vertices are gone."""
    number = np.full(max(int(used.max(initial=-1)), int(pairs.max(initial=-1))) + 1, -1)
    number[used] = np.arange(len(used))
    found = np.sort(number[pairs], axis=1)
    found = found[(found >= 0).all(axis=1)]
    return found[np.lexsort(found.T[::-1])]
