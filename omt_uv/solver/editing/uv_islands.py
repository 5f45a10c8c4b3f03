"""Find UV islands as charts: faces joined by edges that have equal UVs at both ends, whatever the seams say.

An island may have several boundaries, unlike the charts that are unwrapped.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import DISSOLVE, FoldedUVError, NonManifoldEdgeError, OrientationError, ZeroAreaFaceError
from ..maps.distortion import WELD
from ..mesh.charts import Chart, charts_of
from ..mesh.geometry import face_areas
from ..mesh.gluing import orientations, turn_over
from ..mesh.repair import repaired_gluing, with_area
from ..mesh.surface import Surface, chosen_triangles, side_ends
from ..mesh.topology import graph_components, pair_keys

# Share of its box, in space and in the map, below which an island has no area.
NOTHING = 1e-14


@dataclass(frozen=True)
class Island:
    """A chart and where its vertices are in the UV map, uv (n,2)."""

    chart: Chart
    uv: np.ndarray


@dataclass(frozen=True)
class Islands:
    """Islands, in the order of their first faces, and what had to be repaired for the map."""

    islands: list[Island]
    warnings: tuple[str, ...]


def uv_islands(surface: Surface, uv: np.ndarray, faces: np.ndarray | None = None) -> Islands:
    """Whole islands of UVs (c,2) that contain one of the polygons `faces` (f,) bool; all islands by default.

    Two corners of a vertex are one UV vertex where they are nearer than `distortion.WELD` of the extent of the UVs.
    Islands without area in space and in the map are left out, with a warning.

    Raises
    ------
    FoldedUVError : UVs that are not finite; three faces of an island at one of its edges
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError, OrientationError : broken geometry in these islands
    """
    uv = np.asarray(uv, float)
    welded, origin = _welded(surface, uv)
    if faces is not None:
        label = _labels(welded)
        faces = np.isin(label, label[faces])
    faces, triangles, owner = chosen_triangles(surface, faces)
    wrong = np.unique(owner[~np.isfinite(uv[triangles]).all((1, 2))])
    if len(wrong):
        raise FoldedUVError("The UVs to refine are not finite", kind="face", elements=wrong)
    repaired = repaired_gluing(welded, faces, triangles, owner)
    if len(repaired.torn):
        raise NonManifoldEdgeError(
            "More than two faces of an island meet at an edge",
            remedy="Delete what is doubled, or unwrap these faces anew first",
            kind="edge",
            elements=origin[repaired.torn],
        )
    gluing = repaired.gluing
    turned, one_sided = orientations(gluing, face_areas(surface.positions, surface.corner_vertex[triangles]))
    if one_sided.any():
        raise OrientationError(
            "An island has only one side",
            remedy="Unwrap these faces anew first",
            kind="face",
            elements=np.unique(owner[one_sided]),
        )
    extent = float(np.ptp(surface.positions, axis=0).max())
    islands, nothing = list[Island](), 0
    for chart in charts_of(welded, turn_over(gluing, turned)):
        place = np.empty((len(chart.vertices), 2))
        place[chart.triangles] = uv[chart.corners]
        flat = (face_areas(chart.vertices, chart.triangles).sum() / extent**2, np.ptp(place, axis=0).prod())
        if max(flat) <= NOTHING:
            nothing += len(np.unique(chart.faces))
            continue
        sound, _ = with_area(replace(chart, vertex_ids=origin[chart.vertex_ids]), extent)
        islands.append(Island(sound, place))
    if nothing and not islands:
        raise ZeroAreaFaceError("No face of the UVs has an area", kind="face", elements=np.unique(owner))
    more = (f"{nothing} faces have no area, neither in space nor in the UVs, and stay; {DISSOLVE}",) if nothing else ()
    return Islands(islands, (*repaired.warnings, *more))


def _welded(surface: Surface, uv: np.ndarray) -> tuple[Surface, np.ndarray]:
    """The surface with a vertex for every UV vertex and without seams, and the old vertex of every new one."""
    finite = np.isfinite(uv).all(axis=1)
    extent = np.ptp(uv[finite], axis=0).max() if finite.any() else 0.0
    cell = np.where(finite[:, None], uv, 0.0) / max(extent, np.finfo(float).tiny) / WELD
    # Corners that are nowhere are alone.
    alone = np.where(finite, 0, 1 + np.arange(len(uv)))
    key = np.column_stack([surface.corner_vertex, np.round(cell), alone])
    unique, index = np.unique(key, axis=0, return_inverse=True)
    origin = unique[:, 0].astype(np.int64)
    welded = replace(
        surface,
        positions=surface.positions[origin],
        corner_vertex=index.ravel().astype(np.int64),
        seams=np.zeros((0, 2), np.int64),
        sharp=np.zeros((0, 2), np.int64),
    )
    return welded, origin


def _labels(surface: Surface) -> np.ndarray:
    """Connected part (f,) of every polygon; polygons are joined by common sides."""
    f = len(surface.face_start) - 1
    key = pair_keys(*side_ends(surface))
    polygon = np.repeat(np.arange(f), np.diff(surface.face_start))
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    a, b = polygon[order][same], polygon[order][same + 1]
    return graph_components(a, b, f)[1]
