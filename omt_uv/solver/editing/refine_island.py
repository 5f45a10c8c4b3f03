"""Refine a map that exists, by Newton's method on the energy of the refinement, however many boundaries it has.

The refinement of charts knows only disks, because its fallbacks are disks. A map without folds needs no fallback; one
that is folded or crosses itself is straightened first, its holes filled for that purpose.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..errors import FoldedUVError, MeshError, positive_density
from ..linalg.symmetric_sweeps import sweeping_solver
from ..maps.contacts import crossings
from ..maps.energy import Elements, area_error
from ..maps.mirror_symmetry import MirrorSymmetry
from ..maps.polygon_elements import polygon_elements
from ..maps.untangle import count_folds
from ..mesh.geometry import face_areas, signed_areas
from ..mesh.topology import boundary_edges, boundary_loops, euler_characteristic, halfedges
from ..progress import Progress, Steps
from ..refinement.boundary_barrier import make_barrier
from ..refinement.continuation import ContinuationResult, MapProblem, minimise_in_stages
from ..refinement.continuation_rules import QUALITIES, Quality
from ..refinement.elimination_order import Renumbered, renumbered
from ..refinement.hessian_blocks import assembly_of
from ..refinement.initial_maps import disk_initial_map
from ..refinement.mirrored_motion import MirroredMotion, find_symmetry, halved, symmetric_start
from ..refinement.pins import aligned_to_pins, move_pins, placed_like
from ..refinement.projected_newton import FreeMotion
from ..refinement.refine import Refinement, refinement_of

STRAIGHTENED = "The UVs were folded, or met themselves; the refinement started from a straightened map"
UNGUARDED = "The outline of an island meets itself; it is not kept apart"
# A boundary this near to itself, relative to the reach of its barrier, is too stiff to be kept apart.
TOUCHING = 1e-3
# How far the boundary of such a map is drawn in, as a share of the way to the mean of each vertex' neighbours.
PARTING = (0.0, 0.01, 0.03, 0.1)


def refine_island(
    vertices: np.ndarray,
    triangles: np.ndarray,
    uv: np.ndarray,
    *,
    balance: float = 0.0,
    quality: str = "standard",
    pins: tuple[np.ndarray, np.ndarray] | None = None,
    polygons: np.ndarray | None = None,
    target: np.ndarray | None = None,
) -> Steps[Refinement]:
    """Refine a map uv (n,2) of a connected surface (n,3), (m,3) with one or more boundaries.

    The result keeps the centroid, the direction, the mirroring and the UV area of the given map. An island that is its
    own mirror image gets a map that is, too, unless it is pinned.

    Parameters
    ----------
    balance, quality : see `refine.refine`
    pins : vertices (k,) and their places (k,2); two or more fix place, direction and scale
    polygons : (m,) polygon of every triangle, whose area counts as a whole; by default each is its own
    target : density (m,) > 0 of the area that each triangle asks for, relative to its own; 1 by default

    Raises
    ------
    DensityError : a target that is not positive and finite
    FoldedUVError : a map without area, or folds that no other start could remove
    PinError : pins that contradict each other or force a fold

    References
    ----------
    See `refine.refine`; the topology of a boundary that may not cross itself is that of Smith, Schaefer 2015.
    """
    if not 0 <= balance <= 1:
        raise ValueError(f"balance must lie in [0, 1], not {balance}")
    yield Progress("Refinement", 0.0)
    mesh = renumbered(vertices, triangles, uv, pins, polygons)
    try:
        faces = island_elements(mesh, polygons, target)
        found, error, warnings = yield from _refined(mesh, polygons, faces, balance, QUALITIES[quality])
    except MeshError as problem:
        raise mesh.original_error(problem) from problem
    refined = mesh.original(found.w)
    if pins is not None:
        refined[pins[0]] = pins[1]
    return refinement_of(refined, found, error, warnings)


def _refined(
    mesh: Renumbered, polygons: np.ndarray | None, faces: Elements, balance: float, settings: Quality
) -> Steps[tuple[ContinuationResult, float, tuple[str, ...]]]:
    """What was found from the map given, in its place; its area error; warnings."""
    given, pins, n = mesh.uv @ [1, 1j], mesh.pins, len(mesh.uv)
    boundary = boundary_edges(mesh.triangles)
    several = pins if pins is not None and len(pins.vertices) > 2 else None
    fixed = several is not None
    start, warnings = island_start(mesh.vertices, mesh.triangles, given, boundary, fixed)
    # Pins may ask for a map that meets itself, as the given one does, and so may handles.
    guard = None if meets_itself(start, boundary) else boundary
    if guard is None and not (pins is not None and np.isin(boundary, pins.vertices).all()):
        warnings = (*warnings, UNGUARDED)
    symmetric = None if pins is not None else _symmetric(mesh, polygons, faces, start, guard)
    symmetry, w = (None, start) if symmetric is None else symmetric
    free = FreeMotion(np.zeros(n, bool))
    half = halved(faces, symmetry)
    task = MapProblem(
        faces=half,
        assembly=assembly_of(half, n, sweeping_solver(mesh.vertices, mesh.triangles), symmetry),
        motion=free if symmetry is None else MirroredMotion(free, symmetry, w),
        loop=guard,
        with_barrier=False,
        symmetry=symmetry,
        count=len(faces.area),
    )
    if several is not None:
        task, w = yield from move_pins(task, w, several)
    found = yield from minimise_in_stages(task, w, balance, settings)
    error = area_error(faces, found.w)
    if several is None:
        if pins is not None and len(pins.vertices) == 2:
            found = replace(found, w=aligned_to_pins(found.w, pins))
        else:
            found = replace(found, w=placed_like(found.w, given, faces, pins))
    return found, error, (*warnings, *found.warnings)


def island_elements(mesh: Renumbered, polygons: np.ndarray | None, target: np.ndarray | None = None) -> Elements:
    """Elements of a surface whose polygons (m,) shall have their own areas, times a density (m,) of its triangles.

    The energy weighs lengths: surface and map are measured in the same unit, in which both have the area 1.
    """
    vertices = mesh.vertices / np.sqrt(face_areas(mesh.vertices, mesh.triangles).sum())
    asked = face_areas(vertices, mesh.triangles)
    if target is not None:
        asked = asked * positive_density(target)
        asked = asked / asked.sum()
    return polygon_elements(vertices, mesh.triangles, asked, polygons)


def _symmetric(
    mesh: Renumbered, polygons: np.ndarray | None, faces: Elements, w: np.ndarray, guard: np.ndarray | None
) -> tuple[MirrorSymmetry, np.ndarray] | None:
    """The symmetry of an island and the symmetric map next to w (n,), None where there is none; guard (b,2): edges of
    the boundary that may not meet."""
    symmetry = find_symmetry(mesh.vertices, mesh.triangles, polygons, faces)
    found = None if symmetry is None else symmetric_start(symmetry, w, faces, "free", np.zeros(0, np.int64))
    return None if found is None or (guard is not None and meets_itself(found[1], guard)) else found


def meets_itself(w: np.ndarray, boundary: np.ndarray) -> bool:
    """Whether boundary edges (b,2) of a map (n,) cross, or come so near to others that they all but touch."""
    with np.errstate(over="ignore"):
        nearest = make_barrier(w, boundary, 1.0).energy(w)
    return not nearest < (1 / TOUCHING) ** 2 or len(crossings(w, boundary)) > 0


def island_start(vertices, triangles, given, boundary, fixed: bool) -> tuple[np.ndarray, tuple[str, ...]]:
    """A map (n,) without folds, the given one if it will do, and a warning if it will not."""
    uv = np.column_stack([given.real, given.imag])
    folds = count_folds(uv, triangles)
    scale = 1.0 if fixed else np.sqrt(1 / np.abs(signed_areas(uv, triangles)).sum())
    if folds == 0:
        apart = given if fixed else _parted(given, triangles, boundary)
        if apart is not None:
            return apart * scale, ()
    straight = _straightened(vertices, triangles, uv)
    if straight is not None:
        return straight @ [1, 1j], (STRAIGHTENED,)
    if folds == 0:
        return given * scale, ()
    folded = np.flatnonzero(~(signed_areas(uv, triangles) > 0))
    raise FoldedUVError("The UVs to refine are folded beyond repair", kind="face", elements=folded)


def _parted(w: np.ndarray, triangles: np.ndarray, boundary: np.ndarray) -> np.ndarray | None:
    """The map w (n,), its boundary drawn in a little if it touches itself; None where that does not part it.

    Fans that share a place in the UV map, and sides of a slit, touch without crossing.
    """
    tail, head = halfedges(triangles)
    ends, others = np.concatenate([tail, head]), np.concatenate([head, tail])
    total = np.bincount(ends, w[others].real, len(w)) + 1j * np.bincount(ends, w[others].imag, len(w))
    inward = total / np.bincount(ends, minlength=len(w)) - w
    for share in PARTING:
        drawn = w.copy()
        drawn[boundary[:, 0]] += share * inward[boundary[:, 0]]
        uv = np.column_stack([drawn.real, drawn.imag])
        if not meets_itself(drawn, boundary) and count_folds(uv, triangles) == 0:
            return drawn
    return None


def _straightened(vertices, triangles, uv) -> np.ndarray | None:
    """An embedding (n,2) in a disk, near uv where that is possible; None for a surface with handles."""
    n, loops = len(vertices), boundary_loops(triangles)
    euler = euler_characteristic(n, len(triangles), sum(map(len, loops)))
    if not loops or euler + len(loops) != 2:
        return None
    outer = int(np.argmax([signed_area_of(uv[loop]) for loop in loops]))
    holes = [loop for k, loop in enumerate(loops) if k != outer]
    points, fans = _fans(np.column_stack([vertices, uv]), holes)
    try:
        start = disk_initial_map(points[:, :3], np.concatenate([triangles, fans]), points[:, 3:], loops[outer])
    except FoldedUVError:
        return None
    straight = start.uv[:n]
    return straight / np.sqrt(signed_areas(straight, triangles).sum())


def signed_area_of(polygon: np.ndarray) -> float:
    """Area of a closed polygon (b,2), positive if it is counter-clockwise."""
    a, b = polygon, np.roll(polygon, -1, axis=0)
    return 0.5 * float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


def _fans(points: np.ndarray, holes: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Points (n+h,d) with the centre of every hole, and triangles (k,3) around the centres that close the holes."""
    n = len(points)
    if not holes:
        return points, np.zeros((0, 3), np.int64)
    centres = np.stack([points[loop].mean(axis=0) for loop in holes])
    fans = [np.column_stack([np.roll(x, -1), x, np.full(len(x), n + k)]) for k, x in enumerate(holes)]
    return np.concatenate([points, centres]), np.concatenate(fans)
