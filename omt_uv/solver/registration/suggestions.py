"""Suggest landmarks: places that stand out on both surfaces, look alike, and lie alike.

What stands out is a peak of saliency (Lee, Varshney, Jacobs 2005); what looks alike has near descriptors; what lies
alike is near after both were put into a box of one size. A pair is suggested if each is the other's best.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.saliency import saliency, unit_size
from ..errors import EmptyMeshError
from ..mesh.geometry import face_areas, vertex_normals
from ..mesh.surface import check_finite
from ..mesh.topology import halfedges
from .functional_maps import descriptors

# Peaks of a surface that are compared, the strongest first, and how far apart they are at least, over the diagonal.
PEAKS = 40
APART = 0.05
# Weight of the squared distance, over the diagonal, and of the normals, next to that of the descriptors.
PLACE_WEIGHT = 60.0
NORMAL_WEIGHT = 1.0
# A pair that differs by more is none.
MOST_DIFFERENCE = 4.0


@dataclass(frozen=True)
class Suggestions:
    """Vertices (k,) of a source and (k,) of a target that may correspond, and how much they differ (k,), the least
    first."""

    source: np.ndarray
    target: np.ndarray
    difference: np.ndarray


def suggest_landmarks(
    source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray], most: int = 12
) -> Suggestions:
    """Pairs of vertices of a source (n,3), (m,3) and a target (k,3), (l,3) that look and lie alike, at most so many.

    Raises
    ------
    EmptyMeshError, NonFiniteError : see `check_side`
    """
    for side in (source, target):
        check_side(*side)
    first, second = _described(*source), _described(*target)
    if not (len(first[0]) and len(second[0])):
        # A surface may be as curved everywhere.
        none = np.zeros(0, np.int64)
        return Suggestions(none, none, np.zeros(0))
    difference = ((first[1][:, None] - second[1]) ** 2).sum(axis=2)
    best, other = difference.argmin(axis=1), difference.argmin(axis=0)
    row = np.arange(len(best))
    mutual = (other[best] == row) & (difference[row, best] < MOST_DIFFERENCE)
    row = row[mutual]
    order = row[np.argsort(difference[row, best[row]], kind="stable")][:most]
    return Suggestions(first[0][order], second[0][best[order]], difference[order, best[order]])


def check_side(vertices: np.ndarray, triangles: np.ndarray) -> None:
    """Raise EmptyMeshError or NonFiniteError where a surface (n,3), (m,3) has no face, or none with an area, or a face
    that is nowhere."""
    if not len(triangles):
        raise EmptyMeshError("There are no faces to look at", "Choose a mesh with faces")
    check_finite(vertices, triangles)
    if not face_areas(vertices, triangles).any():
        raise EmptyMeshError("No face has an area", "Choose a mesh whose faces are no lines and no points")


def _described(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Peaks (k,) of saliency, and what they are compared by (k,c)."""
    value = saliency(vertices, triangles)
    place = unit_size(vertices, triangles)
    peaks = _peaks(value, place, triangles)
    normal = vertex_normals(vertices, triangles)[peaks]
    looks = descriptors(vertices, triangles)[peaks]
    return peaks, np.column_stack([looks, np.sqrt(PLACE_WEIGHT) * place[peaks], np.sqrt(NORMAL_WEIGHT) * normal])


def _peaks(value: np.ndarray, place: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """The strongest local maxima (k,) of values (n,), no two of them near each other."""
    highest = np.zeros(len(value))
    tail, head = halfedges(triangles)
    np.maximum.at(highest, tail, value[head])
    np.maximum.at(highest, head, value[tail])
    left = np.flatnonzero((value >= highest) & (value > 0))
    left = left[np.argsort(-value[left], kind="stable")]
    found: list[int] = []
    while len(left) and len(found) < PEAKS:
        found.append(int(left[0]))
        left = left[np.linalg.norm(place[left] - place[left[0]], axis=1) > APART]
    return np.array(found, np.int64)
