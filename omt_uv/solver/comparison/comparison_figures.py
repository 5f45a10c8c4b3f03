"""Compare a surface with another: the one it was made of, or the next level of detail."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from scipy.spatial import cKDTree

from ..analysis.curvature import gaussian_curvature, mean_curvature
from ..errors import EmptyMeshError, NonFiniteError
from ..mesh.closest_point import ClosestPoint, SurfacePoints, random_points
from ..mesh.geometry import face_areas, face_normals
from ..mesh.topology import boundary_edges, expand
from ..progress import Progress, Steps, part_of
from .bumps import Bumps, bumps_of, curvature_error
from .greatest import by_position, farthest, greatest_distance
from .triangle_shapes import TriangleShapes, compare_shapes, topology_of

# Positions (n,3) and triangles (m,3).
Mesh: TypeAlias = tuple[np.ndarray, np.ndarray]
# Points on each surface from which distances are taken, beside all of its vertices.
POINTS = 100_000
# Points that are looked for at once, for memory.
CHUNK = 100_000
# Points along the boundary for each diagonal.
BOUNDARY_POINTS = 2000


@dataclass(frozen=True)
class Comparison(TriangleShapes):
    """Figures of a surface B beside a surface A; lengths are shares of the diagonal of the box of A.

    vertices, faces : of B, whose faces are triangles
    hausdorff, hausdorff_a, hausdorff_b : greatest distance: of both ways, from A to B, and from B to A
    hausdorff_bound : no distance is above it; None where distances are those of points alone
    rms, rms_a, rms_b : root of the mean square over the area, both ways, from A to B, and from B to A
    normal_mean, normal_p99 : angle in degrees between the normals at closest points, from A to B
    gaussian_error, mean_error : curvature measures under bumps, `sum |phi_A - phi_B| / sum |phi_A|`
    boundary : Hausdorff distance of the boundaries; None where one has none
    those of its triangles : of B, see `TriangleShapes`
    topology_kept : as many components and boundary loops, the same Euler characteristic, manifold and oriented
    components, loops, euler : of B
    """

    vertices: int
    faces: int
    hausdorff: float
    hausdorff_a: float
    hausdorff_b: float
    hausdorff_bound: float | None
    rms: float
    rms_a: float
    rms_b: float
    normal_mean: float
    normal_p99: float
    gaussian_error: float
    mean_error: float
    boundary: float | None
    topology_kept: bool
    components: int
    loops: int
    euler: int


@dataclass(frozen=True)
class _OneWay:
    """From a surface to another: the triangles (k,) of points that stand for the same area each; then, of these and of
    all vertices, the closest points and distances, the greatest of the surface, and a bound of it, if there is one."""

    owner: np.ndarray
    found: SurfacePoints
    distance: np.ndarray
    most: float
    bound: float | None


def compare(A: Mesh, B: Mesh, points: int = 0) -> Steps[Comparison]:
    """Figures of B beside A, each positions (n,3) and triangles (m,3).

    Distances are taken from 100,000 points of a surface and from all of its vertices, and the greatest is looked for
    between them. points : from so many points of a surface and its vertices alone, as programs that sample have it

    Raises
    ------
    EmptyMeshError : one of them has no faces
    NonFiniteError : a position is NaN or infinite
    """
    A, B = _checked(*A), _checked(*B)
    diagonal = float(np.linalg.norm(np.ptp(A[0], axis=0)))
    bumps = yield from part_of(bumps_of(*A), 0.0, 0.4)
    there = yield from part_of(_way(A, B, points), 0.4, 0.3)
    back = yield from part_of(_way(B, A, points), 0.7, 0.3)
    rms_a, rms_b = (float(np.sqrt(np.mean(_spread(w) ** 2))) / diagonal for w in (there, back))
    most_a, most_b = (way.most / diagonal for way in (there, back))
    bounds = [way.bound / diagonal for way in (there, back) if way.bound is not None]
    # A point of a triangle and its closest point are about where the surfaces are the same.
    n = len(there.owner)
    cosine = (face_normals(*A)[there.owner] * face_normals(*B)[there.found.faces[:n]]).sum(axis=1)
    turn = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    gaussian, mean = _curvature_errors(A, B, bumps, back)
    first, second = topology_of(A[1]), topology_of(B[1])
    same = (first.components, first.loops, first.euler) == (second.components, second.loops, second.euler)
    return Comparison(
        vertices=len(B[0]),
        faces=len(B[1]),
        hausdorff=max(most_a, most_b),
        hausdorff_a=most_a,
        hausdorff_b=most_b,
        hausdorff_bound=max(bounds, default=None),
        rms=float(np.hypot(rms_a, rms_b) / np.sqrt(2)),
        rms_a=rms_a,
        rms_b=rms_b,
        normal_mean=float(turn.mean()),
        normal_p99=float(np.percentile(turn, 99)),
        gaussian_error=gaussian,
        mean_error=mean,
        boundary=_boundary_distance(A, B, diagonal),
        topology_kept=bool(same and not second.crowded and not second.disagreeing),
        components=second.components,
        loops=second.loops,
        euler=second.euler,
        **vars(compare_shapes(*B)),
    )


def distances_to(positions: np.ndarray, triangles: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance (k,) of points (k,3) from the surface of positions (n,3) and triangles (m,3)."""
    V, F = _checked(positions, triangles)
    index = ClosestPoint(V, F, _spacing(V, F))
    found = np.concatenate([by_position(index, part).points for part in _parts(points)])
    return np.linalg.norm(found - points, axis=1)


def _checked(V: np.ndarray, F: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the vertices that are in use, and triangles with an area."""
    V, F = np.asarray(V, float), np.asarray(F, np.int64)
    if not np.isfinite(V).all():
        raise NonFiniteError(
            "A position is not finite", kind="vertex", elements=np.flatnonzero(~np.isfinite(V).all(axis=1))
        )
    F = F[face_areas(V, F) > 0] if len(F) else F
    if not len(F):
        raise EmptyMeshError("There are no faces to compare")
    used, flat = np.unique(F, return_inverse=True)
    return V[used], flat.reshape(-1, 3)


def _spacing(V: np.ndarray, F: np.ndarray) -> float:
    """How far apart points are that are spread over a surface."""
    return float(np.sqrt(face_areas(V, F).sum() / POINTS))


def _parts(points: np.ndarray) -> list[np.ndarray]:
    return np.array_split(points, max(-(-len(points) // CHUNK), 1))


def _way(source: Mesh, target: Mesh, count: int) -> Steps[_OneWay]:
    """Distances from a surface to another, of so many points, or of POINTS and what is between them."""
    owner, points = _scattered(*source, count or POINTS)
    every = np.concatenate([points, source[0]])
    index = ClosestPoint(*target, _spacing(*target))
    parts, chunks = [], _parts(every)
    for k, part in enumerate(chunks):
        yield Progress("distances", 0.5 * k / len(chunks))
        parts.append(by_position(index, part))
    found = SurfacePoints(*(np.concatenate(x) for x in zip(*(vars(p).values() for p in parts), strict=True)))
    distance = np.linalg.norm(found.points - every, axis=1)
    if count:
        return _OneWay(owner, found, distance, farthest(index, every, distance), None)
    steps = greatest_distance(*source, index, found.faces[len(points) :], (every, distance))
    greatest = yield from part_of(steps, 0.5, 0.5)
    return _OneWay(owner, found, distance, greatest.distance, greatest.bound)


def _scattered(V: np.ndarray, F: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (k,) and places (k,3) of random points, one in each of as many equal parts of the area."""
    owner, weights = random_points(face_areas(V, F), count, np.random.default_rng(0))
    return owner, sum(weights[:, k, None] * V[F[owner, k]] for k in range(3))


def _spread(way: _OneWay) -> np.ndarray:
    """Distances of the points that are scattered, without the vertices."""
    return way.distance[: len(way.owner)]


def _curvature_errors(A: Mesh, B: Mesh, bumps: Bumps, back: _OneWay) -> tuple[float, float]:
    """Errors of the Gaussian and the mean curvature measure; bumps of A at vertices of B by their closest points."""
    faces, weights = (part[len(back.owner) :] for part in (back.found.faces, back.found.barycentric))
    at = [bumps.values[:, A[1][faces, k]].multiply(weights[:, k][None]) for k in range(3)]
    moved = (at[0] + at[1] + at[2]).tocsr()
    errors = [
        curvature_error(bumps.values @ curvature(*A), moved @ curvature(*B))
        for curvature in (gaussian_curvature, mean_curvature)
    ]
    return errors[0], errors[1]


def _boundary_distance(A: Mesh, B: Mesh, diagonal: float) -> float | None:
    """Hausdorff distance of the boundaries, by points along them."""
    a, b = (_along(mesh, diagonal / BOUNDARY_POINTS) for mesh in (A, B))
    if not len(a) or not len(b):
        return None
    return float(max(cKDTree(a).query(b)[0].max(), cKDTree(b).query(a)[0].max())) / diagonal


def _along(mesh: Mesh, step: float) -> np.ndarray:
    """Points (k,3) along the boundary, no farther apart than a step."""
    V, F = mesh
    edges = boundary_edges(F)
    a, b = V[edges[:, 0]], V[edges[:, 1]]
    count = np.maximum(1, np.ceil(np.linalg.norm(b - a, axis=1) / step).astype(int))
    edge, step_number = expand(count)
    t = (step_number / count[edge])[:, None]
    return a[edge] * (1 - t) + b[edge] * t
