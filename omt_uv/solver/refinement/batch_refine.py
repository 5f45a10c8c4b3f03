"""Refine many small charts at once, by one Newton iteration on their disjoint union.

Energy, assembly and factorisation do not ask whether a mesh is connected. Only what is decided from step to step, how
far to go, the area weight and when to stop, is decided for every chart alone (`batch_continuation`). The initial map is
a mean value map, or a nearly flat chart unrolled: what the transport adds to a small chart, Newton finds as soon. A
chart that needs more, say a barrier for its boundary, is given back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..linalg.nested_dissection import vertex_graph
from ..linalg.sparse import minimum_degree
from ..maps.contacts import crossings, turns
from ..maps.development import developed
from ..maps.energy import FACE_ERROR, SHARE_ERROR, Elements, energies, gradient
from ..maps.mirror_symmetry import MirrorSymmetry, without_symmetry
from ..maps.polygon_elements import polygon_elements, restricted, with_convex_quads
from ..maps.tutte import tutte
from ..mesh.geometry import angle_defects, angles_from_lengths, cross3, halfedge_lengths, lengths, signed_areas
from ..mesh.topology import vertices_along_boundary
from ..progress import Progress, Steps
from .batch_continuation import AreaErrors, BatchContinuation
from .hessian_blocks import assembly_of
from .initial_maps import EXACT, NEARLY_FLAT, farthest_from_first, least_squares_conformal
from .mirrored_motion import MirroredMotion, find_symmetry, symmetric_start
from .projected_newton import ARMIJO, FOLD_SHARE, FreeMotion, Motion, NewtonProblem, fold_shares, newton_direction

# Halvings of a step before it counts as none.
MAX_HALVINGS = 12
# The union is built anew without the charts that are done when fewer than this share of its charts are left, unless
# there are only a few of them.
REBUILD = 0.6
FEW = 8
# Polygons below which a chart has no ties that its mirror image would have to break.
LEAST_SYMMETRIC = 6
# Relative differences of lengths that are rounding.
ISOMETRIC = 1e-9


@dataclass(frozen=True)
class MeshUnion:
    """Charts side by side.

    Attributes
    ----------
    positions, triangles : (n,3), (m,3) of all charts, one after the other
    boundary : (b,2) edges
    polygon : (m,) of every triangle, None where each is its own
    of_vertex, of_face, of_boundary : (n,), (m,), (b,) the chart of each of them
    count : of charts
    """

    positions: np.ndarray
    triangles: np.ndarray
    boundary: np.ndarray
    polygon: np.ndarray | None
    of_vertex: np.ndarray
    of_face: np.ndarray
    of_boundary: np.ndarray
    count: int

    def of_polygons(self, faces: Elements) -> np.ndarray:
        """The chart (p,) of every polygon of the elements of the union."""
        chart = np.zeros(len(faces.area), np.int64)
        chart[faces.owner] = self.of_vertex[faces.triangles[:, 0]]
        return chart

    def sums(self, face_values: np.ndarray) -> np.ndarray:
        """Sum of face values (m,) over each chart, (c,)."""
        return np.bincount(self.of_face, face_values, self.count)


@dataclass(frozen=True)
class BatchMaps:
    """Maps of many charts.

    Attributes
    ----------
    uv : (n,2) coordinates of all charts, one after the other, without folds
    solved : (c,) bool of every chart; False: nothing was found
    steps, residual, area_weight, energy : (c,) as in `refine.Refinement`
    area_l1, area_sd, angle_mean : (c,) as `maps.distortion` measures them
    """

    uv: np.ndarray
    solved: np.ndarray
    steps: np.ndarray
    residual: np.ndarray
    area_l1: np.ndarray
    area_sd: np.ndarray
    angle_mean: np.ndarray
    area_weight: np.ndarray
    energy: np.ndarray


def refine_batch(
    meshes: list[tuple[np.ndarray, np.ndarray]],
    quality: str,
    balance: float,
    density: np.ndarray | None = None,
    region: np.ndarray | None = None,
    polygons: list[np.ndarray] | None = None,
) -> Steps[BatchMaps]:
    """Refine maps with free boundaries of disks, vertices (n,3) of unit extent and triangles (m,3) each.

    Every map has the area of its disk.

    Parameters
    ----------
    quality, balance : see `refine.RefinementOptions`
    density : (m,) target area over area of the triangles of all disks, one after the other; 1 by default
    region : (m,) in [0, 1], weights of a region whose share of every disk's target is to be exact
    polygons : of the triangles (m,) of every disk; by default each triangle is its own

    Raises
    ------
    PrecisionError : a linear system is singular in double precision
    """
    yield Progress("Small charts", 0.0)
    union = _union(meshes, polygons)
    area = 0.5 * lengths(_normals(union))
    target = area if density is None else area * density
    target = target * (union.sums(area) / union.sums(target))[union.of_face]
    w = _initial_maps(union, area)
    faces = polygon_elements(union.positions, union.triangles, target, union.polygon, region)
    faces = with_convex_quads(faces, w)
    symmetry, w = _symmetric(union, faces, w)
    of_polygon = union.of_polygons(faces)
    share = np.bincount(of_polygon, faces.weight, union.count)
    order = minimum_degree(vertex_graph(faces.triangles, len(w)))
    with_polygons = np.zeros(union.count, bool)
    if faces.polygon is not None:
        with_polygons[of_polygon[np.bincount(faces.polygon) > 1]] = True
    continuation = BatchContinuation(
        with_polygons,
        quality,
        balance,
        lambda area_weight: np.bincount(of_polygon, energies(faces, w, area_weight[of_polygon]), union.count) / share,
    )
    while continuation.live.any():
        active = _ActiveCharts(union, faces, order, continuation.live, symmetry)
        began = continuation.live.sum()
        while continuation.live.sum() > REBUILD * began or 0 < continuation.live.sum() < FEW:
            active.step(w, continuation)
            yield Progress("Small charts", 1 - continuation.live.mean())
    continuation.solved[union.of_boundary[crossings(_side_by_side(union, w), union.boundary)]] = False
    return _measured(union, faces, w, continuation)


def _measured(union: MeshUnion, faces: Elements, w: np.ndarray, continuation: BatchContinuation) -> BatchMaps:
    """Maps w (n,) with their figures."""
    faces, of_polygon = with_convex_quads(faces, w), union.of_polygons(faces)
    a, b = (np.abs(x) for x in faces.derivatives(w))
    has, target = faces.areas(w), faces.area * faces.ratio

    def sums(values: np.ndarray) -> np.ndarray:
        return np.bincount(of_polygon, values, union.count)

    share = target / sums(target)[of_polygon]
    ratio = has / sums(has)[of_polygon] / share
    shear = faces.sums(np.where(a > b, (a + b) / np.maximum(a - b, 1e-300), 0)) / faces.sums(np.ones(len(a)))
    return BatchMaps(
        uv=np.column_stack([w.real, w.imag]),
        solved=continuation.solved,
        steps=continuation.steps,
        residual=continuation.residual,
        area_l1=sums(share * np.abs(ratio - 1)),
        area_sd=np.sqrt(sums(share * (ratio - 1) ** 2)),
        angle_mean=sums(share * shear),
        area_weight=continuation.area_weight,
        energy=continuation.value,
    )


def _union(meshes, polygons) -> MeshUnion:
    sizes = np.array([len(v) for v, _ in meshes])
    first = np.cumsum(sizes) - sizes
    triangles = np.concatenate([t + k for (_, t), k in zip(meshes, first, strict=True)])
    of_vertex = np.repeat(np.arange(len(meshes)), sizes)
    # Disks have one loop each, and its first vertex is among theirs.
    along, size = vertices_along_boundary(triangles)
    following = np.arange(1, len(along) + 1)
    following[np.cumsum(size) - 1] -= size
    boundary = np.column_stack([along, along[following]])
    positions = np.concatenate([v for v, _ in meshes])
    return MeshUnion(
        positions=positions,
        triangles=triangles,
        boundary=boundary,
        polygon=None if polygons is None else _numbered(polygons),
        of_vertex=of_vertex,
        of_face=of_vertex[triangles[:, 0]],
        of_boundary=of_vertex[boundary[:, 0]],
        count=len(meshes),
    )


def _initial_maps(union: MeshUnion, area: np.ndarray) -> np.ndarray:
    """Every chart with its area, (n,) complex: its mean value map with a circle as the boundary, or unrolled."""
    loop = union.boundary[:, 0]
    ends = np.flatnonzero(union.of_boundary[1:] != union.of_boundary[:-1]) + 1
    step = lengths(union.positions[union.boundary[:, 1]] - union.positions[loop])
    whole, before = np.bincount(union.of_boundary, step, union.count), np.cumsum(step) - step
    began = before[np.r_[0, ends]]
    turn = 2 * np.pi * (before - began[union.of_boundary]) / whole[union.of_boundary]
    uv = tutte(union.positions, union.triangles, loop, np.column_stack([np.cos(turn), np.sin(turn)]))
    angle = angles_from_lengths(halfedge_lengths(union.positions, union.triangles).reshape(-1, 3))
    defect = np.abs(angle_defects(union.triangles, angle, loop, len(uv)))
    defect[loop] = 0
    flat = np.bincount(union.of_vertex, defect, union.count) <= NEARLY_FLAT
    w = uv @ [1, 1j]
    exact, places = _developed(union, flat)
    w[exact[union.of_vertex]] = places[exact[union.of_vertex]]
    if (flat & ~exact).any():
        conformal, places = _conformal(union, flat & ~exact)
        w[conformal[union.of_vertex]] = places[conformal[union.of_vertex]]
    signed = signed_areas(np.column_stack([w.real, w.imag]), union.triangles)
    return np.sqrt(union.sums(area) / np.abs(union.sums(signed)))[union.of_vertex] * w


def _developed(union: MeshUnion, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which of the flat charts (c,) bool are developable and do not cover themselves, and their places (n,) complex.

    What `unroll` does with one of them.
    """
    w, gap = developed(union.positions, union.triangles)
    first = np.searchsorted(union.of_vertex, np.arange(union.count))
    exact = flat & (np.maximum.reduceat(gap, first) <= EXACT * np.maximum.reduceat(np.abs(w), first))
    start, end = farthest_from_first(union.positions, union.boundary, union.of_boundary)
    along = w[end] - w[start]
    w = (w - w[start][union.of_vertex]) * (along.conj() / np.maximum(np.abs(along), 1e-300))[union.of_vertex]
    return _one_to_one(union, exact, w), w


def _conformal(union: MeshUnion, nearly: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which of the nearly flat charts (c,) bool have a conformal map that is one to one, and their places (n,) complex.

    As `unroll` maps one of them.
    """
    vertices = np.flatnonzero(nearly[union.of_vertex])
    place = np.full(len(union.positions), -1)
    place[vertices] = np.arange(len(vertices))
    mine = nearly[union.of_boundary]
    start, end = farthest_from_first(union.positions, union.boundary[mine], union.of_boundary[mine])
    triangles = union.triangles[nearly[union.of_face]]
    w = np.zeros(len(union.positions), complex)
    w[vertices] = least_squares_conformal(union.positions[vertices], place[triangles], place[start], place[end])
    signed = signed_areas(np.column_stack([w.real, w.imag]), triangles)
    unfolded = nearly.copy()
    unfolded[union.of_vertex[triangles[:, 0]][~(signed > 0)]] = False
    return _one_to_one(union, unfolded, w), w


def _one_to_one(union: MeshUnion, chosen: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Which of the chosen charts (c,) bool, whose maps w (n,) have no folds, do not cover themselves."""
    chosen = chosen & (turns(w, union.boundary[:, 0], union.boundary[:, 1], union.of_boundary) <= 1)
    mine = chosen[union.of_boundary]
    if mine.any():
        chosen[union.of_boundary[mine][crossings(_side_by_side(union, w), union.boundary[mine])]] = False
    return chosen


class _ActiveCharts:
    """The charts of a union that are still on their way, renumbered."""

    def __init__(
        self,
        union: MeshUnion,
        faces: Elements,
        order: np.ndarray,
        live: np.ndarray,
        symmetry: MirrorSymmetry | None,
    ):
        self.vertices = order[live[union.of_vertex[order]]]
        place = np.empty(len(order), np.int64)
        place[self.vertices] = np.arange(len(self.vertices))
        of_polygon = union.of_polygons(faces)
        kept = live[of_polygon]
        self.faces = restricted(faces, kept, place)
        self.of_face, self.of_vertex = of_polygon[kept], union.of_vertex[self.vertices]
        self.count = union.count
        self.share = np.maximum(self._sums(self.faces.weight), 1e-300)
        self.symmetry = None if symmetry is None else symmetry.restricted(self.vertices, place)
        self.assembly = assembly_of(self.faces, len(self.vertices), None, self.symmetry)
        self.motion: Motion = FreeMotion(np.zeros(len(self.vertices), bool))
        if self.symmetry is not None:
            self.motion = MirroredMotion(self.motion, self.symmetry, np.zeros(len(self.vertices), complex))

    def step(self, whole: np.ndarray, continuation: BatchContinuation) -> None:
        """A Newton step of all charts of the group, every one as far as it may go, in place."""
        w, area_weight = whole[self.vertices], continuation.area_weight[self.of_face]
        self._select_quads(w, area_weight, continuation)
        faces = self._tilted(continuation, continuation.area_weight)
        problem = NewtonProblem(
            faces=faces,
            assembly=self.assembly,
            motion=self.motion,
            area_weight=area_weight,
            symmetry=self.symmetry,
        )
        step, _ = newton_direction(problem, w, continuation.pressure[self.of_face])
        step = self.motion.frame(w) * step
        if self.symmetry is not None:
            step = self.symmetry.spread(step)
        down = (step.conj() * gradient(faces, w, area_weight)).real
        slope = np.bincount(self.of_vertex, down, self.count) / self.share
        far = np.full(self.count, 1 / FOLD_SHARE)
        folds = fold_shares(*faces.derivatives(w), *faces.derivatives(step))
        part = faces.part
        if part is not None:
            folds = np.where(part > 0, folds, np.inf)
        np.minimum.at(far, faces.of_triangles(self.of_face), folds)
        share = np.where(continuation.live, FOLD_SHARE * far, 0)
        waiting = continuation.live.copy()
        for _ in range(MAX_HALVINGS):
            trial = w + share[self.of_vertex] * step
            value = self._energies(faces, trial, area_weight)
            waiting &= ~(value <= continuation.value + ARMIJO * share * slope)
            if not waiting.any():
                break
            share[waiting] *= 0.5
        share[waiting] = 0
        trial = w + share[self.of_vertex] * step
        whole[self.vertices] = trial
        after = np.where(waiting, continuation.value, value)
        continuation.update(
            after,
            -slope / 2,
            share,
            self._area_errors(trial),
            lambda new: self._energies(self._tilted(continuation, new), trial, new[self.of_face]),
        )

    def _select_quads(self, w: np.ndarray, area_weight: np.ndarray, continuation: BatchContinuation) -> None:
        """Measure quads that have become convex on both triangulations, and the energies of their charts anew."""
        before, self.faces = self.faces, with_convex_quads(self.faces, w)
        if before is not self.faces:
            value = self._energies(self._tilted(continuation, continuation.area_weight), w, area_weight)
            continuation.value = np.where(continuation.live, value, continuation.value)

    def _energies(self, faces, w, area_weight):
        return self._sums(energies(faces, w, area_weight)) / self.share

    def _tilted(self, continuation: BatchContinuation, area_weight) -> Elements:
        """The faces with the targets that lead to the shares, see `energy.tilted`."""
        faces = self.faces
        if faces.region is None:
            return faces
        ratio = faces.ratio * np.exp((continuation.multiplier / area_weight)[self.of_face] * faces.region)
        scale = self._sums(faces.area * faces.ratio) / np.maximum(self._sums(faces.area * ratio), 1e-300)
        return replace(faces, ratio=ratio * scale[self.of_face])

    def _area_errors(self, w) -> AreaErrors:
        area, target = self.faces.areas(w), self.faces.area * self.faces.ratio
        error, region = self._errors(area, target), self.faces.region
        if region is None:
            return AreaErrors(error, error, np.zeros(self.count))
        has, aim = (x / np.maximum(self._sums(x), 1e-300)[self.of_face] for x in (area, target))
        mean = self._sums(region * has)
        spread = self._sums(region**2 * has) - mean**2
        tilt = np.where(spread > 0, self._sums(region * aim) - mean, 0) / np.where(spread > 0, spread, 1)
        return AreaErrors(error, self._errors(area * np.exp(tilt[self.of_face] * region), target), tilt)

    def _errors(self, area, target):
        """`energy.target_error` of every chart, (c,), by the areas that its faces have and are to have."""
        area, target = (x / np.maximum(self._sums(x), 1e-300)[self.of_face] for x in (area, target))
        error = area - target
        worst = self._sums(np.abs(error))
        region = self.faces.region
        for part in () if region is None else (region, 1 - region):
            share = self._sums(part * target)
            present = np.where(share > 0, share, np.inf)
            single = FACE_ERROR * self._sums(part * np.abs(error)) / present
            worst = np.maximum.reduce([worst, SHARE_ERROR * np.abs(self._sums(part * error)) / present, single])
        return worst

    def _sums(self, face_values):
        return np.bincount(self.of_face, face_values, self.count)


def _numbered(of_disks: list[np.ndarray]) -> np.ndarray:
    """Polygons of several disks, any numbers, as different numbers."""
    every = np.concatenate(of_disks).astype(np.int64)
    disk = np.repeat(np.arange(len(of_disks)), list(map(len, of_disks)))
    order = np.lexsort((every, disk))
    new = (np.diff(every[order]) != 0) | (np.diff(disk[order]) != 0)
    label = np.empty(len(every), np.int64)
    label[order] = np.cumsum(np.r_[0, new])
    return label


def _symmetric(union: MeshUnion, faces: Elements, w: np.ndarray) -> tuple[MirrorSymmetry | None, np.ndarray]:
    """The symmetry of all charts that are their own mirror images, and the maps w (n,) made symmetric."""
    of_polygon, w = union.of_polygons(faces), w.copy()
    sizes = np.bincount(of_polygon, minlength=union.count)
    large = np.flatnonzero((sizes >= LEAST_SYMMETRIC) & ~_isometric(union, faces, w))
    found = without_symmetry(len(w))
    begin, first = (np.searchsorted(x, np.arange(union.count + 1)) for x in (union.of_vertex, union.of_face))
    for k in large:
        vertices, rows = np.arange(begin[k], begin[k + 1]), slice(first[k], first[k + 1])
        chart = restricted(faces, of_polygon == k, np.arange(len(w)) - begin[k])
        polygon = None if union.polygon is None else union.polygon[rows]
        symmetry = find_symmetry(union.positions[vertices], union.triangles[rows] - begin[k], polygon, chart)
        start = None if symmetry is None else symmetric_start(symmetry, w[vertices], chart, "free", vertices[:0])
        if start is not None:
            found = found.with_part(start[0], vertices)
            w[vertices] = start[1]
    return (found if found.follows.any() else None), w


def _isometric(union: MeshUnion, faces: Elements, w: np.ndarray) -> np.ndarray:
    """Which charts (c,) bool have the areas asked for in the maps w (n,), and no shear: those are as symmetric as the
    charts."""
    owner = union.of_vertex[faces.triangles[:, 0]]
    a, b = (np.abs(x) for x in faces.derivatives(w))
    size = np.maximum(a, b) / np.sqrt(faces.of_triangles(faces.ratio))
    low, high = np.full(union.count, np.inf), np.zeros(union.count)
    np.minimum.at(low, owner, size)
    np.maximum.at(high, owner, size)
    sheared = np.bincount(owner, np.minimum(a, b) > ISOMETRIC * np.maximum(a, b), union.count) > 0
    return ~sheared & (high - low <= ISOMETRIC * high)


def _side_by_side(union: MeshUnion, w: np.ndarray) -> np.ndarray:
    """The maps (n,) moved and scaled until none of them touches another."""
    first = np.searchsorted(union.of_vertex, np.arange(union.count))
    low, high = ([f.reduceat(x, first) for x in (w.real, w.imag)] for f in (np.minimum, np.maximum))
    extent = np.maximum(np.maximum(high[0] - low[0], high[1] - low[1]), 1e-300)
    columns = int(np.ceil(np.sqrt(union.count)))
    place = 2.0 * (np.arange(union.count) % columns + 1j * (np.arange(union.count) // columns))
    corner = low[0] + 1j * low[1]
    return (w - corner[union.of_vertex]) / extent[union.of_vertex] + place[union.of_vertex]


def _normals(union: MeshUnion) -> np.ndarray:
    p = union.positions[union.triangles]
    return cross3(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
