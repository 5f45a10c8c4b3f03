"""The map that the refinement starts from: conformal map and transport, for large charts those of a coarser mesh.

A refined map of a coarser mesh is carried back vertex by vertex (`disk_coarsening`) and leaves the refinement little to
do. Coarsening goes on until the chart is small.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..analysis.density import graded_density
from ..conformal.disk_map import ConformalMap, conformal_disk, conformal_rectangle
from ..conformal.rectangle_to_disk import centre_in_disk
from ..errors import PrecisionError, TransportError
from ..maps.energy import elements
from ..maps.tutte import arc_length_parameters, tutte
from ..mesh.geometry import face_areas, halfedge_lengths
from ..mesh.topology import boundary_loops
from ..progress import RunLog, Steps, part_of
from ..refinement.initial_maps import is_far
from ..refinement.mesh_hierarchy import coarsen_disk
from ..refinement.refine import RefinementOptions, refine
from ..refinement.vertex_sweeps import smoothed
from ..transport.convex_domain import Disk, Domain, Rectangle
from ..transport.semidiscrete import Transport, transport

# Where the time of a chart goes, roughly, as start and width: a bar that moves evenly needs no more.
CONFORMAL, TRANSPORT = (0.0, 0.4), (0.4, 0.6)
COARSENING, COARSE_MAP, COARSE_REFINEMENT = (0.0, 0.3), (0.3, 0.2), (0.5, 0.3)
RETURN, SMOOTHING = (0.8, 0.1), (0.9, 0.1)
# Sites closer than this share of the domain are lost when they are lifted to the paraboloid, where their
# distance counts squared.
SITE_RESOLUTION = 1e-7
# A mean this near to the middle of the unit disk is there.
CENTRED = 1e-3
# Charts with more vertices than this come by way of one with an eighth of their vertices, or at most a quarter.
COARSE_ABOVE, COARSER, COARSE_ENOUGH = 5000, 8, 0.25
# Where the target is far from the surface's areas, coarser meshes say less: they are taken in smaller steps, and mapped
# at once up to a larger size.
COARSER_FAR, COARSE_ENOUGH_FAR, DIRECT_FAR = 5, 0.4, 20000
# Their edges grow by at most the root of this over the number of vertices for a length: as they do around a disk that
# gets most of the map, and meets its ring with as many edges as the ring has around it.
AROUND = 4.0
# Vertices are at most so much denser in one place than in another.
LEAST_DENSITY = 1e-4
# What comes back is smoothed so many times, with these weights of the area term.
SWEEPS, SMOOTH_WEIGHT, SMOOTH_WEIGHT_FAR = 8, 30.0, 500.0


@dataclass(frozen=True)
class FirstMap:
    """Coordinates uv (n,2), and the conformal map and the transport they come from, on the coarsest mesh, or None.

    near: the map comes from a refined one, and is smooth; pull: its multiplier, see `refine.Refinement`.
    """

    conformal: ConformalMap | None
    cells: Transport | None
    uv: np.ndarray
    near: bool = False
    pull: float = 0.0


def coarse_first_map(
    vertices, triangles, target, loop, corners, boundary: str, balance, log: RunLog, flat=None, region=None
) -> Steps[FirstMap | None]:
    """A first map by way of a coarser mesh; None where the mesh cannot be coarsened, or where that does not pay.

    target (m,): areas of the triangles in the map; flat (n,2): an embedding, a mean value map by default; region (m,):
    weights of a region whose share is to be exact.
    """
    far = is_far(target, face_areas(vertices, triangles))
    with log.timed("coarsening"):
        if flat is None:
            flat = mean_value_sites(vertices, triangles, loop, None, Disk())
        goal = len(vertices) // (COARSER_FAR if far else COARSER)
        density = _density(vertices, triangles, target, goal) if far else None
        steps = coarsen_disk(vertices, triangles, flat, target, goal, region, density)
        coarse = yield from part_of(steps, *COARSENING)
    if len(coarse.kept) > (COARSE_ENOUGH_FAR if far else COARSE_ENOUGH) * len(vertices):
        return None
    points, mesh, mass = vertices[coarse.kept], coarse.triangles, coarse.mass
    found: FirstMap | None = None
    rim = boundary_loops(mesh)[0]
    if boundary != "free" and len(rim) < len(loop):
        return None  # what returned to the rim would lie on a chord
    corners = None if corners is None else np.searchsorted(coarse.kept, corners)
    if len(points) > (DIRECT_FAR if far else COARSE_ABOVE):
        rest = (boundary, balance, log, flat[coarse.kept], coarse.region)
        found = yield from part_of(coarse_first_map(points, mesh, mass, rim, corners, *rest), *COARSE_MAP)
    if found is None:
        domain = Rectangle() if boundary == "square" else Disk()
        direct = first_map(points, mesh, mass, rim, corners, domain, log)
        found = yield from part_of(direct, *COARSE_MAP)
    with log.timed("coarse refinement"):
        options = RefinementOptions(
            boundary=boundary,
            balance=balance,
            quality="rough" if far else "relaxed",
            warm_start=found.near,
            multiplier=found.pull,
        )
        way = refine(points, mesh, found.uv, options, target=mass, region=coarse.region)
        refined = yield from part_of(way, *COARSE_REFINEMENT)
    log.warnings += refined.warnings
    with log.timed("coarsening"):
        uv = yield from part_of(coarse.prolonged(refined.uv, len(vertices)), *RETURN)
        faces, w = elements(vertices, triangles, target), uv @ [1, 1j]
        w = w * np.sqrt((faces.area @ faces.ratio) / faces.areas(w).sum())
        sweeps = smoothed(faces, w, SMOOTH_WEIGHT_FAR if far else SMOOTH_WEIGHT, SWEEPS)
        w = yield from part_of(sweeps, *SMOOTHING)
        uv = np.column_stack([w.real, w.imag])
    return FirstMap(found.conformal, found.cells, uv, far, refined.multiplier)


def _density(vertices, triangles, target, goal: int) -> np.ndarray:
    """Density (n,) of the vertices of a coarse mesh: as the map stretches what is to get the areas target (m,)."""
    area = face_areas(vertices, triangles)
    wanted = target / area
    wanted = np.maximum(wanted, LEAST_DENSITY * wanted.max())
    density = area * graded_density(wanted, vertices, triangles, np.sqrt(AROUND / goal), goal)
    has, all_of_it = (np.bincount(triangles.ravel(), np.repeat(x, 3), len(vertices)) for x in (density, area))
    return has / all_of_it


def first_map(vertices, triangles, target, loop, corners, domain: Domain, log: RunLog) -> Steps[FirstMap]:
    """Conformal map and transport to the areas target (m,) of a disk (n,3), (m,3) with its boundary loop (b,).

    The conformal map moved by the transport; where rounding decides where its points lie, a mean value map so moved.
    """
    mass = np.bincount(triangles.ravel(), np.repeat(target / 3, 3), len(vertices))
    conformal, sites, trouble = yield from _conformal_sites(vertices, triangles, corners, log)
    if not trouble:
        sites = _centred(sites, mass, triangles, loop) if corners is None else sites
        cells, trouble = yield from _transport(sites, mass, domain, log)
        if cells is not None:
            return FirstMap(conformal, cells, centroid_map(cells, domain, loop, corners, log.warnings))
    log.warnings.append(f"{trouble}; started from a mean value map instead")
    sites = mean_value_sites(vertices, triangles, loop, corners, domain)
    cells, trouble = yield from _transport(sites, mass, domain, log)
    if cells is None:
        log.warnings.append(f"{trouble}; refined the embedding without transport")
        return FirstMap(conformal, None, sites)
    return FirstMap(conformal, cells, centroid_map(cells, domain, loop, corners, log.warnings))


def _conformal_sites(vertices, triangles, corners, log: RunLog):
    """Conformal map, its coordinates (n,2) in the domain, and why they cannot be used or an empty text."""
    with log.timed("conformal"):
        try:
            if corners is None:
                conformal = yield from part_of(conformal_disk(vertices, triangles), *CONFORMAL)
                sites = conformal.uv
            else:
                conformal = yield from part_of(conformal_rectangle(vertices, triangles, corners), *CONFORMAL)
                sites = conformal.uv / [1, conformal.aspect] - 0.5
        except PrecisionError as error:
            return None, None, error.cause
        nearest = halfedge_lengths(sites, triangles).min()
        if nearest < SITE_RESOLUTION:
            trouble = f"The conformal map puts neighbours {nearest:.0e} apart, too close for the transport"
            return conformal, None, trouble
        return conformal, sites, ""


def _centred(sites: np.ndarray, mass: np.ndarray, triangles: np.ndarray, loop: np.ndarray) -> np.ndarray:
    """Sites (n,2) of the disk moved by a Moebius map so that what has most mass is in the middle, if they stay apart.

    The transport then has less to move, and a magnified region meets the circle on all sides at once.
    """
    if np.linalg.norm(mass @ sites) < CENTRED * mass.sum():
        return sites
    centred = centre_in_disk(sites, mass)
    centred[loop] /= np.linalg.norm(centred[loop], axis=1)[:, None]
    return centred if halfedge_lengths(centred, triangles).min() >= SITE_RESOLUTION else sites


def _transport(sites, mass, domain: Domain, log: RunLog):
    """The transport, or None and why there is none."""
    with log.timed("transport"):
        try:
            return (yield from part_of(transport(sites, mass, domain), *TRANSPORT)), ""
        except (TransportError, PrecisionError) as error:
            return None, error.cause


def mean_value_sites(vertices, triangles, loop, corners, domain: Domain) -> np.ndarray:
    """A milder embedding (n,2) with the boundary spread by its length (Floater 2003)."""
    if corners is not None:
        # Each side of the square takes the boundary between two corners.
        loop = np.roll(loop, -int(np.flatnonzero(loop == corners[0])[0]))
    share = arc_length_parameters(vertices, loop)
    if corners is not None:
        first = np.append(share[np.isin(loop, corners)], 1.0)
        share = np.interp(share, first, np.arange(5) / 4)
    return tutte(vertices, triangles, loop, domain.map_boundary(share))


def centroid_map(cells: Transport, domain: Domain, loop, corners, warnings: list[str]) -> np.ndarray:
    """The inverse of the transport map, (n,2): every vertex at the centroid of its cell.

    Boundary vertices (b,) move on to the boundary of the domain, in their order, and `corners` (4,), if given,
    into those of the rectangle.
    """
    uv = cells.cells.centroid.copy()
    s = domain.boundary_parameter(uv[loop])
    step = (np.roll(s, -1) - s + domain.period / 2) % domain.period - domain.period / 2
    if not np.isclose(step.sum(), domain.period):
        warnings.append("The transport tangles the boundary; it was spread evenly instead")
        step = np.full(len(loop), domain.period / len(loop))
    # Start behind the largest gap: there nothing can be out of order.
    first = (int(step.argmax()) + 1) % len(loop)
    along = s[first] + np.concatenate([[0.0], np.cumsum(np.roll(step, -first)[:-1])])
    if (np.diff(along) <= 0).any():
        along = np.maximum.accumulate(along)
        spread = along[0] + domain.period * np.arange(len(loop)) / len(loop)
        along = 0.9 * along + 0.1 * spread
    loop = np.roll(loop, -first)
    if corners is not None:
        loop, along = _into_corners(domain, loop, along, corners)
    uv[loop] = domain.boundary_point(along)
    return uv


def _into_corners(domain: Domain, loop, along, corners) -> tuple[np.ndarray, np.ndarray]:
    """Warp boundary parameters in order (b,) piecewise linearly so that the corners come to lie in corners."""
    first = int(np.flatnonzero(loop == corners[0])[0])
    loop, along = np.roll(loop, -first), np.concatenate([along[first:], along[:first] + domain.period])
    place = np.flatnonzero(np.isin(loop, corners))
    ends = np.append(along[place], along[0] + domain.period)
    return loop, np.interp(along, ends, domain.period * np.arange(5) / 4)
