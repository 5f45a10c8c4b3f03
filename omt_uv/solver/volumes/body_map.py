"""Map the inside of a body to a ball or a cube, volume by volume (Hu, Zou, Hua 2014, sections 3 and 4).

The boundary goes by the area-preserving map of the sphere, the inside follows harmonically; what is inverted is
untangled, volumes come near by Newton's method (`tet_newton`), and those of all tetrahedra are made right by points
that move in the body, too (`tet_exact`). The paper's flow is a method of its own
(`paper_flow`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..errors import TetrahedraError, plural
from ..flows.enclosed_volume import corner_volumes
from ..flows.paths import rotation_between
from ..linalg.sparse import Factor
from ..mesh.closed_surface import ClosedSurface, closed_surface
from ..progress import Progress, Steps, part_of
from ..sphere.sphere_map import sphere_map
from .domains import BALL, CUBE, DOMAINS, BallDomain, CubeDomain, HeldDomain, on_cube
from .meshing import TetMesh, tetrahedra
from .paper_flow import paper_flow
from .tet_exact import exact_volumes
from .tet_mesh import boundary_vertices, graph_laplacian, share_error, stiffness, tet_volumes, vertex_share_error
from .tet_newton import LONG_STAGES, STAGES, inverted, refined, tet_problem, unlocked, untangled
from .transfer import TetLocation

NEWTON = "newton"
FLOW = "flow"
METHODS = (NEWTON, FLOW)
# Least weight of an edge, relative to the mean of their sizes: where cotangents are negative.
POSITIVE = 1e-3
# What volumes of tetrahedra may be off, summed up.
TOLERANCE = 9.5e-3
# From here on they are told to be off.
COARSE = 0.02


@dataclass(frozen=True)
class VolumeMap:
    """Points (n,3) of tetrahedra (m,4) of a body, and their positions (n,3) in the domain.

    The first points are the vertices of the surface. shares: sum of abs(share of the volume there - here) over
    tetrahedra,
    around_vertices: over what lies around vertices, a quarter of each tetrahedron there; inverted: tetrahedra
    """

    points: np.ndarray
    tets: np.ndarray
    positions: np.ndarray
    domain: str
    shares: float
    around_vertices: float
    inverted: int
    steps: int
    warnings: tuple[str, ...]


def volume_map(
    vertices: np.ndarray,
    triangles: np.ndarray,
    domain: str = BALL,
    method: str = NEWTON,
    count: int = 40_000,
    mesh: TetMesh | None = None,
    held: bool = True,
) -> Steps[VolumeMap]:
    """Map the inside of a closed surface (n,3), (m,3) without handles to the unit ball, or the cube from -1 to 1.

    Parameters
    ----------
    domain : "ball" or "cube"; method : "newton", or "flow", the paper's
    count : tetrahedra, about; mesh : those to take instead, whose first points are the vertices
    held : no point inside a given mesh moves

    Raises
    ------
    MeshError : see `closed_surface.closed_surface`; LibraryError, SelfIntersectionError, TetrahedraError
    ValueError : an unknown domain or method

    References
    ----------
    Hu, Zou, Hua 2014; Garanzha et al. 2021; Smith, de Goes, Kim 2019; Chen et al. 2024
    """
    if domain not in DOMAINS or method not in METHODS:
        raise ValueError(f"domain must be one of {', '.join(DOMAINS)}, method one of {', '.join(METHODS)}")
    vertices, triangles = np.asarray(vertices, float), np.asarray(triangles, np.int64)
    surface = closed_surface(vertices, triangles, body=True)
    outwards = _outwards(surface.vertices, triangles)
    yield Progress("Tetrahedra", 0.0)
    given = mesh is not None and held
    mesh = tetrahedra(surface.vertices, outwards, count) if mesh is None else _in_box(mesh, vertices, surface)
    sphere = yield from part_of(sphere_map(surface.vertices, outwards), 0.05, 0.15)
    aligned = _aligned(sphere.positions, surface.vertices)
    mesh, positions, steps = yield from _mapped(mesh, aligned, domain, method, given)
    target = tet_volumes(mesh.points, mesh.tets)
    count_inverted = inverted(positions, mesh.tets)
    points = mesh.points * surface.extent + _middle(vertices)
    points[: len(vertices)] = vertices
    shares = share_error(positions, mesh.tets, target)
    told = _told(count_inverted, shares if method == NEWTON and not given else 0.0)
    return VolumeMap(
        points=points,
        tets=mesh.tets,
        positions=positions,
        domain=domain,
        shares=shares,
        around_vertices=vertex_share_error(positions, mesh.tets, target),
        inverted=count_inverted,
        steps=steps,
        warnings=(*surface.warnings, *sphere.warnings, *told),
    )


def _told(count_inverted: int, shares: float) -> list[str]:
    """What is to be said of a map with so many tetrahedra inverted and volumes off."""
    told = []
    if count_inverted:
        told.append(
            plural(count_inverted, "A tetrahedron is", "{} tetrahedra are")
            + " inverted in the map; the method newton has none"
        )
    if shares > COARSE:
        told.append(f"Volumes are {100 * shares:.0f} % off in sum: remesh the surface evenly, with smaller faces")
    return told


def _in_box(mesh: TetMesh, vertices: np.ndarray, surface: ClosedSurface) -> TetMesh:
    """The mesh, whose first points are vertices (n,3), in the unit box of their surface."""
    inner = (mesh.points[len(vertices) :] - _middle(vertices)) / surface.extent
    return TetMesh(np.concatenate([surface.vertices, inner]), mesh.tets)


def _middle(vertices: np.ndarray) -> np.ndarray:
    """The middle (3,) of the box around vertices (n,3)."""
    return vertices.min(axis=0) / 2 + vertices.max(axis=0) / 2


def _outwards(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Triangles (m,3) that look outwards."""
    return triangles[:, ::-1] if corner_volumes(vertices, triangles).sum() < 0 else triangles


def _aligned(sphere: np.ndarray, vertices: np.ndarray) -> np.ndarray:
    """Unit vectors (n,3) turned so that they lie on the sides where vertices (n,3) do."""
    return sphere @ rotation_between(sphere, vertices).T


def harmonic(mesh: TetMesh, boundary: np.ndarray) -> np.ndarray:
    """Positions (n,3) with the first (b,3) given and the others the means of their neighbours, with positive
    weights."""
    weights = stiffness(mesh.points, mesh.tets)
    weights = np.maximum(weights, POSITIVE * np.abs(weights).mean())
    matrix = sp.csr_matrix(graph_laplacian(mesh.tets, weights, len(mesh.points)))
    b = len(boundary)
    inner = Factor(matrix[b:][:, b:]).solve(-(matrix[b:][:, :b] @ boundary))
    return np.concatenate([boundary, inner])


def _mapped(
    mesh: TetMesh, sphere: np.ndarray, domain: str, method: str, given: bool
) -> Steps[tuple[TetMesh, np.ndarray, int]]:
    """The mesh, whose points inside move unless it is given, positions (n,3) with the boundary at unit vectors (b,3),
    and steps."""
    b = np.arange(len(sphere))
    side = np.abs(sphere).argmax(axis=1)
    kind: BallDomain | CubeDomain = CubeDomain(b, side) if domain == CUBE else BallDomain(b)
    start = harmonic(mesh, kind.start(sphere))
    yield Progress("Harmonic map", 0.2)
    if method == FLOW:
        flowed = yield from part_of(paper_flow(mesh.points, mesh.tets, start, kind), 0.2, 0.8)
        return mesh, flowed.positions, len(flowed.errors) - 1
    stages = STAGES
    try:
        free = yield from part_of(untangled(tet_problem(mesh.points, mesh.tets, kind), start), 0.2, 0.15)
    except TetrahedraError:
        if given:
            raise
        stages = LONG_STAGES
        mesh, free = yield from part_of(_with_room(mesh, sphere, domain), 0.35, 0.05)
    problem = tet_problem(mesh.points, mesh.tets, kind)
    rough, steps = yield from part_of(refined(problem, free, stages), 0.4, 0.2)
    exact = exact_volumes(mesh.points, mesh.tets, rough, kind, TOLERANCE, slide=not given)
    found = yield from part_of(exact, 0.6, 0.4)
    return TetMesh(found.points, mesh.tets), found.positions, steps + found.rounds


def _with_room(mesh: TetMesh, sphere: np.ndarray, domain: str) -> Steps[tuple[TetMesh, np.ndarray]]:
    """A finer mesh and positions (n,3) with nothing inverted and the boundary held at unit vectors (b,3), or along
    their rays on the cube, where the middle sees all faces that it sees on the sphere."""
    mesh, positions = yield from part_of(unlocked(mesh, harmonic(mesh, sphere), len(sphere)), 0.0, 0.6)
    if domain == CUBE:
        mesh, positions = yield from part_of(unlocked(mesh, on_cube(positions), len(sphere)), 0.6, 0.4)
    return mesh, positions


def into_body(first: VolumeMap, other: VolumeMap, placed: np.ndarray | None = None) -> Steps[VolumeMap]:
    """Map the inside of the first body to the other one: through the ball, where both are, and then inside the other
    until volumes are right; `placed` (n,3) instead of the first one's positions there, as after a registration.

    Where that leaves tetrahedra inverted, as between tetrahedra of the other body that are too large, the result is
    what goes through the ball, with a warning.
    """
    at = first.positions if placed is None else placed
    through = TetLocation(other.positions, other.tets).values(at, other.points)
    edge = HeldDomain(boundary_vertices(first.tets))
    points, positions = first.points, through
    told: tuple[str, ...] = ()
    try:
        free = yield from part_of(untangled(tet_problem(first.points, first.tets, edge), through), 0.0, 0.4)
        exact = exact_volumes(first.points, first.tets, free, edge, TOLERANCE)
        found = yield from part_of(exact, 0.4, 0.6)
        points, positions = found.points, found.positions
    except TetrahedraError:
        count = inverted(through, first.tets)
        verb = plural(count, "is", "are")
        told = (
            f"{count} of {len(first.tets)} tetrahedra {verb} inverted where they lie between those of the other body",
        )
    target = tet_volumes(points, first.tets)
    return replace(
        first,
        points=points,
        positions=positions,
        domain="body",
        shares=share_error(positions, first.tets, target),
        around_vertices=vertex_share_error(positions, first.tets, target),
        inverted=inverted(positions, first.tets),
        warnings=(*first.warnings, *other.warnings, *told),
    )
