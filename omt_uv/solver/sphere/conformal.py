"""Conformal map of a closed surface of genus 0 to the unit sphere, centred by a Moebius map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..conformal.intrinsic_triangulation import IntrinsicTriangulation, euclidean_diagonal, from_mesh, make_delaunay
from ..conformal.moebius import centre_on_sphere, to_sphere
from ..conformal.punctured_sphere import FlatPolygon, flatten_punctured_sphere
from ..conformal.yamabe_flow import yamabe_flow
from ..errors import PrecisionError
from ..linalg.sparse import solve_spd
from ..mesh.closed_surface import closed_surface
from ..mesh.geometry import (
    angle_defects,
    angles_from_lengths,
    cotangents_from_lengths,
    halfedge_lengths,
    laplacian_from_weights,
    vertex_areas,
)
from ..mesh.spherical_geometry import signed_volumes
from ..mesh.topology import halfedges
from ..progress import Steps
from .untangle import locally_untangled

# Among this share of the vertices, those whose surroundings the map magnifies most, the best fan goes to infinity.
CANDIDATES = 0.02
ATTEMPTS = 4


@dataclass(frozen=True)
class ConformalSphere:
    """positions (n,3) on the unit sphere, faces counter-clockwise seen from outside, area-weighted mean at 0.

    sites (n,3): the same before faces were straightened which come out folded, as edges that flipped may, and their
    number; infinite: the vertex that was sent to infinity; triangles (m,3): the Delaunay triangulation of the sites,
    to which the edges flipped; residual: largest error of an angle sum in radians; Newton steps, and flips.
    """

    positions: np.ndarray
    sites: np.ndarray
    straightened: int
    infinite: int
    triangles: np.ndarray
    residual: float
    iterations: int
    flips: int


def conformal_sphere(vertices: np.ndarray, triangles: np.ndarray) -> Steps[ConformalSphere]:
    """Discrete conformal map of a closed surface (n,3), (m,3) to the sphere.

    Discrete uniformisation with Ptolemy flips and one vertex at infinity (Springborn, Schroeder, Pinkall 2008,
    section 5; Gillespie, Springborn, Crane 2021), laid out in the plane, projected stereographically, and centred so
    that the mean of the vertices, weighted by their areas, is 0.

    Raises
    ------
    MeshError : see `closed.closed_surface`
    PrecisionError : the map leaves double precision
    """
    surface = closed_surface(vertices, triangles)
    vertices, triangles = surface.vertices, surface.triangles
    tri, _ = make_delaunay(from_mesh(vertices, triangles), euclidean_diagonal)
    infinite, flat = yield from _flattened(tri, magnified_vertices(vertices, triangles))
    z = lay_out(flat, len(vertices))
    mass = vertex_areas(vertices, triangles)
    sites = centre_on_sphere(_on_sphere(z, infinite, mass), mass)
    folds = int((~(signed_volumes(sites, triangles) > 0)).sum())
    positions = sites
    if folds:
        positions = yield from locally_untangled(vertices, triangles, sites)
    if not signed_volumes(positions, triangles).min() > 0:
        raise PrecisionError("Faces of the conformal map are too small for double precision on the sphere")
    delaunay = flat.triangulation.triangles
    return ConformalSphere(positions, sites, folds, infinite, delaunay, flat.residual, flat.iterations, flat.flips)


def _flattened(tri: IntrinsicTriangulation, candidates: np.ndarray) -> Steps[tuple[int, FlatPolygon]]:
    """The first of the vertices that can be sent to infinity, and what becomes of the others."""
    n = int(tri.triangles.max()) + 1
    for start in ("as it is", "rounded"):
        if start == "rounded":
            tri = yield from rounded(tri, n)
        for vertex in candidates.tolist():
            try:
                return vertex, (yield from flatten_punctured_sphere(tri, vertex))
            except PrecisionError as error:
                failure = error
    raise failure


def rounded(tri: IntrinsicTriangulation, n: int) -> Steps[IntrinsicTriangulation]:
    """A conformally equivalent triangulation, Delaunay, whose curvature is spread evenly over its n vertices.

    Such a metric always exists (Gu, Luo, Sun, Wu 2018), and from there the way to infinity is about as short as from a
    round sphere. Raises PrecisionError: see `yamabe_flow.yamabe_flow`.
    """
    even = yield from yamabe_flow(tri, np.arange(n), np.full(n, 2 * np.pi * (1 - 2 / n)))
    return IntrinsicTriangulation(even.triangulation.triangles, even.triangulation.twin, np.log(even.length).ravel())


def magnified_vertices(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Vertices of the part that a conformal map to the sphere magnifies most, those amid the best faces first.

    To first order the logarithm of the scale solves Laplacian(u) = curvature. From there limbs are far away and end
    small, which the plane can hold; a limb at infinity would squeeze all else.
    """
    n = len(vertices)
    angle = angles_from_lengths(halfedge_lengths(vertices, triangles).reshape(-1, 3))
    curvature = angle_defects(triangles, angle, np.zeros(0, np.int64), n)
    mass = vertex_areas(vertices, triangles)
    tail, head = halfedges(triangles)
    cotangent = cotangents_from_lengths(halfedge_lengths(vertices, triangles).reshape(-1, 3)).ravel()
    matrix = laplacian_from_weights(tail, head, np.clip(0.5 * cotangent, 1e-3, 1e3), n)
    u = np.zeros(n)
    u[1:] = solve_spd(matrix[1:][:, 1:].tocsc(), (4 * np.pi * mass / mass.sum() - curvature)[1:])
    likely = np.argsort(-u, kind="stable")[: max(ATTEMPTS, int(CANDIDATES * n))]
    least = np.full(n, np.pi)
    np.minimum.at(least, triangles.ravel(), np.repeat(angle.min(axis=1), 3))
    return likely[np.argsort(-least[likely], kind="stable")][:ATTEMPTS]


def lay_out(flat: FlatPolygon, n: int) -> np.ndarray:
    """Places (n,) complex of the vertices in the plane; the infinite one's is not meant."""
    heading = np.concatenate([[0.0], np.cumsum(np.pi - flat.angle[1:])])
    step = flat.side_length * np.exp(1j * heading)
    z = np.zeros(n, complex)
    z[flat.boundary] = np.concatenate([[0.0], np.cumsum(step)[:-1]])
    tail, head = halfedges(flat.triangulation.triangles[flat.inner])
    weight = cotangents_from_lengths(flat.length[flat.inner]).ravel()
    matrix = laplacian_from_weights(tail, head, weight, n)
    free = np.zeros(n, dtype=bool)
    free[tail] = True
    free[flat.boundary] = False
    if free.any():
        right = -(matrix @ np.column_stack([z.real, z.imag]))[free]
        solved = solve_spd(matrix[free][:, free].tocsc(), right, order="mmd")
        z[free] = solved[:, 0] + 1j * solved[:, 1]
    return z


def _on_sphere(z: np.ndarray, infinite: int, mass: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3), about half of the mass (n,) on either half of the sphere."""
    finite = np.arange(len(z)) != infinite
    weight = mass[finite]
    centre = _median(z[finite].real, weight) + 1j * _median(z[finite].imag, weight)
    radius = _median(np.abs(z[finite] - centre), weight)
    if not radius > 0:
        raise PrecisionError("The map gathers half of the surface in one point of the sphere")
    positions = to_sphere((z - centre) / radius)
    positions[infinite] = [0, 0, 1]
    return positions


def _median(value: np.ndarray, weight: np.ndarray) -> float:
    order = np.argsort(value, kind="stable")
    total = np.cumsum(weight[order])
    return float(value[order][np.searchsorted(total, total[-1] / 2)])
