"""Map two surfaces to a common domain with areas kept: the unit sphere, or the unit disk.

Holes that do not count are closed by fans, for the map only. What the two surfaces must have in common is checked
first: one part each, no handles, and the same kind of boundary.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..errors import (
    EmptyMeshError,
    NonManifoldEdgeError,
    OrientationError,
    PinchedVertexError,
    SeveralComponentsError,
    TopologyMismatchError,
    ZeroAreaFaceError,
    plural,
)
from ..linalg.nested_dissection import mesh_order
from ..mesh.geometry import face_areas
from ..mesh.surface import check_finite, triangle_surface
from ..mesh.topology import boundary_edges, boundary_loops, graph_components, halfedges, pair_keys, paired, with_fans
from ..parameterization.options import UnwrapOptions
from ..parameterization.unwrap import unwrap
from ..progress import Steps
from ..sphere.sphere_map import sphere_map
from .carriers import DiskCarrier, InPlace, SphereCarrier, TargetCarrier
from .functional_maps import descriptors, eigenfunctions
from .landmarks import Landmarks, SplitSurface, check_landmarks, points_of, split_at
from .surface_newton import Features, flat

SPHERE = "sphere"
DISK = "disk"
AUTO = "auto"
CHARTS = "charts"
DOMAINS = (AUTO, SPHERE, DISK, CHARTS)
# The square of a boundary over the area up to which it is a hole in a body, as a mouth or a neck of one with arms and
# legs: a disk with so short a boundary has limbs, which no map of it to the plane has room for. Heads have 0.5 or more.
SMALL_OPENING = 0.1


@dataclass(frozen=True)
class FilledSurface:
    """A surface whose holes are closed: vertices (n,3), triangles (m,3), of which the first `count` are its own, and
    the first `own` of the vertices; loop (k,): its one boundary, in order, where it is to be a disk."""

    vertices: np.ndarray
    triangles: np.ndarray
    own: int
    count: int
    holes: int
    loop: np.ndarray


def kind_of(source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray], domain: str) -> str:
    """The domain for a source (n,3), (m,3) and a target: the disk where both are open by more than a small hole."""
    if domain != AUTO:
        return domain
    return DISK if all(_opening(*surface) > SMALL_OPENING for surface in (source, target)) else SPHERE


def _opening(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """The square of the longest boundary over the area of a surface (n,3), (m,3): 4 pi of a disk, 0 of a closed one."""
    around = (_around(vertices, loop) for loop in boundary_loops(triangles))
    return max(around, default=0.0) ** 2 / max(float(face_areas(vertices, triangles).sum()), 1e-300)


def _around(vertices: np.ndarray, loop: np.ndarray) -> float:
    """How long a closed line through vertices (k,) is."""
    return float(np.linalg.norm(vertices[loop] - vertices[np.roll(loop, -1)], axis=1).sum())


def checked(vertices: np.ndarray, triangles: np.ndarray, name: str) -> None:
    """Raise unless a surface (n,3), (m,3) is one manifold part without handles, all of whose vertices are used.

    name : "source" or "target", for the message
    """
    if not len(triangles):
        raise EmptyMeshError(f"The {name} has no faces")
    check_finite(vertices, triangles)
    tail, head = halfedges(triangles)
    key, count = np.unique(pair_keys(tail, head), return_counts=True)
    ends = paired(key)
    if (count > 2).any():
        raise NonManifoldEdgeError(f"More than two faces of the {name} meet at an edge", "", "edge", ends[count > 2])
    directed = tail * len(vertices) + head
    _, first, repeated = np.unique(directed, return_index=True, return_counts=True)
    if (repeated > 1).any():
        wrong = first[repeated > 1]
        pairs = np.stack([tail[wrong], head[wrong]], axis=1)
        raise OrientationError(f"Neighbouring faces of the {name} have opposite orientation", "", "edge", pairs)
    part = graph_components(tail, head, len(vertices))[1][triangles[:, 0]]
    _, of, size = np.unique(part, return_inverse=True, return_counts=True)
    if len(size) > 1:
        rest = np.flatnonzero(of.ravel() != size.argmax())
        raise SeveralComponentsError(f"The {name} has {len(size)} parts", "Match its parts one by one", "face", rest)
    edges = boundary_edges(triangles)
    pinched = np.flatnonzero(np.bincount(edges[:, 0], minlength=len(vertices)) > 1)
    if len(pinched):
        raise PinchedVertexError(f"Boundaries of the {name} touch in a vertex", "", "vertex", pinched)
    euler = len(vertices) - len(key) + len(triangles) + len(boundary_loops(triangles))
    if euler != 2:
        handles = (2 - euler) // 2
        raise TopologyMismatchError(
            f"The {name} has {plural(handles, 'a handle', '{} handles')}",
            "Match surfaces without handles; or mark the same seams on both, and match charts cut alike",
        )


def filled(surface: tuple[np.ndarray, np.ndarray], domain: str, name: str) -> FilledSurface:
    """A surface, vertices (n,3) and triangles (m,3), with a fan in every hole; a disk keeps the longest boundary.

    Raises
    ------
    TopologyMismatchError : a closed surface, and the domain is a disk
    """
    vertices, triangles = surface
    loops = boundary_loops(triangles)
    lengths = [_around(vertices, loop) for loop in loops]
    outer = np.zeros(0, np.int64)
    if domain == DISK:
        if not loops:
            raise TopologyMismatchError(
                f"The {name} is closed, and the other surface is not",
                "Open both or close both, or take the sphere as domain, which closes holes",
            )
        outer = loops.pop(int(np.argmax(lengths)))
    closed, faces = with_fans(vertices, triangles, loops)
    return FilledSurface(
        vertices=closed,
        triangles=faces,
        own=len(vertices),
        count=len(triangles),
        holes=len(loops),
        loop=outer,
    )


def domain_map(surface: FilledSurface, domain: str, balance: float) -> Steps[np.ndarray]:
    """Places of the vertices in the domain: unit vectors (n,3), or points of the unit disk (n,2).

    Areas are kept at balance 0, angles at 1. Raises MeshError: see `sphere.sphere_map`, `parameterization.unwrap`.
    """
    if domain == SPHERE:
        return (yield from sphere_map(surface.vertices, surface.triangles, balance=balance)).positions
    options = UnwrapOptions(boundary="disk", balance=balance, seams="existing")
    found = yield from unwrap(triangle_surface(surface.vertices, surface.triangles), options=options)
    corners, uv = found.corner_uv()
    places = np.zeros((len(surface.vertices), 2))
    places[surface.triangles.ravel()[corners]] = uv
    return places / np.linalg.norm(places[surface.loop], axis=1).mean()


@dataclass(frozen=True)
class Pair:
    """Both surfaces, ready: the source with holes filled, landmarks as vertices, renumbered; all in units of extent 1
    and of equal area. order (n,): vertex of `split` that each vertex was; targets: triangle and coordinates of each
    landmark's place."""

    source: FilledSurface
    target: FilledSurface
    split: SplitSurface
    order: np.ndarray
    vertices: np.ndarray
    triangles: np.ndarray
    landmarks: np.ndarray
    targets: tuple[np.ndarray, np.ndarray]
    loop: np.ndarray
    domain: str

    @cached_property
    def described(self) -> tuple[np.ndarray, np.ndarray]:
        """Descriptors (n,c) of the source's vertices and (k,c) of the target's."""
        return descriptors(self.vertices, self.triangles), descriptors(self.target.vertices, self.target.triangles)

    @cached_property
    def spectra(self) -> tuple[np.ndarray, np.ndarray]:
        """As many eigenfunctions (n,c) of the source as (k,c) of the target."""
        first = eigenfunctions(self.vertices, self.triangles)
        second = eigenfunctions(self.target.vertices, self.target.triangles)
        count = min(first.shape[1], second.shape[1])
        return first[:, :count], second[:, :count]


def prepared(source, target, landmarks: Landmarks, domain: str) -> Pair:
    """Holes filled, landmarks made vertices, sizes alike, vertices in the order of elimination.

    source, target : vertices (n,3) and triangles (m,3). Raises LandmarkError, TopologyMismatchError, ZeroAreaFaceError.
    """
    domain = kind_of(source, target, domain)
    first, second = filled(source, domain, "source"), filled(target, domain, "target")
    sizes = [np.sqrt(face_areas(surface.vertices, surface.triangles).sum()) for surface in (first, second)]
    if not min(sizes) > 0:
        raise ZeroAreaFaceError("A surface has no area", "Give meshes whose faces are no lines and no points")
    first = replace(first, vertices=(first.vertices - first.vertices.mean(axis=0)) / sizes[0])
    second = replace(second, vertices=(second.vertices - second.vertices.mean(axis=0)) / sizes[1])
    check_landmarks(
        landmarks, *points_of(landmarks, (first.vertices, first.triangles), (second.vertices, second.triangles))
    )
    split = split_at(first.vertices, first.triangles, landmarks.source_faces, landmarks.source_barycentric)
    order = mesh_order(split.vertices, split.triangles)
    place = np.empty(len(order), np.int64)
    place[order] = np.arange(len(order))
    return Pair(
        source=first,
        target=second,
        split=split,
        order=order,
        vertices=split.vertices[order],
        triangles=place[split.triangles],
        landmarks=place[split.landmarks],
        targets=(landmarks.target_faces, landmarks.target_barycentric),
        loop=place[first.loop],
        domain=domain,
    )


@dataclass(frozen=True)
class Case:
    """A pair, and what both maps to the domain made of it: where the source's vertices lie there, (n,d), turned onto
    the target's map; the target as a carrier; features that are to be kept."""

    pair: Pair
    aligned: np.ndarray
    carrier: TargetCarrier
    features: Features | None

    @cached_property
    def targets(self) -> InPlace:
        """The places of the landmarks."""
        return self.carrier.at(*self.pair.targets)

    def domain_carrier(self, loop: np.ndarray) -> SphereCarrier | DiskCarrier:
        """The domain as a carrier, for a mesh with vertices (k,) on its circle."""
        return SphereCarrier() if self.pair.domain == SPHERE else DiskCarrier(loop)

    def flat_targets(self) -> InPlace:
        """The places of the landmarks in the domain."""
        return flat(self.targets)
