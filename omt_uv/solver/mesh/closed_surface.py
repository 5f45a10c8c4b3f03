"""Check that a surface is closed and of genus 0, move it into a unit box, and give area to faces that have none."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import (
    DISSOLVE,
    DuplicateFaceError,
    EmptyMeshError,
    LooseVertexError,
    NonFiniteError,
    NonManifoldEdgeError,
    NotASphereError,
    OpenSurfaceError,
    OrientationError,
    PinchedVertexError,
    RepeatedVertexError,
    SeveralComponentsError,
    plural,
)
from .geometry import bounding_box
from .repair import faces_without_area, perturbed
from .topology import graph_components, halfedges, next_halfedge, pair_keys, paired

CUT_OPEN = "Only closed surfaces without handles map to a sphere; unwrap it with cuts"
# What is inside of a body is in no chart of its surface.
SOLID = "Only bodies without handles map to a ball; fill the tunnels through it"
FILL_BODY = "Fill the holes, or take the library tetwild, which does"


@dataclass(frozen=True)
class ClosedSurface:
    """Positions (n,3) in a unit box about 0, triangles (m,3), extent of the original, and what was repaired."""

    vertices: np.ndarray
    triangles: np.ndarray
    extent: float
    warnings: tuple[str, ...]


def closed_surface(
    vertices: np.ndarray, triangles: np.ndarray, polygons: np.ndarray | None = None, body: bool = False
) -> ClosedSurface:
    """Check that a mesh (n,3), (m,3) is one topological sphere, and repair triangles without area.

    polygons (m,): polygon of every triangle, of which those that have no area are warned of; by default each is its own
    body : the surface is asked for what it encloses, which no chart has

    Raises
    ------
    MeshError : EmptyMeshError, NonFiniteError, DuplicateFaceError, NonManifoldEdgeError, OrientationError;
        NotASphereError for boundaries, handles, several components, fans that meet at a vertex, and loose vertices;
        ZeroAreaFaceError where no repair helps. Elements are indices of the input's vertices, edges and triangles.
    """
    vertices, triangles = np.asarray(vertices, float), np.asarray(triangles, np.int64)
    if not len(triangles):
        raise EmptyMeshError("There are no faces to map to the sphere")
    wrong = np.flatnonzero(~np.isfinite(vertices).all(axis=1))
    if len(wrong):
        raise NonFiniteError("Coordinates are not finite numbers", kind="vertex", elements=wrong)
    _check_faces(triangles)
    _check_edges(triangles, body)
    _check_components(triangles, len(vertices))
    _check_genus(triangles, body)
    middle, extent = bounding_box(vertices)
    extent = extent or 1.0
    given = (vertices - middle) / extent
    sound, moved = perturbed(given, triangles, 1.0)
    warnings: tuple[str, ...] = ()
    faces = np.arange(len(triangles)) if polygons is None else polygons
    if moved and (count := faces_without_area(given, triangles, faces)):
        who = plural(count, "A face has", "{} faces have")
        warnings = (f"{who} no area and got a little for the map; {DISSOLVE}",)
    return ClosedSurface(vertices=sound, triangles=triangles, extent=extent, warnings=warnings)


def _check_faces(triangles: np.ndarray) -> None:
    """Raise unless every triangle (m,3) has three vertices, and no other triangle has the same."""
    a, b, c = np.sort(triangles, axis=1).T
    repeating = np.flatnonzero((a == b) | (b == c))
    if len(repeating):
        raise RepeatedVertexError("A face uses a vertex twice", kind="face", elements=repeating)
    _, inverse, count = np.unique(np.stack([a, b, c], axis=1), axis=0, return_inverse=True, return_counts=True)
    double = np.flatnonzero(count[inverse.ravel()] > 1)
    if len(double):
        raise DuplicateFaceError("Several faces have the same vertices", kind="face", elements=double)


def _check_edges(triangles: np.ndarray, body: bool) -> None:
    """Raise unless every edge has two faces that agree about which side is out."""
    tail, head = halfedges(triangles)
    edges, inverse, count = np.unique(pair_keys(tail, head), return_inverse=True, return_counts=True)
    ends = paired(edges)
    if (count > 2).any():
        raise NonManifoldEdgeError("More than two faces meet at an edge", kind="edge", elements=ends[count > 2])
    forward = np.bincount(inverse.ravel(), tail < head, len(edges))
    if (unlike := (count == 2) & (forward != 1)).any():
        raise OrientationError("Neighbouring faces have opposite orientation", kind="edge", elements=ends[unlike])
    if (count < 2).any():
        raise OpenSurfaceError(
            "The surface is not closed: it has boundary edges", FILL_BODY if body else "", "edge", ends[count < 2]
        )


def _check_components(triangles: np.ndarray, n: int) -> None:
    """Raise unless n vertices are connected by the faces, with one fan of them around each."""
    used = np.zeros(n, dtype=bool)
    used[triangles] = True
    if not used.all():
        raise LooseVertexError("A vertex belongs to no face", kind="vertex", elements=np.flatnonzero(~used))
    tail, head = halfedges(triangles)
    count, component = graph_components(tail, head, n)
    if count > 1:
        of_face = component[triangles[:, 0]]
        largest = np.bincount(of_face).argmax()
        raise SeveralComponentsError(
            f"The surface has {count} parts", kind="face", elements=np.flatnonzero(of_face != largest)
        )
    # Corners of one fan follow each other across edges.
    m = len(triangles)
    order = np.lexsort((tail < head, pair_keys(tail, head)))
    first, second = order[0::2], order[1::2]
    rows = np.concatenate([first, next_halfedge(first)])
    columns = np.concatenate([next_halfedge(second), second])
    fans, fan = graph_components(rows, columns, 3 * m)
    if fans > n:
        pairs = np.unique(np.stack([triangles.ravel(), fan], axis=1), axis=0)
        torn = np.flatnonzero(np.bincount(pairs[:, 0], minlength=n) > 1)
        raise PinchedVertexError("Several fans of faces meet in one vertex", kind="vertex", elements=torn)


def _check_genus(triangles: np.ndarray, body: bool) -> None:
    """Raise unless the closed surface has no handles, by Euler's formula."""
    n, m = int(triangles.max()) + 1, len(triangles)
    # Every edge has two faces: V - E + F = n - m / 2 = 2 - 2 genus.
    genus = (2 - (n - m // 2)) // 2
    if genus > 0:
        handles = plural(genus, "a handle", "{} handles")
        raise NotASphereError(f"The surface has {handles}", SOLID if body else CUT_OPEN)
