"""Find edges of a triangle mesh that stand out: sharp ones, borders of regions, jumps of values across them."""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import cross3, dot3, face_areas, face_normals, halfedge_lengths, lengths
from ..mesh.repair import NEEDLE
from ..mesh.topology import graph_components, halfedges, pair_keys, pair_up, twins

NO_EDGES = np.zeros((0, 2), np.int64)
# A region of fewer new triangles than this has no shape of its own,
LEAST_TRIANGLES = 0.7
# nor one that is narrower than this share of a new edge.
LEAST_WIDTH = 0.25


def sharp_edges(positions: np.ndarray, triangles: np.ndarray, angle: float) -> np.ndarray:
    """Edges (k,2) of a mesh (n,3), (m,3) where the normals of the two faces differ by more than `angle` radians."""
    first, second, edges = _pairs(triangles)
    normal = face_normals(positions, triangles)
    a, b = normal[first // 3], normal[second // 3]
    turn = np.arctan2(lengths(cross3(a, b)), np.einsum("ej,ej->e", a, b))
    return edges[turn > angle]


def fold_angles(positions: np.ndarray, triangles: np.ndarray, pair: np.ndarray) -> np.ndarray:
    """Angle (e,) between the normals of the two faces (m,3) at pairs of halfedges (e,2), radians.

    Negative where the surface is hollow. Faces without area lie in the plane of a neighbour, of that along their
    longest side; 0 where there is none that has one.
    """
    p = np.take(positions, triangles, axis=0)
    normal = cross3(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    size = lengths(normal)
    normal /= np.where(size > 0, size, 1)[:, None]
    t, s = pair.T // 3
    side = halfedge_lengths(positions, triangles)
    if (needles := size <= 2 * NEEDLE * side.reshape(-1, 3).max(axis=1) ** 2).any():
        normal, size = _of_neighbours(normal, needles, np.stack([t, s]), side[pair[:, 0]])
    one, other = np.take(normal, t, axis=0), np.take(normal, s, axis=0)
    cosine = np.clip(dot3(one, other), -1, 1)
    # The far corner of the one face lies above the other where the surface is hollow.
    far = positions[triangles[s, (pair[:, 1] + 2) % 3]] - positions[triangles[t, pair[:, 0] % 3]]
    rise = dot3(one, far)
    depth = np.where((size[t] > 0) & (size[s] > 0), np.arccos(cosine), 0.0)
    return np.where(rise > 0, -depth, depth)


def _of_neighbours(
    normal: np.ndarray, needles: np.ndarray, faces: np.ndarray, long: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Normals (m,3) in which `needles` (m,) bool have that of a neighbour, of pairs of faces (2,e) along sides of such
    lengths (e,), and whether (m,) they have one: what rounding leaves of their own turns any way."""
    normal, known = np.where(needles[:, None], 0.0, normal), ~needles
    mine, other = (np.concatenate([faces[k], faces[1 - k]]) for k in range(2))
    mine, other, long = mine[needles[mine]], other[needles[mine]], np.concatenate([long, long])[needles[mine]]
    most = np.zeros(len(needles))
    np.maximum.at(most, mine, long)
    while True:
        # One needle after the other has the plane of what lies along its longest side, if that gets any.
        next_to = ~known[mine] & known[other]
        along = next_to & (long == most[mine])
        found = np.flatnonzero(along if along.any() else next_to)
        if not len(found):
            return normal, known
        normal[mine[found]] = normal[other[found]]
        known[mine[found]] = True


def region_borders(triangles: np.ndarray, region: np.ndarray) -> np.ndarray:
    """Edges (k,2) of triangles (m,3) between faces of different `region` (m,)."""
    first, second, edges = _pairs(triangles)
    return edges[region[first // 3] != region[second // 3]]


def value_jumps(triangles: np.ndarray, corners: np.ndarray, values: np.ndarray, tolerance: float) -> np.ndarray:
    """Edges (k,2) of triangles (m,3) with corners (m,3) across which corner values (c,d) differ by > `tolerance`."""
    first, second, edges = _pairs(triangles)
    tail, head = halfedges(triangles)
    at_tail, at_head = halfedges(corners)
    same = tail[first] == tail[second]
    begin = np.where(same, at_tail[second], at_head[second])
    end = np.where(same, at_head[second], at_tail[second])
    apart = np.abs(values[at_tail[first]] - values[begin]).max(axis=1, initial=0) > tolerance
    apart |= np.abs(values[at_head[first]] - values[end]).max(axis=1, initial=0) > tolerance
    return edges[apart]


def _pairs(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The two halfedges (e,), (e,) of every edge between two faces, and its vertices (e,2)."""
    tail, head = halfedges(triangles)
    first, second = pair_up(pair_keys(tail, head))
    return first, second, np.stack([tail[first], head[first]], axis=1)


def edge_union(*sets: np.ndarray) -> np.ndarray:
    """The union (k,2) of sets of edges, every edge once, the smaller vertex first."""
    return np.unique(np.sort(np.concatenate([NO_EDGES, *(np.reshape(s, (-1, 2)) for s in sets)]), axis=1), axis=0)


def resolved_features(
    positions: np.ndarray, triangles: np.ndarray, features: np.ndarray, size: np.ndarray
) -> tuple[np.ndarray, int]:
    """The features (e,2) of a mesh (n,3), (m,3) without the borders of regions too small to show.

    size (m,): how long the edges of a new mesh are to be on every triangle. Regions are the components between
    features. One with too few new triangles, or too narrow, joins the neighbour with which it has most of its border in
    common. Returns the remaining features, and how many regions joined another.
    """
    first, second, edges = _pairs(triangles)
    keys = pair_keys(*features.T)
    is_feature = np.isin(pair_keys(*edges.T), keys)
    count, label = graph_components(first[~is_feature] // 3, second[~is_feature] // 3, len(triangles))
    own, other = label[first[is_feature] // 3], label[second[is_feature] // 3]
    length = halfedge_lengths(positions, triangles) / np.repeat(size, 3)
    open_ = np.flatnonzero(twins(triangles) < 0)
    area = np.bincount(label, face_areas(positions, triangles) / size**2, count)
    boundary = np.bincount(label[open_ // 3], length[open_], count)
    group = _merged(area, boundary, own, other, (length[first] + length[second])[is_feature] / 2)
    lost = edges[is_feature][(own != other) & (group[own] == group[other])]
    return features[~np.isin(keys, pair_keys(*lost.T))], count - len(np.unique(group))


def _merged(
    area: np.ndarray, boundary: np.ndarray, own: np.ndarray, other: np.ndarray, length: np.ndarray
) -> np.ndarray:
    """Group (r,) of every region after small ones have joined others, as often as it takes.

    area (r,) and boundary (r,), the length of the mesh's boundary, in units of new edges; own, other (e,): regions on
    the two sides of every border edge, length (e,).
    """
    group, count = np.arange(len(area)), len(area)
    while True:
        a, b = group[own], group[other]
        between = a != b
        a, b, shared = a[between], b[between], np.tile(length[between], 2)
        side = np.concatenate([a, b])
        border = np.bincount(side, shared, count) + np.bincount(group, boundary, count)
        inside = np.bincount(group, area, count)
        small = (inside < LEAST_TRIANGLES * np.sqrt(3) / 4) | (2 * inside < LEAST_WIDTH * border)
        pair, index = np.unique(side * count + np.concatenate([b, a]), return_inverse=True)
        total = np.bincount(index, shared, len(pair))
        pair, total = pair[small[pair // count]], total[small[pair // count]]
        if not len(pair):
            return group
        order = np.lexsort([-total, pair // count])
        best = pair[order[np.r_[True, np.diff(pair[order] // count) > 0]]]
        group = graph_components(best // count, best % count, count)[1][group]
