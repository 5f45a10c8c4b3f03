"""Flatten a disk almost conformally with the boundary as it comes, by one factorisation (Sawhney, Crane 2017).

The log scale u is 0 on the boundary, which distorts areas least (Springborn, Schroeder, Pinkall 2008), and solves
L u = -K inside. What of the curvature flows out there turns the boundary: its curve has the old lengths and the angles
k + (L u), and closes after the least change of its lengths. Both coordinates are harmonic inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..linalg.sparse import Factor
from ..mesh.geometry import (
    LEAST_STIFFNESS,
    angle_defects,
    angles_from_lengths,
    halfedge_lengths,
    laplacian_from_lengths,
    vertex_areas,
)


@dataclass(frozen=True)
class FlatDisk:
    """A disk in the plane: uv (n,2), log_scale (n,) of the lengths there, area (n,) of the surface at the vertices.

    It may have folds, and cover itself.
    """

    uv: np.ndarray
    log_scale: np.ndarray
    area: np.ndarray

    def spread(self, asked: np.ndarray) -> float:
        """Mean square over the surface of the log scale, beyond half the log of the areas asked for (n,) over its own.

        Their sum does not matter.
        """
        share = self.area / self.area.sum()
        beyond = self.log_scale - 0.5 * np.log(asked / self.area)
        return float(share @ (beyond - share @ beyond) ** 2)


def boundary_first(
    vertices: np.ndarray, triangles: np.ndarray, loop: np.ndarray, order: np.ndarray | None = None
) -> FlatDisk:
    """Flatten a disk (n,3), (m,3) with its boundary loop (b,), in the unit of the vertices; order (n,): see
    `nested_dissection.mesh_order`.

    Raises
    ------
    PrecisionError : the surface is degenerate

    References
    ----------
    Sawhney, Crane 2017, Boundary First Flattening, section 4.
    """
    n = len(vertices)
    length = halfedge_lengths(vertices, triangles).reshape(-1, 3)
    laplacian = laplacian_from_lengths(length, triangles, n, LEAST_STIFFNESS)
    curvature = angle_defects(triangles, angles_from_lengths(length), loop, n)
    inside = np.ones(n, bool)
    inside[loop] = False
    inner = np.flatnonzero(inside) if order is None else order[inside[order]]
    rows = laplacian[inner]
    uv, log_scale = np.zeros((n, 2)), np.zeros(n)
    factor = Factor(rows[:, inner].tocsc(), None if order is None else "natural") if len(inner) else None
    if factor is not None:
        log_scale[inner] = factor.solve(-curvature[inner])
    uv[loop] = _closed_curve(vertices[loop], curvature[loop] + laplacian[loop] @ log_scale)
    if factor is not None:
        uv[inner] = factor.solve(-(rows[:, loop] @ uv[loop]))
    return FlatDisk(uv, log_scale, vertex_areas(vertices, triangles))


def _closed_curve(points: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Corners (b,2) of a closed polygon that turns by these angles (b,), with the sides of points (b,3), but for what
    closes it."""
    side = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    heading = np.cumsum(turn) - turn[0]
    direction = np.stack([np.cos(heading), np.sin(heading)])
    # The change of lengths that closes it, least in the squares over the lengths.
    pull = np.linalg.lstsq((direction * side) @ direction.T, direction @ side, rcond=None)[0]
    step = direction * (side - (direction.T @ pull) * side)
    return np.roll(np.cumsum(step, axis=1), 1, axis=1).T
