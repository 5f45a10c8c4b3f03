"""Cut small patches out of a mesh, disjoint rings around faces, to try something on copies of each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...mesh.geometry import of_corners


@dataclass(frozen=True)
class RingPatches:
    """Disjoint patches of a mesh, the vertices within some edges of a face in the middle of each.

    vertices (v,) and faces (f,) of the mesh; triangles (f,3) of the patches' own vertices; outer (v,) bool: the last
    ring of vertices; of_vertex (v,), of_face (f,): which patch; middle (p,): the face of every patch in the middle.
    """

    vertices: np.ndarray
    faces: np.ndarray
    triangles: np.ndarray
    outer: np.ndarray
    of_vertex: np.ndarray
    of_face: np.ndarray
    middle: np.ndarray

    def __len__(self) -> int:
        return len(self.middle)


def cut_patches(triangles: np.ndarray, middle: np.ndarray, n: int, rings: int) -> RingPatches:
    """Cut patches out of a mesh (m,3) with n vertices, around faces (p,) more than 2 `rings` + 2 edges apart."""
    label = np.full(n, -1)
    label[triangles[middle].ravel()] = np.repeat(np.arange(len(middle)), 3)
    inner = _grown(triangles, label, rings)
    label = _spread(triangles, inner)
    faces = np.flatnonzero(of_corners(np.maximum, inner[triangles]) >= 0)
    vertices, own = np.unique(triangles[faces], return_inverse=True)
    number = np.zeros(len(triangles), np.int64)
    number[faces] = np.arange(len(faces))
    of_face = label[triangles[faces, 0]]
    return RingPatches(
        vertices=vertices,
        faces=faces,
        triangles=own.reshape(-1, 3),
        outer=inner[vertices] < 0,
        of_vertex=label[vertices],
        of_face=of_face,
        middle=number[middle],
    )


def within_rings(triangles: np.ndarray, mask: np.ndarray, rings: int) -> np.ndarray:
    """Vertices (n,) bool within so many edges of those of a mask (n,)."""
    return _grown(triangles, np.where(mask, 0, -1), rings) >= 0


def _grown(triangles: np.ndarray, label: np.ndarray, rings: int) -> np.ndarray:
    for _ in range(rings):
        label = _spread(triangles, label)
    return label


def _spread(triangles: np.ndarray, label: np.ndarray) -> np.ndarray:
    """Labels (n,) of vertices, -1 for none, on all neighbours as well."""
    around = of_corners(np.maximum, label[triangles])
    mine = np.flatnonzero(around >= 0)
    label = label.copy()
    np.maximum.at(label, triangles[mine].ravel(), np.repeat(around[mine], 3))
    return label


def spaced_faces(triangles: np.ndarray, faces: np.ndarray, n: int, rings: int, most: int) -> np.ndarray:
    """Choose those of the faces (k,), in order of preference, with none before within so many edges; up to `most`."""
    chosen = np.zeros(0, np.int64)
    while len(faces) and len(chosen) < most:
        rank = np.full(n, len(faces))
        np.minimum.at(rank, triangles[faces].ravel(), np.repeat(np.arange(len(faces)), 3))
        for _ in range(rings):
            np.minimum.at(rank, triangles.ravel(), np.repeat(of_corners(np.minimum, rank[triangles]), 3))
        first = faces[(rank[triangles[faces]] == np.arange(len(faces))[:, None]).all(axis=1)]
        chosen = np.concatenate([chosen, first])
        near = np.zeros(n, dtype=bool)
        near[triangles[first]] = True
        near = within_rings(triangles, near, rings)
        faces = faces[~near[triangles[faces]].any(axis=1)]
    return chosen[:most]
