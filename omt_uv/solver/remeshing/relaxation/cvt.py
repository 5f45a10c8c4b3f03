"""Relax a mesh to a centroidal Voronoi tessellation of a surface, without cuts, by L-BFGS.

The energy is the integral of density^2 |x - x_i|^2 over the cells (Du, Faber, Gunzburger 1999): with the square of the
density, cells in the plane get areas inverse to the density. Cells are read off the Delaunay triangulation of the
vertices, the energy is lowered by L-BFGS (Liu, Wang, Levy, Sun, Yan, Lu, Yang 2009), and after every step the vertices
go back to the surface. Crests weigh more than the rest, so that vertices line up on them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...linalg.lbfgs import LBFGS
from ...mesh.geometry import vertex_areas, vertex_normals
from ...progress import Progress, Steps
from ..edits.delaunay_flips import make_delaunay_embedded
from ..edits.working_mesh import WorkingMesh
from .surface_carrier import SurfaceCarrier
from .voronoi_cells import VoronoiCells, voronoi_cells

# No vertex moves farther in one step, in shares of the shortest side of a triangle around it.
MAX_STEP = 0.4
# Rounds after which cells are compared with samples of the surface again.
SAMPLE_EVERY = 15
# Area of the surface over area of the mesh from which on samples of the surface are trusted,
TRUST_FROM = 1.1
# and at which they are alone.
TRUST_FULLY = 1.3
# Weight of crests, next to the area around them.
CREST_WEIGHT = 4.0
# Vertices go back to the surface after so many rounds: along the tangents they hardly leave it.
RETURN_EVERY = 2
# Edges flip as often,
FLIP_EVERY = 2
# by one round of flips; what it leaves is for the next.
FLIP_ROUNDS = 1
# Relative rise of the energy at which the descent begins anew: triangles flipped.
RISE = 1e-6


class Relaxation:
    """A mesh that is relaxed on a surface, and goes on from where it ended: with the samples, and the memory of its
    descent, that it has.

    Boundary vertices should be fixed.
    """

    def __init__(self, mesh: WorkingMesh, carrier: SurfaceCarrier):
        self._start, self._carrier, self._descent = mesh, carrier, LBFGS()
        self._triangles, self._twin = mesh.triangles.copy(), mesh.twin.copy()
        self._normal = vertex_normals(mesh.points, mesh.triangles)
        carrier.begin_at(mesh.points, self._normal, mesh.near)
        self._points, self._density = carrier.closest(mesh.points, self._normal)
        self._points[mesh.fixed] = mesh.points[mesh.fixed]
        self._best, self._rounds, self._residual = np.inf, 0, 0.0

    def run(self, rounds: int) -> Steps[tuple[WorkingMesh, float]]:
        """Go on for so many rounds; steps of the mesh, and the mean step of the last round in edge lengths."""
        mesh, carrier, fixed = self._start, self._carrier, self._start.fixed
        for k in range(rounds):
            if mesh.delaunay and self._rounds % FLIP_EVERY == 0:
                make_delaunay_embedded(self._points, self._triangles, self._twin, mesh.locked, FLIP_ROUNDS)
            trial = self._points + self._step()
            self._normal = vertex_normals(trial, self._triangles)
            if self._rounds % RETURN_EVERY == 0 or k == rounds - 1:
                trial, self._density = carrier.closest(trial, self._normal)
            # A vertex that found no place stays where it is.
            found = ~fixed & np.isfinite(trial).all(axis=1)
            self._points = np.where(found[:, None], trial, self._points)
            self._rounds += 1
            yield Progress("Relaxation", (k + 1) / rounds)
        if mesh.delaunay:
            make_delaunay_embedded(self._points, self._triangles, self._twin, mesh.locked)
        # The mesh that is returned does not change when this one goes on.
        arrays = self._points, self._triangles.copy(), self._twin.copy()
        return mesh.turned_into(*arrays, near=carrier.faces), self._residual

    def _step(self) -> np.ndarray:
        """The next step (n,3) of the descent."""
        points, normal, fixed = self._points, self._normal, self._start.fixed
        if self._rounds % SAMPLE_EVERY == 0:
            # The energy is another one, but so little that what is remembered of its changes still tells the way.
            self._correction = _sample_correction(points, self._triangles, normal, self._carrier)
            self._best = np.inf
        cells = voronoi_cells(points, self._triangles, self._density**2, self._start.delaunay)
        cells = self._correction.correct(points, cells)
        if cells.energy > self._best * (1 + RISE):
            self._descent.reset()
        self._best = cells.energy
        gradient = _tangential(-2 * cells.moment, normal, fixed)
        step = self._descent.direction(points, gradient, 1 / (2 * np.maximum(cells.mass, 1e-300))[:, None])
        step, self._residual = _bounded(_tangential(step, normal, fixed), cells.shortest, self._triangles)
        return step


def relax_cvt(mesh: WorkingMesh, rounds: int, carrier: SurfaceCarrier) -> Steps[tuple[WorkingMesh, float]]:
    """Relax a mesh on a surface for so many rounds; see `Relaxation`."""
    return (yield from Relaxation(mesh, carrier).run(rounds))


def _tangential(vectors: np.ndarray, normal: np.ndarray, fixed: np.ndarray) -> np.ndarray:
    """The share of vectors (n,3) along the surface, 0 at fixed vertices."""
    along = vectors - np.einsum("ij,ij->i", vectors, normal)[:, None] * normal
    along[fixed] = 0
    return along


@dataclass(frozen=True)
class SampleCorrection:
    """What samples of the surface say of the cells.

    share (n,) in which they are trusted; their mass (n,) and centroid (n,3); crest_mass (n,) and crest_centroid (n,3)
    of the crests to add
    """

    share: np.ndarray
    mass: np.ndarray
    centroid: np.ndarray
    crest_mass: np.ndarray
    crest_centroid: np.ndarray

    def correct(self, points: np.ndarray, cells: VoronoiCells) -> VoronoiCells:
        """Replace cells of points (n,3) by those of samples where these see more, and add the crests."""
        b = self.share
        to_crest = self.crest_centroid - points
        moment = (1 - b)[:, None] * cells.moment + (b * self.mass)[:, None] * (self.centroid - points)
        return VoronoiCells(
            (1 - b) * cells.mass + b * self.mass + self.crest_mass,
            moment + self.crest_mass[:, None] * to_crest,
            cells.energy + float(self.crest_mass @ np.einsum("ij,ij->i", to_crest, to_crest)),
            cells.shortest,
        )


def _sample_correction(
    points: np.ndarray, triangles: np.ndarray, normals: np.ndarray, carrier: SurfaceCarrier
) -> SampleCorrection:
    """Compare the cells of samples of the surface with those of the mesh.

    A tip or a ridge that the triangles cut off weighs too little in their cells, and would lose its vertices more and
    more. The samples are too few for exact cells, but enough to find these places, and to correction there.
    """
    seen, crest = carrier.nearest_sums(points, normals)
    n = len(points)
    covered = vertex_areas(points, triangles)
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    # A few samples a cell are a rough measure; the mean with the neighbours is a better one.
    seen_area = np.bincount(tail, seen.area[head], n) + 2 * seen.area
    ratio = seen_area / np.maximum(np.bincount(tail, covered[head], n) + 2 * covered, 1e-300)
    share = np.clip((ratio - TRUST_FROM) / (TRUST_FULLY - TRUST_FROM), 0, 1) * (seen.mass > 0)
    return SampleCorrection(
        share=share,
        mass=seen.mass,
        centroid=points + seen.moment / np.maximum(seen.mass, 1e-300)[:, None],
        crest_mass=CREST_WEIGHT * crest.mass,
        crest_centroid=points + crest.moment / np.maximum(crest.mass, 1e-300)[:, None],
    )


def _bounded(step: np.ndarray, shortest: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, float]:
    """Steps (n,3) no longer than MAX_STEP of the shortest side (m,) of a triangle around, and their mean in such
    sides."""
    size = np.sqrt(np.einsum("ij,ij->i", step, step))
    shortest = np.maximum(shortest, 1e-6 * shortest.mean())
    share = MAX_STEP * shortest / np.maximum(size.take(triangles.T), 1e-300)
    corner, far = np.nonzero(share < 1)
    least = np.ones(len(step))
    np.minimum.at(least, triangles[far, corner], share[corner, far])
    step = np.nan_to_num(least[:, None] * step, posinf=0.0, neginf=0.0)
    return step, float(np.mean((least * size).take(triangles.T) / shortest))
