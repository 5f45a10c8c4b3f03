"""A connected part of a surface that is to be cut: its edges, what they cost, and what kind of surface it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import connected_components

from ..mesh.gluing import Gluing, groups
from ..mesh.topology import halfedges

# Cost of a cut per length. A sharp edge or a fold hides a cut, most of all in a hollow; an edge at a full right
# angle counts as this share of its length. Shares near 1 keep cuts short: their length is bounded by them.
CREASE, HOLLOW, SEAM = 0.85, 0.75, 0.3
# An edge marked sharp is where the artist breaks the shading, and so does one whose faces look to opposite sides.
SHARP = 0.5
# Angles up to this one occur within a smooth surface and hide nothing.
SMOOTH = np.pi / 6
# Edges between vertices that are to be kept free of seams count as so many times their length.
AVOIDED = 10.0
# Neither cut the triangles that fill a hole, nor along its edge, if there is another way.
HOLE = 1000.0
# Equal costs are told apart by this share of noise, the same for a mesh wherever it is and however large.
NOISE = 1e-6


@dataclass(frozen=True)
class Piece:
    """A connected manifold with or without boundary, in arrays of its own.

    positions (n,3) in a unit box; triangles (m,3); pair (e,2) the two halfedges of every inner edge, `sheet_pair` (e,)
    their number among the pairs of the sheets; ends (e,2) vertices; length (e,); cost (e,), infinite for diagonals;
    rim (r,) halfedges on the boundary; members (m,) triangles of the sheets; vertex_ids (n,) of the surface;
    avoid (n,) in [0,1].
    """

    positions: np.ndarray
    triangles: np.ndarray
    pair: np.ndarray
    sheet_pair: np.ndarray
    ends: np.ndarray
    length: np.ndarray
    cost: np.ndarray
    rim: np.ndarray
    members: np.ndarray
    vertex_ids: np.ndarray
    avoid: np.ndarray

    @property
    def count(self) -> int:
        """Number n of vertices."""
        return len(self.positions)

    def welcome(self) -> np.ndarray:
        """Factor (n,) > 0 by which a cut would rather end at a vertex: small where cuts are to be avoided."""
        return 1 - 0.999 * self.avoid

    def on_boundary(self) -> np.ndarray:
        """Boundary vertices (n,) bool."""
        tail, head = halfedges(self.triangles)
        on_boundary = np.zeros(self.count, dtype=bool)
        on_boundary[tail[self.rim]] = on_boundary[head[self.rim]] = True
        return on_boundary


@dataclass(frozen=True)
class Kind:
    """Topology of every part of some sheets, (k,) each: number of boundaries, of handles, and orientability.

    A part that cannot be oriented has crosscaps in the place of handles.
    """

    boundaries: np.ndarray
    handles: np.ndarray
    one_sided: np.ndarray

    @property
    def is_disk(self) -> np.ndarray:
        """Which parts are disks, (k,) bool: one boundary, and neither handles nor crosscaps."""
        return (self.boundaries == 1) & (self.handles == 0)


def classify(gluing: Gluing, corner_class: np.ndarray, part: np.ndarray, one_sided: np.ndarray) -> Kind:
    """Kind of every part, from the classes of corners (c,), the parts (m,) and whether each triangle is one-sided."""
    k = int(part.max()) + 1
    tail, head = halfedges(corner_class[gluing.triangles])
    rim = _open_halfedges(len(tail), gluing.first, gluing.second)
    vertices, where = np.unique(corner_class[gluing.triangles], return_index=True)
    n = np.bincount(part[where // 3], minlength=k)
    m = np.bincount(part, minlength=k)
    b = np.bincount(part[rim // 3], minlength=k)
    a, z = np.searchsorted(vertices, tail[rim]), np.searchsorted(vertices, head[rim])
    graph = coo_matrix((np.ones(len(rim)), (a, z)), shape=(len(vertices),) * 2)
    loop = connected_components(graph, directed=False)[1][a]
    _, first = np.unique(loop, return_index=True)
    boundaries = np.bincount(part[rim[first] // 3], minlength=k)
    euler = n - (3 * m + b) // 2 + m
    sided = np.zeros(k, dtype=bool)
    sided[part[one_sided]] = True
    missing = 2 - euler - boundaries
    return Kind(boundaries, np.where(sided, missing, missing // 2), sided)


def _open_halfedges(count: int, first: np.ndarray, second: np.ndarray) -> np.ndarray:
    open_ = np.ones(count, dtype=bool)
    open_[first] = open_[second] = False
    return np.flatnonzero(open_)


def make_piece(
    gluing: Gluing,
    positions: np.ndarray,
    corner_class: np.ndarray,
    members: np.ndarray,
    mine: np.ndarray,
    weight: np.ndarray,
    ease: np.ndarray,
) -> Piece:
    """The piece of the triangles `members` (m,), in ascending order, and the pairs `mine` (e,) between them.

    Parameters
    ----------
    positions : (n,3) of the surface, in a unit box
    weight : (n,) in [0,1] keeps vertices of the surface free of cuts
    ease : (p,) factor by which each pair is cheaper to cut, see `cutting.ease_of_cuts`
    """  # fmt: skip
    corners = gluing.triangles[members]
    _, index, inverse = np.unique(corner_class[corners], return_index=True, return_inverse=True)
    triangles = inverse.reshape(-1, 3).astype(np.int64)
    vertex_ids = gluing.vertex[corners.ravel()[index]]
    pair = np.stack([gluing.first[mine], gluing.second[mine]], axis=1)
    patch = (gluing.owner[pair // 3] < 0).any(axis=1)
    diagonal = ~gluing.side[pair[:, 0]] & ~patch
    pair = 3 * np.searchsorted(members, pair // 3) + pair % 3
    tail, head = halfedges(triangles)
    ends = np.stack([tail[pair[:, 0]], head[pair[:, 0]]], axis=1)
    p = positions[vertex_ids]
    length = np.linalg.norm(p[ends[:, 0]] - p[ends[:, 1]], axis=1)
    # An edge without length still costs something: sparse graphs take a zero for no edge.
    floor = 1e-9 * max(float(length.mean()) if len(length) else 1.0, 1e-30)
    noise = 1 + NOISE * np.random.default_rng(0).random(len(pair))
    cost = (length + floor) * _hiding(p, triangles, pair) * noise
    cost *= ease[mine] * (1 + (AVOIDED - 1) * weight[vertex_ids][ends].mean(axis=1))
    cost[patch] *= HOLE
    cost[diagonal] = np.inf
    rim = _open_halfedges(3 * len(triangles), pair[:, 0], pair[:, 1])
    return Piece(p, triangles, pair, mine, ends, length, cost, rim, members, vertex_ids, weight[vertex_ids])


def fold_angles(positions: np.ndarray, triangles: np.ndarray, pair: np.ndarray) -> np.ndarray:
    """Angle (e,) between the normals of the two faces (m,3) at pairs of halfedges (e,2), radians.

    Negative where the surface is hollow, 0 beside faces without area.
    """
    p = positions[triangles]
    normal = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    size = np.linalg.norm(normal, axis=1)
    normal /= np.where(size > 0, size, 1)[:, None]
    t, s = pair.T // 3
    cosine = np.clip((normal[t] * normal[s]).sum(axis=1), -1, 1)
    # The far corner of the one face lies above the other where the surface is hollow.
    far = positions[triangles[s, (pair[:, 1] + 2) % 3]] - positions[triangles[t, pair[:, 0] % 3]]
    rise = (normal[t] * far).sum(axis=1)
    depth = np.where((size[t] > 0) & (size[s] > 0), np.arccos(cosine), 0.0)
    return np.where(rise > 0, -depth, depth)


def _hiding(positions: np.ndarray, triangles: np.ndarray, pair: np.ndarray) -> np.ndarray:
    """Factor (e,) that makes creased and hollow edges cheaper, by the angle between the faces of an edge."""
    fold = fold_angles(positions, triangles, pair)
    share = np.clip((np.abs(fold) - SMOOTH) / (np.pi / 2 - SMOOTH), 0, 1)
    return 1 - share * np.where(fold < 0, 1 - HOLLOW, 1 - CREASE)


def edge_graph(piece: Piece, edges: np.ndarray, ends: np.ndarray, n: int) -> csr_matrix:
    """Symmetric graph (n,n) of the cost of edges (k,) between the vertices `ends` (k,2); diagonals are no edges.

    No two edges have the same ends (`repair.join` sees to it): a sparse matrix would add them up.
    """
    keep = np.isfinite(piece.cost[edges])
    (a, b), cost = ends[keep].T, piece.cost[edges[keep]]
    return csr_matrix((np.concatenate([cost, cost]), (np.concatenate([a, b]), np.concatenate([b, a]))), shape=(n, n))


def rim_loops(piece: Piece) -> list[np.ndarray]:
    """Vertices of every boundary, in no order."""
    tail, head = halfedges(piece.triangles)
    a, b = tail[piece.rim], head[piece.rim]
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(piece.count, piece.count))
    rim = np.unique(a)
    label = connected_components(graph, directed=False)[1][rim]
    return [rim[group] for group in groups(label)] if len(rim) else []


def fingerprint(piece: Piece) -> tuple[bytes, ...]:
    """Equal for copies of a piece, moved but not turned, and almost surely for no others."""
    p = piece.positions - piece.positions.min(axis=0)
    size = float(p.max()) or 1.0
    rounded = [np.round(x / size * 1e6) for x in (p, np.where(np.isfinite(piece.cost), piece.cost, -1))]
    return tuple(a.tobytes() for a in (piece.triangles, piece.pair, *rounded))
