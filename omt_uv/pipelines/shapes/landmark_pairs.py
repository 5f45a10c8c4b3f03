"""Pair the landmarks of two objects by their names; each name once on either side."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ...errors import UserError
from ...solver.mesh.closest_point import ClosestPoint
from ...solver.mesh.geometry import halfedge_lengths, vertex_normals
from ...solver.registration.landmarks import Landmarks, no_landmarks

# No mesh has more.
MOST_VERTICES = 2**31 - 1


class PairsError(UserError):
    """Landmarks that are on one side alone, or twice; or a file of pairs that cannot be read."""


@dataclass(frozen=True)
class LandmarkPoint:
    """A landmark of an object: its name, and a vertex, or a position (3,) near the surface."""

    name: str
    vertex: int = -1
    position: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Pairs:
    """Landmarks of a source and a target in the same order."""

    source: tuple[LandmarkPoint, ...]
    target: tuple[LandmarkPoint, ...]


def pairs_of(source: list[LandmarkPoint], target: list[LandmarkPoint], names: tuple[str, str]) -> Pairs:
    """The landmarks of two objects, paired by name; names: of the objects.

    Raises
    ------
    PairsError : a name on one side only, or twice on one
    """
    for points, name in ((source, names[0]), (target, names[1])):
        every = [point.name for point in points]
        twice = sorted({n for n in every if every.count(n) > 1})
        if twice:
            raise PairsError(f"{name} has more than one landmark {', '.join(twice)}. Delete or rename one.")
    first, second = {p.name: p for p in source}, {p.name: p for p in target}
    for mine, other, name, far in ((first, second, *names), (second, first, names[1], names[0])):
        alone = sorted(mine.keys() - other.keys())
        if alone:
            raise PairsError(f"Landmarks {', '.join(alone)} are on {name} alone. Add them to {far}, or delete them.")
    return Pairs(tuple(first.values()), tuple(second[name] for name in first))


def read_pairs(path: Path) -> Pairs:
    """Pairs of a JSON file: a list of [source, target], each the number of a vertex or a position [x, y, z].

    Raises
    ------
    PairsError : no such file, or another content
    """
    try:
        rows = json.loads(path.read_text())
    except (OSError, ValueError, RecursionError) as error:
        raise PairsError(f"{path}: {error}") from error
    sides: tuple[list[LandmarkPoint], list[LandmarkPoint]] = ([], [])
    try:
        for k, row in enumerate(_list(rows)):
            for side, value in zip(sides, _list(row), strict=True):
                side.append(_point(f"{k}", value))
    except (TypeError, ValueError, OverflowError) as error:
        raise PairsError(
            f"{path}: pair {len(sides[1])} is none. Give a list of [source, target], "
            "each the number of a vertex or a position [x, y, z]."
        ) from error
    return Pairs(tuple(sides[0]), tuple(sides[1]))


def _list(value) -> list:
    """What is a list. Raises TypeError for what only goes through a loop as one does."""
    if not isinstance(value, list):
        raise TypeError("no list")
    return value


def _point(name: str, value) -> LandmarkPoint:
    """A point at the number of a vertex, or at a position [x, y, z]. Raises TypeError, ValueError, OverflowError."""
    if isinstance(value, int) and not isinstance(value, bool):
        if not 0 <= value <= MOST_VERTICES:
            raise ValueError("no number of a vertex")
        return LandmarkPoint(name, vertex=value)
    x, y, z = (float(v) for v in _list(value))
    if not math.isfinite(x + y + z):
        raise ValueError("no place")
    return LandmarkPoint(name, position=(x, y, z))


def landmarks_on(
    pairs: Pairs, source: tuple[np.ndarray, np.ndarray], target: tuple[np.ndarray, np.ndarray]
) -> Landmarks:
    """The pairs as points on two surfaces, each vertices (n,3) and triangles (m,3).

    Raises
    ------
    PairsError : a number of a vertex that a surface does not have
    """
    if not pairs.source:
        return no_landmarks()
    first, second = _located(pairs.source, *source), _located(pairs.target, *target)
    names = tuple(point.name for point in pairs.source)
    return Landmarks(first[0], first[1], second[0], second[1], names)


def _located(
    points: tuple[LandmarkPoint, ...], vertices: np.ndarray, triangles: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (k,) and barycentric coordinates (k,3) of landmarks on a surface (n,3), (m,3)."""
    chosen = np.array([point.vertex for point in points])
    place = np.array([point.position or (0.0, 0.0, 0.0) for point in points])
    used = np.unique(triangles)
    by_vertex = chosen >= 0
    wrong = [points[k].name for k in np.flatnonzero(by_vertex & ~np.isin(chosen, used)).tolist()]
    if wrong:
        raise PairsError(f"Landmarks {', '.join(wrong)} are at vertices that are not there, or in no face of the part.")
    place[by_vertex] = vertices[chosen[by_vertex]]
    spacing = float(np.median(halfedge_lengths(vertices, triangles)))
    near = used[((vertices[used][None] - place[:, None]) ** 2).sum(axis=2).argmin(axis=1)]
    closest = ClosestPoint(vertices, triangles, spacing)
    normals = vertex_normals(vertices, triangles)[near]
    found = closest.closer(place, normals, closest(place, normals))
    faces, barycentric = found.faces.copy(), found.barycentric.copy()
    order = np.argsort(triangles.ravel(), kind="stable")
    corner = order[np.searchsorted(triangles.ravel(), chosen[by_vertex], sorter=order)]
    faces[by_vertex], barycentric[by_vertex] = corner // 3, np.eye(3)[corner % 3]
    return faces, barycentric
