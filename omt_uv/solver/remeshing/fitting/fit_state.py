"""Hold a mesh on its way to a surface, and move it by steps of least squares, flips, and patches of other meshes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.closest_point import FEW_CANDIDATES, ClosestPoint, ClosestPointTracker
from ...mesh.geometry import vertex_normals
from ...mesh.topology import twins
from ..edits.delaunay_flips import make_delaunay_embedded
from ..edits.working_mesh import WorkingMesh
from ..relaxation.surface_samples import SurfaceSamples, join_samples
from ..relaxation.voronoi_cells import voronoi_cells
from .closest_pairs import ClosestPairs, Pairing, PairingStart
from .least_squares import DistanceWeighting, displacements

# Share of an edge beyond which no vertex goes from the surface.
TETHER = 0.15
# Share of an edge below which distances have no direction but the normal's.
CLOSE = 1e-3


@dataclass(frozen=True)
class PatchSource:
    """Which vertices (k,) and faces (l,) of a mesh are taken over from another state's, from_vertices (k,) and
    from_faces (l,), and the new triangles (l,3) in numbers of the mesh."""

    vertices: np.ndarray
    from_vertices: np.ndarray
    faces: np.ndarray
    from_faces: np.ndarray
    triangles: np.ndarray


class FitState:
    """A mesh near a surface with a density (m,) of its triangles, moved step by step.

    memory : finds the closest points of its vertices; outer (n,) bool: vertices that no new edge shall join; recent:
    the pairs before the last step
    """

    recent: ClosestPairs

    def __init__(
        self,
        mesh: WorkingMesh,
        pairing: Pairing,
        density: np.ndarray,
        memory: ClosestPointTracker,
        outer: np.ndarray | None = None,
    ):
        self.start, self.pairing, self.index, self.density = mesh, pairing, pairing.index, density
        self.points, self.triangles = mesh.points, mesh.triangles.copy()
        self.twin, self.outer, self._memory = mesh.twin.copy(), outer, memory
        self._locate()

    def _locate(self) -> None:
        self.on = self._memory(self.index, self.points, vertex_normals(self.points, self.triangles))

    @property
    def mesh(self) -> WorkingMesh:
        """The mesh as it is now."""
        return self.start.turned_into(self.points, self.triangles, self.twin, near=self.on.faces)

    def pairs(self) -> ClosestPairs:
        """Pair closest points of mesh and surface."""
        return self.pairing(self.points, self.triangles, self.on.points, self.twin)

    def place(self, points: np.ndarray) -> None:
        """Put the vertices at points (n,3)."""
        self.points = points
        self._locate()

    def step(self, rms: float | None = None, fixed_now: np.ndarray | None = None, keep_centroids: bool = False) -> bool:
        """Bring pairs together by moves of the vertices, see `least_squares.displacements`, and flip edges to Delaunay.

        rms : the usual distance, that of the pairs by default; fixed_now (n,) bool: vertices that stay this time. False
        if there are no such moves in double precision.
        """
        fixed_now = self.start.fixed if fixed_now is None else fixed_now
        points, triangles, spacing = self.points, self.triangles, self.index.spacing
        pairs = self.recent = self.pairs()
        cells = voronoi_cells(points, triangles, self.density[self.on.faces] ** 2, self.start.delaunay)
        to_centroid = cells.moment / np.maximum(cells.mass, 1e-300)[:, None]
        weighting = DistanceWeighting(CLOSE * spacing, pairs.rms if rms is None else rms, keep_centroids)
        moves = displacements(points, triangles, self.twin, fixed_now, pairs, to_centroid, weighting)
        if not np.isfinite(moves).all():
            return False
        self.points = points + moves
        self._locate()
        self.points = np.where(fixed_now[:, None], points, _tethered(self.points, self.on.points, TETHER * spacing))
        self.flip()
        return True

    def flip(self) -> None:
        """Flip edges to Delaunay, if the mesh is one of these."""
        if self.start.delaunay:
            make_delaunay_embedded(self.points, self.triangles, self.twin, self.start.locked, outer=self.outer)

    def add_samples(self, extra: SurfaceSamples, places: np.ndarray) -> None:
        """Pair more samples of the surface from now on, and these places (r,3) of the mesh's triangles."""
        mesh = ClosestPoint(self.points, self.triangles, self.index.spacing, self.twin, even=True)
        start = PairingStart(
            mesh_faces=np.append(self.pairing.mesh_faces, mesh(extra.points, extra.normals, FEW_CANDIDATES).faces),
            surface_faces=self.pairing.surface_faces_for(places),
            area_per_vertex=self.pairing.area_per_vertex,
            places=places,
        )
        self.pairing = Pairing(self.index, join_samples(self.pairing.samples, extra), start)

    def take_over(self, other: FitState, patches: PatchSource, pairs: ClosestPairs) -> None:
        """Replace patches by those of another state, and go on from these pairs."""
        points = self.points.copy()
        points[patches.vertices] = other.points[patches.from_vertices]
        self.points = points
        self.triangles[patches.faces] = patches.triangles
        self.twin = twins(self.triangles)
        # Overwritten in place: the memory of closest points walks on from the same faces.
        for mine, theirs in (
            (self.on.points, other.on.points),
            (self.on.faces, other.on.faces),
            (self.on.barycentric, other.on.barycentric),
        ):
            mine[patches.vertices] = theirs[patches.from_vertices]
        self.pairing.take_over(pairs, patches.faces, other.pairing, patches.from_faces)


def _tethered(points: np.ndarray, on: np.ndarray, longest: float) -> np.ndarray:
    """Points (n,3) no farther than that from their closest ones on the surface (n,3).

    Few distances see a vertex at a tip, and what they say in a straight line may lead far out.
    """
    offset = points - on
    distance = np.sqrt(np.einsum("ni,ni->n", offset, offset))
    return on + offset * np.minimum(1, longest / np.maximum(distance, 1e-300))[:, None]
