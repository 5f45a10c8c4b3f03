"""Tell what decides where and whether a gluing is cut: costs of edges, curvature of components, marked seams."""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import angle_defects, angles_from_lengths, halfedge_lengths
from ..mesh.gluing import Gluing
from ..mesh.surface import Surface, is_seam, is_sharp
from ..mesh.topology import halfedges, pair_keys
from .component import SEAM, SHARP


def cost_factors(surface: Surface, gluing: Gluing) -> np.ndarray:
    """Factor (p,) on the cost of cutting each pair: less where the artist marked a seam or a sharp edge.

    What cannot be oriented is rather cut where its faces look to opposite sides: then none has to be turned over.
    """
    key = pair_keys(*gluing.ends(gluing.first))
    factor = np.where(is_sharp(surface, key) | gluing.parallel(), SHARP, 1.0)
    factor[is_seam(surface, key)] = SEAM
    return factor


def total_curvature(gluing: Gluing, corner_class: np.ndarray, component_of: np.ndarray, positions) -> np.ndarray:
    """Curvature (k,) of every component off its boundary, in radians, summed without sign."""
    classes = corner_class[gluing.triangles]
    n = int(classes.max()) + 1
    length = halfedge_lengths(positions, gluing.vertex[gluing.triangles]).reshape(-1, 3)
    tail, head = halfedges(classes)
    open_ = _open(gluing)
    boundary = np.unique(np.concatenate([tail[open_], head[open_]]))
    curvature = np.abs(angle_defects(classes, angles_from_lengths(length), boundary, n))
    curvature[boundary] = 0
    vertices, where = np.unique(classes, return_index=True)
    return np.bincount(component_of[where // 3], curvature[vertices], int(component_of.max()) + 1)


def marked_triangles(surface: Surface, gluing: Gluing) -> np.ndarray:
    """Triangles (t,) beside a marked seam that has the surface on both sides."""
    key = pair_keys(*gluing.ends(np.arange(3 * len(gluing.triangles))))
    open_ = _open(gluing) & is_seam(surface, key)
    keys, count = np.unique(key[open_], return_counts=True)
    return np.flatnonzero(open_ & np.isin(key, keys[count > 1])) // 3


def _open(gluing: Gluing) -> np.ndarray:
    """Halfedges (3m,) bool that are joined to none."""
    open_ = np.ones(3 * len(gluing.triangles), dtype=bool)
    open_[gluing.first] = open_[gluing.second] = False
    return open_
