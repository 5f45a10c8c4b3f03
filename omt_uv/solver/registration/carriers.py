"""What vertices move on while a map is optimised: the unit sphere, the unit disk, or a surface with a map of its own.

Each gives tangents, takes steps along them, and tells folds: by the orientation of the faces in the domain, which is
the same for all positions on the surface that a map without folds has.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from ..mesh.geometry import signed_areas, unit
from ..mesh.point_location import locate
from ..mesh.spherical_geometry import normalized, signed_volumes
from ..mesh.topology import boundary_edges, twins
from ..sphere.newton import tangents
from .straight_walks import StraightWalks


@dataclass(frozen=True)
class InPlace:
    """Vertices in their places: positions (n,3), places in the domain (n,3) or (n,2), and where the carrier is a
    surface, its triangle (n,) and barycentric coordinates (n,3)."""

    positions: np.ndarray
    domain: np.ndarray
    faces: np.ndarray
    barycentric: np.ndarray

    def chosen(self, take: np.ndarray, other: InPlace) -> InPlace:
        """These places, and those of the other where take (n,) is False."""
        parts = zip(vars(self).values(), vars(other).values(), strict=True)
        return InPlace(*(np.where(take.reshape(-1, *[1] * (a.ndim - 1)), a, b) for a, b in parts))

    def put(self, vertices: np.ndarray, places: InPlace, take: np.ndarray) -> None:
        """Set vertices (k,) to those of the places (l,) that take (l,) bool says, in these very arrays."""
        for part, place in zip(vars(self).values(), vars(places).values(), strict=True):
            part[vertices] = place[take]


class Carrier(Protocol):
    """Where vertices may be, and how they move there."""

    # Whether the positions are unit vectors, so that a pull along the radius bends a step.
    round: bool

    def place(self, domain: np.ndarray) -> InPlace:
        """Places of points of the domain (k,d)."""

    def within(self, domain: np.ndarray) -> np.ndarray:
        """Means of points of the domain (k,d), back in it."""

    def axes(self, placed: InPlace) -> np.ndarray:
        """Two orthonormal tangents (n,2,3), 0 for a direction in which a vertex must not go."""

    def move(self, placed: InPlace, step: np.ndarray) -> InPlace:
        """The places after steps (n,3) in space along the tangents."""

    def folded(self, placed: InPlace, triangles: np.ndarray) -> np.ndarray:
        """Triangles (m,) bool of (m,3) that are folded in the domain."""


class SphereCarrier:
    """The unit sphere."""

    round = True

    def place(self, positions: np.ndarray) -> InPlace:
        """Unit vectors (n,3) as places."""
        n = len(positions)
        return InPlace(positions, positions, np.zeros(n, np.int64), np.zeros((n, 3)))

    def within(self, domain: np.ndarray) -> np.ndarray:
        """Means of unit vectors (k,3), back on the sphere."""
        return normalized(domain)

    def axes(self, placed: InPlace) -> np.ndarray:
        """Any two tangents (n,2,3)."""
        return tangents(placed.positions)

    def move(self, placed: InPlace, step: np.ndarray) -> InPlace:
        """By normalising the sum, (n,3)."""
        return self.place(normalized(placed.positions + step))

    def folded(self, placed: InPlace, triangles: np.ndarray) -> np.ndarray:
        """(m,) bool: triangles (m,3) that are clockwise seen from outside."""
        return ~(signed_volumes(placed.domain, triangles) > 0)


class DiskCarrier:
    """The unit disk; vertices of the loop (k,) slide on the circle."""

    round = False

    def __init__(self, loop: np.ndarray):
        self.loop = loop

    def place(self, uv: np.ndarray) -> InPlace:
        """Points of the plane (n,2) as places."""
        n = len(uv)
        return InPlace(np.column_stack([uv, np.zeros(n)]), uv, np.zeros(n, np.int64), np.zeros((n, 3)))

    def within(self, domain: np.ndarray) -> np.ndarray:
        """Means of points of the disk (k,2), as they are."""
        return domain

    def axes(self, placed: InPlace) -> np.ndarray:
        """The axes of the plane (n,2,3); along the circle, and none, for the loop."""
        axes = np.broadcast_to(np.eye(3)[:2], (len(placed.positions), 2, 3)).copy()
        at = placed.domain[self.loop]
        axes[self.loop] = 0
        axes[self.loop, 0, :2] = np.column_stack([-at[:, 1], at[:, 0]])
        return axes

    def move(self, placed: InPlace, step: np.ndarray) -> InPlace:
        """The sum (n,3), back on the circle for the loop."""
        moved = placed.domain + step[:, :2]
        moved[self.loop] = normalized(moved[self.loop])
        return self.place(moved)

    def folded(self, placed: InPlace, triangles: np.ndarray) -> np.ndarray:
        """(m,) bool: triangles (m,3) that are clockwise."""
        return ~(signed_areas(placed.domain, triangles) > 0)


class TargetCarrier:
    """A surface (n,3), (m,3) with a map without folds (n,d) to the sphere or the plane.

    loop (k,): vertices, of the mesh that moves, that slide on the boundary of the surface
    """

    round = False

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray, domain: np.ndarray, loop: np.ndarray | None = None):
        self.vertices, self.triangles, self.domain = vertices, triangles, domain
        self.loop = np.zeros(0, np.int64) if loop is None else loop
        self.walks = StraightWalks(vertices, triangles)

    def sliding(self, loop: np.ndarray) -> TargetCarrier:
        """The same for a mesh whose vertices (k,) slide on the boundary."""
        other = copy(self)
        other.loop = loop
        return other

    @cached_property
    def outline(self) -> _Outline:
        """The boundary of the surface."""
        return _Outline(self.vertices, self.triangles)

    def place(self, domain: np.ndarray) -> InPlace:
        """Points of the domain (k,d) as places on the surface."""
        return self.at(*locate(self.domain, self.triangles, domain))

    def within(self, domain: np.ndarray) -> np.ndarray:
        """Means of points of the domain (k,d), back in it."""
        return normalized(domain) if domain.shape[1] == 3 else domain

    def at(self, faces: np.ndarray, barycentric: np.ndarray) -> InPlace:
        """Places of barycentric coordinates (k,3) in triangles (k,)."""
        corners = self.triangles[faces]
        domain = np.einsum("kc,kcd->kd", barycentric, self.domain[corners])
        if domain.shape[1] == 3:
            domain = normalized(domain)
        return InPlace(np.einsum("kc,kcd->kd", barycentric, self.vertices[corners]), domain, faces, barycentric)

    def axes(self, placed: InPlace) -> np.ndarray:
        """Tangents (n,2,3) in the planes of the faces; along the boundary for the loop."""
        axes = tangents(self.walks.normals[placed.faces])
        if len(self.loop):
            axes[self.loop] = 0
            axes[self.loop, 0] = self.outline.direction(placed.faces[self.loop], placed.barycentric[self.loop])
        return axes

    def pushed(self, placed: InPlace, axes: np.ndarray) -> np.ndarray:
        """How places in the domain change along tangents (n,2,3) on the surface, (n,2,3)."""
        speed = np.einsum("ncd,nad->nac", self.walks.gradients[placed.faces], axes)
        corner = self.domain[self.triangles[placed.faces]]
        change = np.einsum("nac,ncd->nad", speed, corner)
        if corner.shape[2] == 2:
            return np.concatenate([change, np.zeros((len(change), 2, 1))], axis=2)
        size = np.linalg.norm(np.einsum("nc,ncd->nd", placed.barycentric, corner), axis=1)
        radial = np.einsum("nad,nd->na", change, placed.domain)
        return (change - radial[..., None] * placed.domain[:, None]) / size[:, None, None]

    def move(self, placed: InPlace, step: np.ndarray) -> InPlace:
        """Where straight walks (n,) end; the nearest points of the boundary for the loop."""
        faces, barycentric = self.walks(placed.faces, placed.barycentric, step)
        if len(self.loop):
            target = placed.positions[self.loop] + step[self.loop]
            faces[self.loop], barycentric[self.loop] = self.outline.nearest(target)
        return self.at(faces, barycentric)

    def folded(self, placed: InPlace, triangles: np.ndarray) -> np.ndarray:
        """(m,) bool: triangles (m,3) that are folded in the domain of the surface."""
        if placed.domain.shape[1] == 3:
            return ~(signed_volumes(placed.domain, triangles) > 0)
        return ~(signed_areas(placed.domain, triangles) > 0)


class _Outline:
    """The one boundary loop of a surface."""

    def __init__(self, vertices: np.ndarray, triangles: np.ndarray):
        from scipy.spatial import cKDTree

        edges = boundary_edges(triangles)
        self.begin, self.end = vertices[edges[:, 0]], vertices[edges[:, 1]]
        self.halfedge = np.flatnonzero(twins(triangles) < 0)
        self.of_halfedge = np.full(triangles.size, -1)
        self.of_halfedge[self.halfedge] = np.arange(len(edges))
        self.tree = cKDTree((self.begin + self.end) / 2)

    def nearest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Triangles (k,) and coordinates (k,3) of the nearest points of the boundary."""
        near = self.tree.query(points, k=min(8, len(self.begin)))[1].reshape(len(points), -1)
        a, way = self.begin[near], (self.end - self.begin)[near]
        along = np.einsum("kcd,kcd->kc", points[:, None] - a, way) / np.einsum("kcd,kcd->kc", way, way)
        along = np.clip(along, 0, 1)
        distance = np.linalg.norm(a + along[..., None] * way - points[:, None], axis=2)
        best = distance.argmin(axis=1)
        row = np.arange(len(points))
        halfedge, along = self.halfedge[near[row, best]], along[row, best]
        barycentric = np.zeros((len(points), 3))
        barycentric[row, halfedge % 3], barycentric[row, (halfedge + 1) % 3] = 1 - along, along
        return halfedge // 3, barycentric

    def direction(self, faces: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """Unit vectors (k,3) along the boundary at points of it."""
        # The edge opposite to the corner whose coordinate is 0.
        halfedges = 3 * faces[:, None] + np.arange(3)
        here = self.of_halfedge[halfedges]
        opposite = barycentric[:, [2, 0, 1]]
        pick = np.where(here >= 0, opposite, np.inf).argmin(axis=1)
        edge = here[np.arange(len(faces)), pick]
        return unit(self.end[edge] - self.begin[edge])
