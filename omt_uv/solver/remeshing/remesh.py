"""Remeshing: sample on the measure-preserving map, triangulate on the conformal map, relax on the surface.

Samples are uniform in the measure-preserving image of the surface and triangles Delaunay in the conformal one (B. Gu
2018). Closed surfaces go through charts; afterwards everything happens on the surface itself, so that the cuts
between the charts leave no trace.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.density import graded_density
from ..errors import CountError, positive_density
from ..mesh.closest_point import ClosestPoint
from ..mesh.geometry import vertex_normals
from ..progress import Progress, Steps, part_of
from .components.coincident_boundaries import opened
from .components.components import Part
from .edits.vertex_count import EdgeSize, StuckError, adjust_count, distribute, least_faces, least_vertices
from .fitting.fit import fit_to_surface
from .initial.component_maps import Original, PartMaps
from .initial.disk_samples import STRATEGIES
from .initial.initial_mesh import Options, Tessellation, least_samples, tessellate
from .relaxation.cvt import relax
from .relaxation.surface_carrier import Carrier
from .relaxation.vertex_balance import balance

# More vertices than this many times the input's tell nothing new about the surface.
FAR_MORE = 50
ROUNDS = 30
FIRST_ROUNDS, BALANCES = 10, 6
# Parts with fewer vertices than this go together.
SMALL = 500
# How often boundaries and features are thinned out to reach a count.
ATTEMPTS, THINNED = 3, 2.0
# Mean step of a relaxation that has settled, in edge lengths.
CONVERGED = 0.01


@dataclass(frozen=True)
class Remesh:
    """A new mesh of a surface.

    vertices (k,3) in the units of the input; triangles (t,3), counter-clockwise as the input's; faces (k,) the input
    triangle on which the closest point of each vertex lies, and barycentric (k,3) where; iterations: rounds of
    relaxation; residual: mean step of the last one, in edge lengths; status: "converged" or "rounds".
    """

    vertices: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    barycentric: np.ndarray
    iterations: int
    residual: float
    status: str
    warnings: tuple[str, ...]


def remesh(
    vertices: np.ndarray,
    triangles: np.ndarray,
    count: int,
    *,
    count_of: str = "vertices",
    density: np.ndarray | None = None,
    features: np.ndarray | None = None,
    preserve_boundary: bool = True,
    strategy: str = "app-cfp",
    fit: bool = True,
    rounds: int = ROUNDS,
    grading: float = 0.0,
    original: Original | None = None,
) -> Steps[Remesh]:
    """A new mesh of the surface (n,3), (m,3) with `count` vertices, its triangles equilateral as far as can be.

    Parameters
    ----------
    count_of : "vertices" or "faces"
    density : (m,) > 0, how many vertices per area every input triangle gets, in proportion; 1 by default
    features : (e,2) pairs of input vertices, edges to keep as lines of the new mesh
    preserve_boundary : keep vertices on boundaries and on their corners; without, a boundary still is one, but its
        vertices slide until they are evenly apart, and it is smoothed as far as the new edges are too long to show it
    strategy : map to sample on and map to triangulate on, each the measure-preserving ("app") or the conformal ("cfp").
        What follows keeps to it: after samples on the conformal map no vertices are carried to where the measure asks
        for them, after triangles of the measure-preserving one no edges flip to Delaunay on the surface
    fit : move vertices off the surface to halve the distance of the triangles to it
    rounds : of relaxation on the surface; 0 leaves the strategy's mesh as it is
    grading : most that edges grow by per length, see `density.graded_density`; 0 for as fast as the density has it
    original : the same surface and features, remeshed before: the maps that were made then serve again

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError, OrientationError : see `parts.split_parts`
    CountError : fewer than the topology, boundaries and features take
    DensityError : a density that is not positive and finite
    """
    if strategy not in STRATEGIES:
        raise ValueError(f"strategy must be one of {', '.join(STRATEGIES)}, not {strategy!r}")
    if count_of not in ("vertices", "faces"):
        raise ValueError(f"count_of must be 'vertices' or 'faces', not {count_of!r}")
    yield Progress("Parts", 0.0)
    original = original or Original(vertices, triangles, features)
    wanted = _checked_density(density, len(original.triangles))
    found = original.parts
    if grading > 0 and np.ptp(wanted) > 0:
        samples = count if count_of == "vertices" else max(count // 2, 1)
        wanted = graded_density(wanted, original.vertices, original.triangles, grading, samples)
    warnings = list(found.warnings)
    if count > FAR_MORE * len(original.vertices if count_of == "vertices" else original.triangles):
        warnings.append(f"{count} {count_of} are more than {FAR_MORE} times the input's; they add no detail")
    options = Options(count_of, strategy, fit, rounds, preserve_boundary)
    maps = original.maps_with_pile(_small(found.parts, wanted, count if count_of == "vertices" else count / 2))
    results = yield from _remesh_parts(maps, wanted, count, options)
    warnings += summed_up([w for r in results for w in r.warnings])
    made = sum(len(r.triangles) for r in results)
    if count_of == "faces" and made != count:
        warnings.append(f"Closed surfaces have an even number of triangles: {made} instead of {count}")
    return _joined(results, found.centre, found.size, warnings, rounds)


@dataclass(frozen=True)
class _Result:
    points: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    barycentric: np.ndarray
    moved: float
    warnings: tuple[str, ...]


def _checked_density(density: np.ndarray | None, m: int) -> np.ndarray:
    if density is None:
        return np.ones(m)
    density = np.asarray(density, float)
    if density.shape != (m,):
        raise ValueError(f"density must have one value for each of {m} triangles, not the shape {density.shape}")
    return positive_density(density)


def _small(parts: list[Part], density: np.ndarray, vertices: float) -> np.ndarray:
    """The parts (k,) bool whose share of so many vertices is small."""
    measure = np.array([float(part.area @ density[part.faces]) for part in parts])
    return vertices * measure < SMALL * measure.sum()


def _remesh_parts(maps: list[PartMaps], density: np.ndarray, count: int, options: Options) -> Steps[list[_Result]]:
    """All parts; what takes more than was thought makes the others do with less.

    Raises CountError where there are not enough vertices, or faces, for all.
    """
    few = f"{count} {options.count_of} are too few:"
    # Corners are kept where the count allows it.
    for corners in (True, False):
        least = _least(maps, options.count_of, corners and options.corners)
        if least.sum() <= count:
            break
    else:
        raise CountError(f"{few} this topology, with its boundaries and features, takes at least {least.sum()}")
    while least.sum() <= count:
        results, least = yield from _with_least(maps, density, count, least, options)
        if results:
            return results
    raise CountError(f"{few} edges of this surface, with its boundaries and features, collapse to {least.sum()}")


def _with_least(
    maps: list[PartMaps], density: np.ndarray, count: int, least: np.ndarray, options: Options
) -> Steps[tuple[list[_Result], np.ndarray]]:
    """All parts, the smallest first, so that the larger ones make up for those that take more than their share.

    An empty list where that leaves too little for the others; and what every part takes at least as far as is known.
    """
    least = least.copy()
    measure = np.array([float(m.part.area @ density[m.part.faces]) for m in maps])
    left = np.argsort(measure, kind="stable")
    results: list[_Result] = [None] * len(maps)  # type: ignore[list-item]
    done = 0.0
    while len(left):
        k, share = left[0], float(measure[left[0]] / measure.sum())
        number = int(distribute(count, measure[left], least[left])[0])
        steps = _remesh_part(maps[k], number, density[maps[k].part.faces], options)
        results[k] = yield from part_of(steps, done, share)
        made = len(results[k].points if options.count_of == "vertices" else results[k].triangles)
        if made > number:
            least[k] = made
        count -= made
        left, done = left[1:], done + share
        if count < least[left].sum():
            return [], least
    return results, least


def _least(maps: list[PartMaps], count_of: str, corners: bool) -> np.ndarray:
    """Vertices, or faces, that every part takes at least."""
    vertices = [max(least_vertices(m.part), least_samples(m, corners)) for m in maps]
    if count_of == "vertices":
        return np.array(vertices)
    return np.array([least_faces(m.part, n) for m, n in zip(maps, vertices, strict=True)])


def summed_up(texts: list[str]) -> list[str]:
    """Every text once, and how often it was said."""
    return [text if (k := texts.count(text)) == 1 else f"{text} ({k} times)" for text in dict.fromkeys(texts)]


def _remesh_part(maps: PartMaps, count: int, density: np.ndarray, options: Options) -> Steps[_Result]:
    """One part in its unit box; boundaries and features get fewer samples where the count cannot be reached, and what
    can be is the count then."""
    part = maps.part
    level = density / (part.area @ density / part.area.sum())
    stretch, attempt = 1.0, 0
    while True:
        attempt += 1
        steps = tessellate(maps, count, level, _at_vertices(part, level), options, stretch)
        start = yield from part_of(steps, 0.0, 0.3)
        anyhow = attempt >= ATTEMPTS or not start.draft.fixed.any()
        try:
            return (yield from part_of(_settle(part, start, level, options, anyhow), 0.3, 0.7))
        except StuckError as error:
            if anyhow:
                draft = error.draft
                count = len(draft.points) + start.copies if options.count_of == "vertices" else len(draft.triangles)
        stretch = start.stretch * THINNED


def _settle(part: Part, start: Tessellation, level: np.ndarray, options: Options, anyhow: bool) -> Steps[_Result]:
    """Relax, count and fit a first mesh."""
    index = ClosestPoint(part.vertices, part.triangles, start.size)
    size = EdgeSize(index, level, start.size)
    draft, moved = start.draft, 0.0
    if options.rounds:
        carrier = Carrier(index, level, start.count)
        draft, _ = yield from part_of(relax(draft, FIRST_ROUNDS, carrier), 0.0, 0.07)
        draft = adjust_count(draft, start.count, size, anyhow)
        claim, at_rest = None, True
        for k in range(BALANCES):
            draft, _ = yield from part_of(relax(draft, FIRST_ROUNDS, carrier), 0.07 + 0.038 * k, 0.038)
            if not options.by_measure:
                break
            balanced = balance(draft, carrier, size, claim)
            draft, claim, at_rest = balanced.draft, balanced.claim, balanced.settled
            if at_rest:
                break
        draft, moved = yield from part_of(relax(draft, options.rounds, carrier), 0.3, 0.2)
        if not at_rest:
            # Along jumps of the density that took vertices away again.
            draft = balance(draft, carrier, size, claim).draft
            draft, moved = yield from part_of(relax(draft, FIRST_ROUNDS, carrier), 0.5, 0.07)
    draft = adjust_count(draft, start.count, size, anyhow)
    if options.fit:
        draft = yield from part_of(fit_to_surface(draft, index, level), 0.57, 0.43)
    points, triangles = opened(draft.points, draft.triangles, start.slits)
    on = index(points, vertex_normals(points, triangles))
    points = points - part.shift[on.faces]
    barycentric = np.einsum("kc,kcj->kj", on.barycentric, part.within[on.faces])
    return _Result(points, triangles, part.faces[on.faces], barycentric, moved, start.warnings)


def _at_vertices(part: Part, density: np.ndarray) -> np.ndarray:
    """Density (n,) at the vertices, the mean of that of their triangles (m,) by area."""
    corner, n = part.triangles.ravel(), len(part.vertices)
    area = np.maximum(part.area, 1e-300)
    total = np.bincount(corner, np.repeat(area * density, 3), n)
    return total / np.maximum(np.bincount(corner, np.repeat(area, 3), n), 1e-300)


def _joined(results: list[_Result], centre, size, warnings: list[str], rounds: int) -> Remesh:
    first = np.cumsum([0] + [len(r.points) for r in results])
    moved = max((r.moved for r in results), default=0.0)
    return Remesh(
        np.concatenate([r.points for r in results]) * size + centre,
        np.concatenate([r.triangles + k for r, k in zip(results, first[:-1], strict=True)]),
        np.concatenate([r.faces for r in results]),
        np.concatenate([r.barycentric for r in results]),
        rounds,
        moved,
        "converged" if moved < CONVERGED else "rounds",
        tuple(warnings),
    )
