"""Map a closed surface of genus 0 to the unit sphere, conformally, by discrete uniformisation (Springborn et al. 2008).

One vertex goes to infinity, the others are laid out in the plane; the inverse stereographic projection brings them to
the sphere, where a Moebius map centres them.
"""

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
    LEAST_STIFFNESS,
    angle_defects,
    angles_from_lengths,
    cotangents_from_lengths,
    halfedge_lengths,
    laplacian_from_lengths,
    laplacian_from_weights,
    vertex_areas,
)
from ..mesh.spherical_geometry import signed_volumes
from ..mesh.topology import halfedges
from ..progress import Steps
from .untangle import untangle_locally

# Share of the vertices, those whose surroundings the map magnifies most, among which the best fan goes to infinity.
CANDIDATE_SHARE = 0.02
# Vertices that are tried at infinity.
MOST_CANDIDATES = 4
# Stiffness that edges have at most in the estimate of the magnification.
GREATEST_STIFFNESS = 1e3


@dataclass(frozen=True)
class ConformalSphere:
    """A conformal map: positions (n,3) on the unit sphere, faces counter-clockwise seen from outside.

    sites (n,3): the same before folded faces were straightened, as some are across which edges flipped, with the
    area-weighted mean at 0; straightened: how many faces those were; infinite: the vertex that was sent to infinity;
    triangles (m,3): the Delaunay triangulation of the sites, to which the edges flipped; residual: largest error of an
    angle sum in radians; iterations: Newton steps; flips: of edges.
    """

    positions: np.ndarray
    sites: np.ndarray
    straightened: int
    infinite: int
    triangles: np.ndarray
    residual: float
    iterations: int
    flips: int


@dataclass(frozen=True)
class ConformalSites:
    """Where a conformal map takes vertices, with faces folded that are too small: see `ConformalSphere`."""

    sites: np.ndarray
    infinite: int
    flat: FlatPolygon


def conformal_sphere(vertices: np.ndarray, triangles: np.ndarray) -> Steps[ConformalSphere]:
    """Map a closed surface (n,3), (m,3) conformally to the unit sphere.

    Discrete uniformisation with Ptolemy flips and one vertex at infinity (Springborn, Schroeder, Pinkall 2008,
    section 5; Gillespie, Springborn, Crane 2021), laid out in the plane, projected stereographically, and centred so
    that the mean of the vertices, weighted by their areas, is 0.

    Raises
    ------
    MeshError : see `closed_surface.closed_surface`
    PrecisionError : the map leaves double precision
    """
    surface = closed_surface(vertices, triangles)
    found = yield from conformal_sites(surface.vertices, surface.triangles)
    return (yield from straightened(surface.vertices, surface.triangles, found))


def conformal_sites(vertices: np.ndarray, triangles: np.ndarray) -> Steps[ConformalSites]:
    """Where the vertices of a closed surface (n,3), (m,3) go. Raises PrecisionError: the plane cannot hold the map."""
    tri, _ = make_delaunay(from_mesh(vertices, triangles), euclidean_diagonal)
    infinite, flat = yield from _flatten(tri, magnified_vertices(vertices, triangles))
    z = plane_layout(flat, len(vertices))
    mass = vertex_areas(vertices, triangles)
    return ConformalSites(centre_on_sphere(_halved_by_equator(z, infinite, mass), mass), infinite, flat)


def straightened(vertices: np.ndarray, triangles: np.ndarray, found: ConformalSites) -> Steps[ConformalSphere]:
    """A conformal map (n,3), (m,3) without folds. Raises PrecisionError: faces are too small on the sphere."""
    sites, flat = found.sites, found.flat
    folds = int((~(signed_volumes(sites, triangles) > 0)).sum())
    positions = sites
    if folds:
        positions = yield from untangle_locally(vertices, triangles, sites)
    if not signed_volumes(positions, triangles).min() > 0:
        raise PrecisionError("Faces of the conformal map are too small for double precision on the sphere")
    delaunay = flat.triangulation.triangles
    return ConformalSphere(
        positions=positions,
        sites=sites,
        straightened=folds,
        infinite=found.infinite,
        triangles=delaunay,
        residual=flat.residual,
        iterations=flat.iterations,
        flips=flat.flips,
    )


def _flatten(tri: IntrinsicTriangulation, candidates: np.ndarray) -> Steps[tuple[int, FlatPolygon]]:
    """Send the first of the candidate vertices (k,) to infinity that can be; it, and what becomes of the others."""
    n = int(tri.triangles.max()) + 1
    for start in ("as it is", "rounded"):
        if start == "rounded":
            tri = yield from with_even_curvature(tri, n)
        for vertex in candidates.tolist():
            try:
                return vertex, (yield from flatten_punctured_sphere(tri, vertex))
            except PrecisionError as error:
                failure = error
    raise failure


def with_even_curvature(tri: IntrinsicTriangulation, n: int) -> Steps[IntrinsicTriangulation]:
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
    length = halfedge_lengths(vertices, triangles).reshape(-1, 3)
    angle = angles_from_lengths(length)
    curvature = angle_defects(triangles, angle, np.zeros(0, np.int64), n)
    mass = vertex_areas(vertices, triangles)
    matrix = laplacian_from_lengths(length, triangles, n, LEAST_STIFFNESS, GREATEST_STIFFNESS)
    u = np.zeros(n)
    u[1:] = solve_spd(matrix[1:][:, 1:].tocsc(), (4 * np.pi * mass / mass.sum() - curvature)[1:])
    likely = np.argsort(-u, kind="stable")[: max(MOST_CANDIDATES, int(CANDIDATE_SHARE * n))]
    least = np.full(n, np.pi)
    np.minimum.at(least, triangles.ravel(), np.repeat(angle.min(axis=1), 3))
    return likely[np.argsort(-least[likely], kind="stable")][:MOST_CANDIDATES]


def plane_layout(flat: FlatPolygon, n: int) -> np.ndarray:
    """Lay the vertices out in the plane, (n,) complex; the place of the infinite one has no meaning.

    The boundary from its sides and angles, what is inside it as the harmonic map of cotangent weights.
    """
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


def _halved_by_equator(z: np.ndarray, infinite: int, mass: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) of places (n,) in the plane, about half of the mass (n,) on either half of the sphere."""
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
    """Median of values (k,) with weights (k,)."""
    order = np.argsort(value, kind="stable")
    total = np.cumsum(weight[order])
    return float(value[order][np.searchsorted(total, total[-1] / 2)])
