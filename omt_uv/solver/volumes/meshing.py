"""Fill a closed surface with tetrahedra, by TetGen where it is installed, the surface kept as it is.

A tetrahedron with two faces on the boundary, or an edge through the inside from boundary to boundary, turns over on a
ball unless the map of the boundary happens to be Delaunay there. So such edges are split, and what is inside can give
way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contact.self_intersections import intersecting_pairs
from ..counts import BYTES_PER_ELEMENT, check_memory
from ..errors import LibraryError, SelfIntersectionError, TetrahedraError, plural
from ..flows.enclosed_volume import corner_volumes
from ..mesh.topology import halfedges, pair_keys, paired
from .tet_mesh import EDGES, boundary_triangles, tet_volumes, turned_right

# Ratio of radius to shortest edge that TetGen aims for.
QUALITY = 1.5
# Tetrahedra that splitting makes of one, about: fewer are asked for.
GROWTH = 1.8
# Tries to come to this share of what was asked.
TRIES = 4
NEAR = 0.85
# Rounds of splitting; each splits edges that have no tetrahedron in common.
ROUNDS = 60


@dataclass(frozen=True)
class TetMesh:
    """Points (n,3), the first of which are those of the surface, in its order, and tetrahedra (m,4) of positive
    volume."""

    points: np.ndarray
    tets: np.ndarray


def tetrahedra(vertices: np.ndarray, triangles: np.ndarray, count: int = 40_000) -> TetMesh:
    """About `count` tetrahedra that fill a closed surface (n,3), (m,3); large ones where its faces are many.

    Raises
    ------
    CountError : more than this machine has memory for
    LibraryError : TetGen is not installed
    SelfIntersectionError : faces pass through one another
    TetrahedraError : TetGen finds none
    """
    check_memory(count, BYTES_PER_ELEMENT, "A body of about {} tetrahedra")
    crossing = intersecting_pairs(vertices, triangles)
    if len(crossing):
        raise SelfIntersectionError(
            "Faces pass through one another, so that there is no inside", kind="face", elements=np.unique(crossing)
        )
    size = float(np.ptp(vertices, axis=0).max())
    scaled = (vertices - vertices.min(axis=0)) / size
    volume = abs(float(corner_volumes(scaled, triangles).sum())) / 6
    most = GROWTH * 4 * volume / max(count, 1)
    for _ in range(TRIES):
        points, tets = _tetgen(scaled, triangles, most)
        if len(points) < len(vertices) or np.abs(points[: len(vertices)] - scaled).max() > 1e-12:
            raise TetrahedraError("TetGen moved vertices of the surface")
        points, tets = without_chords(points, turned_right(points, tets), triangles)
        if len(tets) > NEAR * count:
            break
        most *= len(tets) / count
    points = points * size + vertices.min(axis=0)
    points[: len(vertices)] = vertices
    flat = np.flatnonzero(~(tet_volumes(points, tets) > 0))
    if len(flat):
        raise TetrahedraError(f"{len(flat)} of {len(tets)} tetrahedra {plural(len(flat), 'has', 'have')} no volume")
    return TetMesh(points, tets)


def _tetgen(points: np.ndarray, triangles: np.ndarray, most: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) and tetrahedra (m,4) of at most about the volume `most`, by TetGen."""
    try:
        import tetgen
    except ImportError as error:
        raise LibraryError(
            "Tetrahedra need the library TetGen, which is not installed",
            "Install it: python -m pip install tetgen (its core is licensed under the AGPL)",
        ) from error
    try:
        mesher = tetgen.TetGen(np.ascontiguousarray(points, float), np.ascontiguousarray(triangles, np.int32))
        found = mesher.tetrahedralize(
            nobisect=True, quality=True, minratio=QUALITY, fixedvolume=True, maxvolume=most, steinerleft=-1
        )
    except RuntimeError as error:
        raise TetrahedraError(
            f"TetGen: {str(error).strip().splitlines()[-1] if str(error).strip() else 'failed'}"
        ) from error
    return np.asarray(found[0], float), np.asarray(found[1], np.int64)


def without_chords(points: np.ndarray, tets: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points (n,3) and tetrahedra (m,4) in which no edge leads through the inside from a vertex of the boundary
    triangles (k,3) to another; the first points stay."""
    tail, head = halfedges(triangles)
    on = np.zeros(len(points), bool)
    on[triangles] = True
    surface = np.unique(pair_keys(tail, head))
    for _ in range(ROUNDS):
        n = len(points)
        ends = tets[:, EDGES]
        keys = pair_keys(ends[..., 0], ends[..., 1])
        chord = on[ends].all(axis=2) & ~np.isin(keys, surface)
        if not chord.any():
            break
        # All tetrahedra around such an edge have it, so the others need no look.
        mine = chord.any(axis=1)
        length = np.linalg.norm(points[ends[mine, :, 0]] - points[ends[mine, :, 1]], axis=2)
        points, halves = _split(points, tets[mine], keys[mine], np.where(chord[mine], length, -1.0))
        tets = np.concatenate([tets[~mine], halves])
        on = np.concatenate([on, np.zeros(len(points) - n, bool)])
    return points, tets


def split_inside(mesh: TetMesh, positions: np.ndarray, asked: np.ndarray) -> tuple[TetMesh, np.ndarray]:
    """The mesh and positions (n,3) with the longest edge inside of tetrahedra `asked` (m,) bool split in its middle.

    Length is that in the body and at the positions together; of edges that share a tetrahedron the longest is split.
    """
    tail, head = halfedges(boundary_triangles(mesh.tets))
    surface = np.unique(pair_keys(tail, head))
    ends = mesh.tets[:, EDGES]
    keys = pair_keys(ends[..., 0], ends[..., 1])
    places = np.concatenate([mesh.points, positions], axis=1)
    way = places[ends[..., 0]] - places[ends[..., 1]]
    length = np.linalg.norm(way[..., :3], axis=2) + np.linalg.norm(way[..., 3:], axis=2)
    length[np.isin(keys, surface)] = -1.0
    rows = np.flatnonzero(asked & (length.max(axis=1) > 0))
    chosen = np.isin(keys, keys[rows, length[rows].argmax(axis=1)])
    # All tetrahedra around such an edge have it, so the others need no look.
    mine = chosen.any(axis=1)
    places, halves = _split(places, mesh.tets[mine], keys[mine], np.where(chosen[mine], length[mine], -1.0))
    return TetMesh(places[:, :3], np.concatenate([mesh.tets[~mine], halves])), places[:, 3:]


def _split(points: np.ndarray, tets: np.ndarray, keys: np.ndarray, length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Split edges of tetrahedra (m,4) in their middle that are the longest, length (m,6), in all of theirs; keys
    (m,6)."""
    used, inverse = np.unique(keys, return_inverse=True)
    inverse = inverse.ravel().reshape(keys.shape)
    # Ties are broken by the key, so that no two edges of a tetrahedron are both the longest.
    best = np.where(length == length.max(axis=1, keepdims=True), inverse, -1).argmax(axis=1)
    rows = np.arange(len(tets))
    here = length[rows, best] > 0
    around = np.bincount(inverse.ravel(), minlength=len(used))
    first = np.bincount(inverse[rows[here], best[here]], minlength=len(used))
    chosen = (first == around) & (first > 0)
    place = np.where(chosen, len(points) + np.cumsum(chosen) - 1, -1)
    middle = points[paired(used[chosen])].sum(axis=1) / 2
    mine = here & chosen[inverse[rows, best]]
    split = np.flatnonzero(mine)
    vertex = place[inverse[split, best[split]]]
    one, other = tets[split].copy(), tets[split].copy()
    pair = EDGES[best[split]]
    one[np.arange(len(split)), pair[:, 0]] = vertex
    other[np.arange(len(split)), pair[:, 1]] = vertex
    return np.concatenate([points, middle]), np.concatenate([tets[~mine], one, other])
