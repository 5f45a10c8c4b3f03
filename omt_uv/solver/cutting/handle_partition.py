"""Take bodies with many handles, as plates full of holes, apart into their sides, or into clusters; and thin walls into
both of theirs.

A cut that opens a hundred handles leaves a chart that has no room for the walls between them. A cluster is what is
nearest, over the surface, to its centre: struts come apart half way between their joints, where two centres are equally
near, and creases are far to cross, so that borders rather run along them.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..analysis.feature_edges import fold_angles
from ..mesh.gluing import Gluing, components, corner_classes
from ..mesh.surface import Surface
from ..walls.two_sides import wall_edges
from .component import SMOOTH, SideFinder, Topology, classify
from .crease_sides import hard_sides
from .developable_nets import HARD
from .gluing_facts import seen_parts
from .hole_filling import hole_boundaries

# A component with more handles comes apart.
MANY_HANDLES = 12
# A component falls into so many clusters.
CLUSTERS = 4
# Clusters with more handles than this fall apart again, so often at most.
FEW = 1
ROUNDS = 12
# A step over an edge at a right angle counts so many times.
CREASE = 4.0


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


def wall_pairs(
    surface: Surface, gluing: Gluing, positions: np.ndarray, gone: np.ndarray, search: SideFinder
) -> np.ndarray:
    """Pairs (p,) bool of a gluing, without those that are gone (p,) bool, along which thin walls that are searched come
    apart into their two sides: a cup, a shirt. What has a hard surface, as a board, comes apart along its creases.

    positions (n,3) in a unit box
    """
    found = np.zeros(len(gone), dtype=bool)
    for part, number, creased in seen_parts(surface, gluing, positions, gone, search):
        wall = wall_edges(part.positions, part.triangles, part.pair, part.length, ~np.isfinite(part.cost))
        if wall is not None and not (creased and hard_sides(part) is not None):
            found[number[wall]] = True
    return found


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


def cluster_borders(gluing: Gluing, positions: np.ndarray, one_sided: np.ndarray, crowded: np.ndarray) -> np.ndarray:
    """Pairs (p,) bool between the clusters of the components that the triangles `crowded` (m,) bool make up.

    positions (n,3) of the surface; one_sided (m,) bool: see `component.classify`.
    """
    steps = _steps(gluing, positions)
    # A polygon goes where its first triangle goes.
    _, first, polygon = np.unique(gluing.owner, return_index=True, return_inverse=True)
    gone = np.zeros(len(gluing.first), dtype=bool)
    for _ in range(ROUNDS):
        if not crowded.any():
            break
        label = _nearest_centres(gluing.without(gone), steps[~gone], crowded)[first][polygon.ravel()]
        gone |= label[gluing.first // 3] != label[gluing.second // 3]
        left = gluing.without(gone)
        component_of = components(left)
        crowded = crowded & (classify(left, corner_classes(left), component_of, one_sided).handles > FEW)[component_of]
    return gone


def _steps(gluing: Gluing, positions: np.ndarray) -> np.ndarray:
    """Length (p,) > 0 of the step from triangle to triangle over each pair, longer over creases."""
    triangles = gluing.vertex[gluing.triangles]
    t, s = gluing.first // 3, gluing.second // 3
    fold = np.abs(fold_angles(positions, triangles, np.stack([gluing.first, gluing.second], axis=1)))
    crease = np.clip((fold - SMOOTH) / (np.pi / 2 - SMOOTH), 0, 1)
    centre = positions[triangles].mean(axis=1)
    # A sparse graph takes a step of no length for none.
    return np.linalg.norm(centre[t] - centre[s], axis=1) * (1 + (CREASE - 1) * crease) + 1e-12


def _nearest_centres(gluing: Gluing, steps: np.ndarray, crowded: np.ndarray) -> np.ndarray:
    """The centre (m,), a triangle, that each crowded triangle is nearest to, -1 elsewhere.

    There are CLUSTERS of them in each component, far from each other.
    """
    m = len(crowded)
    component_of = components(gluing)
    graph = csr_matrix((steps, (gluing.first // 3, gluing.second // 3)), shape=(m, m))
    members = np.flatnonzero(crowded)
    number = np.unique(component_of[members], return_inverse=True)[1].ravel()
    far = dijkstra(graph, directed=False, indices=members[np.unique(number, return_index=True)[1]], min_only=True)
    centres = np.zeros(0, dtype=np.int64)
    nearest = np.full(m, -1)
    for _ in range(CLUSTERS):
        order = np.lexsort((far[members], number))
        last = np.append(np.flatnonzero(np.diff(number[order])), len(order) - 1)
        centres = np.append(centres, members[order[last]])
        far, _, nearest = dijkstra(graph, directed=False, indices=centres, min_only=True, return_predecessors=True)
    return np.where(crowded, nearest, -1)
