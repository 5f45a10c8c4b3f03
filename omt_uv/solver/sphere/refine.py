"""Refine a map to the sphere until every face has its area, none folds, and the shear is low, by Newton's method.

The energy and its continuation are those of the plane (`refinement.continuation`); faces are measured in tangent planes
(`newton`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import FoldedUVError
from ..linalg.nested_dissection import mesh_order
from ..maps.energy import Elements, elements
from ..maps.polygon_elements import polygon_elements, polygon_mesh, with_convex_quads_of
from ..mesh.polygon_areas import polygon_areas
from ..mesh.spherical_geometry import normalized, signed_volumes
from ..progress import Progress, Steps, part_of
from ..refinement.continuation import StageLimits, minimise
from ..refinement.continuation_rules import (
    LOOSE,
    PROMISED,
    QUALITIES,
    SQUEEZED_WEIGHT,
    STAGE_STEPS,
    STRICT,
    Quality,
    is_enough,
    is_squeezed,
    planned_weights,
)
from ..refinement.elimination_order import has_several
from ..refinement.hessian_blocks import Assembly, assembly_of, lone_triangles
from ..refinement.mirrored_motion import find_symmetry
from .newton import SphereProblem
from .symmetry import symmetric_map
from .untangle import untangle_on_sphere, untangle_spots

# Predicted decrease over energy at which an area weight is left for a greater one, where the area error is not reached.
TOLERANCE = 1e-2
# Least and greatest factor by which the area weight grows where the area error is not reached.
LEAST_GROWTH = 2.0
MOST_GROWTH = 10.0
# Share of its value below which the area error has to fall for the same area weight to be used again.
ENOUGH_PROGRESS = 0.9
# Area error, over that of a free map, that a symmetric one may have where neither reaches what was asked for.
MUCH_LESS = 1.25
# Rings of vertices around folds of a start that are straightened by themselves, first few, then more.
RINGS = (1, 2, 4)
# Where a symmetric map is through, of the time of a refinement.
SYMMETRIC = 0.7
# Steps on the way from coarse to fine: the finer levels do the rest.
RELAXING = Quality(0.1, (1.0, 10.0), 10.0, 30, LOOSE)


@dataclass(frozen=True)
class SphereRefinement:
    """A refined map: positions (n,3) on the sphere, no face folded.

    iterations: Newton steps, after those that untangle all at once; residual: last predicted decrease over energy;
    area_error: the larger of the share of the area in the wrong place and the deviation of the areas' ratios;
    area_weight and energy at the end; status: "converged", "stalled" or "steps".
    """

    positions: np.ndarray
    iterations: int
    untangling: int
    residual: float
    area_error: float
    area_weight: float
    energy: float
    status: str


def sphere_refine(
    vertices: np.ndarray,
    triangles: np.ndarray,
    positions: np.ndarray,
    target: np.ndarray,
    *,
    balance: float = 0.0,
    quality: str = "standard",
    polygons: np.ndarray | None = None,
    mirror_polygons: np.ndarray | None = None,
) -> Steps[SphereRefinement]:
    """Refine a map (n,3) of a closed surface (n,3), (m,3) to the sphere until every polygon has its area.

    Minimises sum a_f (symmetric MIPS + area weight (r + 1 / r) / 2), r the ratio of a face's area to its target, with
    growing area weight, by projected Newton steps.

    Parameters
    ----------
    target : (m,) area that every spherical triangle shall have relative to the others
    balance : 0 for exact areas to 1 for the least shear
    quality : "draft", "standard" or "exact"
    polygons : (m,) polygon of every triangle; by default each is its own. A mesh that is its own mirror image gets a
        symmetric map
    mirror_polygons : (m,) polygons by which it is its own mirror image, those of the areas by default

    Raises
    ------
    FoldedUVError : faces of the start are folded, and could not be straightened

    References
    ----------
    As for `refinement.refine.refine`.
    """
    if not 0 <= balance <= 1:
        raise ValueError(f"balance must lie in [0, 1], not {balance}")
    # Its images give a triangle the other diagonal of a quad, too.
    problem, order = _renumbered(vertices, triangles, target, polygons if mirror_polygons is None else mirror_polygons)
    positions = yield from _spots_straightened(vertices, triangles, positions, target)
    start, steps = yield from untangle_on_sphere(problem.faces, problem.assembly, positions[order])
    folded = np.flatnonzero(~(signed_volumes(start, problem.faces.triangles) > 0))
    if len(folded):
        raise FoldedUVError("Folds of the transport map could not be straightened", kind="face", elements=folded)
    by_triangle, problem = problem, _of_polygons(problem, vertices[order], polygons)
    faces, mirrored = problem.faces, polygons
    if mirror_polygons is not None:
        faces, mirrored = _of_polygons(by_triangle, vertices[order], mirror_polygons).faces, mirror_polygons
        problem = replace(problem, uneven=True)
    symmetry = find_symmetry(vertices[order], by_triangle.faces.triangles, mirrored, faces)
    found, settings = None, QUALITIES[quality]
    if symmetry is not None:
        refining = _symmetric(problem, by_triangle, symmetry.images, start, balance, settings)
        found, more = yield from part_of(refining, 0.0, SYMMETRIC)
        steps += more
    if found is None or (balance == 0 and found.area_error > settings.area_error):
        begin = 0.0 if found is None else SYMMETRIC
        free = yield from part_of(_stages(problem, start, balance, settings), begin, 1 - begin)
        # Around a thin limb the symmetric map may be the one with less room.
        found = found if found is not None and found.area_error <= MUCH_LESS * free.area_error else free
    yield Progress("Refinement", 1.0)
    return replace(found, positions=_in_order(found.positions, order), untangling=steps)


def _spots_straightened(
    vertices: np.ndarray, triangles: np.ndarray, positions: np.ndarray, target: np.ndarray
) -> Steps[np.ndarray]:
    """The start (n,3) with what is around its folds straightened, first by few vertices: where all of them move, folds
    of limbs that lie in few points of the conformal map become more."""
    yield Progress("Refinement", 0.0)
    held, area = np.zeros(len(positions), bool), 4 * np.pi * target / target.sum()
    for rings in RINGS:
        positions = yield from untangle_spots(vertices, triangles, positions, held, rings, area)
    return positions


def relax(
    vertices: np.ndarray, triangles: np.ndarray, positions: np.ndarray, target: np.ndarray, regular: bool = False
) -> Steps[tuple[np.ndarray, int]]:
    """Relax a map without folds (n,3) by a few steps, and their number: areas (m,) roughly right, shear low.

    regular: every face counts as equilateral, whatever its shape.
    """
    problem, order = _renumbered(vertices, triangles, np.ones(len(target)) if regular else target)
    if regular:
        faces = _equilateral(problem)
        problem = replace(problem, faces=faces, ratio=faces.ratio)
    found = yield from _stages(problem, positions[order], 0.0, RELAXING)
    return _in_order(found.positions, order), found.iterations


def _equilateral(problem: SphereProblem) -> Elements:
    """The faces as they were if each were equilateral, of its target area."""
    m = len(problem.target)
    side = np.sqrt(problem.target)[:, None, None]
    corners = side * np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(0.75), 0]])
    faces = elements(corners.reshape(-1, 3), np.arange(3 * m).reshape(-1, 3), problem.target)
    return replace(faces, triangles=problem.faces.triangles)


def _renumbered(vertices, triangles, target, polygons=None) -> tuple[SphereProblem, np.ndarray]:
    """The problem with vertices in the order (n,) in which they are eliminated; polygons (m,): all corners of a quad
    are neighbours, or what parts the mesh along diagonals would part nothing, and factors would fill."""
    several = polygons is not None and has_several(polygons)
    order = mesh_order(vertices, polygon_mesh(triangles, polygons).every_triangle() if several else triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    triangles, target = place[triangles], target * (4 * np.pi / target.sum())
    faces = elements(vertices[order], triangles, target)
    assembly = Assembly(triangles, len(vertices))
    return SphereProblem(faces=faces, target=target, ratio=faces.ratio, assembly=assembly, area_weight=1.0), order


def _of_polygons(problem: SphereProblem, vertices: np.ndarray, polygons: np.ndarray | None) -> SphereProblem:
    """The problem with the areas of polygons (m,), any numbers, and shear without a diagonal; itself without any."""
    faces = polygon_elements(vertices, problem.faces.triangles, problem.target, polygons)
    if faces.polygon is None:
        return problem
    area = faces.area * polygon_areas(vertices, problem.faces.triangles, polygons).sum()
    ratio = faces.ratio * (4 * np.pi / (area @ faces.ratio))
    faces = replace(faces, ratio=ratio)
    return replace(problem, faces=faces, target=area * ratio, ratio=ratio, assembly=assembly_of(faces, len(vertices)))


def _symmetric(
    problem: SphereProblem,
    by_triangle: SphereProblem,
    images: np.ndarray,
    start: np.ndarray,
    balance: float,
    settings: Quality,
) -> Steps[tuple[SphereRefinement | None, int]]:
    """The symmetric map next to unit vectors (n,3) without folds, refined, None where there is none; and the steps that
    straightened its start."""
    near = symmetric_map(images, start)
    if near is None:
        return None, 0
    symmetry, averaged = near
    averaged, steps = yield from untangle_on_sphere(by_triangle.faces, by_triangle.assembly, averaged)
    averaged = normalized(symmetry.averaged(averaged))
    if not signed_volumes(averaged, by_triangle.faces.triangles).min() > 0:
        return None, steps
    return (yield from _stages(replace(problem, symmetry=symmetry), averaged, balance, settings)), steps


def _in_order(positions: np.ndarray, order: np.ndarray) -> np.ndarray:
    """Positions (n,3) of vertices order (n,) back in the order of the mesh."""
    result = np.empty_like(positions)
    result[order] = positions
    return result


def _stages(problem: SphereProblem, p: np.ndarray, balance: float, settings: Quality) -> Steps[SphereRefinement]:
    """Newton in stages of growing area weight, as `refinement.continuation.minimise_in_stages`."""
    weights = planned_weights(balance, settings)
    squeezed = is_squeezed(with_projected_targets(problem, p, weights[0]).energy(p), weights[0])
    if squeezed:
        weights = [SQUEEZED_WEIGHT, *weights]
    # Exact maps, and those on the way to others, go as far as they promise; what is squeezed has far to go.
    brisk = balance == 0 and settings.area_error <= PROMISED and settings.tolerance >= LOOSE and not squeezed
    steps, k, error = 0, 0, np.inf
    while True:
        current = with_projected_targets(with_both_diagonals(problem, p), p, weights[k])
        goal = settings.area_error if k >= len(weights) - 1 else np.inf
        left = settings.max_steps - steps
        allowed = min(left, STAGE_STEPS) if balance == 0 else left
        tolerance = TOLERANCE if balance == 0 else STRICT
        last = bool(np.isfinite(goal))
        limits = StageLimits(goal, allowed, tolerance, foreseeing=balance == 0 and last, passing=brisk and not last)
        stage = yield from minimise(current, p, limits, k)
        p, steps, weight, k = stage.w, steps + stage.steps, weights[k], k + 1
        before, error = error, problem.area_error(p)
        enough = is_enough(settings, balance, error, weights[-1])
        if steps >= settings.max_steps or stage.status == "stalled" or (enough and k >= len(weights)):
            return SphereRefinement(
                positions=p,
                iterations=steps,
                untangling=0,
                residual=stage.residual,
                area_error=error,
                area_weight=weight,
                energy=stage.energy,
                status=stage.status,
            )
        if k >= len(weights):
            # What is left may be due to large faces, whose projections are smaller: then projecting anew is enough.
            projections_right = (
                current.projected_area_error(p) <= 0.5 * settings.area_error and error < ENOUGH_PROGRESS * before
            )
            excess = error / settings.area_error
            growth = 1.0 if projections_right else min(max(LEAST_GROWTH, excess**2), MOST_GROWTH)
            weights.append(weights[-1] * growth)


def with_both_diagonals(problem: SphereProblem, p: np.ndarray) -> SphereProblem:
    """The problem with both triangulations of the quads that are convex in the map p (n,3)."""
    if problem.faces.quads is None:
        return problem
    area = signed_volumes(p, problem.faces.triangles[lone_triangles(problem.faces) :]).reshape(-1, 4)
    return replace(problem, faces=with_convex_quads_of(problem.faces, area))


def with_projected_targets(problem: SphereProblem, p: np.ndarray, area_weight: float) -> SphereProblem:
    """The problem with its targets as much below the spherical ones as the projected faces of the map p (n,3) are."""
    shrink = problem.projected_areas(p) * problem.target / problem.ratio / problem.spherical_areas(p)
    return replace(problem, faces=replace(problem.faces, ratio=problem.ratio * shrink), area_weight=area_weight)
