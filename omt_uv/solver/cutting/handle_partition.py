"""Bodies with many handles, as plates full of holes, taken apart into their sides, or into fragments.

A cut that opens a hundred handles leaves a chart that has no room for the walls between them.
"""

from __future__ import annotations

import numpy as np

from ..mesh.gluing import Gluing, components, corner_classes
from .component import Kind, classify, fold_angles
from .developable_nets import HARD
from .geodesic_clusters import fragment_pairs
from .hole_filling import hole_rims

# A part with more handles comes apart.
MANY_HANDLES = 12


def parting_pairs(gluing: Gluing, positions: np.ndarray, one_sided: np.ndarray) -> np.ndarray:
    """Pairs (p,) bool along which parts with more than MANY_HANDLES fall apart.

    These are the hard edges around the holes of sides: from a plate come away the walls of the holes through it,
    each in one piece. Where that leaves as many handles, a part falls into fragments instead.
    positions (n,3) of the surface; one_sided (m,) bool: see `piece.classify`.
    """
    part, whole = _kinds(gluing, one_sided)
    crowded = (whole.handles > MANY_HANDLES)[part]
    if not crowded.any():
        return np.zeros(len(gluing.first), dtype=bool)
    gone, settled = _sides(gluing, positions, one_sided, crowded)
    return gone | fragment_pairs(gluing, positions, one_sided, crowded & ~settled)


def _sides(gluing: Gluing, positions, one_sided, crowded) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (p,) bool between the walls of holes and the sides that have these, and the triangles (m,) bool of parts
    that have few handles without them; others are left alone."""
    part = components(gluing)
    pair = np.stack([gluing.first, gluing.second], axis=1)
    hard = np.abs(fold_angles(positions, gluing.vertex[gluing.triangles], pair)) > HARD
    hard &= crowded[gluing.first // 3]
    around = np.zeros(3 * len(gluing.triangles), dtype=bool)
    around[hole_rims(positions, gluing.without(hard), one_sided)[0]] = True
    gone = hard & around[pair].any(axis=1)
    # What ends inside of a side is a slit, which parts nothing.
    side = components(gluing.without(gone))[pair // 3]
    gone &= side[:, 0] != side[:, 1]
    side, left = _kinds(gluing.without(gone), one_sided)
    handles = np.zeros(int(part.max()) + 1, dtype=np.int64)
    np.maximum.at(handles, part, left.handles[side])
    settled = (handles <= MANY_HANDLES)[part]
    return gone & settled[gluing.first // 3], settled


def _kinds(gluing: Gluing, one_sided: np.ndarray) -> tuple[np.ndarray, Kind]:
    """The part (m,) of every triangle, and the kinds of the parts."""
    part = components(gluing)
    return part, classify(gluing, corner_classes(gluing), part, one_sided)
