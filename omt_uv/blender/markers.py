"""Read what turns a globe and what it gives more room, from vertex groups or the vertices picked last in Edit Mode."""

from __future__ import annotations

from collections.abc import Sequence

import bpy

import bmesh
import numpy as np

from ..pipelines.globe import Markers
from ..solver.analysis.density import check_region, from_polygons, means_of_corners, painted_density
from ..solver.errors import WeightError
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
    is 0; None where it is the same everywhere, as of objects that are not painted beside one that is.

    name : a vertex group, "saliency" or "curvature", see `weights.region_weights`; empty for no densities

    Raises
    ------
    GroupError, Refusal : no such group or score; MeshError : a factor that is not positive, no object with a region
    and a rest
    """
    if not name:
        return [None] * len(pairs)
    found = []
    for w, (_, reading) in zip(region_weights(pairs, name), pairs, strict=True):
        surface = reading.surface
        mean = means_of_corners(w, surface.corner_vertex, surface.face_start)
        found.append(from_polygons(mean, surface.triangle_face))
    # Every part has the whole texture to itself: what one has is of no matter to another.
    varies = [bool((region != region[:1]).any()) for region in found]
    if not any(varies):
        check_region(np.concatenate(found))
        raise WeightError("No object has both a part of the region and a rest", "Paint a part of an object")
    return [painted_density(r, factor) if varied else None for r, varied in zip(found, varies, strict=True)]
