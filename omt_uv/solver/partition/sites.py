"""Put sites onto a surface: as many into every part as its mass asks for, spread by halving samples, and k-means."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..errors import CountError
from ..mesh.closest_point import random_points
from ..mesh.geometry import face_areas, face_normals
from ..mesh.topology import triangle_parts

# Samples for every site, and rounds of k-means.
SAMPLES = 40
ROUNDS = 3
# Weight of normals against places, in radii of a cell: the two sides of something thin are far apart.
NORMALS = 0.4
# Sites keep this distance from the sides of their triangle, in barycentric coordinates.
INSIDE = 1e-3


@dataclass(frozen=True)
class Sites:
    """Points of a surface: triangles (k,) and barycentric coordinates (k,3), all of them positive."""

    triangle: np.ndarray
    barycentric: np.ndarray

    def positions(self, positions: np.ndarray, triangles: np.ndarray) -> np.ndarray:
        """Places (k,3) of the sites on a mesh (n,3), (m,3)."""
        return np.einsum("kc,kcd->kd", self.barycentric, positions[triangles[self.triangle]])


def inner(barycentric: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (k,3), moved into the triangle as far as sites lie."""
    moved = np.maximum(barycentric, INSIDE)
    return moved / moved.sum(axis=1, keepdims=True)


def parts(triangles: np.ndarray, n: int) -> np.ndarray:
    """The part (m,), from 0 up, of every triangle (m,3) of n vertices."""
    return np.unique(triangle_parts(triangles, n), return_inverse=True)[1].ravel()


def allot(mass: np.ndarray, count: int) -> np.ndarray:
    """Numbers (k,) of cells, `count` in all, for parts of the masses (k,): in proportion, and one at least.

    Raises
    ------
    CountError : fewer cells than parts
    """
    if count < len(mass):
        raise CountError(
            f"{count} cells are fewer than the {len(mass)} separate parts of the mesh",
            f"Ask for {len(mass)} cells or more, or join the parts",
        )
    share = mass / mass.sum() * count
    found = np.maximum(np.floor(share).astype(np.int64), 1)
    while found.sum() > count:
        found[np.argmax(np.where(found > 1, found - share, -np.inf))] -= 1
    # What is left goes to those that are farthest below their share, one each.
    short = np.argsort(found - share, kind="stable")[: count - int(found.sum())]
    found[short] += 1
    return found


def spread(
    positions: np.ndarray, triangles: np.ndarray, mass: np.ndarray, part: np.ndarray, counts: np.ndarray, seed: int
) -> Sites:
    """Sites on a mesh (n,3), (m,3), `counts` (k,) of them in each part (m,), by the mass (m,) of its triangles."""
    rng = np.random.default_rng(seed)
    normals = face_normals(positions, triangles)
    area = np.bincount(part, face_areas(positions, triangles), len(counts))
    order = np.argsort(part, kind="stable")
    ends = np.cumsum(np.bincount(part, minlength=len(counts)))
    found = []
    for members, count, size in zip(np.split(order, ends[:-1]), counts, np.sqrt(area / counts), strict=True):
        face, barycentric = random_points(mass[members], int(count) * SAMPLES, rng)
        face = members[face]
        places = np.einsum("kc,kcd->kd", barycentric, positions[triangles[face]])
        features = np.concatenate([places, NORMALS * size * normals[face]], axis=1)
        chosen = _k_means(features, int(count))
        found.append((face[chosen], barycentric[chosen]))
    triangle, barycentric = (np.concatenate(k) for k in zip(*found, strict=True))
    return Sites(triangle, inner(barycentric))


def _k_means(features: np.ndarray, count: int) -> np.ndarray:
    """Indices (count,) of points (k,d) next to the means of as many clusters of them (Lloyd 1982).

    At first all have the same number of points: masses that are out of balance far and wide would take long to mend.
    """
    centres = np.stack([features[group].mean(axis=0) for group in _halved(features, np.arange(len(features)), count)])
    for _ in range(ROUNDS):
        nearest = cKDTree(centres).query(features)[1]
        size = np.bincount(nearest, minlength=count)
        mean = np.stack([np.bincount(nearest, f, count) for f in features.T], axis=1) / np.maximum(size, 1)[:, None]
        centres = np.where(size[:, None] > 0, mean, centres)
    return _distinct(cKDTree(features).query(centres)[1], len(features))


def _halved(features: np.ndarray, group: np.ndarray, count: int) -> list[np.ndarray]:
    """Points (g,) of (k,d) in `count` groups of the same size, split across their longest extents."""
    if count == 1:
        return [group]
    mine = features[group]
    along = mine[:, np.ptp(mine, axis=0).argmax()]
    low = count // 2
    at = len(group) * low // count
    order = np.argpartition(along, at)
    return [
        *_halved(features, group[order[:at]], low),
        *_halved(features, group[order[at:]], count - low),
    ]


def _distinct(chosen: np.ndarray, n: int) -> np.ndarray:
    """The numbers (k,) below n, with those that repeat replaced by some that are not among them."""
    first = np.unique(chosen, return_index=True)[1]
    again = np.ones(len(chosen), bool)
    again[first] = False
    free = np.setdiff1d(np.arange(n), chosen)
    found = chosen.copy()
    found[again] = free[np.linspace(0, len(free) - 1, int(again.sum())).astype(np.int64)] if again.any() else 0
    return found
