"""Maps on few vertices first: a change over long distances takes few steps there, and none of them is stuck.

Vertices far from one another are chosen (Eldar, Lindenbaum, Porat, Zeevi 1997), and joined by the Delaunay
triangulation of their places in the domain, which on the sphere is their convex hull. The map of the coarse mesh
carries all other vertices along, linearly in each of its triangles; the few that fold are straightened.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from ..linalg.nested_dissection import mesh_order
from ..linalg.sparse import solve_spd
from ..mesh.geometry import cross2, halfedge_lengths, laplacian_from_lengths, vertex_areas
from ..mesh.point_location import locate
from ..mesh.spherical_geometry import normalized, signed_volumes
from ..mesh.topology import vertices_around
from ..progress import Steps
from ..sphere.untangle import untangle_spots
from .surface_newton import Features

# Rings of vertices around folds that are straightened, first few, then more.
RINGS = (1, 2, 4, 8)
# Rings of what is laid out anew, and the least stiffness of an edge there.
LAID_OUT_RINGS = 4
LEAST_STIFFNESS = 1e-2


@dataclass(frozen=True)
class FewVertices:
    """Vertices (k,) of a mesh, triangles (m,3) of them without folds in the domain, their places there (k,d), which of
    them are landmarks (l,), in their order, and which (b,) lie on the loop."""

    chosen: np.ndarray
    triangles: np.ndarray
    domain: np.ndarray
    landmarks: np.ndarray
    loop: np.ndarray

    def carried(self, places: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Where points of the domain (n,d) go if the vertices go to places (k,d): linearly in every triangle."""
        faces, weights = locate(self.domain, self.triangles, others)
        moved = np.einsum("nc,ncd->nd", weights, places[self.triangles[faces]])
        return normalized(moved) if moved.shape[1] == 3 else moved


def coarse_mesh(
    vertices: np.ndarray, domain: np.ndarray, landmarks: np.ndarray, loop: np.ndarray, count: int
) -> FewVertices | None:
    """A mesh of about `count` of the vertices (n,3), with places in the domain (n,d), all landmarks (l,) among them.

    Every few vertices of the loop (b,) are, too. None where the triangulation leaves one out.
    """
    chosen = far_vertices(vertices, landmarks, loop, count)
    triangles = _delaunay(domain[chosen])
    if triangles is None:
        return None
    order = mesh_order(vertices[chosen], triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    number = np.full(len(vertices), -1)
    number[chosen] = place
    on_loop = number[loop]
    return FewVertices(
        chosen=chosen[order],
        triangles=place[triangles],
        domain=domain[chosen[order]],
        landmarks=number[landmarks],
        loop=on_loop[on_loop >= 0],
    )


def far_vertices(vertices: np.ndarray, first: np.ndarray, loop: np.ndarray, count: int) -> np.ndarray:
    """Vertices (k,) of (n,3) far from one another: the first ones, and each next one farthest from all before.

    Of a loop (b,) every few vertices are among the first.
    """
    first = np.unique(first)
    if len(loop):
        first = np.union1d(first, loop[:: max(1, len(loop) // max(12, int(np.sqrt(count))))])
    chosen = first.tolist()
    distance = np.full(len(vertices), np.inf)
    for vertex in chosen:
        np.minimum(distance, ((vertices - vertices[vertex]) ** 2).sum(axis=1), out=distance)
    while len(chosen) < min(count, len(vertices)):
        vertex = int(distance.argmax())
        chosen.append(vertex)
        np.minimum(distance, ((vertices - vertices[vertex]) ** 2).sum(axis=1), out=distance)
    return np.array(chosen)


def _delaunay(domain: np.ndarray) -> np.ndarray | None:
    """Triangles (m,3) of points on the sphere (k,3), or in the plane (k,2); None where they leave one out."""
    if domain.shape[1] == 2:
        triangles = Delaunay(domain).simplices
        a, b, c = (domain[triangles[:, k]] for k in range(3))
        turned = cross2(b - a, c - a) < 0
    else:
        triangles = ConvexHull(domain).simplices
        turned = signed_volumes(domain, triangles) < 0
    triangles = np.where(turned[:, None], triangles[:, [0, 2, 1]], triangles).astype(np.int64)
    return triangles if len(np.unique(triangles)) == len(domain) else None


def on_coarse(features: Features | None, mesh: FewVertices, vertices: np.ndarray) -> Features | None:
    """Features of all vertices as those of the coarse mesh with vertices at (k,3)."""
    if features is None:
        return None
    area = vertex_areas(vertices, mesh.triangles)
    share = features.share.sum() * area / area.sum()
    return replace(features, values=features.values[mesh.chosen], share=share)


def straightened(before: np.ndarray, triangles: np.ndarray, after: np.ndarray, held: np.ndarray) -> Steps[np.ndarray]:
    """Places (n,3) on the sphere whose folded faces (m,3) are straightened, as far as possible; held (n,) bool stay.

    before (n,3) : places without folds, whose shapes they are to have. In the plane they are left as they are. Spots
    are straightened one by one; what is left at last is laid out anew, harmonically, from around it.
    """
    if after.shape[1] == 2:
        return after
    for rings in RINGS:
        after = yield from untangle_spots(before, triangles, after, held, rings)
    folded = ~(signed_volumes(after, triangles) > 0)
    if folded.any():
        spot = vertices_around(triangles, folded, len(after), LAID_OUT_RINGS) & ~held
        if spot.all():
            # Folds all over leave nothing around them to lay them out from.
            return after
        fresh = laid_out(before, triangles, after, spot)
        for rings in RINGS:
            fresh = yield from untangle_spots(before, triangles, fresh, held, rings)
        if (signed_volumes(fresh, triangles) > 0).all():
            return fresh
    return after


def laid_out(before: np.ndarray, triangles: np.ndarray, after: np.ndarray, spot: np.ndarray) -> np.ndarray:
    """Places (n,3) on the sphere, those of a spot (n,) bool as a harmonic map from their surroundings has them.

    before (n,3) : the shapes, for the stiffness of edges
    """
    free, rest = np.flatnonzero(spot), np.flatnonzero(~spot)
    length = halfedge_lengths(before, triangles).reshape(-1, 3)
    stiffness = laplacian_from_lengths(length, triangles, len(after), least=LEAST_STIFFNESS)
    result = after.copy()
    if len(free):
        result[free] = normalized(solve_spd(stiffness[free][:, free], -(stiffness[free][:, rest] @ after[rest])))
    return result
