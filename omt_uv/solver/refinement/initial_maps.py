"""Find an initial map for the refinement: one without folds whose boundary lies where it shall move.

Every one is one of these, in this order: the given map; the given map untangled; a mean value map of the surface
with the boundary spread by its length. Whatever replaces the given map is said in a warning.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass

import numpy as np

from ..analysis.density import relative_entropy
from ..errors import FoldedUVError, PrecisionError
from ..linalg.sparse import Factor
from ..maps.contacts import covers_itself
from ..maps.development import developed
from ..maps.energy import elements
from ..maps.tutte import NO_QUADS, arc_length_parameters, arcs_of_parts, released_vertices, tutte
from ..maps.untangle import USABLE, arc_length_boundary, circle_boundary, count_folds, map_energy, untangle
from ..mesh.geometry import cross3, dot3, face_areas, lengths, signed_areas
from ..mesh.topology import expand
from .projected_newton import CircleMotion, FreeMotion, LineMotion, Motion, linear_forms

SPREAD = "The boundary of the start is not in order; it was spread over the domain by its length"
SQUEEZED = "The corners of the start squeeze or fold faces; they were spread by the length of the boundary"
# Curvature, summed without sign over the inner vertices, below which a chart may be unrolled at once, in radians.
NEARLY_FLAT = 0.5
# In meshes of more than so many vertices an eighth of them is looked at before all.
SAMPLED = 1000
# Triangles whose angles are found at a time: what is found on the way takes ten times their memory.
AT_ONCE = 100_000
# Triangles of a chart that is developed may disagree about a vertex by this share of its size; by more, it is curved.
EXACT = 1e-10
# Solutions of normal equations have half of the digits, and each further one of what is left has as many more: on a
# plane with hundreds of slits rounding would let the two sides of some cross.
POLISH = 3
# A boundary vertex this near to being the farthest of all is as good as that.
FARTHEST = 1 - 1e-6
# What parts of a disk that one edge each cuts off may take of the circle beyond their shares of the area: more of it
# shears the rest, too.
CROWDED = 0.125
# Mean energy of a start above which another one may be better.
RELAXED = 2.0
# A target is far from the areas of a surface where its relative entropy is more than this. A twentieth of the surface
# that gets four fifths of the map has 1.9.
FAR = 0.5
# A map whose signed area is a smaller share of its unsigned area has no orientation to speak of.
BEYOND_REPAIR = 0.05
# The same of an outline that is no outline.
USELESS = 1e-3
# Turns of a square's corners, of eight, that are tried with the vertices off its sides that have no room there.
BEST = 2


@dataclass(frozen=True)
class InitialMap:
    """A map without folds.

    Attributes
    ----------
    uv : (n,2)
    motion : of its vertices
    warnings : what was replaced
    may_cross : its boundary might come to cross itself
    with_barrier : it would, in ways that `crossings` cannot see
    """

    uv: np.ndarray
    motion: Motion
    warnings: tuple[str, ...]
    may_cross: bool = False
    with_barrier: bool = False


def is_far(target: np.ndarray, area: np.ndarray) -> bool:
    """Whether target areas (m,) are far from those of the surface, so that any map to them is sheared."""
    return relative_entropy(target, area) > FAR


def disk_initial_map(vertices, triangles, uv, loop) -> InitialMap:
    """Boundary on the circle about 0 that has the area of the surface."""
    radius = np.sqrt(face_areas(vertices, triangles).sum() / np.pi)
    uv = uv * (radius / lengths(uv[loop]).mean())
    motion, places = CircleMotion(loop, radius, len(vertices)), circle_boundary(uv, loop, radius)
    # Vertices that nearly coincide on the outline fold what is between them, and are spread, too.
    with contextlib.suppress(FoldedUVError):
        if places is not None:
            warnings: list[str] = []
            return InitialMap(_straighten(uv, vertices, triangles, loop, places, warnings), motion, tuple(warnings))
    warnings, places = [SPREAD], arc_length_boundary(vertices, loop, radius)
    return InitialMap(_straighten(uv, vertices, triangles, loop, places, warnings), motion, tuple(warnings))


def is_crowded(triangles: np.ndarray, loop: np.ndarray, area: np.ndarray) -> bool:
    """Whether parts that one edge each cuts off leave the rest of a disk (m,3) too little of its circle, with the loop
    (b,) upon it, for triangles of these areas (m,)."""
    arcs, shares = arcs_of_parts(triangles, loop, area)
    return float(np.maximum(arcs - shares, 0).sum()) > CROWDED


def notched_disk(start: InitialMap, triangles, loop) -> InitialMap | None:
    """A disk start with those vertices off the circle whose faces hardly have room there; None if there are none.

    A part that one inner edge cuts off has all its boundary on an arc, and an arc encloses little.
    """
    everywhere = np.zeros(len(loop), np.int64)
    released = released_vertices(triangles, loop, everywhere, everywhere > 0, len(start.uv))
    if not released.any():
        return None
    radius = float(lengths(start.uv[loop]).mean())
    motion = CircleMotion(loop[~released], radius, len(start.uv))
    warning = f"{released.sum()} boundary vertices leave the circle, where it has no room for their faces"
    return InitialMap(
        uv=start.uv, motion=motion, warnings=(*start.warnings, warning), may_cross=True, with_barrier=True
    )


def free_initial_map(vertices, triangles, uv, loop, relaxed: float = RELAXED) -> InitialMap:
    """Free boundary: the given map if it is one to one, else a disk; charts that are flat are unrolled.

    The disk is the given map untangled. Where that squeezes faces, of an energy above `relaxed`, and a mean value map
    less, it is the latter: Newton's way from squeezed faces is long, and takes its turns by chance.
    """
    area = face_areas(vertices, triangles).sum()
    motion = FreeMotion(np.zeros(len(vertices), bool))
    flat = unroll(vertices, triangles, loop)
    if flat is not None:
        return InitialMap(uv=flat, motion=motion, warnings=(), may_cross=True)
    uv = uv * np.sqrt(area / np.abs(signed_areas(uv, triangles)).sum())
    if count_folds(uv, triangles) == 0 and not covers_itself(uv @ [1, 1j], loop):
        return InitialMap(uv=uv, motion=motion, warnings=(), may_cross=True)
    start = disk_initial_map(vertices, triangles, uv - _middle(uv[loop]), loop)
    least = map_energy(start.uv, vertices, triangles)
    if least > relaxed:
        fresh = tutte(vertices, triangles, loop, arc_length_boundary(vertices, loop, np.sqrt(area / np.pi)))
        if map_energy(fresh, vertices, triangles) < least:
            return InitialMap(uv=fresh, motion=motion, warnings=(), may_cross=True)
    return InitialMap(uv=start.uv, motion=motion, warnings=start.warnings, may_cross=True)


def _middle(outline: np.ndarray) -> np.ndarray:
    """Centroid (2,) of a polygon (b,2). The mean of a map's vertices is where they are dense, which may be anywhere."""
    a, b = outline - outline[0], np.roll(outline, -1, axis=0) - outline[0]
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    if not np.abs(twice.sum()) > USELESS * np.abs(twice).sum():
        return outline.mean(axis=0)
    return outline[0] + (twice @ (a + b)) / (3 * twice.sum())


def square_initial_map(vertices, triangles, uv, loop, quads=NO_QUADS) -> InitialMap:
    """Boundary on the square about 0 that has the area of the surface; the vertices nearest to its corners take them.

    Where that squeezes faces beyond use, the corners are spread by the boundary's length instead. No quad (q,4) has
    three of its vertices on one side.
    """
    return _rectangle_map(vertices, triangles, uv, loop, np.ones(2), quads)


def rectangle_initial_map(vertices, triangles, uv, loop, quads=NO_QUADS) -> InitialMap:
    """As `square_initial_map`, on the rectangle about 0 that has the aspect of the given map."""
    size = np.ptp(uv[loop], axis=0)
    shape = size / np.sqrt(max(size.prod(), np.finfo(float).tiny))
    return _rectangle_map(vertices, triangles, uv, loop, shape, quads)


def _rectangle_map(vertices, triangles, uv, loop, shape: np.ndarray, quads: np.ndarray) -> InitialMap:
    """A start on the rectangle whose sides have the ratio of shape (2,), of product 1."""
    low, high = uv[loop].min(0), uv[loop].max(0)
    if not (high > low).all():
        raise FoldedUVError("The UVs to refine have no area")
    half = shape * np.sqrt(face_areas(vertices, triangles).sum()) / 2
    uv = ((uv - low) / (high - low) * 2 - 1) * half
    given = _perimeter(uv[loop] / half)
    turn = (np.roll(given, -1) - given) % 4
    ordered = (turn > 0).all() and abs(turn.sum() - 4) < 1e-9
    mesh = (vertices, triangles, uv, loop, quads)
    tries = [_attempt(mesh, given, half, [])] if ordered else []
    if not tries or tries[0][1] > USABLE:
        even = 4 * arc_length_parameters(vertices, loop)
        reasons = [SQUEEZED if ordered else SPREAD]
        tries += _attempts(mesh, [(even + k / 8) % 4 for k in range(8)], half, reasons)
    best, _ = min(tries, key=lambda found: found[1])
    if isinstance(best, FoldedUVError):
        raise best
    return best


def _attempts(mesh, several, half, reasons) -> list[tuple[InitialMap | FoldedUVError, float]]:
    """Those of the starts with these positions (b,) along the square that are the best two by embeddings with the whole
    loop upon it, which have one matrix; all of them where these tell nothing."""
    vertices, triangles, uv, loop, _ = mesh
    places = [_on_square(_snap_corners(s)[0]) * half for s in several]
    inside = ~np.isin(triangles, loop).all(axis=1)
    try:
        embedded = tutte(uv, triangles, loop, np.concatenate(places, axis=1))
        starts = [embedded[:, 2 * k : 2 * k + 2] for k in range(len(several))] if inside.any() else []
        values = [map_energy(start, vertices, triangles[inside]) for start in starts]
    except PrecisionError:
        values = []
    best = [k for k in np.argsort(values)[:BEST] if np.isfinite(values[k])]
    found = [_attempt(mesh, several[k], half, reasons) for k in best]
    if not any(np.isfinite(energy) for _, energy in found):
        found = [_attempt(mesh, s, half, reasons) for s in several]
    return found


def _attempt(mesh, s, half, reasons) -> tuple[InitialMap | FoldedUVError, float]:
    """A start with these positions along the square, or why there is none, and its energy."""
    try:
        start = _on_sides(mesh, s, half, reasons)
    except FoldedUVError as error:
        return error, np.inf
    return start, map_energy(start.uv, *mesh[:2])


def _on_sides(mesh, s, half, reasons) -> InitialMap:
    """A start of a mesh (vertices, triangles, map, loop (b,), quads) with the loop at the positions s (b,) in [0, 4)
    along the square.

    Where a face would have three of its corners on one side, one of its vertices is released from the side.
    """
    vertices, triangles, uv, loop, quads = mesh
    warnings = list(reasons)
    s, corner = _snap_corners(s)
    places = _on_square(s) * half
    side = np.floor(s).astype(int)
    released = released_vertices(triangles, loop, side, corner, len(vertices), quads)
    if released.any():
        warnings.append(f"{released.sum()} boundary vertices leave the square, where a face would lie along a side")
    straight = _straighten(uv, vertices, triangles, loop[~released], places[~released], warnings)
    slide = ~corner & ~released
    motion = LineMotion(loop[slide], np.where(side[slide] % 2 == 0, 1.0, 1j), loop[corner], len(vertices))
    # Vertices of a side could pass each other where a released one between them leaves the side.
    notched = bool(released.any())
    return InitialMap(uv=straight, motion=motion, warnings=tuple(warnings), may_cross=notched, with_barrier=notched)


def unroll(vertices, triangles, loop) -> np.ndarray | None:
    """The map (n,2) of a nearly flat surface that changes hardly any length, where it neither folds nor covers itself.

    Developable charts are developed, others mapped by least squares conformal (Levy et al. 2002). None for any other.
    """
    if is_curved(vertices, triangles, loop):
        return None
    w, gap = developed(vertices, triangles)
    first, second = farthest_from_first(vertices, loop[:, None], np.zeros(len(loop), np.int64))
    if gap.max() <= EXACT * np.abs(w).max():
        w = (w - w[first]) * np.abs(w[second] - w[first]) / (w[second] - w[first])
    else:
        w = least_squares_conformal(vertices, triangles, first, second)
    uv = np.column_stack([w.real, w.imag])
    signed = signed_areas(uv, triangles)
    if not (signed > 0).all() or covers_itself(w, loop):
        return None
    return uv * np.sqrt(face_areas(vertices, triangles).sum() / signed.sum())


def farthest_from_first(vertices: np.ndarray, boundary: np.ndarray, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first tail of the boundary edges (b,2) of every chart, and the one farthest in space from it, (c,) each.

    owner (b,) : ascending; which chart an edge belongs to
    """
    begin = np.searchsorted(owner, np.unique(owner))
    chart = np.repeat(np.arange(len(begin)), np.diff(np.append(begin, len(owner))))
    tail = boundary[:, 0]
    far = lengths(vertices[tail] - vertices[tail[begin]][chart])
    # On a symmetric boundary rounding shall not decide between two.
    good = np.flatnonzero(far >= FARTHEST * np.maximum.reduceat(far, begin)[chart])
    return tail[begin], tail[good[np.unique(chart[good], return_index=True)[1]]]


def least_squares_conformal(vertices, triangles, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The least squares conformal map (n,) complex of disks side by side (n,3), (m,3) (Levy et al. 2002).

    It keeps the distance of two vertices of each, first and second (c,), the first one at 0. Raises PrecisionError.
    """
    n = len(vertices)
    area = face_areas(vertices, triangles)
    faces = elements(vertices, triangles, area)
    rows = np.sqrt(area)[:, None] * faces.gradient
    linear = linear_forms(np.vstack([triangles, triangles]), np.vstack([rows, -1j * rows]), n).tocsc()
    fixed = np.concatenate([2 * first, 2 * first + 1, 2 * second, 2 * second + 1])
    x = np.zeros(2 * n)
    x[2 * second] = lengths(vertices[second] - vertices[first])
    others = np.setdiff1d(np.arange(2 * n), fixed)
    free = linear[:, others]
    factor = Factor(free.T @ free)
    for _ in range(POLISH):
        x[others] -= factor.solve(free.T @ (linear @ x))
    return x.reshape(n, 2) @ [1, 1j]


def check_initial_map(uv: np.ndarray, triangles: np.ndarray) -> None:
    """Raise FoldedUVError unless uv (n,2) is finite, has an area, and lies on one side for the most part."""
    wrong = np.flatnonzero(~np.isfinite(uv).all(1))
    if len(wrong):
        raise FoldedUVError("The UVs to refine are not finite", kind="vertex", elements=wrong)
    signed = signed_areas(uv, triangles)
    total = np.abs(signed).sum()
    if not total > 1e-12 * np.ptp(uv, axis=0).max() ** 2:
        raise FoldedUVError("The UVs to refine have no area")
    if abs(signed.sum()) < BEYOND_REPAIR * total:
        folded = np.flatnonzero(~(signed * np.sign(signed.sum()) > 0))
        raise FoldedUVError("The UVs to refine are folded beyond repair", kind="face", elements=folded)


def _straighten(uv, vertices, triangles, loop, places, warnings):
    """The map uv with its boundary loop on places, untangled where that folds it."""
    pushed = uv.copy()
    pushed[loop] = places
    if count_folds(pushed, triangles):
        pushed, warning = untangle(uv, vertices, triangles, loop, places)
        warnings.extend([warning] if warning else [])
    left = np.flatnonzero(~(signed_areas(pushed, triangles) > 0))
    if len(left):
        raise FoldedUVError("Faces stay folded in every start tried", kind="face", elements=left)
    return pushed


def _perimeter(p):
    """Nearest point of the square [-1,1]^2 to p (b,2), by its position in [0, 4) along the sides from lower left."""
    x, y = p.T
    along = np.clip((np.stack([x, y, -x, -y]) + 1) / 2, 0, 1 - 1e-12)
    side = np.stack([-y, x, y, -x]).argmax(0)
    return side + along[side, np.arange(len(p))]


def _on_square(s):
    """Points (b,2) of the square [-1,1]^2 at positions s (b,) in [0, 4]."""
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1.0]])
    return np.column_stack([np.interp(s, np.arange(5), c) for c in corners.T])


def _snap_corners(s):
    """Positions (b,) with the nearest vertex moved to every corner, order kept, and which vertices these are, bool."""
    b = len(s)
    if b < 4:
        raise FoldedUVError("A chart with fewer than four boundary vertices has no square map")
    at = np.abs((s - np.arange(4)[:, None] + 2) % 4 - 2).argmin(1)
    count = (np.roll(at, -1) - at) % b
    if not (count > 0).all() or count.sum() != b:
        at = (at[0] + np.arange(4) * b // 4) % b
        count = (np.roll(at, -1) - at) % b
    order = (at[0] + np.arange(b)) % b
    side, place = expand(count)
    # The boundary may pass a corner before or after the vertex that takes it: then the side is spread evenly.
    along = np.clip((s[order] - side + 2) % 4 - 2, 0, 1)
    along[place == 0] = 0
    step = np.diff(np.append(along, 0)) + (place == count[side] - 1)
    even = np.bincount(side, step <= 0)[side] > 0
    snapped, corner = np.empty(b), np.zeros(b, bool)
    snapped[order] = side + np.where(even, place / count[side], along)
    corner[at] = True
    return snapped, corner


def is_curved(vertices: np.ndarray, triangles: np.ndarray, boundary: np.ndarray) -> bool:
    """Whether triangles (m,3) of vertices (n,3) with this boundary (b,) are too curved to be unrolled: most that are
    show it in a part of them."""
    n = len(vertices)
    if n > SAMPLED:
        inside = np.arange(n) < n // 8
        around = triangles[inside[triangles].any(axis=1)]
        if inner_curvature(vertices, around, np.concatenate([boundary, np.flatnonzero(~inside)])) > NEARLY_FLAT:
            return True
    return inner_curvature(vertices, triangles, boundary) > NEARLY_FLAT


def inner_curvature(vertices: np.ndarray, triangles: np.ndarray, boundary: np.ndarray) -> float:
    """Sum of |angle defect|, in radians, over the vertices (n,3) of triangles (m,3) but those of the boundary (b,)."""
    angle = np.empty(triangles.shape)
    for begin in range(0, len(triangles), AT_ONCE):
        p = np.take(vertices, triangles[begin : begin + AT_ONCE], axis=0)
        after, before = np.roll(p, -1, axis=1) - p, np.roll(p, 1, axis=1) - p
        angle[begin : begin + AT_ONCE] = np.arctan2(lengths(cross3(after, before)), dot3(after, before))
    defect = 2 * np.pi - np.bincount(triangles.ravel(), angle.ravel(), len(vertices))
    defect[boundary] = 0
    return float(np.abs(defect).sum())
