"""Untangle a map to the sphere that has folded faces, by an energy that is finite at a fold (Garanzha et al. 2021).

In the energy of `maps.energy` the area ratio r of a face is replaced by chi(r) = (r + sqrt(eps^2 + r^2)) / 2, positive
for folded faces too, and eps shrinks with the worst fold (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov 2021).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..linalg.nested_dissection import mesh_order
from ..maps.energy import Elements, FaceDerivatives, elements, face_derivatives_of, squared
from ..mesh.spherical_geometry import signed_volumes, spherical_areas
from ..mesh.topology import graph_components, halfedges, vertices_around
from ..progress import Progress, Steps
from ..refinement.hessian_blocks import Assembly
from ..refinement.projected_newton import ARMIJO
from .newton import derivatives, newton_direction, project_faces, projected_corners, retract, tangents

# Newton steps.
MAX_STEPS = 40
# Halvings of a step that does not lower the energy enough.
MAX_HALVINGS = 12
# eps is one of these shares of the worst fold's area ratio, the next where no step helps, and at least LEAST_EPS.
EPS_SHARES = (0.2, 1.0, 5.0)
LEAST_EPS = 0.05
# Radians that a vertex moves in a step at most.
LONGEST_MOVE = 0.05
# Folds may become this many times as many on the way.
SPREADING = 3
# Of the energy that untangles; the refinement that follows has its own.
AREA_WEIGHT = 1.0
# Rings of vertices around a few folds that move with them.
RINGS = 4


def untangle_on_sphere(
    faces: Elements, assembly: Assembly, positions: np.ndarray, fixed: np.ndarray | None = None
) -> Steps[tuple[np.ndarray, int]]:
    """Unit vectors (n,3) near the given ones with no face folded, if that is found, and the steps taken.

    Fixed vertices (n,) bool stay. Newton's method on the energy with chi, eps anew in every step. The caller checks for
    folds: the method has no guarantee, and gives up where it makes no more progress.
    """
    # In units of the areas asked for; faces of little area must not fold either.
    even = np.full(len(faces.area), 1 / len(faces.area))
    faces = replace(faces, hats=faces.gradient / np.sqrt(faces.ratio)[:, None], weight=(faces.weight + even) / 2)
    most = None
    for k in range(MAX_STEPS):
        folds = int((~(signed_volumes(positions, faces.triangles) > 0)).sum())
        most = most or SPREADING * folds
        if folds == 0 or folds > most:
            return positions, k
        yield Progress("Untangling", k / MAX_STEPS)
        tries = (_step(faces, assembly, positions, fixed, share) for share in EPS_SHARES)
        following = next((found for found in tries if found is not None), None)
        if following is None:
            return positions, k
        positions = following
    return positions, MAX_STEPS


def _step(faces: Elements, assembly: Assembly, positions: np.ndarray, fixed, eps_share: float) -> np.ndarray | None:
    """Unit vectors (n,3) after one line-searched Newton step; None where no share of it lowers the energy."""
    face = project_faces(positions, faces.triangles)
    a, b = derivatives(faces, face.corner)
    worst = min(float((squared(a) - squared(b)).min()), 0.0)
    eps = np.hypot(LEAST_EPS, eps_share * worst)
    value, local = _energy(faces, a, b, eps), _local(faces, a, b, eps)
    axes = tangents(positions)
    direction, slope = newton_direction(faces, assembly, positions, face, local, fixed)
    share = min(1.0, LONGEST_MOVE / max(float(np.linalg.norm(direction, axis=1).max()), LONGEST_MOVE))
    for _ in range(MAX_HALVINGS):
        trial = retract(positions, axes, share * direction)
        there = derivatives(faces, projected_corners(trial, faces.triangles))
        if _energy(faces, *there, eps) <= value + ARMIJO * share * slope:
            return trial
        share /= 2
    return None


def _chi(det: np.ndarray, eps: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """chi(det) = (det + sqrt(eps^2 + det^2)) / 2 and its first two derivatives, (m,) each."""
    root = np.hypot(eps, det)
    # For folds the sum cancels: chi = eps^2 / (2 (root - det)).
    chi = np.where(det > 0, 0.5 * (det + root), 0.5 * eps**2 / (root + np.abs(det)))
    return chi, chi / root, 0.5 * eps**2 / root**3


def _energy(faces: Elements, a: np.ndarray, b: np.ndarray, eps: float) -> float:
    """Sum over the faces of weight ((|a|^2 + |b|^2) / chi + AREA_WEIGHT (chi + 1 / chi) / 2)."""
    outer, inner = squared(a), squared(b)
    chi, _, _ = _chi(outer - inner, eps)
    return float(faces.weight @ ((outer + inner) / chi + AREA_WEIGHT * (chi + 1 / chi) / 2))


def _local(faces: Elements, a: np.ndarray, b: np.ndarray, eps: float) -> FaceDerivatives:
    """As `maps.energy.derivatives_of`, for the energy with chi instead of the area ratio."""
    outer, inner = squared(a), squared(b)
    chi, first, second = _chi(outer - inner, eps)
    total = outer + inner
    # The area term is a function of chi, the shear term a quotient by it.
    slope = AREA_WEIGHT / 2 * (1 - 1 / chi**2) * first
    bend = AREA_WEIGHT * (first**2 / chi**3 + (1 - 1 / chi**2) * second / 2)
    quotient = total * (2 * first**2 / chi**3 - second / chi**2) + bend
    weight = faces.weight
    by_outer = weight * (1 / chi - total * first / chi**2 + slope)
    by_inner = weight * (1 / chi + total * first / chi**2 - slope)
    oo = weight * (quotient - 2 * first / chi**2)
    ii = weight * (quotient + 2 * first / chi**2)
    block = (
        2 * by_outer + 4 * outer * oo,
        -4 * weight * np.sqrt(outer * inner) * quotient,
        2 * by_inner + 4 * inner * ii,
    )
    return face_derivatives_of(faces, a, b, (by_outer, by_inner), (by_outer, by_inner), block)


def untangle_spots(
    reference: np.ndarray,
    triangles: np.ndarray,
    positions: np.ndarray,
    held: np.ndarray,
    rings: int,
    area: np.ndarray | None = None,
) -> Steps[np.ndarray]:
    """Unit vectors (n,3) with the folded faces straightened, where it works, by vertices so many rings around them.

    The faces (m,3) are to keep the shapes of the reference (n,3) and the area (m,), that which they have by default;
    held vertices (n,) bool stay.
    """
    folded = ~(signed_volumes(positions, triangles) > 0)
    if not folded.any():
        return positions
    touched = vertices_around(triangles, folded, len(positions), rings) & ~held
    tail, head = halfedges(triangles)
    inside = touched[tail] & touched[head]
    label = graph_components(tail[inside], head[inside], len(positions))[1]
    # All at once, where folds may wander for a while, then one by one, where one failure is not that of all.
    for spot in (touched, *(touched & (label == number) for number in np.unique(label[touched]).tolist())):
        if (signed_volumes(positions, triangles[spot[triangles].any(axis=1)]) > 0).all():
            continue
        kept = np.abs(spherical_areas(positions, triangles)) if area is None else area
        straight = yield from straighten_around(reference, triangles, positions, kept, spot)
        positions = positions if straight is None else straight
    return positions


def untangle_locally(surface: np.ndarray, triangles: np.ndarray, positions: np.ndarray) -> Steps[np.ndarray]:
    """Untangle the few folded faces of a map to the sphere, unit vectors (n,3), moving a few rings of vertices only.

    surface (n,3): shapes that the faces (m,3) are to keep; their areas are those that they have on the sphere, folded
    or not. Where that fails the map is returned as it was.
    """
    touched = vertices_around(triangles, ~(signed_volumes(positions, triangles) > 0), len(positions), RINGS)
    area = np.abs(spherical_areas(positions, triangles))
    straight = yield from straighten_around(surface, triangles, positions, area, touched)
    return positions if straight is None else straight


def straighten_around(
    reference: np.ndarray, triangles: np.ndarray, positions: np.ndarray, area: np.ndarray, free: np.ndarray
) -> Steps[np.ndarray | None]:
    """Untangle the faces at the free vertices (n,) bool, which alone move: unit vectors (n,3), None where that fails.

    The faces (m,3) are to keep the shapes of the reference (n,3) and the area (m,).
    """
    # Where most faces have no area, as of vertices that were put in one place, the mean has one, or any will do.
    target = np.maximum(area, 1e-9 * (np.median(area) or area.mean() or 1.0))
    inside = free[triangles].any(axis=1)
    vertices, small = np.unique(triangles[inside], return_inverse=True)
    # Newton eliminates unknowns as they come.
    order = mesh_order(reference[vertices], small.reshape(-1, 3))
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    vertices, small = vertices[order], place[small.reshape(-1, 3)]
    faces = elements(reference[vertices], small, target[inside])
    assembly = Assembly(small, len(vertices))
    straight, _ = yield from untangle_on_sphere(faces, assembly, positions[vertices], ~free[vertices])
    if not signed_volumes(straight, small).min() > 0:
        return None
    result = positions.copy()
    result[vertices] = straight
    return result
