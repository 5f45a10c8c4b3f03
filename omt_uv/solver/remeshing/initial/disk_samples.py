"""Sample a chart evenly by measure, and triangulate the samples, on two maps to the disk (B. Gu 2018).

Points that are uniform in the measure-preserving image are uniform on the surface; triangles that are Delaunay in the
conformal image are so on the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import TransportError
from ...maps.tutte import tutte
from ...mesh.point_location import locate
from ...mesh.topology import twins
from ...transport.convex_domain import Disk
from ...transport.power_diagram import power_diagram
from ...transport.regular_triangulation import by_hull
from .arc_network import ChartBoundary

# Rounds of moving samples to the centroids of their cells.
ROUNDS = 2
# Distance, in distances between boundary samples, that inner samples keep from a chord between these.
CHORD_MARGIN = 0.02


@dataclass(frozen=True)
class ChartMesh:
    """A chart triangulated anew: positions (k,3) of its inner samples and triangles (t,3), boundary samples first."""

    points: np.ndarray
    triangles: np.ndarray


def triangulate_chart(
    vertices: np.ndarray,
    triangles: np.ndarray,
    loop: np.ndarray,
    maps: tuple[np.ndarray, np.ndarray],
    chart_boundary: ChartBoundary,
    count: int,
) -> ChartMesh | None:
    """Triangulate a chart (n,3), (m,3) with its boundary samples and about `count` inner ones; None if precision fails.

    loop (b,): its boundary; maps: images (n,2) in the unit disk to sample on, and to triangulate on
    """
    from_map, to_map = maps
    spread = spread_samples(_on_circle(from_map, loop, chart_boundary), count)
    face, bary = locate(from_map, triangles, spread)
    corners = triangles[face]
    points = np.einsum("kc,kcj->kj", bary, vertices[corners])
    inner = np.einsum("kc,kcj->kj", bary, to_map[corners])
    found = triangulate_disk(_on_circle(to_map, loop, chart_boundary), inner)
    if found is None:
        return None
    used = np.unique(found[found >= len(chart_boundary.samples)])
    number = np.arange(len(chart_boundary.samples) + len(points))
    number[used] = len(chart_boundary.samples) + np.arange(len(used))
    return ChartMesh(points[used - len(chart_boundary.samples)], number[found])


def _on_circle(uv: np.ndarray, loop: np.ndarray, chart_boundary: ChartBoundary) -> np.ndarray:
    """Images (b,2) of boundary samples, between their neighbours by angle, all different."""
    angle = np.unwrap(np.arctan2(uv[loop, 1], uv[loop, 0]))
    angle = np.append(angle, angle[0] + 2 * np.pi)
    place = np.interp(chart_boundary.place, np.arange(len(angle)), angle)
    return np.column_stack([np.cos(place), np.sin(place)])


def even_image(
    vertices: np.ndarray, triangles: np.ndarray, loop: np.ndarray, chart_boundary: ChartBoundary
) -> np.ndarray:
    """Embed a chart in the disk by mean value coordinates, (n,2), boundary samples about equally far apart.

    It is there where other maps leave double precision, or are not worth their time.
    """
    b = len(chart_boundary.samples)
    place = np.append(chart_boundary.place, len(loop))
    angle = np.interp(np.arange(len(loop)), place, 2 * np.pi * np.arange(b + 1) / b)
    return tutte(vertices, triangles, loop, np.column_stack([np.cos(angle), np.sin(angle)]))


def spread_samples(boundary: np.ndarray, count: int, rounds: int = ROUNDS) -> np.ndarray:
    """Spread points (count,2) inside the unit disk evenly between themselves and the boundary's (b,2), by Lloyd's
    algorithm from a lattice."""
    points = _lattice(count)
    disk, b = Disk(), len(boundary)
    if count == 0 or b + count < 4:
        return points
    try:
        for _ in range(rounds):
            cells = power_diagram(np.concatenate([boundary, points]), np.zeros(b + count), disk)
            filled = cells.area[b:] > 0
            points = np.where(filled[:, None], cells.centroid[b:], points)
    except TransportError:
        # Boundary samples that coincide in double precision: the lattice alone has to do.
        return _lattice(count)
    return points


def _lattice(count: int) -> np.ndarray:
    """The `count` (count,2) points of a triangular lattice nearest to a point of it, filling the disk but a margin."""
    half = int(np.ceil(np.sqrt(count))) + 2
    i, j = np.meshgrid(np.arange(-half, half + 1), np.arange(-half, half + 1))
    # Off the lattice's symmetries, so that no two points are equally far.
    points = np.column_stack([(i + j / 2).ravel() + 0.31, (j * np.sqrt(3) / 2).ravel() + 0.17])
    points = points[np.argsort((points**2).sum(axis=1), kind="stable")[:count]]
    pitch = np.sqrt(np.pi / (max(count, 1) * np.sqrt(3) / 2))
    return points * pitch * (1 - 0.5 / np.sqrt(max(count, 1)))


def triangulate_disk(boundary: np.ndarray, inner: np.ndarray) -> np.ndarray | None:
    """Triangulate boundary samples (b,2) in order on the circle and inner ones, Delaunay, (t,3); None if these fail.

    Inner samples beyond a chord of the boundary are pulled to its inside.
    """
    b = len(boundary)
    if b + len(inner) < 4:
        return np.arange(3)[None] if b == 3 and len(inner) == 0 else None
    points = np.concatenate([boundary, _inside(boundary, inner)])
    try:
        triangles = by_hull(points, np.zeros(len(points))).triangles
    except TransportError:
        return None
    flat, twin = triangles.ravel(), twins(triangles)
    head = triangles[:, [1, 2, 0]].ravel()
    open_ = twin < 0
    successor = np.full(len(points), -1)
    successor[flat[open_]] = head[open_]
    whole = open_.sum() == b and (successor[:b] == (np.arange(b) + 1) % b).all()
    if not whole or len(triangles) != 2 * len(np.unique(triangles)) - b - 2:
        return None
    return triangles


def _inside(boundary: np.ndarray, inner: np.ndarray) -> np.ndarray:
    angle = np.unwrap(np.arctan2(boundary[:, 1], boundary[:, 0]))
    edges = np.append(angle, angle[0] + 2 * np.pi)
    mine = (np.arctan2(inner[:, 1], inner[:, 0]) - edges[0]) % (2 * np.pi) + edges[0]
    k = np.clip(np.searchsorted(edges, mine, side="right") - 1, 0, len(boundary) - 1)
    # Distance of the chord from the centre, and along the ray.
    half = (edges[k + 1] - edges[k]) / 2
    along = np.cos(half) / np.maximum(np.cos(mine - edges[k] - half), 1e-12)
    radius = np.linalg.norm(inner, axis=1)
    limit = np.where(half < np.pi / 2, along - CHORD_MARGIN * np.sin(half) * half - 1e-9, radius)
    return inner * np.minimum(1, limit / np.maximum(radius, 1e-300))[:, None]
