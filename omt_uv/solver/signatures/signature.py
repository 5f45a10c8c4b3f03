"""Quantise a surface for comparison: points of the conformal sphere that stand for equal areas of the surface.

A lattice is pulled back through the map with exact areas to the Moebius-centred conformal map (Su 2015, section 3.2.7),
so that a rotation and a mirroring are left free. Isometric surfaces look alike there, but for their mean curvature.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.curvature import mean_curvature
from ..conformal.moebius import centre_on_sphere
from ..errors import EmptyMeshError, NotASphereError
from ..mesh.geometry import face_areas, vertex_areas
from ..mesh.point_location import locate
from ..mesh.spherical_geometry import fibonacci_sphere, normalized
from ..mesh.topology import boundary_loops, graph_components, halfedges, with_fans
from ..progress import Steps
from ..sphere.sphere_map import sphere_map

POINTS = 400
# Mean curvature is squashed, so that single sharp points do not outweigh a body.
SQUASH = 3.0


@dataclass(frozen=True)
class Signature:
    """points (k,3): unit vectors of equal masses; curvature (k,): mean curvature there for a surface of area 4 pi,
    squashed to [-1, 1]"""

    points: np.ndarray
    curvature: np.ndarray


def signature(positions: np.ndarray, triangles: np.ndarray, count: int = POINTS) -> Steps[Signature]:
    """The signature of a mesh (n,3), (m,3): of its largest part, with holes filled.

    Raises
    ------
    MeshError : what `sphere_map` raises, as for handles

    >>> import numpy as np
    >>> from omt_uv.solver.progress import drain
    >>> from omt_uv.solver.signatures.signature import signature
    >>> corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]])
    >>> found = drain(signature(corners, np.array([[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]]), 50))
    >>> found.points.shape
    (50, 3)
    """
    vertices, faces = closed_part(positions, triangles)
    found = yield from sphere_map(vertices, faces, quality="draft")
    mass = vertex_areas(vertices, faces)
    conformal = centre_on_sphere(found.conformal, mass)
    at, barycentric = locate(found.positions, faces, fibonacci_sphere(count))
    corner = faces[at]
    points = normalized(np.einsum("kc,kcd->kd", barycentric, conformal[corner]))
    area = np.maximum(mass, 1e-12 * mass.sum())
    bend = mean_curvature(vertices, faces) / area * np.sqrt(mass.sum() / (4 * np.pi))
    curvature = np.einsum("kc,kc->k", barycentric, np.tanh(bend / SQUASH)[corner])
    return Signature(points, curvature)


def closed_part(positions: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The part of greatest area of a mesh (n,3), (m,3), with its holes filled by fans about their centres.

    Raises
    ------
    EmptyMeshError, NotASphereError : nothing, or a boundary that is no loop
    """
    if not len(triangles):
        raise EmptyMeshError("There are no faces to compare")
    label = graph_components(*halfedges(triangles), len(positions))[1][triangles[:, 0]]
    area = np.bincount(label, face_areas(positions, triangles))
    used, local = np.unique(triangles[label == area.argmax()], return_inverse=True)
    faces, vertices = local.reshape(-1, 3).astype(np.int64), positions[used]
    try:
        loops = boundary_loops(faces)
    except (ValueError, IndexError) as error:
        raise NotASphereError("The boundary is no set of loops", "Merge vertices that coincide") from error
    return with_fans(vertices, faces, loops)
