"""The power diagram of sites with geodesic distances, cut exactly on the triangles of a mesh.

Squared distances are linear on every triangle, so that the cell of site i, where d_i^2 + h_i is least, is a convex
polygon there. Its area changes with the weight of a neighbour by the integral of dl / |grad (d_i^2 - d_j^2)| along
their common side (Su 2015, equation 3.16, with its sign mended).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from ..errors import TransportError
from ..linalg.sparse import solve_spd
from ..mesh.geometry import laplacian_from_weights
from .clipping import CellPieces, clip, whole_triangles
from .polar_coordinates import PolarCoordinates, WindowMesh, polar_coordinates
from .sites import Sites

# What a window grows by when its cell comes to its end.
GROWTH = 1.5
MOST_GROWTHS = 60
# By up to this share of the greatest squared distance weights differ at random, so that no point is as near to two
# sites by chance, as on symmetric meshes, and all triangles at a vertex agree who has it.
CHANCE = 1e-11
# Multiples of this are spread evenly, modulo 1.
GOLDEN = 0.6180339887498949


@dataclass(frozen=True)
class GeodesicCells:
    """CellPieces of a power diagram.

    area (n,): mass of the cell of every site; pair (k,): row of the pairs that each piece belongs to; polygons: the
    pieces; part (k,): their masses; side (e,2), conductance (e,): sites with a common side, and the change of the
    areas by it
    """

    area: np.ndarray
    pair: np.ndarray
    polygons: CellPieces
    part: np.ndarray
    side: np.ndarray
    conductance: np.ndarray


def geodesic_cells(pairs: PolarCoordinates, site_weights: np.ndarray, mass: np.ndarray) -> GeodesicCells:
    """Cells of the weights (n,) of sites on triangles of the masses (m,), where pairs reach."""
    n = len(site_weights)
    chance = CHANCE * pairs.farthest.max() * (np.arange(1, n + 1) * GOLDEN % 1)
    weight = (site_weights + chance)[pairs.site]
    first = np.flatnonzero(np.r_[True, pairs.face[1:] != pairs.face[:-1]])
    size = np.diff(np.r_[first, len(pairs.face)])
    # Whoever is above the best site's greatest value everywhere has no share.
    bound = np.minimum.reduceat(pairs.farthest + weight, first)
    row = np.flatnonzero(pairs.nearest + weight <= np.repeat(bound, size))
    value, face = pairs.squared[row] + weight[row][:, None], pairs.face[row]
    polygons, kept = _clipped(value, face, pairs.site[row])
    pair = row[kept]
    share, _ = polygons.moments()
    part = 2 * np.maximum(share, 0) * mass[pairs.face[pair]]
    side, conductance = _sides(polygons, mass[pairs.face[pair]])
    i, j, length = _against(pairs, site_weights, side, conductance, pair)
    area = np.bincount(pairs.site[pair], part, n)
    return GeodesicCells(area, pair, polygons, part, np.stack([i, j], axis=1), length)


def _clipped(value: np.ndarray, face: np.ndarray, site: np.ndarray) -> tuple[CellPieces, np.ndarray]:
    """Where each of the rows (r,3), ordered by triangle (r,) and site (r,), is least; and the rows with one."""
    first = np.flatnonzero(np.r_[True, face[1:] != face[:-1]])
    size = np.diff(np.r_[first, len(face)])
    begin, rivals = np.repeat(first, size), np.repeat(size, size)
    polygons, rows = whole_triangles(len(face)), np.arange(len(face))
    done: list[tuple[CellPieces, np.ndarray]] = []
    for slot in range(int(size.max(initial=0))):
        # Finished rows leave, so that few rivals cost little.
        over = rivals[rows] <= slot
        done.append((polygons.chosen(over), rows[over]))
        polygons, rows = polygons.chosen(~over), rows[~over]
        other = begin[rows] + slot
        active = np.flatnonzero(other != rows)
        mine, its = rows[active], other[active]
        difference = value[mine] - value[its]
        cut, left = clip(polygons.chosen(active), difference, site[its])
        alone = np.flatnonzero(other == rows)
        polygons = _stacked([polygons.chosen(alone), cut])
        rows = np.concatenate([rows[alone], mine[left]])
    done.append((polygons, rows))
    rows = np.concatenate([r for _, r in done])
    order = np.argsort(rows, kind="stable")
    return _stacked([p for p, _ in done]).chosen(order), rows[order]


def _stacked(many: list[CellPieces]) -> CellPieces:
    """All polygons of several lots."""
    width = max(p.points.shape[1] for p in many)
    wide = [
        (np.pad(p.points, ((0, 0), (0, width - p.points.shape[1]), (0, 0))),
         np.pad(p.label, ((0, 0), (0, width - p.label.shape[1]))))
        for p in many
    ]  # fmt: skip
    points, label = (np.concatenate(k) for k in zip(*wide, strict=True))
    return CellPieces(points, np.concatenate([p.count for p in many]), label)


def _sides(polygons: CellPieces, mass: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows (e,2) of a piece and a slot whose side is shared with another site, and twice its length times mass (e,)."""
    rows, slots = np.nonzero((polygons.label >= 0) & polygons.used())
    step = polygons.following()[rows, slots] - polygons.points[rows, slots]
    length = np.hypot(step[:, 0], step[:, 1])
    return np.stack([rows, polygons.label[rows, slots]], axis=1), 2 * length * mass[rows]


def _against(pairs, site_weights, side, measure, pair):
    """Sites i, j (e,) on both sides of each common side, and its conductance (e,)."""
    mine = pair[side[:, 0]]
    key = pairs.face * (len(site_weights) + 1) + pairs.site
    its = np.searchsorted(key, pairs.face[mine] * (len(site_weights) + 1) + side[:, 1])
    difference = pairs.squared[mine] - pairs.squared[its]
    slope = np.hypot(difference[:, 0] - difference[:, 2], difference[:, 1] - difference[:, 2])
    # Each side is met from both of its cells.
    with np.errstate(divide="ignore", invalid="ignore"):
        conductance = np.where(slope > 0, measure / (2 * slope), 0)
    return pairs.site[mine], side[:, 1], conductance


@dataclass(frozen=True)
class DivisionProblem:
    """What is divided: a mesh, the mass (m,) and the part (m,) of its triangles, and the masses asked for (n,)."""

    mesh: WindowMesh
    mass: np.ndarray
    part: np.ndarray
    asked: np.ndarray


class GeodesicDual:
    """The dual for sites on a mesh, see `damped_newton.Dual`; windows grow when a cell comes to the end of its own.

    diagrams : how many there were; radius (n,) : of the windows
    """

    growth = 4.0
    small_step = 0.0
    good_residual = 0.0

    def __init__(self, problem: DivisionProblem, sites: Sites, pairs: PolarCoordinates, radius: np.ndarray):
        self.mesh, self.mass, self.part, self.asked = problem.mesh, problem.mass, problem.part, problem.asked
        self.sites, self.pairs = sites, pairs
        self.radius = radius.copy()
        self.diagrams = 0

    def cells(self, site_weights: np.ndarray) -> GeodesicCells:
        """The cells of site weights (n,), in windows large enough for them."""
        self.diagrams += 1
        return self._within_windows(site_weights, geodesic_cells(self.pairs, site_weights, self.mass))

    def _within_windows(self, site_weights: np.ndarray, cells: GeodesicCells) -> GeodesicCells:
        """The cells of site weights (n,), after the windows have grown whose ends they came to."""
        for _ in range(MOST_GROWTHS):
            short = np.unique(self.pairs.site[cells.pair[self.pairs.last[cells.pair] & (cells.part > 0)]])
            if not len(short):
                return cells
            self.radius[short] *= GROWTH
            grown = polar_coordinates(self.mesh, self.sites, self.radius[short], short)
            self.pairs = self.pairs.joined(grown, short)
            self.diagrams += 1
            cells = geodesic_cells(self.pairs, site_weights, self.mass)
        raise TransportError("The cells reach beyond every window", "Remove parts that are far away", "face")

    def near(self, site_weights: np.ndarray, cells: GeodesicCells) -> GeodesicCells | None:
        """The cells of site weights (n,); None where they are worse than the others, before windows grow for them."""
        self.diagrams += 1
        trial = geodesic_cells(self.pairs, site_weights, self.mass)
        if trial.area.min() <= 0 or np.linalg.norm(trial.area - self.asked) > np.linalg.norm(cells.area - self.asked):
            return None
        return self._within_windows(site_weights, trial)

    def confirmed(self, site_weights: np.ndarray, cells: GeodesicCells) -> GeodesicCells:
        """The cells themselves: nothing was guessed."""
        return cells

    def direction(self, cells: GeodesicCells, mass: np.ndarray) -> np.ndarray:
        """Newton's direction (n,); on every part of the mesh one weight stays."""
        n = len(mass)
        hessian = laplacian_from_weights(cells.side[:, 0], cells.side[:, 1], cells.conductance, n)
        fixed = np.unique(self.part[self.sites.triangle], return_index=True)[1]
        degree = hessian.diagonal()
        # A cell without a side in common with another one has nothing to give.
        free = degree > 0
        free[fixed] = False
        keep = np.flatnonzero(free)
        direction = np.zeros(n)
        if len(keep):
            small = csr_matrix(hessian[keep][:, keep])
            direction[keep] = solve_spd(small, (cells.area - mass)[keep])
        return direction

    def first_step(self, cells: GeodesicCells, direction: np.ndarray) -> float:
        """The whole step."""
        return 1.0
