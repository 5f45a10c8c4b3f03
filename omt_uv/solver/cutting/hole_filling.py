"""Fill holes with fans, for the map only, so that eyes and nostrils do not tear a face apart; and take pockets off that
would.

Every hole gets a fan of triangles around a new vertex. In the gluing they are triangles of polygon -1, on corners and
vertices after those of the surface.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..analysis.feature_edges import fold_angles
from ..analysis.seam_costs import SeamCosts
from ..errors import plural
from ..mesh.geometry import face_areas, face_normals, lengths, unit
from ..mesh.gluing import Gluing, components, corner_classes, groups
from ..mesh.surface import Surface, is_seam
from ..mesh.topology import expand, graph_components, halfedges, pair_keys
from .component import NOISE, SideFinder
from .gluing_facts import in_unit_box, to_search, total_curvature

NO_POLYGON = -1
# Cuts to more holes than these make a chart of slits, for which there is hardly a map: such a component is a sieve.
MANY = 32
# A component looks one way if its normals sum up to that share of their lengths, and unrolls with no more curvature
# than the second figure; its holes are small with no more than the third share of it.
LEVEL = 0.95
FLAT = 1e-3
SMALL = 0.04
# A side is large with this share of the area of its component, and folds nowhere by more than that.
LARGE_SIDE = 0.02
PLANE = np.radians(1)
# A hole lies in a bevel beside a side where it is no farther from that than this share of its radius, and its normal
# nearer to that of the side than this cosine, which normals of the bevel are not.
BEVEL = 0.3
PARALLEL = 0.98
# Boundaries of a sieve that are so many times as long as most are no holes, but outer boundaries; at most MANY.
OUTSTANDING = 3.0
# Holes in a face are eyes, nostrils and throats, if they are no longer around than the first share of the root of the
# area of their component, and either lie within the face, most of them, or open it to the front, by the cosine of the
# second figure, as a hole in something smooth does: by the third, of what is around them.
SHORT = 0.5
FORWARDS = 0.5
SMOOTH = 0.7
# A component with no more curvature than a sphere has no pocket, but for noise.
POCKETED = 4.1 * np.pi


@dataclass(frozen=True)
class Filled:
    """The surface with a vertex in the middle of every hole, the gluing with the fans, and the number of holes, but for
    those of what was to be filled as a whole and those in faces."""

    surface: Surface
    gluing: Gluing
    holes: int


def fill_holes(
    surface: Surface,
    gluing: Gluing,
    one_sided: np.ndarray,
    sieve: int | None = None,
    level: LevelParts | None = None,
    costs: Callable[[], SeamCosts] | None = None,
    closing: bool = True,
) -> Filled:
    """Fill all boundaries but the longest of every component of an oriented gluing.

    one_sided : (m,) triangles that are left alone
    sieve : fill only where there are more than so many holes, and leave outer boundaries open
    level : where holes are filled all the same
    costs : gives those of seams; holes in a face are filled all the same
    closing : the last boundary of a component, too, unless some of its seams were marked
    """
    tail, head = halfedges(corner_classes(gluing)[gluing.triangles])
    boundary, loop = hole_boundaries(surface.positions, gluing, one_sided, sieve, level)
    counted = len(np.unique(loop if level is None else loop[~level.triangles[boundary // 3]]))
    if costs is not None:
        boundary, loop = _with_holes_in_faces(surface, gluing, one_sided, boundary, costs, closing)
    if len(boundary) == 0:
        return Filled(surface, gluing, 0)
    filled = _fans(surface, gluing, boundary, loop, tail, head, int(max(tail.max(), head.max())) + 1)
    return replace(filled, holes=counted)


@dataclass(frozen=True)
class LevelParts:
    """Where holes need no cut: the triangles (m,) bool of components that look one way but do not quite unroll, and the
    halfedges (3m,) bool around holes with bevels in flat sides of those that do not."""

    parts: np.ndarray
    bevelled: np.ndarray

    @property
    def triangles(self) -> np.ndarray:
        """Triangles (m,) bool of either."""
        return self.parts | self.bevelled.reshape(-1, 3).any(axis=1)


def level_parts(gluing: Gluing, positions: np.ndarray) -> LevelParts:
    """Where holes need no cut. Cuts to those of what unrolls close again in its map."""
    component_of, triangles = components(gluing), gluing.vertex[gluing.triangles]
    area = face_areas(positions, triangles)
    vector = area[:, None] * face_normals(positions, triangles)
    whole = np.linalg.norm(np.stack([np.bincount(component_of, x) for x in vector.T]), axis=0)
    bent = total_curvature(gluing, corner_classes(gluing), component_of, positions) > FLAT
    level = (whole >= LEVEL * np.bincount(component_of, area)) & bent
    bevelled = np.zeros(3 * len(triangles), dtype=bool)
    boundary, loop = _boundaries(gluing, np.zeros(len(triangles), dtype=bool))
    bevelled[boundary] = _in_bevels(gluing, positions, boundary, loop, bent)[loop]
    return LevelParts(level[component_of], bevelled)


def _in_bevels(
    gluing: Gluing, positions: np.ndarray, boundary: np.ndarray, loop: np.ndarray, among: np.ndarray
) -> np.ndarray:
    """Loops (l,) bool of boundary halfedges (r,) in a bevel beside a large flat side of their component, of those
    `among` (k,) bool that have several. Where a hole has no bevel, nothing else may have one: cuts to it close again.
    """
    component_of, triangles = components(gluing), gluing.vertex[gluing.triangles]
    at = component_of[boundary[np.unique(loop, return_index=True)[1]] // 3]
    among = among & (np.bincount(at, minlength=len(among)) > 1)
    if not among.any():
        return np.zeros(len(at), dtype=bool)
    pair = np.stack([gluing.first, gluing.second], axis=1)
    side = components(gluing.without(np.abs(fold_angles(positions, triangles, pair)) > PLANE))
    area, first = face_areas(positions, triangles), np.unique(side, return_index=True)[1]
    size, own = np.bincount(side, area), component_of[first]
    large = np.flatnonzero(among[own] & (size >= LARGE_SIDE * np.bincount(component_of, area)[own]))
    large = large[np.argsort(own[large], kind="stable")]
    middle = np.stack([np.bincount(side, area * x) for x in positions[triangles].mean(axis=1).T], axis=1)[large]
    normal, middle = face_normals(positions, triangles[first[large]]), middle / size[large, None]
    loops = _Loops.around(positions, *gluing.ends(boundary), loop)
    bevel = _means(face_normals(positions, triangles[boundary // 3]), loop)
    # Every loop with the sides of its own component: of thousands there are few in each.
    begin, end = np.searchsorted(own[large], [at, at + 1])
    one, two = expand(end - begin)
    two = two + begin[one]
    away, parallel, level = (
        np.abs((x * normal[two]).sum(axis=1)) for x in (loops.centre[one] - middle[two], loops.normal[one], bevel[one])
    )
    within = (away <= BEVEL * loops.radius[one]) & (parallel >= PARALLEL) & (level < PARALLEL)
    return np.bincount(one[within], minlength=len(at)) > 0


@dataclass(frozen=True)
class _Loops:
    """Centres (l,3) of loops, mean radii (l,), and normals (l,3), which are shorter than 1 where a loop is not flat."""

    centre: np.ndarray
    radius: np.ndarray
    normal: np.ndarray

    @staticmethod
    def around(positions: np.ndarray, a: np.ndarray, b: np.ndarray, loop: np.ndarray) -> _Loops:
        """What sides go around, from vertices a (r,) to b (r,), by the numbers (r,) of their loops."""
        centre = _means(positions[a], loop)
        out = positions[a] - centre[loop]
        normal = np.cross(out, positions[b] - centre[loop])
        size = np.maximum(np.bincount(loop, lengths(normal)), 1e-300)
        return _Loops(
            centre=centre,
            radius=np.bincount(loop, lengths(out)) / np.bincount(loop),
            normal=_sums(normal, loop) / size[:, None],
        )


def _sums(of: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Sums (l,3) of vectors (r,3) over loops, by the numbers (r,) of these."""
    return np.stack([np.bincount(loop, x) for x in of.T], axis=1)


def _means(of: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Means (l,3) of vectors (r,3) over loops, by the numbers (r,) of these."""
    return _sums(of, loop) / np.bincount(loop)[:, None]


def sieved(holes: int) -> str:
    """The warning that so many holes of sieves are filled."""
    who = plural(holes, "A hole is", "{} holes are")
    return f"{who} filled for the map: cuts to them would leave it no shape"


def hole_boundaries(
    positions: np.ndarray,
    gluing: Gluing,
    one_sided: np.ndarray,
    sieve: int | None = None,
    level: LevelParts | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """The halfedges (r,) around the holes that `fill_holes` fills, and the number (r,) of the hole of each."""
    boundary, loop = _boundaries(gluing, one_sided)
    if len(boundary) == 0:
        return boundary, boundary
    return _chosen(boundary, loop, _holes(positions, gluing, boundary, loop, sieve, level))


def _boundaries(gluing: Gluing, one_sided: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The halfedges (r,) around all boundaries but those of the triangles one_sided (m,), and the number (r,) of the
    boundary of each."""
    tail, head = halfedges(corner_classes(gluing)[gluing.triangles])
    open_ = np.ones(len(tail), dtype=bool)
    open_[gluing.first] = open_[gluing.second] = False
    boundary = np.flatnonzero(open_)
    boundary = boundary[~one_sided[boundary // 3]]
    if len(boundary) == 0:
        return boundary, boundary
    size = int(max(tail.max(), head.max())) + 1
    loop = graph_components(tail[boundary], head[boundary], size)[1]
    return boundary, np.unique(loop[tail[boundary]], return_inverse=True)[1].ravel()


def _chosen(boundary: np.ndarray, loop: np.ndarray, hole: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Those of halfedges (r,) around the boundaries (r,) that are chosen (l,) bool, these numbered anew."""
    return boundary[hole[loop]], np.unique(loop[hole[loop]], return_inverse=True)[1].ravel()


def _with_holes_in_faces(
    surface: Surface,
    gluing: Gluing,
    one_sided: np.ndarray,
    holes: np.ndarray,
    costs: Callable[[], SeamCosts],
    closing: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """The halfedges (r,) around those `holes` (h,) and around holes in faces, and the number (r,) of the hole of each:
    no seam has to begin there, nor to lead there."""
    boundary, loop = _boundaries(gluing, one_sided)
    if len(boundary) == 0:
        return boundary, boundary
    (a, b), positions = gluing.ends(boundary), in_unit_box(surface, gluing)[0]
    around = np.bincount(loop, lengths(positions[a] - positions[b]))
    component_of, triangles = components(gluing), gluing.vertex[gluing.triangles]
    area = np.bincount(component_of, face_areas(positions, triangles))
    at = component_of[boundary[np.unique(loop, return_index=True)[1]] // 3]
    hole = around <= SHORT * np.sqrt(area[at])
    if not closing or len(surface.seams):
        order = np.lexsort((-around, at))
        last = order[np.unique(at[order], return_index=True)[1]]
        marked = component_of[boundary[is_seam(surface, pair_keys(a, b))] // 3]
        hole[last[np.isin(at[last], marked) | (not closing)]] = False
    if hole.any():  # Few meshes have one, and to find its face takes a while.
        known, count = costs(), np.bincount(loop)
        hole &= np.bincount(loop, known.in_face[a]) == count
        within = np.bincount(loop, known.within_face[a]) > count / 2
        hole &= within | _opens(positions, a, b, loop, face_normals(positions, triangles)[boundary // 3], known)
    hole[loop[np.isin(boundary, holes)]] = True
    return _chosen(boundary, loop, hole)


def _opens(
    positions: np.ndarray, a: np.ndarray, b: np.ndarray, loop: np.ndarray, normals: np.ndarray, costs: SeamCosts
) -> np.ndarray:
    """Holes (l,) bool in something smooth that look to the front, from their sides (r,), numbers (r,) and the normals
    (r,3) of the triangles at them."""
    # Around the hole as around the triangles at it, the other way round.
    normal = unit(-_Loops.around(positions, a, b, loop).normal)
    smooth = (normal * _means(normals, loop)).sum(axis=1) >= SMOOTH
    # What looks to the back is in no face; but a body may be inside out.
    return smooth & (np.abs(normal @ costs.facing.front) >= FORWARDS)


def _holes(
    positions: np.ndarray,
    gluing: Gluing,
    boundary: np.ndarray,
    loop: np.ndarray,
    sieve: int | None,
    level: LevelParts | None,
) -> np.ndarray:
    """Loops (l,) bool that are not the longest of their component, or that are holes of sieves or of the triangles
    `whole`."""
    a, b = gluing.ends(boundary)
    # Halves: the difference of two huge numbers may be infinite.
    step = lengths(positions[a] / 2 - positions[b] / 2)
    around = np.bincount(loop, step)
    # Of many equal holes rounding shall not choose the one that stays open.
    length = around * (1 + NOISE * np.random.default_rng(0).random(len(around)))
    first_of = boundary[np.unique(loop, return_index=True)[1]]
    component_at = components(gluing)
    component_of = component_at[first_of // 3]
    order = np.lexsort((-length, component_of))
    _, first, place, count = np.unique(component_of[order], return_index=True, return_inverse=True, return_counts=True)
    hole = np.ones(len(length), dtype=bool)
    hole[order[first]] = False
    if sieve is not None:
        inner = hole.copy()
        ordinary = length[order[first + np.minimum(count // 2, MANY)]]
        hole[order] &= (count > sieve + 1)[place] & (length[order] <= OUTSTANDING * ordinary[place])
        if level is not None:
            size = np.bincount(component_at, face_areas(positions, gluing.vertex[gluing.triangles]))
            # A disk inside such a loop is no more than that.
            small = (2 * around) ** 2 <= 4 * np.pi * SMALL * size[component_of]
            hole |= inner & (small & level.parts[first_of // 3] | level.bevelled[first_of])
    return hole


def _fans(surface, gluing, boundary, loop, tail, head, size) -> Filled:
    """A triangle (head, tail, centre of the hole) on every boundary halfedge (k,), joined to its neighbours."""
    a, b = gluing.ends(boundary)
    n, c, m, k = len(surface.positions), len(gluing.vertex), len(gluing.triangles), len(boundary)
    count = np.bincount(loop)
    centre = np.stack([np.bincount(loop, x / count[loop]) for x in surface.positions[a].T], axis=1)
    successor = np.full(size, -1, dtype=np.int64)
    successor[tail[boundary]] = np.arange(k)
    following = successor[head[boundary]]
    mine = 3 * (m + np.arange(k))
    extended = replace(
        gluing,
        triangles=np.concatenate([gluing.triangles, c + np.arange(3 * k).reshape(k, 3)]),
        owner=np.concatenate([gluing.owner, np.full(k, NO_POLYGON)]),
        vertex=np.concatenate([gluing.vertex, np.stack([b, a, n + loop], axis=1).ravel()]),
        side=np.concatenate([gluing.side, np.tile([True, False, False], k)]),
        first=np.concatenate([gluing.first, boundary, mine + 2]),
        second=np.concatenate([gluing.second, mine, mine[following] + 1]),
    )
    positions = np.concatenate([surface.positions, centre])
    return Filled(replace(surface, positions=positions, corner_vertex=extended.vertex), extended, len(count))


def around_pockets(
    surface: Surface, gluing: Gluing, positions: np.ndarray, gone: np.ndarray, search: SideFinder, anew: bool
) -> np.ndarray:
    """Pairs (p,) bool of a gluing, without those that are gone (p,) bool, around pockets in faces: those that came off
    before, and anew those of components that are searched; positions (n,3) in a unit box."""
    keys = pair_keys(*gluing.ends(gluing.first))
    before = np.isin(keys, pair_keys(*search.pocketed.T))
    if not anew:
        return before
    left = gluing.without(gone | before)
    component_of = components(left)
    curved = total_curvature(left, corner_classes(left), component_of, positions) > POCKETED
    chosen = np.flatnonzero(to_search(surface, left, component_of, groups(component_of), search, curved))
    if not len(chosen):
        return before
    around = np.isin(keys, pair_keys(*search.pockets().T))
    return before | (around & np.isin(component_of[gluing.first // 3], chosen))
