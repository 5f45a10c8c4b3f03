"""Many small charts at once: one Newton iteration on their disjoint union.

Energy, assembly and factorisation do not ask whether a mesh is connected. Only what is decided from step to step, how
far to go, the weight of the area term and when to stop, is decided for every chart alone, by the rules of `stages.py`
(`control.py`). The start is a mean value map, or a nearly flat chart unrolled: what the transport adds to a small
chart, Newton finds as soon. A chart that needs more, say a barrier for its boundary, is given back.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..linalg.nested_dissection import vertex_graph
from ..linalg.sparse import minimum_degree
from ..maps.energy import FACE_ERROR, SHARE_ERROR, Elements, elements, energies, gradient
from ..maps.tutte import arc_length_parameters, tutte
from ..mesh.geometry import angle_defects, angles_from_lengths, halfedge_lengths, signed_areas
from ..mesh.topology import boundary_loops
from ..progress import Progress, Steps
from .batch_continuation import AreaErrors, BatchContinuation
from .boundary_barrier import crossings
from .initial_maps import NEARLY_FLAT, unroll
from .projected_newton import ARMIJO, FOLD_SHARE, Assembly, FreeMotion, NewtonProblem, fold_shares, newton_direction

# Halvings of a step before it counts as none.
MAX_HALVINGS = 12
# The union is built anew without the charts that are done when fewer than this share of its charts are left.
REBUILD = 0.6


@dataclass(frozen=True)
class MeshUnion:
    """Charts side by side: positions (n,3), triangles (m,3), rim edges (b,2), and the chart of each of them."""

    positions: np.ndarray
    triangles: np.ndarray
    rim: np.ndarray
    of_vertex: np.ndarray
    of_face: np.ndarray
    of_rim: np.ndarray
    count: int

    def sums(self, face_values: np.ndarray) -> np.ndarray:
        """Sum of face values (m,) over each chart, (c,)."""
        return np.bincount(self.of_face, face_values, self.count)


@dataclass(frozen=True)
class BatchMaps:
    """Coordinates uv (n,2) of all charts, one after the other, without folds.

    Per chart (c,): solved (False: nothing was found), Newton steps, residual, area_l1, area_sd and angle_mean.
    """

    uv: np.ndarray
    solved: np.ndarray
    steps: np.ndarray
    residual: np.ndarray
    area_l1: np.ndarray
    area_sd: np.ndarray
    angle_mean: np.ndarray
    weight: np.ndarray


def refine_batch(
    meshes: list[tuple[np.ndarray, np.ndarray]],
    quality: str,
    balance: float,
    density: np.ndarray | None = None,
    region: np.ndarray | None = None,
) -> Steps[BatchMaps]:
    """Area-preserving maps with free boundaries of disks, vertices (n,3) of unit extent and triangles (m,3) each.

    density, region : of the triangles of all disks, one after the other, see `chart_map.map_chart`. Every map has
        the area of its disk

    Raises
    ------
    PrecisionError : a linear system is singular in double precision
    """
    yield Progress("Small charts", 0.0)
    parts = _union(meshes)
    area = 0.5 * np.linalg.norm(_normals(parts), axis=1)
    wanted = area if density is None else area * density
    wanted = wanted * (parts.sums(area) / parts.sums(wanted))[parts.of_face]
    faces = elements(parts.positions, parts.triangles, wanted, region)
    share = parts.sums(faces.weight)
    w = _starts(parts, meshes, area)
    order = minimum_degree(vertex_graph(parts.triangles, len(w)))
    control = BatchContinuation(
        parts.count, quality, balance, lambda weight: parts.sums(energies(faces, w, weight[parts.of_face])) / share
    )
    while control.live.any():
        group = _Group(parts, faces, order, control.live)
        began = control.live.sum()
        while control.live.sum() > REBUILD * began or 0 < control.live.sum() < 8:
            group.step(w, control)
            yield Progress("Small charts", 1 - control.live.mean())
    control.solved[parts.of_rim[crossings(_apart(parts, w), parts.rim)]] = False
    a, b = (np.abs(x) for x in faces.derivatives(w))
    has, target = faces.areas(w), faces.area * faces.ratio
    weight = target / parts.sums(target)[parts.of_face]
    ratio = has / parts.sums(has)[parts.of_face] / weight
    return BatchMaps(
        np.column_stack([w.real, w.imag]),
        control.solved,
        control.steps,
        control.residual,
        parts.sums(weight * np.abs(ratio - 1)),
        np.sqrt(parts.sums(weight * (ratio - 1) ** 2)),
        parts.sums(weight * (a + b) / np.maximum(a - b, 1e-300)),
        control.weight,
    )


def _union(meshes) -> MeshUnion:
    sizes = np.array([len(v) for v, _ in meshes])
    first = np.cumsum(sizes) - sizes
    triangles = np.concatenate([t + k for (_, t), k in zip(meshes, first, strict=True)])
    of_vertex = np.repeat(np.arange(len(meshes)), sizes)
    loops = sorted(boundary_loops(triangles), key=lambda loop: of_vertex[loop[0]])
    rim = np.concatenate([np.column_stack([loop, np.roll(loop, -1)]) for loop in loops])
    positions = np.concatenate([v for v, _ in meshes])
    return MeshUnion(
        positions, triangles, rim, of_vertex, of_vertex[triangles[:, 0]], of_vertex[rim[:, 0]], len(meshes)
    )


def _starts(parts: MeshUnion, meshes, area: np.ndarray) -> np.ndarray:
    """Every chart with its area, (n,) complex: its mean value map with a circle as the boundary, or unrolled."""
    loop = parts.rim[:, 0]
    ends = np.flatnonzero(parts.of_rim[1:] != parts.of_rim[:-1]) + 1
    loops = np.split(loop, ends)
    turn = 2 * np.pi * np.concatenate([arc_length_parameters(parts.positions, part) for part in loops])
    uv = tutte(parts.positions, parts.triangles, loop, np.column_stack([np.cos(turn), np.sin(turn)]))
    angle = angles_from_lengths(halfedge_lengths(parts.positions, parts.triangles).reshape(-1, 3))
    defect = np.abs(angle_defects(parts.triangles, angle, loop, len(uv)))
    defect[loop] = 0
    flat = np.bincount(parts.of_vertex, defect, parts.count) <= NEARLY_FLAT
    for k in np.flatnonzero(flat):
        vertices, triangles = meshes[k]
        begin = int(np.searchsorted(parts.of_vertex, k))
        unrolled = unroll(vertices, triangles, loops[k] - begin)
        if unrolled is not None:
            uv[begin : begin + len(vertices)] = unrolled
    scale = np.sqrt(parts.sums(area) / np.abs(parts.sums(signed_areas(uv, parts.triangles))))
    return scale[parts.of_vertex] * (uv[:, 0] + 1j * uv[:, 1])


class _Group:
    """The charts of a union that are still on their way, renumbered."""

    def __init__(self, parts: MeshUnion, faces: Elements, order: np.ndarray, live: np.ndarray):
        self.vertices = order[live[parts.of_vertex[order]]]
        place = np.empty(len(order), np.int64)
        place[self.vertices] = np.arange(len(self.vertices))
        kept = live[parts.of_face]
        triangles = place[faces.triangles[kept]]
        region = None if faces.region is None else faces.region[kept]
        self.faces = Elements(
            triangles, faces.area[kept], faces.gradient[kept], faces.ratio[kept], faces.weight[kept], region
        )
        self.of_face, self.of_vertex = parts.of_face[kept], parts.of_vertex[self.vertices]
        self.count = parts.count
        self.share = np.maximum(self._sums(self.faces.weight), 1e-300)
        self.assembly = Assembly(triangles, len(self.vertices))
        self.motion = FreeMotion(np.zeros(len(self.vertices), bool))

    def step(self, whole: np.ndarray, control: BatchContinuation) -> None:
        """A Newton step of all charts of the group, every one as far as it may go, in place."""
        w, weight = whole[self.vertices], control.weight[self.of_face]
        faces = self._tilted(control, control.weight)
        problem = NewtonProblem(faces, self.assembly, self.motion, weight)
        step, _ = newton_direction(problem, w, control.pressure[self.of_face])
        down = (step.conj() * gradient(faces, w, weight)).real
        slope = np.bincount(self.of_vertex, down, self.count) / self.share
        far = np.full(self.count, 1 / FOLD_SHARE)
        np.minimum.at(far, self.of_face, fold_shares(*self.faces.derivatives(w), *self.faces.derivatives(step)))
        share = np.where(control.live, FOLD_SHARE * far, 0)
        waiting = control.live.copy()
        for _ in range(MAX_HALVINGS):
            trial = w + share[self.of_vertex] * step
            value = self._energies(faces, trial, weight)
            waiting &= ~(value <= control.value + ARMIJO * share * slope)
            if not waiting.any():
                break
            share[waiting] *= 0.5
        share[waiting] = 0
        trial = w + share[self.of_vertex] * step
        whole[self.vertices] = trial
        after = np.where(waiting, control.value, value)
        control.update(
            after,
            -slope / 2,
            share,
            self._lack(trial),
            lambda new: self._energies(self._tilted(control, new), trial, new[self.of_face]),
        )

    def _energies(self, faces, w, weight):
        return self._sums(energies(faces, w, weight)) / self.share

    def _tilted(self, control: BatchContinuation, weight) -> Elements:
        """The faces with the targets that lead to the shares, see `energy.tilted`."""
        faces = self.faces
        if faces.region is None:
            return faces
        ratio = faces.ratio * np.exp((control.multiplier / weight)[self.of_face] * faces.region)
        scale = self._sums(faces.area * faces.ratio) / np.maximum(self._sums(faces.area * ratio), 1e-300)
        return replace(faces, ratio=ratio * scale[self.of_face])

    def _lack(self, w) -> AreaErrors:
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
            held = np.where(share > 0, share, np.inf)
            single = FACE_ERROR * self._sums(part * np.abs(error)) / held
            worst = np.maximum.reduce([worst, SHARE_ERROR * np.abs(self._sums(part * error)) / held, single])
        return worst

    def _sums(self, face_values):
        return np.bincount(self.of_face, face_values, self.count)


def _apart(parts: MeshUnion, w: np.ndarray) -> np.ndarray:
    """The maps (n,) moved and scaled until none of them touches another."""
    first = np.searchsorted(parts.of_vertex, np.arange(parts.count))
    low, high = ([f.reduceat(x, first) for x in (w.real, w.imag)] for f in (np.minimum, np.maximum))
    extent = np.maximum(high[0] - low[0], high[1] - low[1])
    columns = int(np.ceil(np.sqrt(parts.count)))
    place = 2.0 * (np.arange(parts.count) % columns + 1j * (np.arange(parts.count) // columns))
    corner = low[0] + 1j * low[1]
    return (w - corner[parts.of_vertex]) / extent[parts.of_vertex] + place[parts.of_vertex]


def _normals(parts: MeshUnion) -> np.ndarray:
    p = parts.positions[parts.triangles]
    return np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
