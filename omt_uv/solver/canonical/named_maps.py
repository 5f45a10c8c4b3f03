"""Map a disk as the papers do, without a refinement: conformally, or by the polar factorisation (Zhengyu Su 2015).

The conformal map phi has all angles; the transport has all areas. Between both lie the power diagrams of the images
phi(v) whose site weights are a share of the transport's: section 3.2.8, algorithm 6, u_t(x) = max_i <x, p_i> +
(t - 1)/2 |p_i|^2 + t h_i. Cells have exactly their areas; the triangles between their centroids may fold, and those
are untangled here.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..conformal.boundary_first import boundary_first
from ..conformal.disk_map import ConformalMap, conformal_disk, conformal_rectangle
from ..errors import BoundaryError, plural
from ..maps.energy import elements
from ..maps.untangle import count_folds, untangle
from ..mesh.geometry import halfedge_lengths
from ..mesh.topology import boundary_loops
from ..progress import Steps, part_of
from ..transport.convex_domain import Disk, Domain, Rectangle
from ..transport.inverse_map import centroid_map
from ..transport.power_diagram import power_diagram
from ..transport.semidiscrete import Transport, transport
from .embeddings import evened_sites
from .markers import ChartMarkers

CONFORMAL = (0.0, 0.4)
TRANSPORT = (0.4, 0.6)
# A conformal image is brought this far into a rectangle, whose sides hold no sites.
INSIDE = 1 - 1e-9
# Sites closer than this are one in a power diagram, where their distance counts squared.
RESOLUTION = 1e-7
# What comes in its place is evened for areas with this weight, or the ends of limbs are no farther apart.
EVENED = 30.0


@dataclass(frozen=True)
class NamedProblem:
    """A disk to map: vertices (n,3), triangles (m,3); target (m,) areas; boundary "free", "disk" or a rectangle, whose
    corners (4,) are vertices of the boundary; aspect of the rectangle, its height over its width, 0 for its own."""

    vertices: np.ndarray
    triangles: np.ndarray
    target: np.ndarray
    boundary: str = "free"
    corners: np.ndarray | None = None
    aspect: float = 0.0
    markers: ChartMarkers = field(default_factory=ChartMarkers)

    @property
    def loop(self) -> np.ndarray:
        """The boundary (b,)."""
        return boundary_loops(self.triangles)[0]


@dataclass(frozen=True)
class NamedMap:
    """A map uv (n,2) by name: what it comes from, and warnings.

    untangled : faces that lay wrongly, and were moved back
    sites : (n,2) in the domain of the transport, if there is one
    """

    uv: np.ndarray
    conformal: ConformalMap | None = None
    cells: Transport | None = None
    untangled: int = 0
    warnings: tuple[str, ...] = ()
    sites: np.ndarray | None = None


def conformal_map(disk: NamedProblem) -> Steps[NamedMap]:
    """The conformal map of a disk to the unit disk or a rectangle; flattened by Boundary First where that is free.

    Raises
    ------
    PrecisionError : the map leaves double precision

    References
    ----------
    Zhengyu Su 2015, algorithm 3, for the disk; Zhao et al. 2013, section 4.3, for the rectangle.
    """
    vertices, triangles, warnings = disk.vertices, disk.triangles, []
    if disk.boundary == "free":
        uv = boundary_first(vertices, triangles, disk.loop).uv
        folds = count_folds(uv, triangles)
        texts = (
            (f"The conformal map with a free boundary turns {plural(folds, 'a face', '{} faces')} over; choose a disk",)
            if folds
            else ()
        )
        return NamedMap(disk.markers.turned(uv), warnings=texts)
    if disk.corners is None:
        conformal = yield from conformal_disk(vertices, triangles)
        uv = disk.markers.in_disk(conformal.uv, disk.loop)
    else:
        conformal = yield from conformal_rectangle(vertices, triangles, disk.corners)
        uv = conformal.uv - [0.5, conformal.aspect / 2]
        if disk.aspect and not np.isclose(disk.aspect, conformal.aspect, rtol=1e-3):
            uv = uv * [1, disk.aspect / conformal.aspect]
            warnings = [f"A conformal map fills a rectangle of aspect {conformal.aspect:.4g}; it was stretched"]
    return NamedMap(uv, conformal, untangled=conformal.straightened, warnings=tuple(warnings))


def polar_map(disk: NamedProblem, balance: float = 0.0) -> Steps[NamedMap]:
    """The map of algorithm 6: the transport from the conformal map with balance 0, the conformal map with 1.

    In between the site weights are 1 - balance times the transport's. Every vertex goes to the centroid of its cell.
    Where the conformal map puts vertices too close together for a power diagram, a mean value map of evened weights
    takes its place, and a warning says so.

    Raises
    ------
    BoundaryError : a free boundary
    PrecisionError, TransportError : the conformal map or the transport leave double precision

    References
    ----------
    Zhengyu Su 2015, section 3.2.8, algorithm 6 (its t is 1 - balance); Brenier 1991.
    """
    if disk.boundary == "free":
        raise BoundaryError("A polar factorisation needs a convex domain")
    found = yield from part_of(conformal_map(disk), *CONFORMAL)
    domain, sites = _in_domain(disk, found)
    nearest, warnings = halfedge_lengths(sites, disk.triangles).min(), list(found.warnings)
    if nearest < RESOLUTION:
        faces = elements(disk.vertices, disk.triangles, disk.target)
        evened = evened_sites(faces, disk.vertices, (disk.loop, disk.corners, domain), EVENED, np.inf)
        sites = sites if evened is None else evened
        warnings.append(
            f"The conformal map puts neighbours {nearest:.0e} apart, too close for the transport; started from a mean "
            "value map instead"
        )
    mass = np.bincount(disk.triangles.ravel(), np.repeat(disk.target / 3, 3), len(disk.vertices))
    cells = yield from part_of(transport(sites, mass, domain), *TRANSPORT)
    centroid = cells.cells.centroid
    if balance > 0:
        centroid = power_diagram(sites, (1 - balance) * cells.site_weights, domain).centroid
    uv = centroid_map(centroid, domain, disk.loop, disk.corners, warnings)
    folds = count_folds(uv, disk.triangles)
    if folds:
        uv, warning = untangle(uv, disk.vertices, disk.triangles, disk.loop, uv[disk.loop])
        warnings += [warning] if warning else []
    uv = uv if disk.corners is not None else disk.markers.turned(uv)
    return NamedMap(uv, found.conformal, cells, folds - count_folds(uv, disk.triangles), tuple(warnings), sites)


def _in_domain(disk: NamedProblem, found: NamedMap) -> tuple[Domain, np.ndarray]:
    """The domain, and the conformal image (n,2) in it."""
    if disk.corners is None:
        return Disk(), found.uv
    size = np.ptp(found.uv, axis=0)
    width, height = size / np.sqrt(size.prod())
    return Rectangle(float(width), float(height)), found.uv * (INSIDE / np.sqrt(size.prod()))
