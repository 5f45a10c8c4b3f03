"""Scale a metric conformally to prescribed cone angles, by dynamic Yamabe flow (Gu, Luo, Sun, Wu 2018).

Lengths l_ij exp(u_i + u_j), and Ptolemy flips that keep the triangulation Delaunay. The energy of the ideal Delaunay
triangulation is convex and its gradient is the angle defect (Springborn, Schroeder, Pinkall 2008; Gillespie,
Springborn, Crane 2021), so on a closed surface a solution always exists and Newton's method finds it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import PrecisionError
from ..linalg.sparse import solve_spd
from ..mesh.geometry import angles_from_lengths, cotangents_from_lengths, laplacian_from_weights
from ..mesh.topology import halfedges
from ..progress import Progress, Steps
from .intrinsic_triangulation import IntrinsicTriangulation, make_delaunay, ptolemy_diagonal

TOLERANCE = 1e-10  # largest error of an angle sum, radians
MAX_STEPS = 40
# Scale factors spread further than this put neighbouring vertices closer than double precision resolves.
MAX_LOG_SCALE = 30.0


@dataclass(frozen=True)
class YamabeFlow:
    """A metric with the cone angles that were prescribed.

    Attributes
    ----------
    triangulation : Delaunay, of the unscaled metric
    log_scale : (n,) u
    length : (m,3) sides of its triangles in the scaled metric
    residual : largest error of an angle sum, in radians
    iterations, flips : Newton steps, and edges flipped
    """

    triangulation: IntrinsicTriangulation
    log_scale: np.ndarray
    length: np.ndarray
    residual: float
    iterations: int
    flips: int


def yamabe_flow(
    tri: IntrinsicTriangulation, owner: np.ndarray, cone_angle: np.ndarray, tolerance: float = TOLERANCE
) -> Steps[YamabeFlow]:
    """Scale a closed triangulation conformally until its cone angles are the prescribed ones.

    Parameters
    ----------
    tri : closed and Delaunay, with vertices 0 ... k-1
    owner : (k,) unknown that scales each vertex; vertices that mirror each other share one
    cone_angle : (n,) radians, sum of the angles around all vertices of each unknown; Gauss-Bonnet must hold
    tolerance : largest error of an angle sum, in radians

    Raises
    ------
    PrecisionError : the scale factors leave double precision, or Newton's method does not converge
    """
    n = len(cone_angle)
    u = np.zeros(n)
    length, gradient = _metric(tri, owner, u, cone_angle)
    total_flips = 0
    first = max(np.abs(gradient).max(), tolerance)
    for iteration in range(MAX_STEPS):
        residual = float(np.abs(gradient).max())
        done = 1 - np.log(max(residual, tolerance) / tolerance) / np.log(1 + first / tolerance)
        yield Progress("Conformal map", float(np.clip(done, 0, 1)))
        if residual <= tolerance:
            return YamabeFlow(
                triangulation=tri,
                log_scale=u,
                length=length,
                residual=residual,
                iterations=iteration,
                flips=total_flips,
            )
        direction = _newton_direction(tri, owner, length, gradient)
        slope = gradient @ direction
        step = 1.0
        while True:
            trial = u + step * direction
            if np.ptp(trial) < 2 * MAX_LOG_SCALE:
                new_tri, flips = make_delaunay(tri, ptolemy_diagonal, trial[owner])
                new_length, new_gradient = _metric(new_tri, owner, trial, cone_angle)
                # The energy is convex: before its minimum along the ray the slope keeps its sign.
                new_slope = new_gradient @ direction
                if new_slope <= 0.1 * abs(slope):
                    break
            step /= 2
            if step < 1e-4:
                raise PrecisionError("The conformal map leaves double precision: Newton's method is stuck")
        u, tri, length, gradient = trial, new_tri, new_length, new_gradient
        total_flips += flips
        if np.ptp(u) > MAX_LOG_SCALE:
            raise PrecisionError("The conformal map leaves double precision: its scale varies too much")
    raise PrecisionError(f"The conformal map did not converge in {MAX_STEPS} steps")


def _metric(tri, owner, u, cone_angle):
    """Side lengths (m,3) and angle defect per unknown (n,) at the scale factors u."""
    length = np.exp(tri.scaled(u[owner])).reshape(-1, 3)
    angle = angles_from_lengths(length)
    corner = owner[tri.triangles[:, [2, 0, 1]]]
    return length, cone_angle - np.bincount(corner.ravel(), angle.ravel(), len(u))


def _newton_direction(tri, owner, length, gradient):
    """The Hessian is the cotangent Laplacian of the current metric; a common scale is its kernel."""
    n = len(gradient)
    tail, head = halfedges(tri.triangles)
    weight = cotangents_from_lengths(length).ravel()
    hessian = laplacian_from_weights(owner[tail], owner[head], weight, n)[1:, 1:]
    direction = np.concatenate([[0.0], solve_spd(hessian.tocsc(), -gradient[1:], order="mmd")])
    return direction - direction.mean()
