"""Take bodies with many handles, as plates full of holes, apart into their sides, or into clusters.

A cut that opens a hundred handles leaves a chart that has no room for the walls between them.
"""

from __future__ import annotations

import numpy as np

from ..analysis.feature_edges import fold_angles
from ..mesh.gluing import Gluing, components, corner_classes
from .component import Topology, classify
from .developable_nets import HARD
from .geodesic_clusters import cluster_borders
from .hole_filling import hole_boundaries

# A component with more handles comes apart.
MANY_HANDLES = 12


def partition_pairs(gluing: Gluing, positions: np.ndarray, one_sided: np.ndarray) -> np.ndarray:
    """Pairs (p,) bool along which components with more than MANY_HANDLES fall apart.

    These are the hard edges around the holes of sides: from a plate come away the walls of the holes through it,
    each in one. Where that leaves as many handles, a component falls into clusters instead.
    positions (n,3) of the surface; one_sided (m,) bool: see `component.classify`.
    """
    component_of, whole = _topologies(gluing, one_sided)
    crowded = (whole.handles > MANY_HANDLES)[component_of]
    if not crowded.any():
        return np.zeros(len(gluing.first), dtype=bool)
    gone, settled = _sides(gluing, positions, one_sided, crowded)
    return gone | cluster_borders(gluing, positions, one_sided, crowded & ~settled)


def _sides(gluing: Gluing, positions, one_sided, crowded) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (p,) bool between the walls of holes and the sides that have these, and the triangles (m,) bool of
    components that have few handles without them; others are left alone."""
    component_of = components(gluing)
    pair = np.stack([gluing.first, gluing.second], axis=1)
    hard = np.abs(fold_angles(positions, gluing.vertex[gluing.triangles], pair)) > HARD
    hard &= crowded[gluing.first // 3]
    around = np.zeros(3 * len(gluing.triangles), dtype=bool)
    around[hole_boundaries(positions, gluing.without(hard), one_sided)[0]] = True
    gone = hard & around[pair].any(axis=1)
    # What ends inside of a side is a slit, which parts nothing.
    side = components(gluing.without(gone))[pair // 3]
    gone &= side[:, 0] != side[:, 1]
    side, left = _topologies(gluing.without(gone), one_sided)
    handles = np.zeros(int(component_of.max()) + 1, dtype=np.int64)
    np.maximum.at(handles, component_of, left.handles[side])
    settled = (handles <= MANY_HANDLES)[component_of]
    return gone & settled[gluing.first // 3], settled


def _topologies(gluing: Gluing, one_sided: np.ndarray) -> tuple[np.ndarray, Topology]:
    """The component (m,) of every triangle, and the topology of the components."""
    component_of = components(gluing)
    return component_of, classify(gluing, corner_classes(gluing), component_of, one_sided)
