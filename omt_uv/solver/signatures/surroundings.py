"""Cut out what lies around a vertex, as far along the surface as another one is: what markers mean on a closed body."""

from __future__ import annotations

import numpy as np

from ..errors import LandmarkError
from ..mesh.geometry import halfedge_lengths
from ..mesh.topology import boundary_loops, pair_keys, paired, with_fans
from ..partition.polar_coordinates import WindowMesh, polar_coordinates
from ..partition.sites import Sites, inner

# Distances are found as far as this over the straight one at first, and grow by as much.
REACH = 1.5
MOST_GROWTHS = 40
# Vertices are on the circle when they are nearer to it than this share of an edge: what is left of triangles would be
# slivers.
NEAR = 0.05


def surroundings(
    vertices: np.ndarray, faces: np.ndarray, centre: int, start: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The part of a connected mesh (n,3), (m,3) that is no farther from the vertex `centre`, along the surface, than
    the vertex `start`: vertices (k,3), triangles (l,3), and which (k,) vertices they were, -1 for new ones. Holes that
    lie within it are filled.

    Raises
    ------
    LandmarkError : both markers at one place
    """
    if not np.linalg.norm(vertices[start] - vertices[centre]) > 0:
        raise LandmarkError("Both markers are at one place", "Mark two that are apart", "vertex", [centre, start])
    n, loops = len(vertices), boundary_loops(faces)
    filled = with_fans(vertices, faces, loops)
    distance = _distances(*filled, centre, start)
    # Ways lead over holes, but not over a boundary that the surface ends at.
    within = [loop for loop in loops if (distance[loop] <= distance[start]).all()]
    if len(within) < len(loops):
        filled = with_fans(vertices, faces, within)
        distance = _distances(*filled, centre, start)
    vertices, faces = filled
    beyond = distance - distance[start]
    edge = halfedge_lengths(vertices, faces)[(beyond[faces] < 0).any(axis=1).repeat(3)].mean()
    beyond[np.abs(beyond) < NEAR * edge] = 0.0
    beyond[centre], beyond[start] = -distance[start], 0.0
    vertices, faces, old = _below(vertices, faces, beyond)
    return vertices, faces, np.where(old < n, old, -1)


def _distances(vertices: np.ndarray, faces: np.ndarray, centre: int, start: int) -> np.ndarray:
    """Distances (n,) from one vertex along the surface, infinite farther than a bit beyond another one."""
    mesh = WindowMesh(vertices, faces)
    at, corner = (int(k[0]) for k in np.nonzero(faces == centre))
    sites = Sites(np.array([at]), inner(np.eye(3)[[corner]]))
    radius = REACH * np.linalg.norm(vertices[start] - vertices[centre])
    for _ in range(MOST_GROWTHS):
        found = polar_coordinates(mesh, sites, np.array([radius]), np.array([0]))
        distance = np.full(len(vertices), np.inf)
        np.minimum.at(distance, faces[found.face], np.sqrt(found.squared))
        # What the last ring has may still come nearer by ways through what was left out.
        if distance[start] * REACH <= radius:
            return distance
        radius *= REACH
    raise LandmarkError("No way leads from marker to marker", "Mark two vertices of one part", "vertex", [start])


def _below(vertices: np.ndarray, faces: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where linear functions of the values (n,) at the corners are negative: vertices (k,3), triangles (l,3), and which
    (k,) vertices they were, -1 for new ones."""
    faces = faces[(value[faces] < 0).any(axis=1)]
    inside = value[faces] <= 0
    count = inside.sum(axis=1)
    # The corner that is unlike the others comes first.
    odd = np.where(count == 2, (~inside).argmax(axis=1), inside.argmax(axis=1))
    a, b, c = faces[np.arange(len(faces))[:, None], (odd[:, None] + np.arange(3)) % 3].T
    two, one = count == 2, count == 1
    within = np.concatenate([b[two], c[two], a[one], a[one]])
    outside = np.concatenate([a[two], a[two], b[one], c[one]])
    key, place = np.unique(pair_keys(within, outside), return_inverse=True)
    x, y = paired(key).T
    with np.errstate(invalid="ignore"):
        share = np.where(np.isfinite(value[x] + value[y]), value[x] / (value[x] - value[y]), 0.5)[:, None]
    cut = vertices[x] + share * (vertices[y] - vertices[x])
    # A vertex on the circle is the end of its edges itself.
    crossing = np.where(value[within] == 0, within, len(vertices) + place.ravel())
    pb, pc, qb, qc = np.split(crossing, np.cumsum([two.sum(), two.sum(), one.sum()]))
    every = np.concatenate([
        faces[count == 3],
        np.stack([pb, b[two], c[two]], axis=1),
        np.stack([pb, c[two], pc], axis=1),
        np.stack([a[one], qb, qc], axis=1),
    ])  # fmt: skip
    every = every[(every != every[:, [1, 2, 0]]).all(axis=1)]
    used, local = np.unique(every, return_inverse=True)
    old = np.where(used < len(vertices), used, -1)
    return np.concatenate([vertices, cut])[used], local.reshape(-1, 3), old
