"""Split a triangle mesh into connected, oriented, manifold components: what can be remeshed.

Vertices and edges that are no manifold are taken apart, faces that look to the wrong side are turned over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...errors import MERGING, OrientationError, ZeroAreaFaceError, plural
from ...mesh.charts import Chart, charts_of
from ...mesh.geometry import bounding_box, face_areas
from ...mesh.gluing import orientations, turn_over
from ...mesh.repair import repaired_gluing
from ...mesh.surface import chosen_triangles, triangle_surface
from ...mesh.topology import euler_characteristic, halfedges, pair_keys, twins
from .coincident_boundaries import join_coincident


@dataclass(frozen=True)
class Component:
    """One component in the common unit box: vertices (n,3), triangles (m,3).

    faces (m,): the input's triangle in which each lies; input_barycentric (m,3,3): where there its corners are;
    features (e,2): pairs of its vertices that are edges to keep; to_reopen: sorted keys of those to be cut afterwards;
    shift (m,3): how far each triangle was moved from its place; members: of a batch, see `component_batch`.
    """

    vertices: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    input_barycentric: np.ndarray
    features: np.ndarray
    to_reopen: np.ndarray
    shift: np.ndarray
    members: tuple[Component, ...] = ()

    @property
    def area(self) -> np.ndarray:
        """Areas (m,) of the triangles, in the unit box."""
        return face_areas(self.vertices, self.triangles)

    @property
    def boundary_edges(self) -> np.ndarray:
        """Keys of the boundary edges, sorted."""
        tail, head = halfedges(self.triangles)
        single = twins(self.triangles) < 0
        return np.sort(pair_keys(tail[single], head[single]))

    @property
    def euler(self) -> int:
        """Euler characteristic: vertices - edges + triangles."""
        return euler_characteristic(len(self.vertices), len(self.triangles), len(self.boundary_edges))

    @property
    def has_lines(self) -> bool:
        """Whether it has boundaries or features."""
        return len(self.boundary_edges) > 0 or len(self.features) > 0

    @property
    def is_disk(self) -> bool:
        """Whether it has one boundary, no handle and no features."""
        return self.euler == 1 and len(self.boundary_edges) > 0 and len(self.features) == 0 and not self.members

    @property
    def is_sphere(self) -> bool:
        """Whether it is closed and has no handle."""
        return len(self.boundary_edges) == 0 and self.euler == 2


@dataclass(frozen=True)
class Components:
    """Components, their unit box (position = centre + size * position in the box), and what was repaired."""

    components: list[Component]
    centre: np.ndarray
    size: float
    warnings: tuple[str, ...]


def split_components(vertices: np.ndarray, triangles: np.ndarray, features: np.ndarray) -> Components:
    """Split a mesh (n,3), (m,3) with edges (e,2) to keep; what lies on one another along a boundary is not apart.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : nothing that could be remeshed
    OrientationError : a component has only one side
    """
    joined = join_coincident(vertices, triangles)
    surface = triangle_surface(vertices, joined.triangles)
    faces, corners, owner = chosen_triangles(surface, None)
    centre, extent = bounding_box(surface.positions[np.unique(surface.corner_vertex)])
    size = extent or 1.0
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
        who = plural(
            int(turned.sum()), "A triangle looked to the wrong side and was", "{} triangles looked there and were"
        )
        warnings.append(f"{who} turned over")
    if len(joined.to_reopen):
        touching = int(np.isin(joined.same, joined.to_reopen).sum())
        warnings.append(f"{touching} boundary vertices lie on one another and stay apart; {MERGING} joins them")
    charts = charts_of(surface, turn_over(repaired.gluing, turned))
    to_reopen = np.sort(pair_keys(joined.to_reopen[:, 0], joined.to_reopen[:, 1]))
    features = joined.same[features]
    kept = np.union1d(pair_keys(features[:, 0], features[:, 1]), to_reopen)
    components = [_component(chart, boxed, kept, to_reopen) for chart in charts]
    sound = [p for p in components if p.area.sum() > 1e-12 * area.sum()]
    if len(sound) < len(components):
        who = plural(len(components) - len(sound), "A part without area was", "{} parts without area were")
        warnings.append(f"{who} left out")
    return Components(components=sound, centre=centre, size=size, warnings=tuple(warnings))


def _component(chart: Chart, boxed: np.ndarray, features: np.ndarray, to_reopen: np.ndarray) -> Component:
    tail, head = halfedges(chart.triangles)
    key = pair_keys(chart.vertex_ids[tail], chart.vertex_ids[head])
    kept = np.isin(key, features)
    rows = np.unique(np.sort(np.stack([tail[kept], head[kept]], axis=1), axis=1), axis=0)
    cut = np.isin(key, to_reopen)
    mine = np.unique(pair_keys(tail[cut], head[cut]))
    m = len(chart.triangles)
    corners, shift = np.tile(np.eye(3), (m, 1, 1)), np.zeros((m, 3))
    return Component(
        vertices=boxed[chart.vertex_ids],
        triangles=chart.triangles,
        faces=chart.faces,
        input_barycentric=corners,
        features=rows.reshape(-1, 2),
        to_reopen=mine,
        shift=shift,
    )
