"""Paths over a coarse surface: along its edges, and across them from corner to corner, where that is straight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..mesh.geometry import edge_lengths
from ..mesh.topology import across_edges, halfedges, twins
from .coarse_surface import CoarseSurface, Mirrored

# Share of the vertices in a mirror plane that symmetric cuts have to be able to reach.
REACHED = 0.9


@dataclass(frozen=True)
class PathGraph:
    """Steps that a path may take.

    Attributes
    ----------
    ends (e,2) : of every step, ascending, those of steps, too; cost (e,) : in lengths over the size of the surface
    boundary (n,) bool : vertices where cuts may begin for nothing
    image (n,) : vertex that is cut together with each, its mirror image; itself where there is no mirror
    matrix (n,n) : cost; keys (e,) : of every step, ascending, see `_keys`
    in_plane (n,) bool : vertices in the mirror plane. A path may leave the plane but never come back to it, since it
        would, with its mirror image, close a loop: `matrix` has no such steps
    """

    ends: np.ndarray
    cost: np.ndarray
    boundary: np.ndarray
    image: np.ndarray
    matrix: csr_matrix
    keys: np.ndarray
    in_plane: np.ndarray

    def paths_from(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Cost (n,) of the cheapest path from the vertices `start` (k,), and the vertex before (n,), < 0 for none."""
        cost, before, _ = dijkstra(self.matrix, indices=start, min_only=True, return_predecessors=True)
        return cost, before

    def is_whole(self, least: float = REACHED) -> bool:
        """Whether the vertices in the mirror plane can be reached from the boundary, nearly all or a share of them."""
        cost, _ = self.paths_from(np.flatnonzero(self.boundary))
        return float(np.isfinite(cost[self.in_plane]).mean()) >= least

    def depth(self, steps: np.ndarray) -> np.ndarray:
        """Cost (n,) of the way from the boundary along steps (k,) alone."""
        n, steps = len(self.boundary), np.sort(steps)
        # Steps are in the order of their ends: those of a row follow each other.
        rows, columns = self.ends[steps].T
        begin = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=n))])
        tree = csr_matrix((self.cost[steps], columns, begin), shape=(n, n))
        return dijkstra(tree, directed=False, indices=np.flatnonzero(self.boundary), min_only=True)

    def is_open(self, steps: np.ndarray) -> bool:
        """Whether steps (k,) from the boundary outwards never come back to the mirror plane."""
        if not self.in_plane.any():
            return True
        depth, ends = self.depth(steps), self.ends[steps]
        first, last = np.take_along_axis(ends, np.argsort(depth[ends], axis=1), axis=1).T
        return not (~self.in_plane[first] & self.in_plane[last]).any()

    def steps_of(self, path: np.ndarray) -> np.ndarray:
        """Steps (k,) between the vertices (k+1,) of a path."""
        one, other = path[:-1], path[1:]
        return np.searchsorted(self.keys, _keys(np.minimum(one, other), np.maximum(one, other), len(self.boundary)))

    def vertices_of(self, steps: np.ndarray) -> np.ndarray:
        """Vertices (k,) of steps and of their mirror images, off the boundary, sorted."""
        among = np.zeros(len(self.boundary), dtype=bool)
        vertices = self.ends[steps].ravel()
        among[vertices] = among[self.image[vertices]] = True
        return np.flatnonzero(among & ~self.boundary)


def path_graph(
    surface: CoarseSurface, factor: np.ndarray, boundary: np.ndarray, mirrored: Mirrored | None = None
) -> PathGraph:
    """The steps over a coarse surface.

    factor (n,): cost of a cut per length; boundary (n,) bool: where cuts may begin. Of a mirrored surface, steps are
    those of one half, and count twice but for those in the plane.
    """
    n = len(surface.positions)
    tail, head = halfedges(surface.triangles)
    twin = twins(surface.triangles)
    once = np.flatnonzero(twin < np.arange(len(twin)))
    ends = np.column_stack([tail[once], head[once]])
    length = edge_lengths(surface.positions, ends)
    across, straight = _across(surface.positions, surface.triangles, twin)
    along_edges = len(ends)
    ends, length = np.concatenate([ends, across]), np.concatenate([length, straight])
    image = np.arange(n)
    if mirrored is not None:
        image = mirrored.image
        # In the plane only edges can be carried: where it crosses faces, there is nothing to cut along.
        keep = mirrored.side[ends].all(axis=1)
        keep[along_edges:] &= ~(image[across] == across).all(axis=1)
        ends, length = ends[keep], length[keep]
        length = np.where((image[ends] == ends).all(axis=1), length, 2 * length)
    ends = np.sort(ends, axis=1)
    keys, first = np.unique(_keys(ends[:, 0], ends[:, 1], n), return_index=True)
    ends, length = ends[first], length[first]
    # A step without length still costs something: sparse graphs take a zero for no step.
    floor = 1e-9 * max(float(length.mean()) if len(length) else 1.0, 1e-30)
    cost = (length + floor) * factor[ends].mean(axis=1) / surface.size
    (rows, columns), both = np.concatenate([ends, ends[:, ::-1]]).T, np.tile(cost, 2)
    in_plane = np.zeros(n, dtype=bool) if mirrored is None else image == np.arange(n)
    onwards = in_plane[rows] | ~in_plane[columns]
    matrix = csr_matrix((both[onwards], (rows[onwards], columns[onwards])), shape=(n, n))
    return PathGraph(ends=ends, cost=cost, boundary=boundary, image=image, matrix=matrix, keys=keys, in_plane=in_plane)


def _keys(lower: np.ndarray, upper: np.ndarray, n: int) -> np.ndarray:
    """One integer (k,) for each step between vertices (k,) and (k,) of n, in their order."""
    return lower * n + upper


def path_to(before: np.ndarray, end: int) -> np.ndarray:
    """Vertices (k,) from `end` back to where the predecessors (n,) stop."""
    path = [end]
    while before[path[-1]] >= 0:
        path.append(int(before[path[-1]]))
    return np.array(path)


def _across(positions, triangles, twin) -> tuple[np.ndarray, np.ndarray]:
    """Corners (k,2) opposite each other across an edge, and the length (k,) of the straight line between them."""
    tail, head = halfedges(triangles)
    h, corners = across_edges(triangles, twin)
    a, b = positions[tail[h]], positions[head[h]]
    length = np.maximum(np.linalg.norm(b - a, axis=1), 1e-300)
    axis = (b - a) / length[:, None]
    offset = [positions[corner] - a for corner in corners.T]
    along = [(d * axis).sum(axis=1) for d in offset]
    away = [np.linalg.norm(d - x[:, None] * axis, axis=1) for d, x in zip(offset, along, strict=True)]
    crossing = along[0] + (along[1] - along[0]) * away[0] / np.maximum(away[0] + away[1], 1e-300)
    seen = (crossing > 0) & (crossing < length) & (corners[:, 0] != corners[:, 1])
    return corners[seen], np.hypot(along[1] - along[0], away[0] + away[1])[seen]
