"""Refine a map until every face has its area, none folds, and the shear is the least that allows, by Newton's method.

Minimises MIPS (Hormann, Greiner 2000) plus an area term (Degener, Meseth, Klein 2003), see `maps.energy`, in stages of
growing area weight (`continuation`). The weight ends where the area error is small enough for the quality.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import MeshError, positive_density
from ..freed_memory import give_back_of
from ..linalg.symmetric_sweeps import sweeping_solver
from ..maps.contacts import crossings
from ..maps.energy import Elements, area_error, elements, has_folds
from ..maps.mirror_symmetry import MirrorSymmetry
from ..maps.polygon_elements import polygon_elements
from ..maps.tutte import tutte
from ..maps.untangle import arc_length_boundary
from ..mesh.geometry import face_areas
from ..mesh.topology import boundary_loops
from ..progress import Progress, Steps, part_of
from .continuation import ContinuationResult, MapProblem, minimise_in_stages
from .continuation_rules import QUALITIES, planned_weights
from .elimination_order import Renumbered, renumbered
from .hessian_blocks import Assembly, RowAssembly, assembly_of, corners_of_quads
from .initial_maps import (
    InitialMap,
    disk_initial_map,
    free_initial_map,
    is_crowded,
    is_far,
    notched_disk,
    rectangle_initial_map,
    square_initial_map,
)
from .mirrored_motion import MirroredMotion, find_symmetry, halved, symmetric_start
from .pins import move_pins, placed_like
from .vertex_sweeps import Smoother, smoothed

INITIAL_MAPS = {
    "free": free_initial_map,
    "disk": disk_initial_map,
    "square": square_initial_map,
    "rectangle": rectangle_initial_map,
}
BOUNDARIES = tuple(INITIAL_MAPS)
# Below so many vertices Newton's steps take so little time that sweeps between them save none; and from a start that is
# warm, where there are fewer steps to save, below so many.
SWEPT_ABOVE = 2000
SWEPT_ABOVE_WARM = 10_000
# Area error of a disk above which vertices without room may leave the circle.
NO_ROOM = 0.005
# An initial map with a free boundary is smoothed above this mean energy and this number of triangles, in so many
# sweeps: small charts have the same way whether they are solved alone or together (`parameterization.small_charts`).
TENSE = 3.0
FEW = 1000
SWEEPS = 4
# Up to this ratio of their densities faces ask for their own areas, but for rounding: no sweeps pay then.
EVEN = 1 + 1e-6
# Nor for maps of coarse meshes, which have nearly their own areas, and for drafts.
UNSMOOTHED = ("draft", "relaxed", "sketch")
# Where the time goes, roughly, as start and width.
SMOOTHING = (0.0, 0.1)
STAGES = (0.1, 0.9)


@dataclass(frozen=True)
class RefinementOptions:
    """How a map of a disk is refined.

    Attributes
    ----------
    boundary : "free"; "disk", sliding on the circle about 0 of the target's area; "square", sliding on the sides of
        the square about 0 of the target's area, corners fixed; "rectangle", as the square, with the aspect of the
        initial map
    balance : 0 for exact areas to 1 for the least shear
    quality : "draft", "standard" or "exact"; "relaxed" or "rough" for the initial map of a finer mesh
    warm_start : the initial map is nearly the one that is looked for, and needs no detour through small area weights
    prolonged : it comes from a coarser mesh, see `continuation_rules.is_ahead`
    multiplier : of a coarser mesh, see `Refinement`
    crossing : a free boundary may come to cross itself, which shears less
    order (n,) : in which vertices are eliminated, where it is known, see `nested_dissection.mesh_order`;
        polygons of several triangles have one of their own

    Raises
    ------
    ValueError : a boundary that is none of these, a balance outside of [0, 1]
    """

    boundary: str = "free"
    balance: float = 0.0
    quality: str = "standard"
    warm_start: bool = False
    prolonged: bool = False
    multiplier: float = 0.0
    crossing: bool = False
    order: np.ndarray | None = field(default=None, repr=False, compare=False)

    def __post_init__(self):
        if self.boundary not in BOUNDARIES:
            raise ValueError(f"boundary must be one of {', '.join(BOUNDARIES)}, not {self.boundary!r}")
        if not 0 <= self.balance <= 1:
            raise ValueError(f"balance must lie in [0, 1], not {self.balance}")


@dataclass(frozen=True)
class Refinement:
    """A refined map, and how it came about.

    Attributes
    ----------
    uv : (n,2) without folds
    iterations : Newton steps
    residual : last predicted decrease over energy
    area_error : share of the UV area in the wrong place
    area_weight : weight of the area term at the end
    energy : at the end
    status : "converged", "stalled" (no decrease could be found) or "steps" (allowance used up)
    overlap : the free boundary crosses itself
    warnings : what was replaced and why
    multiplier : Lagrange multiplier of the region's share, see `continuation.ContinuationResult`
    """

    uv: np.ndarray
    iterations: int
    residual: float
    area_error: float
    area_weight: float
    energy: float
    status: str
    overlap: bool
    warnings: tuple[str, ...]
    multiplier: float = 0.0


def refine(
    vertices: np.ndarray,
    triangles: np.ndarray,
    uv: np.ndarray,
    options: RefinementOptions | None = None,
    *,
    target: np.ndarray | None = None,
    region: np.ndarray | None = None,
    pins: tuple[np.ndarray, np.ndarray] | None = None,
    polygons: np.ndarray | None = None,
) -> Steps[Refinement]:
    """Refine a map uv (n,2) of a disk (n,3), (m,3) until every polygon has its area.

    Parameters
    ----------
    target : (m,) area that every face shall have relative to the others; the surface's areas by default. They are
        scaled to sum to the area of the surface.
    region : (m,) in [0, 1], weights of a region whose share of the target's area is to be exact
    pins : vertices (k,) and their places (k,2), in free mode. Two or more fix place, direction and scale, one fixes the
        place; with one, scale and direction are those of `uv`. Without pins the map has the area of the surface, and
        the place and the direction of `uv`.
    polygons : (m,) polygon of every triangle; by default each is its own

    Raises
    ------
    DensityError : a target that is not positive and finite
    PinError : pins that contradict each other or force a fold
    FoldedUVError : an initial map without area, or a fold that no embedding could remove

    References
    ----------
    Hormann, Greiner 2000 (shear); Degener, Meseth, Klein 2003 (area); Smith, de Goes, Kim 2019 (eigensystem);
    Smith, Schaefer 2015 (barrier against folds).
    """
    options = options or RefinementOptions()
    if pins is not None and options.boundary != "free":
        raise ValueError("pins need a free boundary")
    yield Progress("Refinement", 0.0)
    give_back_of(len(vertices))
    target = _targets(face_areas(vertices, triangles), target)
    mesh = renumbered(vertices, triangles, uv, pins, polygons, options.order)
    steps, mesh = _refined(mesh, _AreasAsked(target, region, polygons), options), mesh.bare()
    # Whoever called may have let go of it.
    del vertices, triangles, uv, target, region, polygons
    try:
        found, faces, warnings = yield from steps
    except MeshError as error:
        raise mesh.original_error(error) from error
    yield Progress("Refinement", 1.0)
    refined = mesh.original(found.w)
    if pins is not None and mesh.pins is not None:
        refined[pins[0]] = pins[1]
    return refinement_of(refined, found, area_error(faces, found.w), (*warnings, *found.warnings))


def refinement_of(uv: np.ndarray, found: ContinuationResult, error: float, warnings: tuple[str, ...]) -> Refinement:
    """The refined map uv (n,2) with its area error and all warnings, and how it came about."""
    return Refinement(
        uv=uv,
        iterations=found.steps,
        residual=found.residual,
        area_error=error,
        area_weight=found.area_weight,
        energy=found.energy,
        status=found.status,
        overlap=found.overlap,
        warnings=warnings,
        multiplier=found.multiplier,
    )


def _targets(area: np.ndarray, target: np.ndarray | None) -> np.ndarray:
    if target is None:
        return area
    target = positive_density(target)
    return target * (area.sum() / target.sum())


@dataclass(frozen=True)
class _AreasAsked:
    """What is asked of the triangles of a mesh, see `refine`."""

    target: np.ndarray
    region: np.ndarray | None
    polygons: np.ndarray | None

    def elements(self, mesh: Renumbered) -> Elements:
        return polygon_elements(mesh.vertices, mesh.triangles, self.target, self.polygons, self.region)

    def by_triangle(self, mesh: Renumbered, faces: Elements) -> Elements:
        """The elements of which each triangle is a polygon of its own."""
        return faces if faces.polygon is None else elements(mesh.vertices, mesh.triangles, self.target, self.region)


def _refined(
    mesh: Renumbered, asked: _AreasAsked, options: RefinementOptions
) -> Steps[tuple[ContinuationResult, Elements, tuple[str, ...]]]:
    """Stages on a renumbered chart: what was found, the elements, and the warnings of the initial map it was found
    from."""
    boundary, balance, quality = options.boundary, options.balance, QUALITIES[options.quality]
    pins, loop, n = mesh.pins, boundary_loops(mesh.triangles)[0], len(mesh.vertices)
    faces = asked.elements(mesh)
    by_triangle = asked.by_triangle(mesh, faces)
    initial, w = _start(mesh, faces, boundary, loop)
    initial, notches = _with_notches(initial, mesh, by_triangle, loop, options)
    swept = _smoother(mesh, faces, options), _is_loose(mesh, faces, balance)
    warm = options.warm_start
    known = None if pins is not None else _symmetry(mesh, asked, faces, by_triangle)
    parts = sweeping_solver(mesh.vertices, mesh.triangles)
    symmetry, w = _next_to_image(faces, initial.may_cross, known, w, by_triangle, boundary, loop)
    if known is not None and symmetry is None and boundary == "free" and not warm:
        symmetry, w = _embedded_to_image(faces, known, w, by_triangle, mesh, loop)
    if known is not None and symmetry is None:
        free = _map_problem(faces, assembly_of(faces, n, parts), initial, loop, boundary, *swept)
        symmetry, w = yield from part_of(_relaxed_to_image(free, known, w, by_triangle, options, loop), *SMOOTHING)
        warm = warm or symmetry is not None
    # It takes the memory of three maps.
    del known
    half = halved(faces, symmetry)
    assembly = assembly_of(half, n, parts, symmetry)
    count = len(faces.area)
    problem = _mirrored(_map_problem(half, assembly, initial, loop, boundary, *swept), symmetry, w, count)
    if options.crossing:
        problem = replace(problem, loop=None, with_barrier=False)
    several_pins = pins is not None and len(pins.vertices) > 1
    if pins is not None and several_pins:
        problem, w = yield from move_pins(problem, w, pins)
    elif _may_be_tense(faces, options):
        w = yield from part_of(
            _smoothed_if_tense(problem, by_triangle, w, planned_weights(balance, quality)[0]), *SMOOTHING
        )
    # All of them take the memory of four maps, and are made in less time than a step takes.
    del by_triangle, faces
    if symmetry is None:
        asked, mesh = _AreasAsked(np.zeros(0), None, None), mesh if boundary == "disk" else mesh.bare()
        if parts is not None:
            parts.hold(half.triangles)
    ahead = options.prolonged and boundary == "free"
    way = minimise_in_stages(problem, w, balance, quality, warm, options.multiplier, ahead)
    w, found = w if boundary == "disk" else w[:0].copy(), (yield from part_of(way, *STAGES))
    faces = half if symmetry is None else asked.elements(mesh)
    error = area_error(faces, found.w)
    if notches and error > max(NO_ROOM, 2 * quality.area_error):
        notched = notched_disk(initial, mesh.triangles, loop)
        if notched is not None:
            again = _map_problem(half, assembly, notched, loop, boundary, *swept)
            problem = _mirrored(again, symmetry, w, count)
            with_notches = yield from minimise_in_stages(problem, w, balance, quality)
            if area_error(faces, with_notches.w) < error:
                found, initial = with_notches, notched
    if boundary == "free" and not several_pins:
        area = faces.area @ faces.ratio if pins is None else None
        found = replace(found, w=placed_like(found.w, mesh.uv @ [1, 1j], faces, pins, area))
    return found, faces, initial.warnings


def _symmetry(mesh: Renumbered, asked: _AreasAsked, faces: Elements, by_triangle: Elements) -> MirrorSymmetry | None:
    """The mirror symmetry of a mesh, if there is one; what looks for it asks for no gradients, which are let go."""
    for some in (faces, by_triangle):
        some.let_go()
    give_back_of(len(mesh.vertices))
    found = find_symmetry(mesh.vertices, mesh.triangles, asked.polygons, faces)
    give_back_of(len(mesh.vertices))
    return found


def _start(mesh: Renumbered, faces: Elements, boundary: str, loop: np.ndarray) -> tuple[InitialMap, np.ndarray]:
    """How the boundary may move, and the map (n,) complex to start from, which notches of disks ask for once more."""
    # A map to areas far from the surface's is sheared by right.
    far = boundary == "free" and is_far(faces.area * faces.ratio, faces.area)
    given = (mesh.vertices, mesh.triangles, mesh.uv, loop)
    initial = INITIAL_MAPS[boundary](*given, **_start_options(boundary, faces, far))
    # That of the mesh, if it is where it starts, is kept once.
    w = np.ascontiguousarray(initial.uv, float).view(complex)[:, 0]
    return initial if boundary == "disk" else replace(initial, uv=np.zeros((0, 2))), w


def _with_notches(
    initial: InitialMap, mesh: Renumbered, by_triangle: Elements, loop: np.ndarray, options: RefinementOptions
) -> tuple[InitialMap, bool]:
    """How the boundary of a disk may move where single edges cut off too much of it, and whether notches may be of use
    later, if not."""
    if options.boundary != "disk" or options.balance > 0:
        return initial, False
    if not is_crowded(mesh.triangles, loop, by_triangle.area * by_triangle.ratio):
        return initial, True
    notched = notched_disk(initial, mesh.triangles, loop)
    return initial if notched is None else notched, False


def _is_loose(mesh: Renumbered, faces: Elements, balance: float) -> bool:
    """Whether stages end on a looser promise: of large meshes with a region, but for polygons, pins, or a balance."""
    plain = faces.polygon is None and mesh.pins is None and balance == 0
    return plain and faces.region is not None and len(mesh.vertices) > SWEPT_ABOVE


def _smoother(mesh: Renumbered, faces: Elements, options: RefinementOptions) -> Smoother | None:
    """Sweeps that follow every step, of such meshes in a domain. A boundary that is free gives way by itself."""
    n, least = len(mesh.vertices), SWEPT_ABOVE_WARM if options.warm_start else SWEPT_ABOVE
    swept = options.boundary != "free" and n > least and _is_loose(mesh, faces, options.balance)
    return Smoother(mesh.triangles, n) if swept else None


def _next_to_image(
    faces: Elements,
    may_cross: bool,
    symmetry: MirrorSymmetry | None,
    w: np.ndarray,
    by_triangle: Elements,
    boundary: str,
    loop: np.ndarray,
) -> tuple[MirrorSymmetry | None, np.ndarray]:
    """The symmetry with its axis, and a symmetric map next to w (n,) complex; None, and w, where there is none."""
    if symmetry is None:
        return None, w
    crosses = (lambda z: len(crossings(z, loop)) > 0) if may_cross else None
    found = symmetric_start(symmetry, w, by_triangle, boundary, loop, crosses)
    # What a mean with its image leaves next to nothing may be a fold by rounding.
    return (None, w) if found is None or has_folds(faces, found[1]) else found


def _embedded_to_image(
    faces: Elements, symmetry: MirrorSymmetry, w: np.ndarray, by_triangle: Elements, mesh: Renumbered, loop
) -> tuple[MirrorSymmetry | None, np.ndarray]:
    """The same by way of a mean value map: what came from a coarser mesh need not be symmetric, and its mean with its
    image may cross itself."""
    radius = np.sqrt(by_triangle.area.sum() / np.pi)
    fresh = tutte(mesh.vertices, mesh.triangles, loop, arc_length_boundary(mesh.vertices, loop, radius)) @ [1, 1j]
    found, mean = _next_to_image(faces, True, symmetry, fresh, by_triangle, "free", loop)
    return (None, w) if found is None else (found, mean)


def _relaxed_to_image(
    problem: MapProblem,
    symmetry: MirrorSymmetry,
    w: np.ndarray,
    by_triangle: Elements,
    options: RefinementOptions,
    loop: np.ndarray,
) -> Steps[tuple[MirrorSymmetry | None, np.ndarray]]:
    """The same by way of a map that was relaxed first: scales of an initial map vary so much from face to face that
    its mean with its image has folds."""
    relaxed = yield from minimise_in_stages(problem, w, options.balance, QUALITIES["relaxed"])
    crossing = problem.loop is not None
    found, mean = _next_to_image(problem.faces, crossing, symmetry, relaxed.w, by_triangle, options.boundary, loop)
    return (None, w) if found is None else (found, mean)


def _start_options(boundary: str, faces: Elements, far: bool) -> dict:
    """What the initial map with this boundary is told besides."""
    if boundary in ("square", "rectangle"):
        return {} if faces.quads is None else {"quads": corners_of_quads(faces)}
    return {"relaxed": np.inf} if far else {}


def _may_be_tense(faces: Elements, options: RefinementOptions) -> bool:
    """Whether an initial map may need to be smoothed: none that is warm, which has been."""
    uneven = faces.ratio.max() > EVEN * faces.ratio.min() and len(faces.triangles) > FEW
    may_be = options.boundary == "free" and options.quality not in UNSMOOTHED and not options.warm_start
    return bool(may_be and uneven)


def _smoothed_if_tense(
    problem: MapProblem, by_triangle: Elements, w: np.ndarray, area_weight: float
) -> Steps[np.ndarray]:
    """An initial map w (n,) whose vertices, those of the boundary too, have moved within their stars, if it is tense.

    Triangles of three boundary vertices are slivers in a disk. They hold up Newton's first steps, and have lost the
    digits that say whither.
    """
    tense = problem.newton_problem(w, area_weight, False).energy(w) > TENSE
    if tense and not problem.boundary_crosses(w):
        free = yield from smoothed(by_triangle, w, area_weight, SWEEPS, problem.loop)
        # Sweeps are not symmetric: halves may have gone ways whose mean folds.
        found = free if problem.symmetry is None else problem.symmetry.averaged(free)
        if by_triangle.areas(found).min() > 0 and not problem.boundary_crosses(found):
            return found
    return w


def _mirrored(problem: MapProblem, symmetry: MirrorSymmetry | None, w: np.ndarray, count: int) -> MapProblem:
    """The problem for maps that keep the symmetry of the map w (n,) complex, if there is one, of so many polygons."""
    if symmetry is None:
        return problem
    motion = MirroredMotion(problem.motion, symmetry, w)
    return replace(problem, motion=motion, symmetry=symmetry, smoother=None, loose=False, count=count)


def _map_problem(
    faces: Elements,
    assembly: Assembly | RowAssembly,
    initial: InitialMap,
    loop,
    boundary: str,
    smoother: Smoother | None,
    loose: bool,
) -> MapProblem:
    return MapProblem(
        faces=faces,
        assembly=assembly,
        motion=initial.motion,
        loop=loop if initial.may_cross else None,
        with_barrier=initial.with_barrier,
        # A polygon in a circle, or a notched square, has less area than the surface: the targets follow it.
        scale_free=boundary != "free",
        smoother=smoother,
        loose=loose,
    )
