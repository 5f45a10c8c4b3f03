"""The least area error that UVs of a cage leave on its subdivided surface: bounded for a cube, and found for a head.

UVs inside of faces are linear in those of the cage, so that the area of a triangle is linear in the products
x_i y_j - x_j y_i of these. The least error over any such numbers, under which no triangle folds, is a linear programme:
no UVs have less, and perhaps none has so little.

Of a head that says nothing, since its numbers are many and free of one another. There the sum of absolute errors is
minimised over its UVs, from where ours are and from there by chance: Gauss-Newton steps of reweighted least squares,
damped, with folds and shear of no account.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import meshes
import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_matrix, csr_matrix, diags, hstack, identity, vstack
from scipy.sparse.linalg import splu

from benchmarks.part import Part
from benchmarks.tables import Table
from omt_uv.pipelines.subdivision import refined_on_subdivision
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.mesh.topology import graph_components
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.subdivision.modifier import SubdivisionModifier, subdivided_surface, subdivided_uv

LEVELS = 2
MODES = ("PRESERVE_BOUNDARIES", "PRESERVE_CORNERS", "SMOOTH_ALL", "NONE")
CORNERS = np.array(list(itertools.product((-1, 1), repeat=3)), float)
FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
EDGES = sorted({tuple(sorted((f[k], f[(k + 1) % 4]))) for f in FACES.tolist() for k in range(4)})
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
LEAST_STEPS = 120
SHARPER = 30  # steps in which absolute values become ten times as sharp
MOST_DAMPED = 12  # tries of one step
JUMP = 1e-3  # how far, over the side of a square as large as the map, a start is moved by chance


def cage_table(args) -> Table:
    """A row for every UV Smooth: the least of all seams, and that of six islands."""
    table = Table(
        f"Least area error of a cube's cage at level {LEVELS}, of any UVs; all sets of its edges as seams",
        {"smooth": 22, "seams": 7, "least": 9, "six islands": 12},
    )
    surface, layouts = _cube(), _layouts()
    for mode in MODES:
        least = [_bound(surface, SubdivisionModifier(LEVELS, uv_smooth=mode), cut) for cut in layouts]
        table.add(smooth=mode, seams=len(layouts), least=np.nanmin(least), **{"six islands": least[-1]})
    return table


def _cube() -> Surface:
    triangles = (4 * np.arange(6)[:, None, None] + HALVES).reshape(-1, 3)
    none = np.zeros((0, 2), np.int64)
    return Surface(CORNERS, FACES.ravel(), np.arange(0, 25, 4), triangles, np.repeat(np.arange(6), 2), none, none)


def _layouts() -> list[tuple[int, ...]]:
    """Sets of edges, one of each that are alike under the cube's symmetries, the smaller first."""
    number = {edge: k for k, edge in enumerate(EDGES)}
    turns = []
    for axes, signs in itertools.product(itertools.permutations(range(3)), itertools.product((1, -1), repeat=3)):
        turned = (CORNERS[:, axes] * signs)[:, None] == CORNERS
        place = turned.all(axis=2).argmax(axis=1).tolist()
        turns.append([number[tuple(sorted((place[a], place[b])))] for a, b in EDGES])
    sets = itertools.chain.from_iterable(itertools.combinations(range(12), k) for k in range(13))
    return sorted(
        {min(tuple(sorted(turn[k] for k in cut)) for turn in turns) for cut in sets}, key=lambda c: (len(c), c)
    )


def _bound(surface: Surface, modifier: SubdivisionModifier, cut: tuple[int, ...]) -> float:
    """The least error along these seams; not a number where every map folds."""
    vertex = _uv_vertices(cut)
    fine = subdivided_surface(surface, modifier, 10**6)
    corners = fine.corners[:, HALVES].reshape(-1, 3, 3)
    area = face_areas(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    first = np.unique(vertex, return_index=True)[1]
    mapping = subdivided_uv(vertex, surface.face_start, surface.corner_vertex[first], modifier, fine.levels)
    forms = _area_forms(mapping.matrix.toarray(), mapping.quads[:, HALVES].reshape(-1, 3))
    return _least_error(forms, area / area.sum())


def _uv_vertices(cut: tuple[int, ...]) -> np.ndarray:
    """The UV vertex (24,) of every corner of the cube cut along edges."""
    joined = [
        [4 * f + FACES[f].tolist().index(v) for f in range(6) if {*EDGES[e]} <= {*FACES[f].tolist()}]
        for e in range(12)
        if e not in cut
        for v in EDGES[e]
    ]
    one, other = np.array(joined, np.int64).reshape(-1, 2).T
    return graph_components(one, other, 24)[1]


def _area_forms(places: np.ndarray, triangles: np.ndarray) -> csr_matrix:
    """The area of every triangle (t,3) of vertices that are places (v,n) times the cage's, by pairs of the latter."""
    a, b = (places[triangles[:, k]] - places[triangles[:, 0]] for k in (1, 2))
    i, j = np.triu_indices(places.shape[1], 1)
    return csr_matrix(0.5 * (a[:, i] * b[:, j] - a[:, j] * b[:, i]))


def _least_error(forms: csr_matrix, share: np.ndarray) -> float:
    """The least sum of |areas - share (t,)| over numbers under which no area is negative, and their sum is 1."""
    count, free = forms.shape
    each, none = identity(count, format="csr"), coo_matrix((count, count))
    above = vstack([hstack([forms, -each]), hstack([-forms, -each]), hstack([-forms, none])]).tocsr()
    whole = hstack([csr_matrix(forms.sum(axis=0)), coo_matrix((1, count))]).tocsr()
    found = linprog(
        np.concatenate([np.zeros(free), np.ones(count)]),
        above,
        np.concatenate([share, -share, np.zeros(count)]),
        whole,
        [1.0],
        bounds=[(None, None)] * free + [(0, None)] * count,
        method="highs",
    )
    return float(found.fun) if found.status == 0 else float("nan")


def least_table(args) -> Table:
    """A row for every UV Smooth: our error and shear, and the least error found, with its shear and folds."""
    title = f"Area error of the triangles of suzanne's cage at level {LEVELS}, automatic seams"
    table = Table(title, {"smooth": 22, "ours": 9, "shear": 6, "least": 9, "its shear": 9, "folds": 5, "spread": 9})
    for mode in MODES:
        fine, uv = _subdivided_head(SubdivisionModifier(LEVELS, uv_smooth=mode))
        moved = uv + JUMP * np.random.default_rng(0).normal(size=uv.shape)
        found = [_with_least_error(fine, start) for start in (uv, moved)]
        ours, (least, other) = fine.figures(uv), sorted((fine.figures(x) for x in found), key=lambda f: f.area_l1)
        table.add(
            smooth=mode,
            ours=ours.area_l1,
            shear=ours.angle_mean,
            least=least.area_l1,
            folds=least.folds,
            spread=other.area_l1 - least.area_l1,
            **{"its shear": least.angle_mean},
        )
    return table


@dataclass(frozen=True)
class _FineMap:
    """Triangles (t,3) of a subdivided surface with corners (t,3,3) in space and shares (t,) of its area; their vertices
    are matrix (v,n) times the UVs (n,2) of the cage."""

    matrix: csr_matrix
    triangles: np.ndarray
    corners: np.ndarray
    share: np.ndarray

    def areas(self, uv: np.ndarray) -> np.ndarray:
        """Areas (t,) in UVs (n,2) of the cage."""
        return signed_areas(self.matrix @ uv, self.triangles)

    def slopes(self, uv: np.ndarray) -> csr_matrix:
        """The derivative (t,2n) of the areas by all first and all second coordinates of UVs (n,2)."""
        p, row = (self.matrix @ uv)[self.triangles], np.repeat(np.arange(len(self.triangles)), 3)
        across = (np.roll(p, -1, axis=1) - np.roll(p, 1, axis=1)) / 2
        places = (row, self.triangles.ravel())
        shape = (len(self.triangles), self.matrix.shape[0])
        by_axis = (across[:, :, 1].ravel(), -across[:, :, 0].ravel())
        return hstack([csr_matrix((values, places), shape) @ self.matrix for values in by_axis]).tocsr()

    def figures(self, uv: np.ndarray):
        """The distortion of UVs (n,2) of the cage."""
        F = np.arange(self.triangles.size).reshape(-1, 3)
        return distortion(self.corners.reshape(-1, 3), F, (self.matrix @ uv)[self.triangles], overlap=False)


def _subdivided_head(modifier: SubdivisionModifier) -> tuple[_FineMap, np.ndarray]:
    """suzanne with the UVs (n,2) that Unwrap gives her cage, whose area is 1."""
    surface = meshes.polygon_surface(*meshes.load_polygons("suzanne"))
    cut = drain(unwrap(surface))
    found = drain(refined_on_subdivision(surface, cut, modifier, None, "free", areas_first=True))
    uv, vertex = np.concatenate([m.uv for m in found.maps]), np.zeros(len(surface.corner_vertex), np.int64)
    first = np.cumsum([0, *(len(c.vertices) for c in found.charts)])
    for chart, offset in zip(found.charts, first, strict=False):
        vertex[chart.corners.ravel()] = offset + chart.triangles.ravel()
    ids = np.concatenate([c.vertex_ids for c in found.charts])
    fine = subdivided_surface(surface, modifier, 10**6)
    mapping = subdivided_uv(vertex, surface.face_start, ids, modifier, fine.levels)
    corners = fine.corners[:, HALVES].reshape(-1, 3, 3)
    area = face_areas(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
    made = _FineMap(csr_matrix(mapping.matrix), mapping.quads[:, HALVES].reshape(-1, 3), corners, area / area.sum())
    return made, uv / np.sqrt(made.areas(uv).sum())


def _with_least_error(fine: _FineMap, uv: np.ndarray) -> np.ndarray:
    """UVs (n,2) whose areas are least off in sum, from others on; the absolute value becomes sharper with the steps."""
    damping, middle = 1e-3, float(np.median(fine.share))
    for k in range(LEAST_STEPS):
        soft = middle * max(10.0 ** (-k / SHARPER), 1e-3)
        missing = fine.areas(uv) - fine.share
        weight, slopes = 1 / np.hypot(missing, soft), fine.slopes(uv)
        hessian, value = (slopes.T @ diags(weight) @ slopes).tocsc(), np.hypot(missing, soft).sum()
        for _ in range(MOST_DAMPED):
            # Charts have no place and no direction of their own.
            shift = diags(damping * hessian.diagonal() + 1e-9 * hessian.diagonal().mean())
            step = splu((hessian + shift).tocsc()).solve(-slopes.T @ (weight * missing)).reshape(2, -1).T
            if np.hypot(fine.areas(uv + step) - fine.share, soft).sum() < value:
                uv, damping = uv + step, max(damping / 3, 1e-7)
                break
            damping *= 4
    return uv


PARTS = (
    Part("cage", "what no UVs of a cube's cage can pass once it is subdivided", cage_table),
    Part("cage_least", "how right UVs of suzanne's cage can be once it is subdivided", least_table, by_default=False),
)
