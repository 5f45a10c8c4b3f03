"""The connected, oriented, manifold parts of a triangle mesh: what can be remeshed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import MERGING, OrientationError, ZeroAreaFaceError
from ...mesh.charts import Chart, charts_of
from ...mesh.geometry import face_areas
from ...mesh.gluing import orientations, turn_over
from ...mesh.repair import repaired_gluing
from ...mesh.surface import chosen_triangles, triangle_surface
from ...mesh.topology import halfedges, pair_keys, twins
from .coincident_boundaries import join_touching


@dataclass(frozen=True)
class Part:
    """One part in a unit box: vertices (n,3), triangles (m,3).

    faces (m,): the input's triangle in which each lies; within (m,3,3): barycentric coordinates there of its corners;
    features (e,2): pairs of its vertices that are edges to keep; slits: sorted keys of those to be opened afterwards;
    shift (m,3): how far each triangle was moved from its place; members: the parts of a pile, see `piles.py`.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    within: np.ndarray
    features: np.ndarray
    slits: np.ndarray
    shift: np.ndarray
    members: tuple[Part, ...] = ()

    @property
    def area(self) -> np.ndarray:
        """Areas (m,) of the triangles, in the unit box."""
        return face_areas(self.vertices, self.triangles)

    @property
    def rim(self) -> np.ndarray:
        """Keys of the boundary edges, sorted."""
        tail, head = halfedges(self.triangles)
        open_ = twins(self.triangles) < 0
        return np.sort(pair_keys(tail[open_], head[open_]))

    @property
    def euler(self) -> int:
        """Euler characteristic: vertices - edges + triangles."""
        edges = (3 * len(self.triangles) + len(self.rim)) // 2
        return len(self.vertices) - edges + len(self.triangles)

    @property
    def lined(self) -> bool:
        """Whether it has boundaries or features."""
        return len(self.rim) > 0 or len(self.features) > 0

    @property
    def disk(self) -> bool:
        """Whether it has one boundary, no handle and no features."""
        return self.euler == 1 and len(self.rim) > 0 and len(self.features) == 0 and not self.members

    @property
    def spherical(self) -> bool:
        """Whether it is closed and has no handle."""
        return len(self.rim) == 0 and self.euler == 2


@dataclass(frozen=True)
class Parts:
    """The parts, their common unit box (position = centre + size * part position), and what was repaired."""

    parts: list[Part]
    centre: np.ndarray
    size: float
    warnings: tuple[str, ...]


def split_parts(vertices: np.ndarray, triangles: np.ndarray, features: np.ndarray) -> Parts:
    """Parts of a mesh (n,3), (m,3) with edges (e,2) to keep; what only slits part is one.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : nothing that could be remeshed
    OrientationError : a part has only one side
    """
    joined = join_touching(vertices, triangles)
    surface = triangle_surface(vertices, joined.triangles)
    faces, corners, owner = chosen_triangles(surface, None)
    used = surface.positions[np.unique(surface.corner_vertex)]
    low, high = used.min(axis=0), used.max(axis=0)
    # Halves first: the difference of two huge numbers may be infinite.
    size = 2 * float((high / 2 - low / 2).max()) or 1.0
    centre = low / 2 + high / 2
    boxed = surface.positions / size - centre / size
    area = face_areas(boxed, surface.corner_vertex[corners])
    if not area.sum() > 1e-20:
        raise ZeroAreaFaceError("No face has an area", kind="face", elements=np.unique(owner))
    repaired = repaired_gluing(surface, faces, corners, owner)
    turned, one_sided = orientations(repaired.gluing, area)
    if one_sided.any():
        raise OrientationError(
            "A part of the mesh has only one side, like a Moebius strip",
            remedy="Cut it open, or delete the faces where it closes",
            kind="face",
            elements=np.unique(owner[one_sided]),
        )
    warnings = [w.replace(", mapped apart", ", remeshed apart").replace(" for the map", "") for w in repaired.warnings]
    if turned.any():
        warnings.append(f"{int(turned.sum())} triangles looked to the wrong side and were turned over")
    if len(joined.slits):
        touching = int(np.isin(joined.same, joined.slits).sum())
        warnings.append(f"{touching} boundary vertices lie on one another and stay apart; {MERGING} joins them")
    charts = charts_of(surface, turn_over(repaired.gluing, turned))
    slits = np.sort(pair_keys(joined.slits[:, 0], joined.slits[:, 1]))
    features = joined.same[features]
    kept = np.union1d(pair_keys(features[:, 0], features[:, 1]), slits)
    parts = [_part(chart, boxed, kept, slits) for chart in charts]
    sound = [p for p in parts if p.area.sum() > 1e-12 * area.sum()]
    if len(sound) < len(parts):
        warnings.append(f"{len(parts) - len(sound)} parts without area were left out")
    return Parts(sound, centre, size, tuple(warnings))


def _part(chart: Chart, boxed: np.ndarray, features: np.ndarray, slits: np.ndarray) -> Part:
    tail, head = halfedges(chart.triangles)
    key = pair_keys(chart.vertex_ids[tail], chart.vertex_ids[head])
    kept = np.isin(key, features)
    rows = np.unique(np.sort(np.stack([tail[kept], head[kept]], axis=1), axis=1), axis=0)
    open_ = np.isin(key, slits)
    mine = np.unique(pair_keys(tail[open_], head[open_]))
    m = len(chart.triangles)
    within, shift = np.tile(np.eye(3), (m, 1, 1)), np.zeros((m, 3))
    positions = boxed[chart.vertex_ids]
    return Part(positions, chart.triangles, chart.faces, within, rows.reshape(-1, 2), mine, shift)
