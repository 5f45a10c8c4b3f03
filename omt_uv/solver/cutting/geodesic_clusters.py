"""Bodies of many handles and no sides to take apart, as sponges, lattices and cages, in fragments of few handles.

A fragment is what is nearest, over the surface, to its middle. Struts come apart half way between their joints, where
two middles are equally near, and creases are far to cross, so that borders rather run along them.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..mesh.gluing import Gluing, components, corner_classes
from .component import SMOOTH, classify, fold_angles

# A part falls into so many fragments, and those with more handles than FEW again, so often at most.
PIECES, FEW, ROUNDS = 4, 1, 12
# A step over an edge at a right angle counts so many times.
CREASE = 4.0


def fragment_pairs(gluing: Gluing, positions: np.ndarray, one_sided: np.ndarray, crowded: np.ndarray) -> np.ndarray:
    """Pairs (p,) bool between the fragments of the parts that the triangles `crowded` (m,) bool make up.

    positions (n,3) of the surface; one_sided (m,) bool: see `piece.classify`.
    """
    steps = _steps(gluing, positions)
    # A polygon goes where its first triangle goes.
    _, first, polygon = np.unique(gluing.owner, return_index=True, return_inverse=True)
    gone = np.zeros(len(gluing.first), dtype=bool)
    for _ in range(ROUNDS):
        if not crowded.any():
            break
        label = _middles(gluing.without(gone), steps[~gone], crowded)[first][polygon.ravel()]
        gone |= label[gluing.first // 3] != label[gluing.second // 3]
        left = gluing.without(gone)
        part = components(left)
        crowded = crowded & (classify(left, corner_classes(left), part, one_sided).handles > FEW)[part]
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


def _middles(gluing: Gluing, steps: np.ndarray, crowded: np.ndarray) -> np.ndarray:
    """The middle (m,), a triangle, that each crowded triangle is nearest to: PIECES in every part, far from each other.

    -1 elsewhere.
    """
    m = len(crowded)
    part = components(gluing)
    graph = csr_matrix((steps, (gluing.first // 3, gluing.second // 3)), shape=(m, m))
    members = np.flatnonzero(crowded)
    number = np.unique(part[members], return_inverse=True)[1].ravel()
    far = dijkstra(graph, directed=False, indices=members[np.unique(number, return_index=True)[1]], min_only=True)
    middles = np.zeros(0, dtype=np.int64)
    nearest = np.full(m, -1)
    for _ in range(PIECES):
        order = np.lexsort((far[members], number))
        last = np.append(np.flatnonzero(np.diff(number[order])), len(order) - 1)
        middles = np.append(middles, members[order[last]])
        far, _, nearest = dijkstra(graph, directed=False, indices=middles, min_only=True, return_predecessors=True)
    return np.where(crowded, nearest, -1)
