"""Find the corners of bodies whose flat sides are joined by hard edges or by narrow bands, and how to cut through them.

A bevel rounds an edge to a band that unrolls, and a corner to a small patch that holds all of its curvature. Cut to the
middle of every such patch, along the bands, the body unrolls as if it had no bevels: its flat sides stay as they are,
and only the patches, which are small, are sheared. At a saddle the angles of the sides make more than a full turn, so
that the side with a reflex corner there has to come free of both its neighbours.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import angles_from_lengths, halfedge_lengths, lengths
from ..mesh.topology import graph_components
from .component import CutComponent

# Curved vertices belong to one corner if edges join them that are at most so long, next to the side of a square with
# the area of the body.
LINK = 0.1
# Of a body with such corners they take at most this share of the area, ...
SMALL = 0.16
# ... are at most so many, ...
MOST_CORNERS = 256
# ... and each holds at least so much curvature in sum, in radians; what holds less is hardly sheared uncut.
CURVED = 0.2
# A vertex is in the middle of a patch, too, that is so many times as far from it as the nearest: around a face there.
AS_NEAR = 1.25
# Corners of sides with a larger angle, in radians, are reflex.
REFLEX = np.pi + 0.1
# An edge beside such a corner counts this share of its length.
BESIDE_REFLEX = 0.5
# Edges that stand upright, and those in front, count more by these shares at most: of nets that are equally long, the
# one is taken whose sides stand in a row, and whose top and bottom hang on the front. Noise is far below.
UPRIGHT = 0.01
FRONT = 0.004


def rounded_corners(component: CutComponent, curvature: np.ndarray, area: np.ndarray) -> np.ndarray | None:
    """The vertices (k,) in the middle of each small patch with curvature (n,), where the surface is flat elsewhere: one
    vertex, or those around a face.

    None if the curved patches, of triangles with areas (m,), are not small.
    """
    whole = float(area.sum())
    curved = np.abs(curvature) > 1e-6
    short = (component.length <= LINK * np.sqrt(whole)) & curved[component.ends].all(axis=1)
    tail, head = component.ends[short].T
    _, patch = graph_components(tail, head, component.vertex_count)
    patch = np.where(curved, patch, -1)
    corner = patch[component.triangles]
    inside = (corner[:, :1] == corner).all(axis=1) & (corner[:, 0] >= 0)
    if area[inside].sum() > SMALL * whole:
        return None
    total = np.bincount(patch[curved], curvature[curved], component.vertex_count)
    kept = np.flatnonzero(np.abs(total) > CURVED)
    # What is curved and in no patch is spread over the body.
    if len(kept) > MOST_CORNERS or np.abs(curvature[curved & ~np.isin(patch, kept)]).sum() > CURVED:
        return None
    weight = np.abs(curvature)
    amount = np.maximum(np.bincount(patch[curved], weight[curved], component.vertex_count), 1e-30)
    moments = [np.bincount(patch[curved], (weight * x)[curved], component.vertex_count) for x in component.positions.T]
    middle = np.stack(moments, axis=1) / amount[:, None]
    off = np.where(curved, lengths(component.positions - middle[patch]), np.inf)
    least = np.full(component.vertex_count, np.inf)
    np.minimum.at(least, patch[curved], off[curved])
    nearest = curved & (off <= AS_NEAR * least[patch]) & np.isin(patch, kept)
    return np.flatnonzero(nearest)


def net_factors(component: CutComponent, folded: np.ndarray) -> np.ndarray:
    """Factor (e,) on the cost of edges, of which some are folded (e,) bool, for nets as an artist lays them out."""
    vector = component.positions[component.ends[:, 1]] - component.positions[component.ends[:, 0]]
    upright = np.abs(vector[:, 2]) / np.maximum(component.length, 1e-30)
    depth = component.positions[component.ends, 1].mean(axis=1)
    extent = max(float(np.ptp(depth)), 1e-30) if len(depth) else 1.0
    factor = 1 + UPRIGHT * upright + FRONT * (depth.max(initial=0.0) - depth) / extent
    return factor * np.where(_beside_reflex(component, folded), BESIDE_REFLEX, 1.0)


def _beside_reflex(component: CutComponent, folded: np.ndarray) -> np.ndarray:
    """Which folded edges (e,) bool end at a reflex corner of one of their sides, (e,) bool."""
    m, n = len(component.triangles), component.vertex_count
    triangle = component.pair // 3
    one, other = triangle[~folded].T
    _, side = graph_components(one, other, m)
    # Angles at the vertices, in their order.
    angle = angles_from_lengths(halfedge_lengths(component.positions, component.triangles).reshape(-1, 3))[:, [1, 2, 0]]
    key = side[:, None] * n + component.triangles
    keys, index = np.unique(key, return_inverse=True)
    reflex = keys[np.bincount(index.ravel(), angle.ravel()) > REFLEX]
    beside = [np.isin(side[triangle[:, i]] * n + component.ends[:, j], reflex) for i in range(2) for j in range(2)]
    return folded & np.any(beside, axis=0)
