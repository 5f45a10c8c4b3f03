"""Sample a closed surface of genus 0 evenly by measure, and triangulate the samples, by way of the sphere (B. Gu 2018).

As `disk_samples`, without a cut: points that are uniform on the measure-preserving sphere are uniform on the surface,
and the convex hull of their conformal images is a Delaunay triangulation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...conformal.moebius import centre_on_sphere
from ...errors import PrecisionError, TransportError
from ...mesh.closed_surface import closed_surface
from ...mesh.geometry import vertex_areas
from ...mesh.point_location import locate
from ...mesh.spherical_geometry import normalized
from ...mesh.topology import twins
from ...progress import Steps
from ...sphere.conformal import ConformalSphere
from ...transport.semidiscrete_sphere import sphere_transport
from ...transport.spherical_power_diagram import Hull, by_hull, spherical_cells

# Rounds of moving samples to the centroids of their cells.
ROUNDS = 5
# Areas of cells may be off by this share: the relaxation on the surface makes up for more.
TOLERANCE = 1e-2
# Transport that takes more steps than this takes longer than doing without.
MOST_STEPS = 40
# Share of the samples that may lie too close together for the hull,
MAX_LOST = 0.05
# in so many attempts without them.
ATTEMPTS = 5


@dataclass(frozen=True)
class SphereSamples:
    """Points (k,3) on a surface, and triangles (2k-4,3) between them."""

    points: np.ndarray
    triangles: np.ndarray


def sphere_image(
    vertices: np.ndarray, triangles: np.ndarray, conformal: ConformalSphere, density: np.ndarray
) -> Steps[np.ndarray]:
    """Map a closed surface (n,3), (m,3) to the sphere, (n,3), by optimal transport, areas times density (m,) kept.

    A few faces may be folded. Raises TransportError, or PrecisionError, where the transport fails.
    """
    sound = closed_surface(vertices, triangles)
    mass = vertex_areas(sound.vertices, triangles, density)
    hull = Hull(conformal.triangles, twins(conformal.triangles))
    # Half of a mass that is gathered on one side has no transport; Moebius maps keep the hull's triangles.
    found = yield from sphere_transport(centre_on_sphere(conformal.sites, mass), mass, TOLERANCE, hull, MOST_STEPS)
    return found.cells.centroids()


def sample_sphere(
    vertices: np.ndarray, triangles: np.ndarray, from_map: np.ndarray, to_map: np.ndarray, count: int
) -> SphereSamples:
    """Sample a closed surface (n,3), (m,3) about `count` times, uniformly in one of its images on the sphere (n,3), and
    join the samples by the convex hull of where they lie in the other (n,3).

    Raises PrecisionError where too many of them coincide there.
    """
    face, bary = locate(from_map, triangles, spread_on_sphere(count))
    corners = triangles[face]
    images = normalized(np.einsum("kc,kcj->kj", bary, to_map[corners]))
    # Moebius maps leave circles circles, and what is Delaunay so; the hull is best seen from the middle.
    images = centre_on_sphere(images, np.ones(count))
    kept = np.arange(count)
    for _ in range(ATTEMPTS):
        try:
            hull = by_hull(images[kept], np.zeros(len(kept)))
            return SphereSamples(np.einsum("kc,kcj->kj", bary, vertices[corners])[kept], hull.triangles)
        except TransportError as error:
            kept = np.delete(kept, error.elements)
            if not len(error.elements) or len(kept) < (1 - MAX_LOST) * count:
                break
    raise PrecisionError("Samples come too close together on the sphere")


def spread_on_sphere(count: int, rounds: int = ROUNDS) -> np.ndarray:
    """Spread unit vectors (count,3) evenly: a spiral of equal steps in height, and what centroids make of it."""
    k = np.arange(count) + 0.5
    height, turn = 1 - 2 * k / count, k * np.pi * (3 - np.sqrt(5))
    radius = np.sqrt(1 - height**2)
    points = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])
    weights = np.zeros(count)
    for _ in range(rounds):
        points = spherical_cells(points, weights, by_hull(points, weights)).centroids()
    return points
