"""Walk straight over a surface: across every edge as if its two faces were unfolded into a plane.

Straightest geodesics (Polthier, Schmies 1998), many at once. Unlike closest points of points off the surface, they do
not get stuck in creases.
"""

from __future__ import annotations

import numpy as np

from ..mesh.geometry import cross3, face_normals
from ..mesh.topology import next_halfedge, twins

# Edges that a walk crosses at most.
MOST_CROSSINGS = 300
# Barycentric coordinate that a walk starts from at least: at a vertex it would not know which face it leaves by.
INSIDE = 1e-10


class StraightWalks:
    """Walks over a surface (n,3), (m,3)."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray):
        self.vertices, self.triangles = vertices, triangles
        self.normals = face_normals(vertices, triangles)
        self.twin = twins(triangles)
        p = vertices[triangles]
        first, second = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
        # Gradients of the barycentric coordinates within the planes of the faces.
        normal = cross3(first, second)
        square = np.maximum((normal**2).sum(axis=1), 1e-300)[:, None]
        two, three = cross3(second, normal) / square, cross3(normal, first) / square
        self.gradients = np.stack([-two - three, two, three], axis=1)

    def __call__(self, faces: np.ndarray, barycentric: np.ndarray, step: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (k,) and coordinates (k,3) where walks end that go steps (k,3) from coordinates in triangles.

        A walk ends at a boundary.
        """
        faces = faces.copy()
        barycentric = np.maximum(barycentric, INSIDE)
        barycentric /= barycentric.sum(axis=1, keepdims=True)
        left, active = _within(step, self.normals[faces]), np.arange(len(faces))
        for _ in range(MOST_CROSSINGS):
            if not len(active):
                break
            face, here = faces[active], barycentric[active]
            speed = np.einsum("kcd,kd->kc", self.gradients[face], left[active])
            until = np.where(speed < 0, here / np.where(speed < 0, -speed, 1), np.inf)
            side = until.argmin(axis=1)
            share = until[np.arange(len(active)), side]
            ends = share >= 1
            barycentric[active] = np.maximum(here + np.minimum(share, 1)[:, None] * speed, 0)
            active, face, side, share = active[~ends], face[~ends], side[~ends], share[~ends]
            # Opposite to corner k is the halfedge k + 1.
            halfedge = next_halfedge(3 * face + side)
            other = self.twin[halfedge]
            goes_on = other >= 0
            active, halfedge, other = active[goes_on], halfedge[goes_on], other[goes_on]
            self._cross(faces, barycentric, left, active, (halfedge, other, 1 - share[goes_on]))
        return faces, barycentric / barycentric.sum(axis=1, keepdims=True)

    def _cross(self, faces, barycentric, left, active, over) -> None:
        """Carry walks (k,) `active` over halfedges (k,) into their twins (k,), with shares (k,) of the way left."""
        halfedge, other, share = over
        here = barycentric[active]
        row = np.arange(len(active))
        tail, head = here[row, halfedge % 3], here[row, next_halfedge(halfedge) % 3]
        faces[active] = other // 3
        there = np.zeros((len(active), 3))
        # The twin runs the other way.
        there[row, other % 3], there[row, next_halfedge(other) % 3] = head, tail
        barycentric[active] = there
        begin = self.vertices[self.triangles.ravel()[halfedge]]
        end = self.vertices[self.triangles.ravel()[next_halfedge(halfedge)]]
        edge = end - begin
        edge = edge / np.maximum(np.linalg.norm(edge, axis=1, keepdims=True), 1e-300)
        way = left[active] * share[:, None]
        along = np.einsum("kd,kd->k", way, edge)
        # To the right of the halfedge, out of the old face, is to the left of its twin, into the new one.
        out = np.einsum("kd,kd->k", way, cross3(edge, self.normals[halfedge // 3]))
        into = cross3(edge, self.normals[other // 3])
        left[active] = along[:, None] * edge + out[:, None] * into


def _within(step: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Steps (k,3) turned into the planes of normals (k,3), lengths kept."""
    flat = step - np.einsum("kd,kd->k", step, normal)[:, None] * normal
    size, new = np.linalg.norm(step, axis=1), np.linalg.norm(flat, axis=1)
    return flat * (size / np.where(new > 0, new, 1))[:, None]
