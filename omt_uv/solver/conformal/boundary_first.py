"""Flatten a disk almost conformally with the boundary as it comes, by one factorisation (Sawhney, Crane 2017).

The log scale u is 0 on the boundary, which distorts areas least (Springborn, Schroeder, Pinkall 2008), and solves
L u = -K inside. What of the curvature flows out there turns the boundary: its curve has the old lengths and the angles
k + (L u), and closes after the least change of its lengths. Both coordinates are harmonic inside.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.sparse import csr_matrix, identity

from ..linalg.sparse import Factor
from ..mesh.geometry import (
    LEAST_STIFFNESS,
    angle_defects,
    angles_from_lengths,
    halfedge_lengths,
    laplacian_from_lengths,
    lengths,
    vertex_areas,
)

# Added to the diagonal, relative to its mean: log scales that their flux determines may all grow by the same.
SHIFT = 1e-10
# Of the share that a disk is bent by until it does not cover itself.
HALVINGS = 5
# The greatest log scale of a side: the products of lengths stay far from what double precision ends at.
MOST_SCALE = 50.0


@dataclass(frozen=True)
class FlatDisk:
    """A disk in the plane: uv (n,2), log_scale (n,) of the lengths there, area (n,) of the surface at the vertices.

    It may have folds, and cover itself.
    """

    uv: np.ndarray
    log_scale: np.ndarray
    area: np.ndarray
    system: HarmonicSystem = field(repr=False, compare=False)

    def spread(self, asked: np.ndarray) -> float:
        """Mean square over the surface of the log scale, beyond half the log of the areas asked for (n,) over its own.

        Their sum does not matter.
        """
        share = self.area / self.area.sum()
        beyond = self.log_scale - 0.5 * np.log(asked / self.area)
        return float(share @ (beyond - share @ beyond) ** 2)

    def bent(self, share: float) -> np.ndarray:
        """The disk (n,2), almost conformal as well, with a boundary that turns by this share of what it turns by here,
        and for the rest as evenly as a circle: with 0 it is convex, and what covers itself here comes apart before."""
        system = self.system
        turn = share * system.turn + (1 - share) * system.even_turn
        return system.inside_of(_closed_curve(system.side * np.exp((1 - share) * system.even_scale), turn))

    def bent_until(self, is_apart: Callable[[np.ndarray], bool]) -> np.ndarray | None:
        """The disk (n,2), bent as little as makes this true; None where no bent one does."""
        found, share = None, 0.0
        for k in range(1, HALVINGS + 1):
            uv = self.bent(share + 0.5**k)
            if is_apart(uv):
                found, share = uv, share + 0.5**k
        return found


@dataclass(frozen=True)
class HarmonicSystem:
    """What flat maps of one disk have in common: laplacian (n,n), the factors of its part inside, the vertices there
    (i,), in the order of their elimination, and all (n,) in theirs; the loop (b,) with its sides (b,), from each vertex
    to the next, and the turns (b,) of the map whose log scale is 0 there."""

    laplacian: csr_matrix
    factor: Factor | None
    inner: np.ndarray
    order: np.ndarray | None
    loop: np.ndarray
    side: np.ndarray
    turn: np.ndarray

    def inside_of(self, boundary: np.ndarray) -> np.ndarray:
        """The harmonic map (n,2) with this boundary (b,2)."""
        uv = np.zeros((self.laplacian.shape[0], 2))
        uv[self.loop] = boundary
        if self.factor is not None:
            uv[self.inner] = self.factor.solve(-(self.outside @ boundary))
        return uv

    @cached_property
    def outside(self) -> csr_matrix:
        """What the laplacian makes of the boundary inside, (i,b)."""
        return self.laplacian[self.inner][:, self.loop]

    @property
    def even_turn(self) -> np.ndarray:
        """The turns (b,) of a circle, in proportion to the sides."""
        return np.pi * (self.side + np.roll(self.side, 1)) / self.side.sum()

    @cached_property
    def even_scale(self) -> np.ndarray:
        """The log scale (b,) of the sides of the map that turns evenly: turns are the flux of log scales."""
        n = self.laplacian.shape[0]
        flux = np.zeros(n)
        flux[self.loop] = self.even_turn - self.turn
        shift = SHIFT * float(self.laplacian.diagonal().mean())
        scale = Factor(self.laplacian + shift * identity(n), self.order).solve(flux)[self.loop]
        scale = (scale + np.roll(scale, -1)) / 2
        return np.clip(scale - scale.mean(), -MOST_SCALE, MOST_SCALE)


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
    within = laplacian[inner][:, inner].tocsc()
    log_scale = np.zeros(n)
    factor = Factor(within, None if order is None else "natural") if len(inner) else None
    if factor is not None:
        log_scale[inner] = factor.solve(-curvature[inner])
    side = lengths(np.roll(vertices[loop], -1, axis=0) - vertices[loop])
    turn = curvature[loop] + laplacian[loop] @ log_scale
    system = HarmonicSystem(laplacian, factor, inner, order, loop, side, turn)
    return FlatDisk(system.inside_of(_closed_curve(side, turn)), log_scale, vertex_areas(vertices, triangles), system)


def _closed_curve(side: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Corners (b,2) of a closed polygon that turns by these angles (b,), with these sides (b,), but for what closes
    it."""
    heading = np.cumsum(turn) - turn[0]
    direction = np.stack([np.cos(heading), np.sin(heading)])
    # The change of lengths that closes it, least in the squares over the lengths.
    pull = np.linalg.lstsq((direction * side) @ direction.T, direction @ side, rcond=None)[0]
    step = direction * (side - (direction.T @ pull) * side)
    return np.roll(np.cumsum(step, axis=1), 1, axis=1).T
