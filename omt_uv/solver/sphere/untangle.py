"""Straighten a map to the sphere that has folded faces, by an energy that is finite at a fold.

In the energy of `energy.py` the area ratio r of a face is replaced by chi(r) = (r + sqrt(eps^2 + r^2)) / 2, positive
for folded faces too, and eps shrinks with the worst fold (Garanzha, Kaporin, Kudryavtseva, Protais, Ray, Sokolov 2021).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..maps.energy import Elements, FaceDerivatives, elements, face_derivatives_of, squared
from ..mesh.spherical_geometry import signed_volumes, spherical_areas
from ..progress import Progress, Steps
from ..refinement.projected_newton import ARMIJO, Assembly
from .newton import derivatives, moved, newton_direction, seen, tangents

MAX_STEPS = 40
MAX_HALVINGS = 12
# eps is one of these shares of the worst fold, the next where no step helps, and at least LEAST.
SHARES = (0.2, 1.0, 5.0)
LEAST = 0.05
# No vertex moves farther in a step.
FARTHEST = 0.05
# Folds may become this many times as many on the way.
SPREADING = 3
AREA_WEIGHT = 1.0
# Around folds that are straightened alone.
RINGS = 4


def untangle_on_sphere(
    faces: Elements, assembly: Assembly, positions: np.ndarray, held: np.ndarray | None = None
) -> Steps[tuple[np.ndarray, int]]:
    """Unit vectors (n,3) near the given ones with no face folded, if that is found, and the steps taken.

    Vertices held (n,) bool stay.

    The caller checks: the method has no guarantee, and gives up where it makes no more progress.
    """
    # In units of the areas asked for; faces of little area must not fold either.
    even = np.full(len(faces.area), 1 / len(faces.area))
    faces = replace(faces, gradient=faces.gradient / np.sqrt(faces.ratio)[:, None], weight=(faces.weight + even) / 2)
    most = None
    for k in range(MAX_STEPS):
        folds = int((~(signed_volumes(positions, faces.triangles) > 0)).sum())
        most = most or SPREADING * folds
        if folds == 0 or folds > most:
            return positions, k
        yield Progress("Untangling", k / MAX_STEPS)
        tries = (_step(faces, assembly, positions, held, share) for share in SHARES)
        following = next((found for found in tries if found is not None), None)
        if following is None:
            return positions, k
        positions = following
    return positions, MAX_STEPS


def _step(faces: Elements, assembly: Assembly, positions: np.ndarray, held, eps_share: float) -> np.ndarray | None:
    face = seen(positions, faces.triangles)
    a, b = derivatives(faces, face.corner)
    worst = min(float((squared(a) - squared(b)).min()), 0.0)
    eps = np.hypot(LEAST, eps_share * worst)
    value, local = _energy(faces, a, b, eps), _local(faces, a, b, eps)
    axes = tangents(positions)
    direction, slope = newton_direction(faces, assembly, positions, axes, face, local, held)
    share = min(1.0, FARTHEST / max(float(np.linalg.norm(direction, axis=1).max()), FARTHEST))
    for _ in range(MAX_HALVINGS):
        trial = moved(positions, axes, share * direction)
        there = derivatives(faces, seen(trial, faces.triangles).corner)
        if _energy(faces, *there, eps) <= value + ARMIJO * share * slope:
            return trial
        share /= 2
    return None


def _chi(det: np.ndarray, eps: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """chi and its first two derivatives."""
    root = np.hypot(eps, det)
    # For folds the sum cancels: chi = eps^2 / (2 (root - det)).
    chi = np.where(det > 0, 0.5 * (det + root), 0.5 * eps**2 / (root + np.abs(det)))
    return chi, chi / root, 0.5 * eps**2 / root**3


def _energy(faces: Elements, a: np.ndarray, b: np.ndarray, eps: float) -> float:
    outer, inner = squared(a), squared(b)
    chi, _, _ = _chi(outer - inner, eps)
    return float(faces.weight @ ((outer + inner) / chi + AREA_WEIGHT * (chi + 1 / chi) / 2))


def _local(faces: Elements, a: np.ndarray, b: np.ndarray, eps: float) -> FaceDerivatives:
    """As `energy.derivatives_of`, for the energy with chi instead of the area ratio."""
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


def locally_untangled(surface: np.ndarray, triangles: np.ndarray, positions: np.ndarray) -> Steps[np.ndarray]:
    """Unit vectors (n,3) of a map whose few folded faces are straightened, all but a few rings of vertices untouched.

    Every face is to keep the area that it has on the sphere, folded or not. Where that fails the map is returned as it
    was.
    """
    touched = around(triangles, ~(signed_volumes(positions, triangles) > 0), len(positions))
    area = np.abs(spherical_areas(positions, triangles))
    straight = yield from straightened(surface, triangles, positions, area, touched)
    return positions if straight is None else straight


def straightened(
    reference: np.ndarray, triangles: np.ndarray, positions: np.ndarray, area: np.ndarray, free: np.ndarray
) -> Steps[np.ndarray | None]:
    """Unit vectors (n,3) without a fold among the faces at the vertices free (n,) bool, which alone move; None where
    that fails.

    The faces are to keep the shapes of the reference (n,3) and the area (m,).
    """
    target = np.maximum(area, 1e-9 * np.median(area))
    inside = free[triangles].any(axis=1)
    vertices, small = np.unique(triangles[inside], return_inverse=True)
    small = small.reshape(-1, 3)
    faces = elements(reference[vertices], small, target[inside])
    assembly = Assembly(small, len(vertices))
    straight, _ = yield from untangle_on_sphere(faces, assembly, positions[vertices], ~free[vertices])
    if not signed_volumes(straight, small).min() > 0:
        return None
    result = positions.copy()
    result[vertices] = straight
    return result


def around(triangles: np.ndarray, faces: np.ndarray, n: int) -> np.ndarray:
    """Vertices (n,) bool of the faces (m,) bool and of a few rings around them."""
    touched = np.zeros(n, dtype=bool)
    touched[triangles[faces]] = True
    for _ in range(RINGS):
        touched[triangles[touched[triangles].any(axis=1)]] = True
    return touched
