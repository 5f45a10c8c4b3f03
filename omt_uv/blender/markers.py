"""Read what turns a globe and what it gives more room, from vertex groups or the vertices picked last in Edit Mode."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

import bmesh
import numpy as np

from ..pipelines.globe import Markers
from ..solver.analysis.density import from_polygons, means_of_corners, painted_density
from ..solver.globe.rotation import MarkerError
from .vertex_groups import GroupError, group_weights
from .weights import region_weights

PICKED = 3


def group_markers(objects: list, pole: str, meridian: str = "", side: str = "") -> list[Markers | None]:
    """Markers of each object by the names of vertex groups, None for objects without the group of the pole.

    Raises
    ------
    GroupError : no object has one of these groups; MarkerError : a meridian without a pole
    """
    if not pole:
        if meridian or side:
            raise MarkerError("A marker of the meridian needs one of the pole. Name its vertex group as well.")
        return [None] * len(objects)
    weights = {name: [group_weights(obj, name) for obj in objects] for name in (pole, meridian, side) if name}
    for name, found in weights.items():
        if all(w is None for w in found):
            names = ", ".join(obj.name for obj in objects)
            raise GroupError(f"{names}: There is no vertex group {name!r}. Choose one, or leave it empty.")
    none = [None] * len(objects)
    rows = zip(weights[pole], weights.get(meridian, none), weights.get(side, none), strict=True)
    return [None if first is None else Markers(first, second, third) for first, second, third in rows]


def picked_markers(obj: bpy.types.Object) -> Markers:
    """Markers from the vertices of an object in Edit Mode picked last: pole, meridian, and, if there are three, east.

    Raises
    ------
    MarkerError : not in Edit Mode, or fewer than two vertices were picked one by one
    """
    picked: list[int] = []
    if obj.mode == "EDIT":
        history = bmesh.from_edit_mesh(obj.data).select_history
        picked = [element.index for element in history if isinstance(element, bmesh.types.BMVert)]
    if len(picked) < 2:
        raise MarkerError(
            "Pick the markers one after the other in Edit Mode, with vertex select: first the pole, then a vertex "
            "on the central meridian, and, if you like, one east of it."
        )
    n = len(obj.data.vertices)
    return Markers(*(np.bincount([vertex], minlength=n).astype(float) for vertex in picked[-PICKED:]))


def globe_densities(pairs: Sequence, name: str, factor: float) -> list[np.ndarray | None]:
    """Densities (m,) of the triangles for each pair of object and Reading: `factor` where the weight is 1, 1 where it
    is 0.

    name : a vertex group, "saliency" or "curvature", see `weights.region_weights`; empty for no densities

    Raises
    ------
    GroupError, Refusal : no such group or score; MeshError : a factor that is not positive
    """
    if not name:
        return [None] * len(pairs)
    weights = region_weights(pairs, name)
    densities: list[np.ndarray | None] = []
    for w, (_, reading) in zip(weights, pairs, strict=True):
        surface = reading.surface
        mean = means_of_corners(w, surface.corner_vertex, surface.face_start)
        densities.append(painted_density(from_polygons(mean, surface.triangle_face), factor))
    return densities
