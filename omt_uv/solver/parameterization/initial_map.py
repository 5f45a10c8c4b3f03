"""Map a chart before its refinement, by a conformal map and optimal transport, for large charts of a coarser mesh.

A refined map of a coarser mesh is carried back vertex by vertex (`mesh_hierarchy`) and leaves the refinement little to
do. Coarsening goes on until the chart is small.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..analysis.density import density_of_vertices
from ..canonical.embeddings import evened_sites, mean_value_sites
from ..errors import FoldedUVError, MeshError, PrecisionError, TransportError
from ..freed_memory import give_back_of
from ..maps.contacts import covers_itself, touches_itself
from ..maps.energy import Elements, area_error, elements, energy
from ..maps.polygon_elements import energy_in_turn, polygon_elements
from ..maps.tutte import evened_tutte
from ..maps.untangle import is_one_to_one, map_energy
from ..mesh.geometry import halfedge_lengths
from ..mesh.topology import boundary_loops
from ..progress import RunLog, Steps, part_of
from ..refinement.continuation_rules import QUALITIES, SQUEEZED, UNSQUEEZED, is_squeezed
from ..refinement.initial_maps import is_crowded
from ..refinement.mesh_hierarchy import Collapsing, coarsen_disk
from ..refinement.refine import Refinement, RefinementOptions, refine
from ..refinement.vertex_sweeps import smoothed_uv
from ..transport.convex_domain import Domain
from .polygons.polygon_disk import DiskMesh

if TYPE_CHECKING:
    from ..conformal.disk_map import ConformalMap
    from ..transport.semidiscrete import Transport

# Where the time of a chart goes, roughly, as start and width.
CONFORMAL = (0.0, 0.4)
TRANSPORT = (0.4, 0.6)
COARSENING = (0.0, 0.3)
COARSE_MAP = (0.3, 0.2)
COARSE_REFINEMENT = (0.5, 0.3)
FREED_BY_COARSER = (0.0, 0.7)
FREED_REFINEMENT = (0.7, 0.3)
RETURN = (0.8, 0.1)
SMOOTHING = (0.9, 0.1)
# Sites closer than this share of the domain are lost on the paraboloid, where their distance counts squared.
SITE_RESOLUTION = 1e-7
# Charts with more vertices come by way of a coarser one.
COARSE_ABOVE = 5000
# Up to so many come without where their boundary is free and what they start from has room: that shears less.
DIRECT_WITH_ROOM = 9000
# Charts of at most so many vertices start from a mean value map and no evened one: steps take little time there.
EVENED_ABOVE = 400
# Of charts with more than this a coarser one is embedded, since factors of all of them take as much memory as all else.
EMBEDDED = 200_000
# That has the vertices divided by this, and at most this share of them: otherwise it does not pay.
COARSER = 8
COARSE_ENOUGH = 0.25
# A mesh of this many vertices is no longer coarsened, even where it has no embedding in double precision.
COARSEST = 50
# Where the target is far from the surface's areas, coarser meshes say less: smaller steps, and more vertices at once.
COARSER_FAR = 5
COARSE_ENOUGH_FAR = 0.4
DIRECT_FAR = 20000
# It is left at least so many, if that is coarse enough: of fewer the ring around a region has too few.
FEWEST_FAR = 2000
# Large ones with a free boundary leave more of them, and go by way of a still coarser one: what is flattened is far
# from where a region is to be, and most steps there are cheapest where vertices are few.
COARSER_FREE = 3
DIRECT_FREE = 5000
# A disk whose log scale spreads less is as near, flattened with the boundary as it comes, as the transport brings it.
LITTLE_SPREAD = 0.5
# Mean energy of a mean value map above which a large chart starts from a flat one: where slivers make it so bad,
# coarser meshes say nothing, and the way from it is long.
HOPELESS = 50.0
# Energy below which a map is an isometry, but for rounding.
ISOMETRY = 1e-8
# What is unrolled so that its outline lies on itself may be that far from one: shear of 1.02 to 1.1.
UNROLLED = 1e-2
# Drafts of charts with more vertices come by way of a coarser mesh, unless their log scale spreads less, and need no
# step of all vertices where sweeps bring the areas of a draft. With an outline those of at most COARSE_ABOVE have
# shorter a way from an embedding by evened weights, and shear less.
DRAFT_ABOVE = 600
DRAFT_COARSE_ABOVE = 3000
DRAFT_COARSER = 4
DRAFT_SPREAD = 0.03
DRAFT_SWEEPS = 16
# What comes back is smoothed so many times, with these area weights.
SWEEPS = 8
SMOOTH_WEIGHT = 30.0
SMOOTH_WEIGHT_DRAFT = 200.0
SMOOTH_WEIGHT_FAR = 500.0
# The most energy at that weight of an evened map that is a start: a stage in which a squeezed one relaxes would leave
# as much, were it all of areas.
ROOM = SMOOTH_WEIGHT * UNSQUEEZED
# The most shear energy, over the spread of the flat map, that it may have: of more some stays.
MOST_SHEAR = 3.0
# Free disks of a middle size whose start has more energy than that have limbs squeezed to next to nothing. From a
# coarser mesh the way is half as long, and ends with less shear; up to so many vertices there is none.
NO_ROOM = 10 * SQUEEZED
TOO_COARSE = 1000


@dataclass(frozen=True)
class InitialChartMap:
    """The map from which the refinement of a chart starts.

    Attributes
    ----------
    uv (n,2) : coordinates
    conformal, cells : the conformal map and the transport they come from, on the coarsest mesh, if any
    warm : the map comes from a refined one, and is smooth; prolonged : it comes from a coarser mesh
    multiplier : of that, see `refine.Refinement`
    apart : it is known to cover no place twice
    freed : it has the room that its faces need, but not their areas: see `polygon_disk.DiskMesh`, buried
    """

    uv: np.ndarray
    conformal: ConformalMap | None = None
    cells: Transport | None = None
    warm: bool = False
    prolonged: bool = False
    multiplier: float = 0.0
    apart: bool = False
    freed: bool = False


def flat_initial_map(disk: DiskMesh, log: RunLog, spread: float = LITTLE_SPREAD) -> InitialChartMap | None:
    """A disk flattened with the boundary as it comes; where that would cover itself, it bent or a mean value map.

    None where it would scale unevenly: areas are farther from a mean value map than from the transport's, then.
    """
    with log.timed("flattening"):
        flat = _evenly_flattened(disk, spread)
        if flat is None or is_one_to_one(flat, disk.triangles, disk.loop):
            return None if flat is None else InitialChartMap(flat)
        faces = elements(disk.vertices, disk.triangles, disk.target)
        starts = (uv for uv in (disk.bent, disk.embedded) if uv is not None)
        return InitialChartMap(min(starts, key=lambda uv: _energy(faces, uv, SMOOTH_WEIGHT)))


def _evenly_flattened(disk: DiskMesh, spread: float) -> np.ndarray | None:
    """A disk flattened (n,2) with the boundary as it comes; None where that scales unevenly."""
    return disk.flat.uv if disk.flat is not None and disk.spread < spread else None


def coarse_initial_map(
    disk: DiskMesh, balance: float, log: RunLog, flat: np.ndarray | None = None, draft: bool = False
) -> Steps[InitialChartMap | None]:
    """Map a disk by way of a coarser mesh; None where it cannot be coarsened, or where that does not pay.

    flat (n,2) : an embedding, a mean value map by default; draft : the map had better have its areas at once
    """
    if flat is None and (draft or len(disk.vertices) > EMBEDDED) and not disk.is_far:
        try:
            found = yield from _coarse_initial_map(disk, balance, log, None, draft, embedded=False)
        except MeshError:
            found = None  # an embedding of all of it says what it is
        if found is not None and map_energy(found.uv, disk.vertices, disk.triangles) < HOPELESS:
            return found
    return (yield from _coarse_initial_map(disk, balance, log, flat, draft, embedded=True))


def _coarse_initial_map(
    disk: DiskMesh, balance: float, log: RunLog, flat: np.ndarray | None, draft: bool, embedded: bool
) -> Steps[InitialChartMap | None]:
    """The same; embedded: the mesh itself is, in place of the coarser one alone."""
    far, vertices, triangles = disk.is_far, disk.vertices, disk.triangles
    give_back_of(len(vertices))
    goal, most = _goal(disk, draft, flat is not None)
    with log.timed("coarsening"):
        if flat is None and embedded:
            flat = disk.embedded
            even = _even_start(disk, flat) if disk.boundary == "free" and not far else None
            # A draft has no steps to spare for a start that is squeezed, too.
            if even is not None and not (draft and map_energy(even, vertices, triangles) > HOPELESS):
                return InitialChartMap(even)
        density = density_of_vertices(vertices, triangles, disk.target, goal) if far else None
        how = Collapsing(whole_boundary=draft and disk.boundary != "free", light_first=draft)
        steps = coarsen_disk(vertices, triangles, flat, disk.target, goal, disk.region, density, how)
        coarse = yield from part_of(steps, *COARSENING)
    if len(coarse.kept) > (COARSE_ENOUGH_FAR if far else COARSE_ENOUGH) * len(vertices):
        return None
    loop = boundary_loops(coarse.triangles)[0]
    if disk.boundary != "free" and len(loop) < len(disk.loop):
        return None  # what returned to the boundary would lie on a chord
    corners = None if disk.corners is None else np.searchsorted(coarse.kept, disk.corners)
    points = vertices[coarse.kept]
    parts = points, coarse.triangles, coarse.mass, loop, disk.boundary, corners, coarse.region
    coarse_disk = DiskMesh(*parts, aspect=disk.aspect, buried=disk.buried)
    found = None
    if len(points) > most:
        coarser = coarse_initial_map(coarse_disk, balance, log, None if flat is None else flat[coarse.kept], draft)
        found = yield from part_of(coarser, *COARSE_MAP)
    if found is None and draft:
        found = _draft_start(coarse_disk, None if flat is None else flat[coarse.kept], log)
    if found is None:
        found = yield from part_of(direct_initial_map(coarse_disk, log), *COARSE_MAP)
    quality = "freed" if disk.buried or found.freed else "sketch" if draft else "rough" if far else "relaxed"
    with log.timed("coarse refinement"):
        way = _coarse_or_coarser_refined(coarse_disk, found, balance, quality, log)
        found, refined = yield from part_of(way, *COARSE_REFINEMENT)
    log.warnings += refined.warnings
    stages = found.conformal, found.cells, far, True, refined.multiplier, False, quality == "freed" or found.freed
    with log.timed("coarsening"):
        uv = yield from part_of(coarse.prolonged(refined.uv, len(vertices)), *RETURN)
        del coarse, coarse_disk, points, found, refined  # what leads back takes the memory of ten maps
        give_back_of(len(vertices))
        weight = SMOOTH_WEIGHT_DRAFT if draft else SMOOTH_WEIGHT_FAR if far else SMOOTH_WEIGHT
        sweeps, enough = (DRAFT_SWEEPS, QUALITIES["draft"].area_error) if draft else (SWEEPS, 0.0)
        uv = yield from part_of(smoothed_uv(vertices, triangles, disk.target, uv, weight, sweeps, enough), *SMOOTHING)
        # Of slivers a coarser mesh says nothing: no vertex of theirs can go without others turning inside out.
        start = None if far or draft else flat
        if start is not None and map_energy(start, vertices, triangles) < map_energy(uv, vertices, triangles):
            return InitialChartMap(start)
    return InitialChartMap(uv, *stages)


def _goal(disk: DiskMesh, draft: bool, again: bool) -> tuple[int, int]:
    """How many vertices the coarser mesh of a disk is to have, and with how many at most it is mapped by itself.

    again : the disk is a coarser mesh already
    """
    count = len(disk.vertices)
    if not disk.is_far:
        return (count // DRAFT_COARSER, DRAFT_COARSE_ABOVE) if draft else (count // COARSER, COARSE_ABOVE)
    if disk.boundary == "free" and (again or count > DIRECT_FAR):
        return count // COARSER_FREE, DIRECT_FREE
    return max(count // COARSER_FAR, min(FEWEST_FAR, int(COARSE_ENOUGH_FAR * count))), DIRECT_FAR


def _coarse_or_coarser_refined(
    disk: DiskMesh, initial: InitialChartMap, balance: float, quality: str, log: RunLog
) -> Steps[tuple[InitialChartMap, Refinement]]:
    """The refined map of a coarse mesh, and what it started from: of what double precision has no embedding, as of a
    body that hangs on a small hole, a still coarser mesh, which has one."""
    try:
        return initial, (yield from _coarse_refined(disk, initial, balance, quality))
    except (FoldedUVError, PrecisionError):
        if len(disk.vertices) <= COARSEST:
            raise
        way = coarse_initial_map(replace(disk, buried=True), balance, log)
        found = yield from part_of(way, *FREED_BY_COARSER)
        if found is None:
            raise
    refined = _coarse_refined(disk, found, balance, "freed")
    return found, (yield from part_of(refined, *FREED_REFINEMENT))


def _even_start(disk: DiskMesh, flat: np.ndarray) -> np.ndarray | None:
    """A start (n,2) that scales evenly, in place of a mean value map (n,2) from which there is hardly a way."""
    if map_energy(flat, disk.vertices, disk.triangles) < HOPELESS:
        return None
    even = _evenly_flattened(disk, LITTLE_SPREAD)
    return even if even is not None and is_one_to_one(even, disk.triangles, disk.loop) else None


def _coarse_refined(disk: DiskMesh, initial: InitialChartMap, balance: float, quality: str) -> Steps[Refinement]:
    """The refined map of a coarse mesh."""
    options = RefinementOptions(
        boundary=disk.boundary,
        balance=balance,
        quality=quality,
        warm_start=initial.warm,
        prolonged=initial.prolonged,
        multiplier=initial.multiplier,
        order=disk.order,
    )
    return refine(disk.vertices, disk.triangles, initial.uv, options, target=disk.target, region=disk.region)


def _draft_start(disk: DiskMesh, flat: np.ndarray | None, log: RunLog) -> InitialChartMap | None:
    """Where a draft of a coarse mesh begins: flattened, or as embedded (n,2), by default in a mean value map; with
    corners by evened weights, or None where these squeeze it."""
    if disk.corners is not None:
        return evened_initial_map(disk, log, large=False)
    even = flat_initial_map(disk, log) if disk.boundary == "free" else None
    if even is not None:
        return even
    flat = disk.embedded if flat is None else flat
    faces = elements(disk.vertices, disk.triangles, disk.target)
    evened = evened_tutte(disk.vertices, disk.loop, flat, faces, SMOOTH_WEIGHT, order=disk.order)
    return InitialChartMap(flat if evened is None else evened)


def roomy_initial_map(disk: DiskMesh, log: RunLog) -> InitialChartMap | None:
    """A free disk of a middle size, flattened as it comes or mapped by evened weights; None where neither has room."""
    n = len(disk.vertices)
    if disk.boundary != "free" or not EVENED_ABOVE < n <= DIRECT_WITH_ROOM or disk.is_far:
        return None
    with log.timed("flattening"):
        faces = elements(disk.vertices, disk.triangles, disk.target)
        # Small ones are flattened in any case, and large ones embedded.
        flat = _roomy_flat(disk, faces) if n <= COARSE_ABOVE else None
        if flat is not None:
            return InitialChartMap(flat)
        try:
            # Others have maps that are nearly isometries.
            sprawls = disk.spread >= LITTLE_SPREAD
            given = (faces, SMOOTH_WEIGHT, SQUEEZED if sprawls else ROOM, disk.order, lambda: sprawls)
            evened = evened_tutte(disk.vertices, disk.loop, disk.embedded, *given)
        except PrecisionError:
            return None
        if evened is not None and n > COARSE_ABOVE:
            flat = _roomy_flat(disk, faces)
        if flat is None and evened is not None and _energy(faces, evened, 0.0) > MOST_SHEAR * disk.spread:
            return None
        return None if evened is None else InitialChartMap(evened if flat is None else flat)


def _roomy_flat(disk: DiskMesh, faces: Elements) -> np.ndarray | None:
    """A disk flattened (n,2) that scales evenly, is one to one, and not squeezed; None where that is not so."""
    flat = _evenly_flattened(disk, LITTLE_SPREAD)
    if flat is None or not (is_one_to_one(flat, disk.triangles, disk.loop) or (flat := disk.bent) is not None):
        return None
    return None if is_squeezed(_energy(faces, flat, SMOOTH_WEIGHT), SMOOTH_WEIGHT) else flat


def _energy(faces: Elements, uv: np.ndarray, area_weight: float) -> float:
    """The energy of a map uv (n,2), as large as its targets."""
    w = uv @ [1, 1j]
    return energy(faces, w * np.sqrt((faces.area @ faces.ratio) / faces.areas(w).sum()), area_weight)


def evened_initial_map(disk: DiskMesh, log: RunLog, large: bool) -> InitialChartMap | None:
    """A disk of a middle size at most, or a large one, embedded in its domain by evened weights; None where that
    squeezes it. It leaves as little to do as conformal map and transport, which take as long as the refinement."""
    if large != (len(disk.vertices) > DIRECT_WITH_ROOM) or disk.is_far:
        return None
    faces, outline = elements(disk.vertices, disk.triangles, disk.target), (disk.loop, disk.corners, disk.domain)
    with log.timed("embedding"), suppress(FoldedUVError, PrecisionError):
        # A transport within a circle that vertices are going to leave is no better start.
        most = np.inf if disk.boundary == "disk" and is_crowded(disk.triangles, disk.loop, disk.target) else SQUEEZED
        evened = evened_sites(faces, disk.vertices, outline, SMOOTH_WEIGHT, most, lambda: True, disk.order)
        return None if evened is None else InitialChartMap(evened)
    return None


def direct_initial_map(disk: DiskMesh, log: RunLog) -> Steps[InitialChartMap]:
    """Map a disk by itself: flattened or, if large, embedded where it may be, else by conformal map and transport."""
    found = flat_initial_map(disk, log) if disk.boundary == "free" else evened_initial_map(disk, log, large=True)
    return (yield from initial_map(disk, log)) if found is None else found


def roomier_initial_map(disk: DiskMesh, balance: float, log: RunLog) -> Steps[InitialChartMap]:
    """The same, but for a free disk of a middle size that has next to no room there: by way of a coarser mesh, if there
    is one."""
    found = yield from direct_initial_map(disk, log)
    middling = TOO_COARSE < len(disk.vertices) <= COARSE_ABOVE
    if disk.boundary != "free" or disk.is_far or not middling:
        return found
    if _energy(elements(disk.vertices, disk.triangles, disk.target), found.uv, SMOOTH_WEIGHT) <= NO_ROOM:
        return found
    with suppress(MeshError):
        coarser = yield from coarse_initial_map(disk, balance, log)
        return found if coarser is None else coarser
    return found


def good_enough(disk: DiskMesh, uv: np.ndarray, draft: bool, apart: bool, goal: float) -> Refinement | None:
    """An initial map uv (n,2) as the result, if no face folds and nothing covers itself, and it is an isometry; for a
    draft it only needs to have a draft's areas, and unrolled with slits whose sides lie on one another, which no
    barrier moves apart, an area error up to `goal`. apart : that it is unrolled, and covers no place twice."""
    faces = polygon_elements(disk.vertices, disk.triangles, disk.target, disk.polygons, disk.region)
    w = uv @ [1, 1j]
    w = w * np.sqrt((faces.area @ faces.ratio) / np.abs(faces.areas(w).sum()))
    value, error = energy_in_turn(faces, w, SMOOTH_WEIGHT_FAR), area_error(faces, w)
    as_it_is = value < ISOMETRY or (apart and value < UNROLLED and error <= goal and touches_itself(uv, disk.loop))
    if not draft and (disk.boundary != "free" or not as_it_is):
        return None
    if not np.isfinite(value) or error > QUALITIES["draft"].area_error:
        return None
    if not apart and covers_itself(w, disk.loop):
        return None
    return Refinement(
        uv=np.column_stack([w.real, w.imag]),
        iterations=0,
        residual=0.0,
        area_error=error,
        area_weight=SMOOTH_WEIGHT_FAR,
        energy=value,
        status="converged",
        overlap=False,
        warnings=(),
    )


def initial_map(disk: DiskMesh, log: RunLog) -> Steps[InitialChartMap]:
    """Map a disk conformally and move that map by optimal transport to the target's areas.

    Where rounding decides where the points of the conformal map lie, a mean value map is moved instead.
    """
    from ..conformal.rectangle_to_disk import centred_sites
    from ..transport.inverse_map import centroid_map

    vertices, triangles, loop, corners, domain = disk.vertices, disk.triangles, disk.loop, disk.corners, disk.domain
    mass = np.bincount(triangles.ravel(), np.repeat(disk.target / 3, 3), len(vertices))
    conformal, sites, trouble = yield from _conformal_sites(disk, log)
    if not trouble:
        sites = centred_sites(sites, mass, triangles, loop, SITE_RESOLUTION) if corners is None else sites
        cells, trouble = yield from _transport(sites, mass, domain, log)
        if cells is not None:
            return InitialChartMap(
                centroid_map(cells.cells.centroid, domain, loop, corners, log.warnings), conformal, cells
            )
    log.warnings.append(f"{trouble}; started from a mean value map instead")
    sites = mean_value_sites(vertices, triangles, loop, corners, domain)
    cells, trouble = yield from _transport(sites, mass, domain, log)
    if cells is None:
        log.warnings.append(f"{trouble}; refined the embedding without transport")
        return InitialChartMap(sites, conformal)
    return InitialChartMap(centroid_map(cells.cells.centroid, domain, loop, corners, log.warnings), conformal, cells)


def _conformal_sites(disk: DiskMesh, log: RunLog):
    """Conformal map, its coordinates (n,2) in the domain, and why they cannot be used or an empty text."""
    from ..conformal.disk_map import conformal_disk, conformal_rectangle

    vertices, triangles, corners = disk.vertices, disk.triangles, disk.corners
    with log.timed("conformal"):
        try:
            if corners is None:
                conformal = yield from part_of(conformal_disk(vertices, triangles), *CONFORMAL)
                sites = conformal.uv
            else:
                conformal = yield from part_of(conformal_rectangle(vertices, triangles, corners), *CONFORMAL)
                sites = (conformal.uv / [1, conformal.aspect] - 0.5) * np.sqrt([1 / disk.aspect, disk.aspect])
        except PrecisionError as error:
            return None, None, error.cause
        nearest = halfedge_lengths(sites, triangles).min()
        if nearest < SITE_RESOLUTION:
            trouble = f"The conformal map puts neighbours {nearest:.0e} apart, too close for the transport"
            return conformal, None, trouble
        return conformal, sites, ""


def _transport(sites, mass, domain: Domain, log: RunLog):
    """The transport, or None and why there is none."""
    from ..transport.semidiscrete import transport

    with log.timed("transport"):
        try:
            return (yield from part_of(transport(sites, mass, domain), *TRANSPORT)), ""
        except (TransportError, PrecisionError) as error:
            return None, error.cause
