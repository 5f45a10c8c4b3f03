"""Map closed surfaces of genus 0 to the unit sphere with prescribed areas, by optimal transport and refinement.

Conformal map, transport, refinement, as on the plane; and where one of the first two leaves double precision, a start
from coarse to fine instead, which always exists.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..errors import FoldedUVError, PrecisionError, TransportError, positive_density
from ..mesh.closed_surface import ClosedSurface, closed_surface
from ..mesh.geometry import face_areas, vertex_areas
from ..mesh.spherical_geometry import signed_volumes, spherical_areas
from ..mesh.topology import twins
from ..progress import Progress, Steps, part_of
from ..refinement.continuation_rules import QUALITIES
from ..transport.semidiscrete_sphere import sphere_transport
from ..transport.spherical_power_diagram import Hull
from .conformal import ConformalSites, ConformalSphere, conformal_sites, straightened
from .dominitz_tannenbaum import SphereFlow, flow_map
from .multilevel import multilevel_start
from .polygon_surface import PolygonSurface, with_polygon_fans
from .refine import SphereRefinement, sphere_refine
from .symmetry import with_mirrored_quads

# Optimal transport, by Newton's method.
NEWTON = "newton"
# Moser's flow and gradient flow (`dominitz_tannenbaum`).
FLOW = "flow"
# Moser's flow by itself, with no refinement, as Dominitz and Tannenbaum compare with it.
MOSER = "moser"
METHODS = (NEWTON, FLOW, MOSER)
# Where the time goes, roughly, as start and width of the whole.
CONFORMAL = (0.0, 0.15)
TRANSPORT = (0.15, 0.25)
REFINEMENT = (0.4, 0.6)
# Area error, over that of symmetric quads, that a map of these may have in the triangles that they came as.
AREA_KEPT = 1.5
# Up to this share of the triangles that are joined to quads for their mirror images, the areas are those of triangles
# as they came, in a symmetric map all the same: it has room for these few.
FEW_JOINED = 0.1
# Cells may be off by this share of their areas: the refinement that follows starts as well from these.
START_TOLERANCE = 0.1
# And by this, where rounding ends the search: a start from coarse to fine has limbs lie otherwise, as chance has it.
START_TOLERATED = 0.5
# From coarse to fine, where the transport failed.
MULTILEVEL = (0.4, 0.3)


@dataclass(frozen=True)
class SphereMap:
    """A map of a closed surface to the unit sphere.

    positions (n,3) unit vectors, faces counter-clockwise seen from outside; conformal (n,3): the Moebius-centred
    conformal map it started from, or the map of least shear where that leaves double precision; sites (n,3): the
    conformal map with folds, where faces are too small for double precision, or the same as conformal; status: see
    `refine.SphereRefinement`; iterations: Newton steps of the refinement; residual: last predicted decrease
    over energy; warnings: what was repaired or replaced, and why; flow: that of Dominitz and Tannenbaum, where it is
    the method.
    """

    positions: np.ndarray
    conformal: np.ndarray
    sites: np.ndarray
    status: str
    iterations: int
    residual: float
    warnings: tuple[str, ...]
    flow: SphereFlow | None = None


def sphere_map(
    vertices: np.ndarray,
    triangles: np.ndarray,
    density: np.ndarray | None = None,
    balance: float = 0.0,
    quality: str = "standard",
    method: str = "newton",
    polygons: np.ndarray | None = None,
) -> Steps[SphereMap]:
    """Map a closed surface (n,3), (m,3) of genus 0 to the unit sphere, every polygon with its share of 4 pi.

    Parameters
    ----------
    density : (m,) > 0 multiplies the area that each triangle asks for; 1 by default
    balance : from 0, exact areas, to 1, least shear
    quality : "draft", "standard" or "exact", how small the area error of single faces becomes
    method : "newton", optimal transport, or "flow", that of Dominitz and Tannenbaum, both refined; "moser", the first
        half of that flow as it comes out
    polygons : (m,) polygon of every triangle; by default each is its own

    Raises
    ------
    MeshError : see `closed_surface.closed_surface`
    DensityError : a density that is not positive and finite
    PrecisionError : the surface has no map without folds in double precision
    ValueError : an unknown method, or a balance outside of [0, 1]

    References
    ----------
    Springborn, Schroeder, Pinkall 2008 (conformal map); Dominitz, Tannenbaum 2010 (flow); Praun, Hoppe 2003 (otherwise)
    """
    _check_method(method)
    surface = closed_surface(vertices, triangles, polygons)
    given = PolygonSurface(surface, polygons, _target(surface, density))
    fanned, options = with_polygon_fans(given), {"balance": balance, "quality": quality}
    if fanned is not None:
        found = yield from _mapped(fanned, method, options)
        n = len(surface.vertices)
        parts = {name: getattr(found, name)[:n] for name in ("positions", "conformal", "sites")}
        found = replace(found, **parts)
        # A cap that is no longer convex may fold the triangles that it came as.
        if method == MOSER or signed_volumes(found.positions, surface.triangles).min() > 0:
            return found
    return (yield from _mapped(given, method, options))


def _mapped(given: PolygonSurface, method: str, options: dict) -> Steps[SphereMap]:
    """The map of a surface as it is cut; options : balance and quality."""
    surface, polygons, target = given.surface, given.polygons, given.target
    warnings = list(surface.warnings)
    joined = with_mirrored_quads(surface.vertices, surface.triangles, polygons)
    few = joined is not None and joined is not polygons and _joined_share(joined, polygons) <= FEW_JOINED
    options = options | ({"polygons": polygons, "mirror_polygons": joined} if few else {"polygons": joined})
    sites, found = yield from part_of(_conformal(surface, warnings), *CONFORMAL)
    refined, flow = None, (yield from part_of(_flow(found, surface, target, method), *TRANSPORT))
    if found is not None and flow is not None and method == MOSER:
        return _unrefined(flow, found, warnings)
    if found is not None:
        begin = _transport_start(found, surface, target) if flow is None else _at_once(flow)
        refined = yield from _refined_start(surface, begin, target, warnings, options)
    if refined is None:
        start, _ = yield from part_of(multilevel_start(surface.vertices, surface.triangles, target), *MULTILEVEL)
        refined = yield from _refined(surface, start, target, options)
    if not few and joined is not polygons and not _as_given(refined.positions, surface, target, refined.area_error):
        refined = yield from _refined(surface, refined.positions, target, options | {"polygons": polygons})
    if options["balance"] == 0 and refined.area_error > QUALITIES[options["quality"]].area_error:
        warnings.append(_area_warning(refined.positions, surface.triangles, target, polygons))
    conformal = found.positions if found else (yield from _least_shear(surface, refined))
    return SphereMap(
        positions=refined.positions,
        conformal=conformal,
        sites=sites.sites if sites else conformal,
        status=refined.status,
        iterations=refined.iterations,
        residual=refined.residual,
        warnings=tuple(warnings),
        flow=flow,
    )


def _joined_share(joined: np.ndarray, polygons: np.ndarray | None) -> float:
    """Share of the triangles whose polygons (m,) were joined, two by two, from others (m,)."""
    given = len(joined) if polygons is None else len(np.unique(polygons))
    return 2 * (given - len(np.unique(joined))) / len(joined)


def _check_method(method: str) -> None:
    if method not in METHODS:
        raise ValueError(f"method must be one of {', '.join(METHODS)}, not {method!r}")


def _flow(
    found: ConformalSphere | None, surface: ClosedSurface, target: np.ndarray, method: str
) -> Steps[SphereFlow | None]:
    """The flow of Dominitz and Tannenbaum from a conformal map, where it is the method."""
    if found is None or method == NEWTON:
        return None
    return (yield from flow_map(found.positions, surface.triangles, target))


def _unrefined(flow: SphereFlow, found: ConformalSphere, warnings: list[str]) -> SphereMap:
    """Moser's flow as it comes out."""
    return SphereMap(
        positions=flow.moser,
        conformal=found.positions,
        sites=found.sites,
        status=MOSER,
        iterations=0,
        residual=0.0,
        warnings=tuple(warnings),
        flow=flow,
    )


def _target(surface: ClosedSurface, density: np.ndarray | None) -> np.ndarray:
    """Area (m,) of every face times its density: its target."""
    area = face_areas(surface.vertices, surface.triangles)
    if density is None:
        return area
    return area * positive_density(density)


def _as_given(positions: np.ndarray, surface: ClosedSurface, target: np.ndarray, error: float) -> bool:
    """Whether triangles as they were given, with their targets (m,), have areas not much farther off than quads, by
    their deviation, which is no less than the mean: a few that are off by half say nothing in that."""
    share = target / target.sum()
    off = np.abs(spherical_areas(positions, surface.triangles) / (4 * np.pi * share) - 1)
    return bool(np.sqrt(share @ off**2) <= AREA_KEPT * error and signed_volumes(positions, surface.triangles).min() > 0)


def _area_warning(positions: np.ndarray, triangles: np.ndarray, target: np.ndarray, polygons: np.ndarray | None) -> str:
    """Say how far areas of polygons (m,) on the sphere are from the target (m,)."""
    owner = np.arange(len(triangles)) if polygons is None else np.unique(polygons, return_inverse=True)[1].ravel()
    share = np.bincount(owner, target / target.sum())
    off = np.abs(np.bincount(owner, spherical_areas(positions, triangles)) / (4 * np.pi * share) - 1)
    mean, deviation = 100 * (share @ off), 100 * np.sqrt(share @ off**2)
    return (
        f"On the sphere, the area of a face is off by {mean:.1f} % on average, standard deviation {deviation:.1f} %; "
        "a finer mesh on long limbs helps"
    )


def _conformal(
    surface: ClosedSurface, warnings: list[str]
) -> Steps[tuple[ConformalSites | None, ConformalSphere | None]]:
    """The conformal map with its folds, and without; None, and a warning, where it leaves double precision."""
    sites = None
    try:
        sites = yield from conformal_sites(surface.vertices, surface.triangles)
        return sites, (yield from straightened(surface.vertices, surface.triangles, sites))
    except PrecisionError as error:
        warnings.append(f"{error.cause}; the map was built from coarse to fine instead")
    return sites, None


def _refined_start(
    surface: ClosedSurface, start: Steps[np.ndarray], target: np.ndarray, warnings: list[str], options: dict
) -> Steps[SphereRefinement | None]:
    """The transport map, refined; None, and a warning, where the transport or the straightening of its folds fails."""
    try:
        positions = yield from part_of(start, *TRANSPORT)
        return (yield from _refined(surface, positions, target, options))
    except (TransportError, FoldedUVError) as error:
        warnings.append(f"{error.cause}; the map was built from coarse to fine instead")
    return None


def _transport_start(found: ConformalSphere, surface: ClosedSurface, target: np.ndarray) -> Steps[np.ndarray]:
    """Every vertex in the middle of its cell, (n,3)."""
    area = face_areas(surface.vertices, surface.triangles)
    mass = vertex_areas(surface.vertices, surface.triangles, target / area)
    hull = Hull(found.triangles, twins(found.triangles))
    transport = sphere_transport(found.sites, mass, START_TOLERANCE, hull, tolerated=START_TOLERATED)
    return (yield from transport).cells.centroids()


def _at_once(flow: SphereFlow) -> Steps[np.ndarray]:
    """Unit vectors (n,3) of the flow of Dominitz and Tannenbaum."""
    yield Progress("Flow", 1.0)
    return flow.positions


def _refined(surface: ClosedSurface, start: np.ndarray, target: np.ndarray, options: dict) -> Steps[SphereRefinement]:
    """The map that starts from unit vectors (n,3), refined."""
    steps = sphere_refine(surface.vertices, surface.triangles, start, target, **options)
    return (yield from part_of(steps, *REFINEMENT))


def _least_shear(surface: ClosedSurface, refined: SphereRefinement) -> Steps[np.ndarray]:
    """What comes nearest to a conformal map where that leaves double precision, (n,3)."""
    area = face_areas(surface.vertices, surface.triangles)
    steps = sphere_refine(surface.vertices, surface.triangles, refined.positions, area, balance=1.0)
    return (yield from part_of(steps, *REFINEMENT)).positions
