"""Bring the centroids of cells, the inverse of the transport map, on to the boundary of the domain, in their order."""

from __future__ import annotations

import numpy as np

from .convex_domain import ConvexPolygon, Domain


def centroid_map(centroid: np.ndarray, domain: Domain, loop, corners, warnings: list[str]) -> np.ndarray:
    """The inverse of the transport map, (n,2): every vertex at the centroid (n,2) of its cell.

    Boundary vertices (b,) move on to the boundary of the domain, in their order, and `corners` (4,), if given,
    into those of the rectangle.
    """
    uv = centroid.copy()
    s = domain.boundary_parameter(uv[loop])
    step = (np.roll(s, -1) - s + domain.period / 2) % domain.period - domain.period / 2
    if not np.isclose(step.sum(), domain.period):
        warnings.append("The transport tangles the boundary; it was spread evenly instead")
        step = np.full(len(loop), domain.period / len(loop))
    # Start behind the largest gap: there nothing can be out of order.
    first = (int(step.argmax()) + 1) % len(loop)
    along = s[first] + np.concatenate([[0.0], np.cumsum(np.roll(step, -first)[:-1])])
    if (np.diff(along) <= 0).any():
        along = np.maximum.accumulate(along)
        spread = along[0] + domain.period * np.arange(len(loop)) / len(loop)
        along = 0.9 * along + 0.1 * spread
    loop = np.roll(loop, -first)
    if corners is not None:
        loop, along = _into_corners(domain, loop, along, corners)
    uv[loop] = domain.boundary_point(along)
    return uv


def _into_corners(domain: Domain, loop, along, corners) -> tuple[np.ndarray, np.ndarray]:
    """Warp boundary parameters in order (b,) piecewise linearly so that the corners come to lie in corners."""
    first = int(np.flatnonzero(loop == corners[0])[0])
    loop, along = np.roll(loop, -first), np.concatenate([along[first:], along[:first] + domain.period])
    place = np.flatnonzero(np.isin(loop, corners))
    ends = np.append(along[place], along[0] + domain.period)
    return loop, np.interp(along, ends, corner_parameters(domain))


def corner_parameters(domain: Domain) -> np.ndarray:
    """Boundary parameters (5,) of the corners of a rectangle, the last one a period after the first."""
    if not isinstance(domain, ConvexPolygon):
        raise ValueError("only polygons have corners")
    return domain.start
