"""Polish a map on few vertices first: a change over long distances takes few steps there, and none of them is stuck.

Vertices far from one another are chosen (Eldar, Lindenbaum, Porat, Zeevi 1997), and joined by the Delaunay
triangulation of their places in the domain, which on the sphere is their convex hull. The map of the coarse mesh
carries all other vertices along, linearly in each of its triangles; the few that fold are straightened.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from ..maps.energy import elements
from ..mesh.geometry import face_areas, vertex_areas
from ..mesh.point_location import locate
from ..mesh.spherical_geometry import signed_volumes, spherical_areas
from ..mesh.topology import vertices_around
from ..progress import Steps
from ..refinement.hessian_blocks import Assembly
from ..sphere.untangle import straighten_around
from .carriers import InPlace, TargetCarrier
from .surface_newton import Deformation, Features, in_space, minimise_on, without_folds

# Vertices of the coarse mesh, and Newton steps on it.
COARSE = 500
COARSE_STEPS = 60
TOLERANCE = 1e-3
# Rings of vertices around folds that are straightened.
RINGS = 3


def coarse_polish(
    problem: Deformation, vertices: np.ndarray, placed: InPlace, loop: np.ndarray, count: int = COARSE
) -> Steps[tuple[InPlace, int]]:
    """The places (n,) after a polish on about `count` vertices, and its steps.

    problem : of all vertices; vertices (n,3): the reference; loop (k,): those that slide on a boundary
    """
    n = len(vertices)
    if n < 2 * count:
        return placed, 0
    chosen = far_vertices(vertices, np.flatnonzero(problem.held), loop, count)
    domain = placed.domain[chosen]
    triangles = _delaunay(domain)
    if triangles is None:
        return placed, 0
    number = np.full(n, -1)
    number[chosen] = np.arange(len(chosen))
    carrier = _with_loop(problem.surface, number[loop[number[loop] >= 0]])
    few = _coarse_problem(problem, vertices, chosen, triangles, carrier)
    few = replace(few, within=_elements(in_space(domain), triangles))
    start = InPlace(*(part[chosen] for part in vars(placed).values()))
    found, steps = yield from minimise_on(few, start, COARSE_STEPS, TOLERANCE, "Polishing")
    faces, weights = locate(domain, triangles, placed.domain)
    moved = carrier.within(np.einsum("nc,ncd->nd", weights, found.domain[triangles[faces]]))
    moved[problem.held] = placed.domain[problem.held]
    moved = yield from _straightened(problem, placed.domain, moved)
    after = problem.carrier.place(moved)
    after = after.chosen(~problem.held, placed)
    return without_folds(problem, placed, after), steps


def far_vertices(vertices: np.ndarray, first: np.ndarray, loop: np.ndarray, count: int) -> np.ndarray:
    """Vertices (k,) of (n,3) far from one another: the first ones, and each next one farthest from all before.

    Of a loop (b,) every few vertices are among the first.
    """
    if len(loop):
        first = np.union1d(first, loop[:: max(1, len(loop) // max(12, int(np.sqrt(count))))])
    chosen = first.tolist() or [0]
    distance = np.full(len(vertices), np.inf)
    for vertex in chosen:
        np.minimum(distance, ((vertices - vertices[vertex]) ** 2).sum(axis=1), out=distance)
    while len(chosen) < count:
        vertex = int(distance.argmax())
        chosen.append(vertex)
        np.minimum(distance, ((vertices - vertices[vertex]) ** 2).sum(axis=1), out=distance)
    return np.array(chosen)


def _delaunay(domain: np.ndarray) -> np.ndarray | None:
    """Triangles (m,3) of points on the sphere (k,3), or in the plane (k,2); None where they leave one out."""
    if domain.shape[1] == 2:
        triangles = Delaunay(domain).simplices
        a, b, c = (domain[triangles[:, k]] for k in range(3))
        turned = np.cross(b - a, c - a) < 0
    else:
        triangles = ConvexHull(domain).simplices
        turned = signed_volumes(domain, triangles) < 0
    triangles = np.where(turned[:, None], triangles[:, [0, 2, 1]], triangles).astype(np.int64)
    return triangles if len(np.unique(triangles)) == len(domain) else None


def _elements(positions: np.ndarray, triangles: np.ndarray):
    """The triangles (m,3) as they are, of positions (k,3)."""
    area = face_areas(positions, triangles)
    return elements(positions, triangles, np.maximum(area, 1e-12 * area.mean()))


def _coarse_problem(problem: Deformation, vertices, chosen, triangles, carrier) -> Deformation:
    """The problem on the chosen vertices (k,) and their triangles (m,3)."""
    reference = vertices[chosen]
    features = problem.features
    if features is not None:
        area = vertex_areas(reference, triangles)
        features = Features(features.values[chosen], features.target, features.share.sum() * area / area.sum())
    return Deformation(
        faces=_elements(reference, triangles),
        assembly=Assembly(triangles, len(chosen)),
        carrier=carrier,
        held=problem.held[chosen],
        area_weight=problem.area_weight,
        features=features,
    )


def _with_loop(carrier: TargetCarrier, loop: np.ndarray) -> TargetCarrier:
    """The carrier for a mesh whose vertices (k,) slide on the boundary."""
    return TargetCarrier(carrier.vertices, carrier.triangles, carrier.domain, loop)


def _straightened(problem: Deformation, before: np.ndarray, after: np.ndarray) -> Steps[np.ndarray]:
    """Places (n,3) on the sphere whose folded faces are straightened; in the plane they are left."""
    triangles = problem.faces.triangles
    if after.shape[1] == 2:
        return after
    folded = ~(signed_volumes(after, triangles) > 0)
    if not folded.any():
        return after
    touched = vertices_around(triangles, folded, len(after), RINGS) & ~problem.held
    area = np.abs(spherical_areas(after, triangles))
    straight = yield from straighten_around(before, triangles, after, area, touched)
    return after if straight is None else straight
