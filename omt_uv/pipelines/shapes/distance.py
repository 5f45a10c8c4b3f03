"""The signature of what a file holds, and many of them as one array."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...solver.mesh.surface import Surface, chosen_triangles
from ...solver.progress import Steps
from ...solver.signatures.signature import POINTS, Signature, signature


def signature_of(surfaces: Sequence[Surface], count: int = POINTS) -> Steps[Signature]:
    """The signature of the largest part of several surfaces.

    Raises
    ------
    MeshError : nothing to compare, or a body with handles
    """
    triangles, positions, n = [], [], 0
    for surface in surfaces:
        _, corners, _ = chosen_triangles(surface, None)
        triangles.append(surface.corner_vertex[corners] + n)
        positions.append(surface.positions)
        n += len(surface.positions)
    return (yield from signature(np.concatenate(positions), np.concatenate(triangles), count))


def packed(found: Signature) -> np.ndarray:
    """A signature as one small array (k,4), single precision."""
    return np.column_stack([found.points, found.curvature]).astype(np.float32)


def unpacked(array: np.ndarray) -> Signature:
    """The signature of an array (k,4)."""
    array = array.astype(float)
    return Signature(array[:, :3] / np.linalg.norm(array[:, :3], axis=1, keepdims=True), array[:, 3])
