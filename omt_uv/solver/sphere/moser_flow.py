"""Map the sphere to itself with prescribed areas, by Moser's flow without a time step (Moser 1965).

As in Dominitz, Tannenbaum 2010, section 3.1, the density of the surface, carried to the sphere by a conformal map,
flows to the uniform one. With the masses A of the
faces at first and S at last, m(t) = A - t (A - S), and a flux F with div F = A - S, everything moves with the velocity
F / m. The flux is that of the lowest Raviart-Thomas elements, one number for every edge, so masses are exact for every
face. In barycentric coordinates of a face the motion is

    d lambda_k / dt = (lambda_k D - F_k) / (2 m),    D = sum F_k = A - S,

with F_k the flux out across the side opposite to k, and it has a closed solution: points go from side to side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..linalg.sparse import solve_spd
from ..mesh.geometry import cross3, lengths
from ..mesh.spherical_geometry import spherical_areas
from ..mesh.topology import next_halfedge, previous_halfedge, twins
from ..progress import Progress, Steps

# Barycentric coordinate, by its corner, of the centre of the share of a face that belongs to the corner.
CORNER_SHARE = 22 / 36
# Rounds of points crossing into the next face, after which what still moves stays where it is.
CROSSINGS = 20_000
# Least mass of a face at the end, relative to the mean: faces folded on the sphere have less than none.
LEAST_SHARE = 1e-6
# Least barycentric coordinate: a point that has just come in does not leave at once for a rounding error.
GRAZE = 1e-14


@dataclass(frozen=True)
class MoserMap:
    """A map of the sphere: positions (n,3), unit vectors, the middle of the image of every vertex' cell.

    crossings: rounds of faces that points crossed; stuck: points that had to be left on the way; status.
    """

    positions: np.ndarray
    crossings: int
    stuck: int
    status: str


def moser_map(points: np.ndarray, triangles: np.ndarray, mass: np.ndarray) -> Steps[MoserMap]:
    """Carry the vertices (n,3) of a map to the sphere along so that the masses (m,) of its faces (m,3) become uniform.

    Faces have to be counter-clockwise seen from outside. With the flux of `edge_fluxes`, points in the corners of every
    face move by the closed solution in the module's head; a vertex goes to their mean.

    Raises
    ------
    PrecisionError : the system for the flux is singular
    """
    yield Progress("Moser's flux", 0.0)
    last = np.maximum(spherical_areas(points, triangles), LEAST_SHARE * 4 * np.pi / len(triangles))
    first = mass * (last.sum() / mass.sum())
    flux = edge_fluxes(points, triangles, first - last)
    m = len(triangles)
    start = np.repeat(np.arange(m), 3)
    cell = _corner_samples(points, triangles)
    face, weights, rounds, stuck = yield from advect_points(triangles, flux, first, last, start, cell)
    share = _mean_value_weights(points, triangles, _on_sphere(points, triangles, start, cell))
    images = share[:, None] * _on_sphere(points, triangles, face, weights)
    positions = np.stack([np.bincount(triangles.ravel(), c, len(points)) for c in images.T], axis=1)
    positions = positions / lengths(positions)[..., None]
    status = "points left on the way" if stuck else "converged"
    return MoserMap(positions=positions, crossings=rounds, stuck=stuck, status=status)


def _corner_samples(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Barycentric coordinates (3m,3) of a point in every corner, on the line that halves its angle.

    So two that follow each other around a vertex are less than half a turn apart, and the vertex lies between them all.
    """
    p = points[triangles]
    after = lengths(np.roll(p, -1, axis=1) - p)
    before = np.roll(after, 1, axis=1)
    m = len(triangles)
    cell = np.zeros((m, 3, 3))
    rows, k = np.arange(m)[:, None], np.arange(3)[None, :]
    cell[rows, k, k] = CORNER_SHARE
    cell[rows, k, (k + 1) % 3] = (1 - CORNER_SHARE) * before / (after + before)
    cell[rows, k, (k + 2) % 3] = (1 - CORNER_SHARE) * after / (after + before)
    return cell.reshape(-1, 3)


def _on_sphere(points: np.ndarray, triangles: np.ndarray, face: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Unit vectors (p,3) at barycentric coordinates (p,3) of faces (p,)."""
    x = np.einsum("pk,pkd->pd", weights, points[triangles[face]])
    return x / lengths(x)[..., None]


def _mean_value_weights(points: np.ndarray, triangles: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Weights (3m,) > 0 of the samples (3m,3) in the corners around every vertex, whose mean is towards the vertex.

    Mean value coordinates (Floater 2003) in the plane that touches the sphere there: where nothing flows nothing moves,
    however irregular the mesh.
    """
    vertex = triangles.ravel()
    height = (samples * points[vertex]).sum(axis=1)
    spoke = samples / height[:, None] - points[vertex]
    length = np.maximum(lengths(spoke), 1e-300)
    # The corner that follows around the vertex lies across the side that ends in it.
    after = twins(triangles)[previous_halfedge(np.arange(len(vertex)))]
    sine = lengths(cross3(spoke, spoke[after]))
    half = sine / np.maximum(
        length * length[after] + (spoke * spoke[after]).sum(axis=1), 1e-12 * length * length[after]
    )
    weight = half / length
    weight[after] = weight[after] + half / length[after]
    return weight / height


def edge_fluxes(points: np.ndarray, triangles: np.ndarray, gain: np.ndarray) -> np.ndarray:
    """Fluxes (m,3) out of every face across the side opposite to each corner; their sum is the `gain` (m,) of the face.

    The gradient flow of least energy with this divergence in Raviart-Thomas elements, by way of the equivalent
    Crouzeix-Raviart ones with one unknown on every edge (Marini 1985). The gains have to sum to 0.
    """
    m = len(triangles)
    p = points[triangles]
    opposite = np.roll(p, -2, axis=1) - np.roll(p, -1, axis=1)
    area = 0.5 * lengths(cross3(opposite[:, 0], opposite[:, 1]))
    # 4 <grad lambda_j, grad lambda_k> area = <e_j, e_k> / area.
    stiffness = np.einsum("mjd,mkd->mjk", opposite, opposite) / area[:, None, None]
    # The side opposite to corner k is halfedge k + 1.
    side = 3 * np.arange(m)[:, None] + np.array([1, 2, 0])
    edge = np.unique(np.minimum(side, twins(triangles)[side]), return_inverse=True)[1].reshape(m, 3)
    unknowns = edge.max() + 1
    rows, columns = np.repeat(edge, 3, axis=1).ravel(), np.tile(edge, (1, 3)).ravel()
    K = sp.csr_matrix((stiffness.ravel(), (rows, columns)), shape=(unknowns, unknowns))
    load = -np.bincount(edge.ravel(), np.repeat(gain / 3, 3), unknowns)
    u = np.zeros(unknowns)
    # Constants are in the kernel; one unknown is given.
    u[1:] = solve_spd(K[1:, 1:], load[1:])
    return np.einsum("mjk,mk->mj", stiffness, u[edge]) + gain[:, None] / 3


def advect_points(
    triangles: np.ndarray,
    flux: np.ndarray,
    first: np.ndarray,
    last: np.ndarray,
    face: np.ndarray,
    weights: np.ndarray,
) -> Steps[tuple[np.ndarray, np.ndarray, int, int]]:
    """Move points from time 0 to 1: their faces (p,) and barycentric coordinates (p,3), from those of the start.

    flux (m,3) as of `edge_fluxes`; first, last (m,): masses of the triangles (m,3) before and after. Also returns how
    many rounds it took, and how many points did not arrive.
    """
    twin = twins(triangles)
    face, weights = face.copy(), weights.copy()
    time = np.zeros(len(face))
    gain = first - last
    active = np.arange(len(face))
    rounds = 0
    while len(active) and rounds < CROSSINGS:
        f, w, t = face[active], weights[active], time[active]
        F, D = flux[f], gain[f]
        m = first[f] - t * D
        slope = w * D[:, None] - F
        # lambda(t) = lambda + slope phi; phi at which each coordinate vanishes, and the time that takes.
        leaving = slope < 0
        phi = np.where(leaving, np.maximum(w, GRAZE) / np.where(leaving, -slope, 1), np.inf)
        k = phi.argmin(axis=1)
        exit_phi = phi[np.arange(len(k)), k]
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            q = 1 + D * exit_phi
            duration = np.where(q > 0, m * exit_phi * (1 + q) / np.maximum(q, 1e-300) ** 2, np.inf)
        rest = 1 - t
        done = ~(duration < rest)
        end = m - rest * D
        root = np.sqrt(np.maximum(end, 0))
        last_phi = rest / np.maximum(root * (np.sqrt(np.maximum(m, 0)) + root), 1e-300)
        w = np.maximum(w + slope * np.where(done, last_phi, exit_phi)[:, None], 0)
        w /= w.sum(axis=1, keepdims=True)
        weights[active], time[active] = w, np.where(done, 1, t + np.where(done, 0, duration))
        going = np.flatnonzero(~done)
        _enter_next_face(triangles, twin, face, weights, active[going], k[going])
        active = active[going]
        rounds += 1
        if rounds % 50 == 0:
            yield Progress("Moser's flow", 1 - len(active) / len(face))
    return face, weights, rounds, len(active)


def _enter_next_face(triangles, twin, face, weights, points, k) -> None:
    """Bring points (p,) that are on the side opposite to corner k (p,) of their face to the face beyond."""
    h = 3 * face[points] + (k + 1) % 3
    g = twin[h]
    here = weights[points]
    rows = np.arange(len(points))
    there = np.zeros_like(here)
    # The side runs the other way in the next face.
    there[rows, g % 3] = here[rows, next_halfedge(h) % 3]
    there[rows, next_halfedge(g) % 3] = here[rows, h % 3]
    face[points], weights[points] = g // 3, there
