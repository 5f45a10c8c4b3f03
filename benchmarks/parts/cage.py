"""The least area error that any UVs of a cube's cage leave on its subdivided surface, bounded by linear programming.

UVs inside of faces are linear in those of the cage, so that the area of a triangle is linear in the products
x_i y_j - x_j y_i of these. The least error over any such numbers, under which no triangle folds, is a linear programme:
no UVs have less, and perhaps none has so little.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.optimize import linprog
from scipy.sparse import coo_matrix, csr_matrix, hstack, identity, vstack

from benchmarks.part import Part
from benchmarks.tables import Table
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.mesh.topology import graph_components
from omt_uv.solver.subdivision.modifier import SubdivisionModifier, subdivided_surface, subdivided_uv

LEVELS = 2
MODES = ("PRESERVE_BOUNDARIES", "PRESERVE_CORNERS", "SMOOTH_ALL", "NONE")
CORNERS = np.array(list(itertools.product((-1, 1), repeat=3)), float)
FACES = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
EDGES = sorted({tuple(sorted((f[k], f[(k + 1) % 4]))) for f in FACES.tolist() for k in range(4)})
HALVES = np.array([[0, 1, 2], [0, 2, 3]])


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


PARTS = (Part("cage", "what no UVs of a cube's cage can pass once it is subdivided", cage_table),)
