"""A mesh on its way to a surface."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.closest_point import ClosestPointTracker
from ...mesh.geometry import vertex_normals
from ...mesh.topology import twins
from ..edits.delaunay_flips import make_delaunay_embedded
from ..edits.working_mesh import Draft
from ..relaxation.voronoi_cells import voronoi_cells
from .closest_pairs import Pairing, Pairs
from .least_squares import displacements

# Vertices stay within this share of an edge of the surface.
TETHER = 0.15
# Distances below this share of an edge have no direction but the normal's.
CLOSE = 1e-3


class Fitting:
    """A mesh near a surface with a density (m,) of its triangles, moved step by step.

    home : finds the closest points of its vertices; outer (n,) bool: vertices that no new edge shall join; recent: the
    pairs before the last step
    """

    recent: Pairs

    def __init__(
        self,
        draft: Draft,
        pairing: Pairing,
        density: np.ndarray,
        home: ClosestPointTracker,
        outer: np.ndarray | None = None,
    ):
        self.start, self.pairing, self.index, self.density = draft, pairing, pairing.index, density
        self.points, self.triangles = draft.points, draft.triangles.copy()
        self.twin, self.outer, self._home = twins(self.triangles), outer, home
        self._look()

    def _look(self) -> None:
        self.on = self._home(self.index, self.points, vertex_normals(self.points, self.triangles))

    @property
    def draft(self) -> Draft:
        """The mesh as it is now."""
        return replace(self.start, points=self.points, triangles=self.triangles)

    def pairs(self) -> Pairs:
        """Closest points of mesh and surface."""
        return self.pairing(self.points, self.triangles, self.on.points)

    def place(self, points: np.ndarray) -> None:
        """Put the vertices at points (n,3)."""
        self.points = points
        self._look()

    def step(self, usual: float | None = None, held: np.ndarray | None = None, firm: bool = False) -> bool:
        """Bring pairs together by moves of all vertices but the fixed ones, or those `held` (n,) bool; edges flip to
        Delaunay. See `displacement.displacements`.

        usual : the usual distance; that of the pairs by default. False if there are no such moves in double precision.
        """
        held = self.start.fixed if held is None else held
        points, triangles, spacing = self.points, self.triangles, self.index.spacing
        pairs = self.recent = self.pairs()
        cells = voronoi_cells(points, triangles, self.density[self.on.faces] ** 2, self.start.delaunay)
        pull = cells.moment / np.maximum(cells.mass, 1e-300)[:, None]
        usual = pairs.usual if usual is None else usual
        off = displacements(points, triangles, self.twin, held, pairs, pull, CLOSE * spacing, usual, firm)
        if not np.isfinite(off).all():
            return False
        self.points = points + off
        self._look()
        self.points = np.where(held[:, None], points, _tethered(self.points, self.on.points, TETHER * spacing))
        self.flip()
        return True

    def flip(self) -> None:
        """Flip edges to Delaunay, if the mesh is one of these."""
        if self.start.delaunay:
            make_delaunay_embedded(self.points, self.triangles, self.twin, self.start.locked, outer=self.outer)


def _tethered(points: np.ndarray, on: np.ndarray, longest: float) -> np.ndarray:
    """Points (n,3) no farther than that from their closest ones on the surface (n,3).

    Few distances see a vertex at a tip, and what they say in a straight line may lead far out.
    """
    way = points - on
    distance = np.sqrt(np.einsum("ni,ni->n", way, way))
    return on + way * np.minimum(1, longest / np.maximum(distance, 1e-300))[:, None]
