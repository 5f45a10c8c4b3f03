"""The volume-preserving flow of Hu, Zou and Hua (2014, section 4), as they give it, with the sign of their equation 8
mended.

Its velocity is the gradient of a potential with div V = (rho_Q - rho_P) / rho, so `L phi = -(rho_Q - rho_P) / rho`
with their positive Laplacian L. Volumes come right; tetrahedra invert, as triangles do under such flows in the plane.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..linalg.sparse import Factor
from ..progress import Progress, Steps
from .domains import BallDomain, CubeDomain
from .tet_mesh import gradients, graph_laplacian, stiffness, tet_volumes, vertex_share_error, vertex_volumes

# Steps of the flow in the paper.
STEPS = 50
# Least weight of an edge, relative to the mean.
POSITIVE = 1e-3


@dataclass(frozen=True)
class PaperFlow:
    """Positions (n,3), what volumes around vertices are off after every step, and the positions at those to `keep`."""

    positions: np.ndarray
    errors: tuple[float, ...]
    kept: tuple[np.ndarray, ...]


def paper_flow(
    points: np.ndarray,
    tets: np.ndarray,
    start: np.ndarray,
    domain: BallDomain | CubeDomain,
    steps: int = STEPS,
    keep: tuple[int, ...] = (),
) -> Steps[PaperFlow]:
    """Move a map `start` (n,3) of tetrahedra (m,4) of points (n,3) until volumes are right; the boundary slides."""
    rest = vertex_volumes(points, tets)
    rest = rest / rest.sum()
    share = tet_volumes(points, tets)
    at = start.copy()
    errors, kept = [vertex_share_error(at, tets, share)], [at] if 0 in keep else []
    now = vertex_volumes(at, tets)
    least = 1e-3 / len(points)
    before = rest / np.maximum(now / now.sum(), least)
    for k in range(steps):
        yield Progress("Flow", k / steps)
        now = vertex_volumes(at, tets)
        density = rest / np.maximum(now / now.sum(), least)
        source = -(before - 1.0) / density * np.abs(now)
        weights = stiffness(at, tets)
        weights = np.maximum(np.where(np.isfinite(weights), weights, 0.0), POSITIVE * np.nanmean(np.abs(weights)))
        matrix = sp.csr_matrix(graph_laplacian(tets, weights, len(at)))
        potential = Factor(matrix + 1e-9 * matrix.diagonal().mean() * sp.identity(len(at))).solve(
            source - source.mean()
        )
        at = domain.retract(at + _velocity(at, tets, potential) / steps)
        errors.append(vertex_share_error(at, tets, share))
        if k + 1 in keep:
            kept.append(at)
    return PaperFlow(at, tuple(errors), tuple(kept))


def _velocity(at: np.ndarray, tets: np.ndarray, potential: np.ndarray) -> np.ndarray:
    """Gradient (n,3) of a potential (n,), of tetrahedra averaged by inverse distances of their centres."""
    volume = np.abs(tet_volumes(at, tets))
    sound = volume > 1e-3 * volume.mean()
    mine = tets[sound]
    slope = np.einsum("ma,mai->mi", potential[mine], gradients(at, mine))
    weight = 1 / np.maximum(np.linalg.norm(at[mine] - at[mine].mean(axis=1, keepdims=True), axis=2), 1e-9)
    flat = mine.ravel()
    total = np.maximum(np.bincount(flat, weight.ravel(), len(at)), 1e-300)
    parts = [np.bincount(flat, (weight * slope[:, k : k + 1]).ravel(), len(at)) / total for k in range(3)]
    return np.stack(parts, axis=1)
