"""Find the motion, with a reflection or without, that takes one surface to another, vertex by vertex."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.topology import pair_keys

# Vertices that correspond are nearer to one another than this share of the extent.
TOLERANCE = 1e-4
# Share of the sides of triangles that have to be the same; in grids of quads a third are diagonals.
SAME_SIDES = 0.5
# Frames of the second surface that are tried: symmetric bodies have many that fit.
MOST_FRAMES = 200


@dataclass(frozen=True)
class Match:
    """vertices (n,): of the second surface, that which each of the first one goes to; whether by a reflection."""

    vertices: np.ndarray
    mirrored: bool


def matching(V: np.ndarray, F: np.ndarray, V2: np.ndarray, F2: np.ndarray) -> Match | None:
    """The motion of space that takes a surface to another one of the same faces, None where there is none.

    The centre, the vertex farthest from it and the one that spans the largest triangle with both fix a frame; every
    frame of the second surface with the same lengths is tried. Motions come before reflections.

    Parameters
    ----------
    V, F, V2, F2 : (n,3) positions and (m,3) triangles of both

    Examples
    --------
    >>> import numpy as np
    >>> V, F = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0.0]]), np.array([[0, 1, 2]])
    >>> matching(V, F, V[[1, 2, 0]] + 5, np.array([[2, 0, 1]])).vertices.tolist()
    [2, 0, 1]
    """
    if V.shape != V2.shape or F.shape != F2.shape or not len(V):
        return None
    P, Q = V - V.mean(axis=0), V2 - V2.mean(axis=0)
    near = nearness(P)
    r, s = np.linalg.norm(P, axis=1), np.linalg.norm(Q, axis=1)
    if np.abs(np.sort(r) - np.sort(s)).max() > near:
        return None
    a = int(r.argmax())
    b = int(np.linalg.norm(np.cross(P[a], P), axis=1).argmax())
    rows, columns = np.flatnonzero(np.abs(s - r[a]) <= near), np.flatnonzero(np.abs(s - r[b]) <= near)
    length = np.linalg.norm(Q[rows][:, None] - Q[columns][None], axis=2)
    pairs = np.argwhere(np.abs(length - np.linalg.norm(P[a] - P[b])) <= near)[:MOST_FRAMES]
    if not len(pairs):
        return None
    frame, tree = _frame(P[a], P[b]), cKDTree(Q)
    for sign in (1.0, -1.0):
        for i, j in pairs.tolist():
            other = _frame(Q[rows[i]], Q[columns[j]])
            turn = frame.T @ (other * [[1.0], [1.0], [sign]])
            found = _checked(P @ turn, tree, F, F2, near)
            if found is not None:
                return Match(found, sign < 0)
    return None


def mirrored_match(
    V: np.ndarray, F: np.ndarray, V2: np.ndarray, F2: np.ndarray, normal: np.ndarray, at: float
) -> np.ndarray | None:
    """Vertices (n,) of the second surface that are those of the first one seen in a plane; None if it is another.

    normal (3,), of length 1, and at : the plane, normal . x = at
    """
    if V.shape != V2.shape or F.shape != F2.shape or not len(V):
        return None
    image = V - 2 * (V @ normal - at)[:, None] * normal
    return _checked(image, cKDTree(V2), F, F2, nearness(V))


def nearness(V: np.ndarray) -> float:
    """How near to one another vertices that correspond lie, of a surface with positions (n,3)."""
    return TOLERANCE * max(float(np.ptp(V, axis=0).max()), 1e-300)


def _frame(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Rows of a right-handed orthonormal frame (3,3): a, b in the plane of both, and their normal."""
    x = a / max(np.linalg.norm(a), 1e-300)
    y = b - (b @ x) * x
    length = np.linalg.norm(y)
    y = y / length if length > 0 else np.cross(x, [0.0, 0.0, 1.0] if abs(x[2]) < 0.9 else [1.0, 0.0, 0.0])
    return np.stack([x, y, np.cross(x, y)])


def _checked(image: np.ndarray, tree: cKDTree, F: np.ndarray, F2: np.ndarray, near: float) -> np.ndarray | None:
    """Nearest vertices (n,) of the other surface, if each is near and once, and the faces go to faces."""
    gap, vertex = tree.query(image)
    if gap.max() > near or len(np.unique(vertex)) < len(vertex):
        return None
    # Polygons may be cut along other diagonals: sides of triangles that stay are enough.
    one, other = (np.unique(pair_keys(faces.ravel(), np.roll(faces, -1, axis=1).ravel())) for faces in (vertex[F], F2))
    return vertex if np.isin(one, other, assume_unique=True).mean() > SAME_SIDES else None
