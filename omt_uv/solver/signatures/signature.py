"""Quantise a surface for comparison: points of the conformal sphere that stand for equal areas of the surface.

A lattice is pulled back through the map with exact areas to the Moebius-centred conformal map (Su 2015, section 3.2.7),
so that a rotation and a mirroring are left free. Isometric surfaces look alike there, but for their mean curvature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from ..analysis.curvature import mean_curvature
from ..conformal.moebius import centre_on_sphere
from ..counts import BYTES_PER_ELEMENT, check_memory
from ..errors import EmptyMeshError, ZeroAreaFaceError
from ..mesh.charts import Chart, charts_of
from ..mesh.geometry import face_areas, vertex_areas
from ..mesh.gluing import orientations, turn_over
from ..mesh.point_location import locate
from ..mesh.repair import repaired_gluing
from ..mesh.spherical_geometry import fibonacci_sphere, normalized, signed_volumes
from ..mesh.surface import check_finite, triangle_surface
from ..mesh.topology import boundary_loops
from ..progress import Steps
from ..sphere.sphere_map import sphere_map
from .membrane import with_membranes

POINTS = 400
# Every point is the mean of so many places of its cell.
FINE = 16
# Mean curvature is smoothed over so many radians of the map with exact areas, and squashed: single sharp points and
# noise do not outweigh a body.
SMOOTHING = 0.15
SQUASH = 3.0
# Weight of the squared difference of curvature next to squared angles.
CURVATURE = 0.15
# Axes of another lattice.
OTHER = np.linalg.qr(np.array([[3.0, 1, 2], [-1, 4, 1], [2, -3, 5]]))[0]


@dataclass(frozen=True)
class Signature:
    """points (k,3): unit vectors of equal masses; curvature (k,): mean curvature there for a surface of area 4 pi,
    squashed to [-1, 1]; floor: how far apart two quantisations of this surface are. With markers points (k,2) of the
    unit disk, and curvature for an area of pi"""

    points: np.ndarray
    curvature: np.ndarray
    floor: float = 0.0

    @property
    def on_disk(self) -> bool:
        """Whether markers have fixed it."""
        return self.points.shape[1] == 2


def signature(positions: np.ndarray, triangles: np.ndarray, count: int = POINTS) -> Steps[Signature]:
    """The signature of a mesh (n,3), (m,3): of its largest part, with holes filled.

    Raises
    ------
    MeshError : what `sphere_map` raises, as for handles
    CountError : more points than this machine has memory for

    >>> import numpy as np
    >>> from omt_uv.solver.progress import drain
    >>> from omt_uv.solver.signatures.signature import signature
    >>> corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    >>> found = drain(signature(corners, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]), 50))
    >>> found.points.shape
    (50, 3)
    """
    check_memory(count, BYTES_PER_ELEMENT, "A signature of {} points")
    vertices, faces = closed_part(positions, triangles)
    found = yield from sphere_map(vertices, faces, quality="draft")
    mass = vertex_areas(vertices, faces)
    conformal = centre_on_sphere(found.sites, mass)
    area = np.maximum(mass, 1e-12 * mass.sum())
    bend = mean_curvature(vertices, faces) / area * np.sqrt(mass.sum() / (4 * np.pi))
    fine = fibonacci_sphere(FINE * count)
    at, barycentric = locate(found.positions, faces, fine)
    values = np.column_stack([conformal, bend])[faces[at]]
    values = np.einsum("kc,kcd->kd", barycentric, values)
    one, other = (_quantised(fine, values, lattice) for lattice in (fibonacci_sphere(count), _other_lattice(count)))
    cost = pair_costs(one, other)
    return Signature(one.points, one.curvature, float(np.sqrt(cost[linear_sum_assignment(cost)].mean())))


def pair_costs(a: Signature, b: Signature, curvature: float = CURVATURE) -> np.ndarray:
    """What it costs (k,l) to take each point of one signature to each of another: squared angles, or squared distances
    in the disk, and, by a weight, squared differences of curvature."""
    own, its = (s.curvature * np.sqrt(curvature) for s in (a, b))
    cost = np.subtract.outer(own, its)
    cost *= cost
    if a.on_disk:
        for x, y in zip(a.points.T, b.points.T, strict=True):
            cost += np.subtract.outer(x, y) ** 2
        return cost
    # By the chord: a cosine near 1 has lost half its digits. Single precision rounds an angle by a share of itself.
    half = (a.points @ b.points.T).clip(-1, 1)
    half = np.sqrt(np.float32(0.5) * (1 - half).astype(np.float32))
    angle = np.arcsin(half, out=half)
    angle *= angle
    cost += 4 * angle
    return cost


def _other_lattice(count: int) -> np.ndarray:
    return fibonacci_sphere(count) @ OTHER.T


def _quantised(fine: np.ndarray, values: np.ndarray, lattice: np.ndarray) -> Signature:
    """Means over the cells of a lattice (k,3) of what is at fine points (n,3): conformal places and curvature (n,4)."""
    owner = cKDTree(lattice).query(fine)[1]
    count = np.maximum(np.bincount(owner, minlength=len(lattice)), 1)
    mean = np.stack([np.bincount(owner, column, len(lattice)) / count for column in values.T], axis=1)
    near = np.exp((lattice @ lattice.T - 1) / SMOOTHING**2)
    smooth = near @ mean[:, 3] / near.sum(axis=1)
    return Signature(normalized(mean[:, :3]), np.tanh(smooth / SQUASH))


def closed_part(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of greatest area of a mesh (n,3), (m,3), with its holes filled by membranes.

    Raises
    ------
    EmptyMeshError, NonFiniteError, ZeroAreaFaceError : nothing, or coordinates that are no numbers, or no area
    """
    parts = sound_parts(positions, triangles)
    area = [face_areas(part.vertices, part.triangles).sum() for part in parts]
    if not max(area) > 0:
        raise ZeroAreaFaceError("The surface has no area", "Give a mesh whose faces are no lines and no points")
    part = parts[int(np.argmax(area))]
    vertices, faces = with_membranes(part.vertices, part.triangles, boundary_loops(part.triangles))
    # A mirror image with the faces of before is inside out.
    inside_out = signed_volumes(vertices - vertices.mean(axis=0), faces).sum() < 0
    return vertices, faces[:, ::-1] if inside_out else faces


def sound_parts(positions: np.ndarray, triangles: np.ndarray) -> list[Chart]:
    """The parts of a mesh (n,3), (m,3), each with two faces at most at every edge, which agree about what is outside,
    and one fan at every vertex: open where it is not so.

    Raises
    ------
    EmptyMeshError, NonFiniteError : nothing, or coordinates that are no numbers
    """
    if not len(triangles):
        raise EmptyMeshError("There are no faces to compare")
    check_finite(positions, triangles)
    surface = triangle_surface(positions, triangles)
    every = np.ones(len(triangles), bool)
    gluing = repaired_gluing(surface, every, surface.triangles, surface.triangle_face).gluing
    turned, _ = orientations(gluing, face_areas(positions, triangles))
    return charts_of(surface, turn_over(gluing, turned))
