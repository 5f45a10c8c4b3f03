"""Map a disk conformally to the unit disk or to a rectangle, by flattening its double (Campen, Capouellez et al. 2021).

The chart is doubled along its boundary and made flat but for four corners of the boundary, where each copy
keeps a right angle: the dynamic Yamabe flow on a closed surface, which is convex and always has a solution.
The flat double is a pillow, each copy of the chart a rectangle whose aspect ratio is the conformal modulus.
Jacobi's elliptic sine maps the rectangle to the disk, its boundary exactly to the circle.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csr_matrix

from ..errors import PrecisionError
from ..linalg.sparse import solve_spd
from ..maps.untangle import count_folds, untangle
from ..mesh.geometry import angles_from_lengths, cotangents_from_lengths, halfedge_lengths, lengths, vertex_areas
from ..mesh.topology import boundary_loops, halfedges
from ..progress import Steps
from .double_cover import crossed_segment, double_disk
from .intrinsic_triangulation import euclidean_diagonal, from_mesh, make_delaunay, split_boundary_edge
from .rectangle_to_disk import centre_in_disk, rectangle_to_disk
from .yamabe_flow import TOLERANCE, YamabeFlow, yamabe_flow

# Below this distance of two neighbours in the unit disk, rounding decides where they lie.
RESOLUTION = 1e-12
# A vertex this share of the boundary before a quarter of it is as good as there: on a symmetric boundary, rounding
# shall not decide between two.
QUARTER_SLACK = 1e-3


@dataclass(frozen=True)
class ConformalMap:
    """A conformal image of a chart.

    Attributes
    ----------
    uv : (n,2) in the unit disk or in the rectangle [0,1] x [0,aspect]
    aspect : height of the rectangle over its width, the conformal modulus
    corners : (4,) vertices with a right angle in the rectangle, -1 for a point between two vertices
    residual : largest error of an angle sum, in radians
    iterations, flips : Newton steps, and edges flipped
    log_scale : (n,) of the flat metric of the rectangle
    straightened : faces that a flat metric puts on the wrong side of a straight line between their corners, and that
        were moved back by `untangle`
    """

    uv: np.ndarray
    aspect: float
    corners: np.ndarray
    residual: float
    iterations: int
    flips: int
    log_scale: np.ndarray
    straightened: int = 0


def conformal_disk(vertices: np.ndarray, triangles: np.ndarray, tolerance: float = TOLERANCE) -> Steps[ConformalMap]:
    """Conformal map of a disk mesh (n,3), (m,3) to the unit disk, boundary vertices exactly on the circle.

    tolerance : largest error of an angle sum of the flat metric, in radians. The area-weighted mean of the image is at
        0. Raises PrecisionError where the map leaves double precision.
    """
    loop = boundary_loops(triangles)[0]
    result = yield from _rectangle(vertices, triangles, loop, quarter_points(vertices, loop), tolerance)
    disk = rectangle_to_disk(result.uv, result.aspect)
    disk = centre_in_disk(disk, vertex_areas(vertices, triangles))
    disk[loop] /= lengths(disk[loop])[:, None]
    _check_resolution(disk, triangles)
    folds = count_folds(disk, triangles)
    if folds:
        # The flat metric is embedded, but the mesh's own edges are not always its straight lines.
        disk, _ = untangle(disk, vertices, triangles, loop, disk[loop])
    return replace(result, uv=disk, straightened=folds - count_folds(disk, triangles))


def conformal_rectangle(
    vertices: np.ndarray, triangles: np.ndarray, corners: np.ndarray | None = None
) -> Steps[ConformalMap]:
    """Conformal map of a disk mesh (n,3), (m,3) to the rectangle [0,1] x [0,aspect].

    corners (4,) boundary vertices, counter-clockwise from the lower left; the sharpest by default.
    Triangles whose three vertices lie on one side have no area in the image.

    Raises
    ------
    PrecisionError : the map leaves double precision
    ValueError : corners that are not four different vertices of the boundary, in turn, where it has as many
    """
    loop = boundary_loops(triangles)[0]
    if corners is None:
        corners = sharpest_corners(vertices, triangles, loop)
    elif len(loop) > 3:
        _check_corners(loop, corners, len(vertices))
    result = yield from _rectangle(vertices, triangles, loop, corners)
    _check_resolution(result.uv / [1, result.aspect], triangles)
    return result


def quarter_points(vertices: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Four distinct vertices (4,) that cut the boundary into parts of about equal length."""
    step = lengths(vertices[np.roll(loop, -1)] - vertices[loop])
    start = np.cumsum(step) - step
    place = np.searchsorted(start, np.arange(4) / 4 * step.sum() - QUARTER_SLACK * step.sum())
    # Long edges may hold several quarters: push the later ones on, and none beyond the end of the loop.
    place = np.maximum.accumulate(place - np.arange(4)) + np.arange(4)
    return loop[np.minimum(place, len(loop) - 4 + np.arange(4))] if len(loop) > 3 else loop


def boundary_turns(vertices: np.ndarray, triangles: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """By how much the boundary loop (b,) turns at its vertices, (b,) in radians: pi minus the angles inside."""
    angle = angles_from_lengths(halfedge_lengths(vertices, triangles).reshape(-1, 3))
    return np.pi - np.bincount(triangles[:, [2, 0, 1]].ravel(), angle.ravel(), len(vertices))[loop]


def sharpest_corners(vertices: np.ndarray, triangles: np.ndarray, loop: np.ndarray, apart: float = 1 / 8) -> np.ndarray:
    """Four vertices (4,) where the boundary turns most, this share of its length apart, in order of the loop."""
    if len(loop) <= 4:
        return loop
    turn, least = boundary_turns(vertices, triangles, loop), apart
    step = lengths(vertices[np.roll(loop, -1)] - vertices[loop])
    start, total = np.cumsum(step) - step, step.sum()
    chosen: list[int] = []
    far = np.full(len(loop), np.inf)
    for _ in range(4):
        # Where no vertex is far enough from the chosen ones, the farthest comes next.
        allowed = far >= least * total
        place = int(np.argmax(np.where(allowed, turn, -np.inf)) if allowed.any() else np.argmax(far))
        chosen.append(place)
        apart = np.abs(start - start[place])
        far = np.minimum(far, np.minimum(apart, total - apart))
        far[chosen] = -1
    return loop[np.sort(chosen)]


def _rectangle(vertices, triangles, loop, corners, tolerance=TOLERANCE) -> Steps[ConformalMap]:
    """The map to the rectangle, by flattening the double with cone angles of pi at the corners (4,)."""
    n = len(vertices)
    loop = np.roll(loop, -int(np.flatnonzero(loop == corners[0])[0]))
    scale = np.sqrt(vertex_areas(vertices, triangles).sum())
    tri = from_mesh((vertices - vertices.mean(axis=0)) / scale, triangles)
    if len(loop) == 3:
        # A rectangle wants four corners: give the longest side a vertex in its middle.
        tri, loop = split_boundary_edge(tri, loop, n)
        corners = loop
    tri, _ = make_delaunay(tri, euclidean_diagonal)
    count = n + (len(loop) == 4 and loop.max() >= n)
    doubled, owner = double_disk(tri, loop, count)
    doubled, _ = make_delaunay(doubled, euclidean_diagonal)
    cone_angle = np.full(count, 4 * np.pi)
    cone_angle[loop] = 2 * np.pi
    cone_angle[corners] = np.pi
    flow = yield from yamabe_flow(doubled, owner, cone_angle, tolerance)
    uv, aspect = _layout(flow, owner, loop, corners, count)
    return ConformalMap(
        uv=uv[:n],
        aspect=aspect,
        corners=np.where(corners < n, corners, -1),
        residual=flow.residual,
        iterations=flow.iterations,
        flips=flow.flips,
        log_scale=flow.log_scale[:n],
    )


def _check_corners(loop: np.ndarray, corners: np.ndarray, n: int) -> None:
    """Raise ValueError unless corners (4,) follow one another along a boundary loop (b,) of n vertices."""
    place = np.full(n, -1, dtype=np.int64)
    place[loop] = np.arange(len(loop))
    at = place[corners]
    if (at < 0).any() or (np.diff((at - at[0]) % len(loop)) <= 0).any():
        raise ValueError("the corners must be four different boundary vertices in counter-clockwise order")


def _layout(flow: YamabeFlow, owner, loop, corners, n) -> tuple[np.ndarray, float]:
    """Coordinates (n,2) of the flat pillow's front, and the aspect ratio of the rectangle.

    Each coordinate is linear, therefore harmonic, but for the kink at the two sides where it is constant;
    an edge that crosses such a side sees the mirror image of its other end there.
    """
    place = np.full(n, -1, dtype=np.int64)
    place[loop] = np.arange(len(loop))
    start = place[corners]
    # Side of the rectangle of each boundary segment: 0 bottom, 1 right, 2 top, 3 left.
    side = (np.searchsorted(start, np.arange(len(loop)), side="right") - 1) % 4
    segment = crossed_segment(flow.triangulation, loop, n)
    crossed = np.where(segment >= 0, side[segment], -1)
    following = np.roll(loop, -1)
    on_side = [np.union1d(loop[side == s], following[side == s]) for s in range(4)]
    x, energy = _coordinate(flow, owner, crossed, on_side, n, 3, 1)
    y, _ = _coordinate(flow, owner, crossed, on_side, n, 0, 2)
    return np.stack([x, y * energy / 2], axis=1), energy / 2


def _coordinate(flow, owner, crossed, on_side, n, low: int, high: int) -> tuple[np.ndarray, float]:
    """Harmonic coordinate (n,), 0 on the side `low`, 1 on `high`, and its Dirichlet energy on the pillow."""
    tail, head = halfedges(flow.triangulation.triangles)
    a, b = owner[tail], owner[head]
    weight = cotangents_from_lengths(flow.length).ravel()
    # Mirrored at x = 0 or 1, the other end b appears at sign * x_b + shift.
    sign = np.where((crossed == low) | (crossed == high), -1.0, 1.0)
    shift = np.where(crossed == high, 2.0, 0.0)
    rows, columns = np.concatenate([a, b, a, b]), np.concatenate([a, b, b, a])
    entries = np.concatenate([weight, weight, -sign * weight, -sign * weight])
    matrix = csr_matrix((entries, (rows, columns)), shape=(n, n))
    right = np.bincount(a, weight * shift, n) - np.bincount(b, weight * sign * shift, n)
    x = np.zeros(n)
    x[on_side[high]] = 1
    free = np.ones(n, dtype=bool)
    free[on_side[low]] = free[on_side[high]] = False
    if free.any():
        x[free] = solve_spd(matrix[free][:, free].tocsc(), (right - matrix @ x)[free], order="mmd")
    energy = 0.5 * float(weight @ (x[a] - sign * x[b] - shift) ** 2)
    return x, energy


def _check_resolution(uv: np.ndarray, triangles: np.ndarray) -> None:
    shortest = halfedge_lengths(uv, triangles).min()
    if not shortest > RESOLUTION:
        raise PrecisionError(
            f"The conformal map leaves double precision: neighbouring vertices are only {shortest:.1e} apart"
        )
