"""Take pockets off a face before any seam is searched: the bag of a mouth, a socket.

Nobody sees what lies within, and it shears whatever it hangs on; but a seam that opens it has to come across the face,
and so has one to the hole that it leaves when it comes apart only later. An artist cuts it off behind the lips or lids,
and leaves the hole open: see `cutting/hole_filling`.
"""

from __future__ import annotations

import numpy as np

from ..analysis.seam_costs import SeamCosts
from ..linalg.minimum_cut import capacities
from ..mesh.geometry import edge_lengths, face_areas
from ..mesh.surface import Surface, chosen_triangles
from ..mesh.topology import graph_components
from ..seams.parting import PolygonGraph, minimum_cut

# A polygon is within a face by more than this, certainly not by less than the second, and certainly by more than the
# third.
WITHIN = 0.5
OUTSIDE = 0.05
CORE = 0.95
# A pocket has this share of its component at least, before and after it is cut off, and at most.
LEAST_POCKET = 0.01
MOST_POCKET = 0.25
# The cut around it is no longer than so many times the side of a square with its area: around half a sphere it is 2.5
# of these, and what is no deeper unfolds beside what it hangs on.
DEEP = 2.0
# So many are taken off at most, the largest first.
MOST_POCKETS = 12


def pocket_borders(surface: Surface, faces: np.ndarray | None, costs: SeamCosts) -> np.ndarray:
    """Edges (k,2) of a surface, of the polygons `faces` (f,) bool or all, along which pockets of faces come off: where
    that costs least.

    Raises
    ------
    EmptyMeshError, NonFiniteError : see `surface.chosen_triangles`
    """
    _, corners, owner = chosen_triangles(surface, faces)
    triangles = surface.corner_vertex[corners]
    if not costs.within_face[triangles].any():
        return np.zeros((0, 2), np.int64)
    graph = PolygonGraph.of_triangles(triangles, owner, face_areas(surface.positions, triangles))
    count = len(graph.area)
    within = np.bincount(graph.polygon, costs.within[triangles].mean(axis=1), count) / np.bincount(graph.polygon)
    component = graph_components(graph.joined[:, 0], graph.joined[:, 1], count)[1]
    whole = np.bincount(component, graph.area)[component]
    deep = within > WITHIN
    both = graph.joined[deep[graph.joined].all(axis=1)]
    region = graph_components(both[:, 0], both[:, 1], count)[1]
    size = np.bincount(region, graph.area * deep)
    largest = np.argsort(-size, kind="stable")[:MOST_POCKETS]
    length = edge_lengths(surface.positions, graph.ends)
    capacity, cut = capacities(length * costs.vertex_cost[graph.ends].mean(axis=1)), np.zeros(len(length), dtype=bool)
    for k in largest[size[largest] > 0]:
        inside = deep & (region == k)
        core, total = inside & (within > CORE), float(whole[inside][0])
        outside = (component != component[inside][0]) | (within < OUTSIDE)
        if size[k] < LEAST_POCKET * total or not (core.any() and outside.any()):
            continue
        side = minimum_cut(graph, capacity, np.flatnonzero(core), np.flatnonzero(outside))
        around, area = graph.around(side), float(graph.area[side].sum())
        if LEAST_POCKET <= area / total <= MOST_POCKET and length[around].sum() <= DEEP * np.sqrt(area):
            cut |= around
    return graph.ends[cut]
