"""Glue triangles of a polygon mesh along pairs of halfedges; components, fans and orientations of the result.

All topology that knows of corners is here: `surface.py` joins strictly, `repair.py` joins what can be joined, and
`cutting` takes pairs away again. Orientation is a property of the pairs: two triangles agree when their common
edge runs in opposite directions in them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .geometry import face_areas
from .topology import graph_components, halfedges, next_corners, pair_keys, pair_up


@dataclass(frozen=True)
class Gluing:
    """Triangles (m,3) of corners with the polygon (m,) of each, and pairs of joined halfedges first, second (p,).

    vertex (c,) of every corner; side (3m,): the halfedge is a side of its polygon, not a diagonal.
    """

    triangles: np.ndarray
    owner: np.ndarray
    vertex: np.ndarray
    side: np.ndarray
    first: np.ndarray
    second: np.ndarray

    def ends(self, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Surface vertices at the tail and the head of halfedges (k,)."""
        tail, head = halfedges(self.triangles)
        return self.vertex[tail[h]], self.vertex[head[h]]

    def parallel(self) -> np.ndarray:
        """Pairs (p,) whose halfedges run in the same direction: the triangles look to opposite sides."""
        tail, head = halfedges(self.triangles)
        # A diagonal between two corners on one vertex has equal ends, whichever way it runs.
        opposite = (tail[self.first] == head[self.second]) & (head[self.first] == tail[self.second])
        return (self.vertex[tail[self.first]] == self.vertex[tail[self.second]]) & ~opposite

    @cached_property
    def classes(self) -> np.ndarray:
        """See `corner_classes`: each of a repair, a cut, and the charts that it leaves asks for them."""
        tail, head = halfedges(self.triangles)
        same = self.parallel()
        f, s = self.first, self.second
        rows = np.concatenate([tail[f], head[f]])
        columns = np.concatenate([np.where(same, tail[s], head[s]), np.where(same, head[s], tail[s])])
        found = graph_components(rows, columns, len(self.vertex))[1]
        found.flags.writeable = False
        return found

    @cached_property
    def parts(self) -> np.ndarray:
        """See `components`, for which a cut asks, and what makes charts of what it leaves."""
        found = graph_components(self.first // 3, self.second // 3, len(self.triangles))[1]
        found.flags.writeable = False
        return found

    def without(self, gone: np.ndarray) -> Gluing:
        """The same triangles with the pairs `gone` (p,) bool cut open."""
        return replace(self, first=self.first[~gone], second=self.second[~gone])


def polygon_gluing(
    triangles: np.ndarray, owner: np.ndarray, corner_vertex: np.ndarray, face_start: np.ndarray
) -> Gluing:
    """Triangles (m,3) of corners of the polygons owner (m,), joined across the diagonals of polygons alone.

    corner_vertex (c,) is the vertex of every corner; polygon f owns the corners face_start[f]:face_start[f+1].
    """
    side = polygon_sides(face_start, triangles)
    first, second = diagonal_pairs(triangles, side)
    return Gluing(triangles=triangles, owner=owner, vertex=corner_vertex, side=side, first=first, second=second)


def polygon_sides(face_start: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Whether each halfedge of the triangles of corners (m,3) is a side of its polygon, (3m,) bool."""
    after, (tail, head) = next_corners(face_start), halfedges(triangles)
    # A triangulation may name the corners of a polygon backwards.
    return (after[tail] == head) | (after[head] == tail)


def diagonal_pairs(triangles: np.ndarray, side: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of halfedges that are two sides of the same diagonal; both lie in one polygon."""
    tail, head = halfedges(triangles)
    diagonal = np.flatnonzero(~side)
    first, second = pair_up(pair_keys(tail[diagonal], head[diagonal]))
    return diagonal[first], diagonal[second]


def corner_classes(gluing: Gluing) -> np.ndarray:
    """Class (c,) of every corner: corners around one vertex that joined halfedges lead from one to the next."""
    return gluing.classes


def components(gluing: Gluing) -> np.ndarray:
    """Component (m,) of every triangle."""
    return gluing.parts


def orientations(gluing: Gluing, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (m,) bool to turn over so that neighbours agree, and those (m,) of components where no choice does.

    Every triangle has two sides; joining those that look the same way leaves two copies of a component that can be
    oriented and one of a component that cannot. The winding of most of the `area` (m,) is kept.
    """
    m = len(gluing.triangles)
    t, s = gluing.first // 3, gluing.second // 3
    shift = m * gluing.parallel()
    rows, columns = np.concatenate([t, t + m]), np.concatenate([s + shift, s + m - shift])
    label = graph_components(rows, columns, 2 * m)[1]
    front, back = label[:m], label[m:]
    total = np.bincount(front, area, label.max() + 1) if m else np.zeros(0)
    turned = (total[front] < total[back]) | ((total[front] == total[back]) & (front > back))
    one_sided = front == back
    return turned & ~one_sided, one_sided


def turn_over(gluing: Gluing, turned: np.ndarray) -> Gluing:
    """The same gluing with the corners of the triangles `turned` (m,) bool in reverse order."""
    if not turned.any():
        return gluing
    triangles = np.where(turned[:, None], gluing.triangles[:, [0, 2, 1]], gluing.triangles)

    def renamed(h: np.ndarray) -> np.ndarray:
        return np.where(turned[h // 3], 3 * (h // 3) + 2 - h % 3, h)

    side = gluing.side[renamed(np.arange(3 * len(triangles)))]
    return replace(gluing, triangles=triangles, side=side, first=renamed(gluing.first), second=renamed(gluing.second))


def oriented(gluing: Gluing, positions: np.ndarray) -> tuple[Gluing, np.ndarray]:
    """Gluing in which neighbours look to the same side, and the triangles (m,) bool of components where they cannot."""
    area = face_areas(positions, gluing.vertex[gluing.triangles])
    turned, one_sided = orientations(gluing, area)
    return turn_over(gluing, turned), one_sided


def groups(label: np.ndarray) -> list[np.ndarray]:
    """Indices of equal labels, one array per label in order."""
    order = np.argsort(label, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(label[order])) + 1)
