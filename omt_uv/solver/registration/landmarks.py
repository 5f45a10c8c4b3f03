"""Check pairs of landmarks, and make vertices of them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import HandednessError, LandmarkError
from .alignment import rotation_of_pairs

# A landmark this near to a vertex, in barycentric coordinates, is at the vertex.
AT_VERTEX = 1e-9
# Landmarks nearer to each other than this share of the extent are one.
SAME = 1e-9
# Mean square distance on the unit sphere from which landmarks do not fit, and the share of it that mirroring leaves.
MISFIT = 0.1
MIRRORED_SHARE = 0.25


@dataclass(frozen=True)
class Landmarks:
    """Pairs of points, triangles (k,) and barycentric coordinates (k,3) of both surfaces, and a name of each pair."""

    source_faces: np.ndarray
    source_barycentric: np.ndarray
    target_faces: np.ndarray
    target_barycentric: np.ndarray
    names: tuple[str, ...] = field(default=())

    def name(self, k: int) -> str:
        """What a message calls the k-th pair."""
        return repr(self.names[k]) if k < len(self.names) else f"{k}"

    def __len__(self) -> int:
        return len(self.source_faces)


@dataclass(frozen=True)
class SplitSurface:
    """Triangles (m,3) with landmarks as vertices (k,): vertices (n,3), and of every triangle the parent (m,) and the
    barycentric coordinates (m,3,3) of its corners there."""

    vertices: np.ndarray
    triangles: np.ndarray
    landmarks: np.ndarray
    parent: np.ndarray
    corners: np.ndarray


def no_landmarks() -> Landmarks:
    """No pairs at all."""
    none, empty = np.zeros(0, np.int64), np.zeros((0, 3))
    return Landmarks(none, empty, none, empty)


def vertex_landmarks(
    source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray], names: tuple[str, ...] = ()
) -> Landmarks:
    """Landmarks from vertices (k,) of triangles (m,3) of the source, and the same of the target.

    Raises
    ------
    LandmarkError : not as many here as there, or a vertex of no triangle
    """
    (vertices, triangles), (others, other_triangles) = source, target
    if len(vertices) != len(others):
        raise LandmarkError(f"There are {len(vertices)} landmarks on the source and {len(others)} on the target")
    return Landmarks(*_points(vertices, triangles, "source"), *_points(others, other_triangles, "target"), names)


def _points(vertices: np.ndarray, triangles: np.ndarray, name: str) -> tuple[np.ndarray, np.ndarray]:
    """A triangle (k,) at each of the vertices (k,), and its coordinates there (k,3)."""
    vertices = np.asarray(vertices, np.int64)
    order = np.argsort(triangles.ravel(), kind="stable")
    found = np.minimum(np.searchsorted(triangles.ravel(), vertices, sorter=order), len(order) - 1)
    corner = order[found]
    wrong = np.unique(vertices[triangles.ravel()[corner] != vertices])
    if len(wrong):
        raise LandmarkError(f"Landmarks of the {name} are at vertices without faces", "", "vertex", wrong)
    return corner // 3, np.eye(3)[corner % 3]


def check_landmarks(landmarks: Landmarks, source: np.ndarray, target: np.ndarray) -> None:
    """Raise LandmarkError where two landmarks of a side coincide, given their points (k,3) on both surfaces."""
    for points, name in ((source, "source"), (target, "target")):
        if len(points) < 2:
            continue
        # Squares of lengths of any size are within floats by a power of two, which rounds nothing.
        points = np.ldexp(points, -np.frexp(np.abs(points).max())[1])
        apart = np.linalg.norm(points[:, None] - points, axis=2) + np.diag(np.full(len(points), np.inf))
        a, b = np.unravel_index(apart.argmin(), apart.shape)
        if apart[a, b] <= SAME * float(np.abs(points).max()):
            pair = f"{landmarks.name(int(a))} and {landmarks.name(int(b))}"
            raise LandmarkError(f"Landmarks {pair} are the same point of the {name}")


def check_handedness(landmarks: Landmarks, source: np.ndarray, target: np.ndarray) -> None:
    """Raise HandednessError where landmarks (k,3), (k,3) on the unit sphere fit far better with one side mirrored."""
    if len(landmarks) < 3:
        return
    proper, mirrored = rotation_of_pairs(source, target), rotation_of_pairs(source, target, mirrored=True)
    if proper.error > MISFIT and mirrored.error < MIRRORED_SHARE * proper.error:
        raise HandednessError("The landmarks of the source are a mirror image of those of the target")


def split_at(vertices: np.ndarray, triangles: np.ndarray, faces: np.ndarray, barycentric: np.ndarray) -> SplitSurface:
    """A surface (n,3), (m,3) with vertices at points, coordinates (k,3) in triangles (k,): three triangles for one.

    A second landmark in a triangle, or one on an edge, goes to the nearest corner instead.
    """
    landmarks = triangles[faces, barycentric.argmax(axis=1)]
    inside = (barycentric > AT_VERTEX).all(axis=1)
    _, first = np.unique(np.where(inside, faces, -1 - np.arange(len(faces))), return_index=True)
    alone = np.zeros(len(faces), bool)
    alone[first] = True
    split = np.flatnonzero(inside & alone)
    own = faces[split]
    points = np.einsum("kc,kcd->kd", barycentric[split], vertices[triangles[own]])
    new = len(vertices) + np.arange(len(split))
    landmarks[split] = new
    parent, corners = np.arange(len(triangles)), np.broadcast_to(np.eye(3), (len(triangles), 3, 3)).copy()
    triangles, added, parents, coordinates = triangles.copy(), [], [], []
    for corner in range(3):
        piece, place = triangles[own].copy(), np.broadcast_to(np.eye(3), (len(own), 3, 3)).copy()
        piece[:, corner], place[:, corner] = new, barycentric[split]
        added.append(piece)
        parents.append(own)
        coordinates.append(place)
    triangles[own], corners[own] = added[0], coordinates[0]
    return SplitSurface(
        vertices=np.concatenate([vertices, points]),
        triangles=np.concatenate([triangles, *added[1:]]),
        landmarks=landmarks,
        parent=np.concatenate([parent, *parents[1:]]),
        corners=np.concatenate([corners, *coordinates[1:]]),
    )


def points_of(
    landmarks: Landmarks, source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Where landmarks are, (k,3) and (k,3), on surfaces, each vertices (n,3) and triangles (m,3)."""
    first = source[0][source[1][landmarks.source_faces]]
    second = target[0][target[1][landmarks.target_faces]]
    return (
        np.einsum("kc,kcd->kd", landmarks.source_barycentric, first),
        np.einsum("kc,kcd->kd", landmarks.target_barycentric, second),
    )


def reflected(
    vertices: np.ndarray, triangles: np.ndarray, landmarks: Landmarks
) -> tuple[np.ndarray, np.ndarray, Landmarks]:
    """The mirror image of a surface (n,3), (m,3) that looks outside, and the landmarks on it."""
    turned = landmarks.source_barycentric[:, [0, 2, 1]]
    return vertices * [-1, 1, 1], triangles[:, [0, 2, 1]], replace(landmarks, source_barycentric=turned)
