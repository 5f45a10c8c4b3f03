"""Make target densities: how much of the domain every face shall get, relative to its area.

A density (m,) has one positive number per triangle; only ratios count, so densities compose by multiplication. The
target measure of a face is its area times its density. `area` (m,) below is always that of the surface.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from ..errors import DensityError, NoRegionError, ShareError, UniformWeightsError, WeightError, positive_density
from ..mesh.geometry import face_areas, vertex_areas
from ..mesh.topology import halfedges
from . import curvature

# Ratio by which a density may vary at most over a surface: faces with less would have no place in double precision.
CONTRAST = 1e6
# An area error above so many times its goal is worth a warning.
INEXACT = 2.0
# Edges of a coarse mesh grow by at most the root of this over the number of vertices for a length: as they do around a
# disk that gets most of the map, and meets its ring with as many edges as the ring has around it.
AROUND = 4.0
# Its vertices are at most so much denser in one place than in another.
LEAST_DENSITY = 1e-4


@dataclass(frozen=True)
class Target:
    """What every triangle of a surface shall get: density (m,), and the weights (m,) in [0, 1] of a region whose share
    shall be exact, if there is one."""

    density: np.ndarray
    region: np.ndarray | None = None

    def of(self, rows: np.ndarray) -> Target:
        """The target of some triangles (k,), given by their numbers or as a mask (m,)."""
        return Target(self.density[rows], None if self.region is None else self.region[rows])


def painted_density(region: np.ndarray, factor: float) -> np.ndarray:
    """Density 1 + (factor - 1) w (m,) of a painted region w (m,): weight 1 gets `factor` times what weight 0 gets.

    Raises
    ------
    WeightError, ShareError : see `check_region` and `check_factor`
    """
    check_factor(factor)
    return 1 + (factor - 1) * check_region(region)


def _curvature_density(
    area: np.ndarray, triangles: np.ndarray, vertex_curvature: np.ndarray, c: float, whole: float
) -> np.ndarray:
    """Density (m,) of the measure area + c |K|, K (n,) integrated over the vertices (B. Gu 2018, eq. 17).

    whole : value of the integral of |K| that with c = 1 counts as much as the whole area, so that c means the same
        on every mesh. Each vertex' curvature is spread over its faces by their area.
    """
    if not (np.isfinite(c) and c >= 0):
        raise DensityError(f"The weight of curvature is {c}", remedy="Give it a number that is not negative")
    at = np.bincount(triangles.ravel(), np.repeat(area / 3, 3), len(vertex_curvature))
    amount = np.abs(vertex_curvature) * (area.sum() / whole)
    return 1 + c * from_vertices(amount / np.where(at > 0, at, 1), triangles)


def gaussian_curvature_density(positions: np.ndarray, triangles: np.ndarray, c: float = 1.0) -> np.ndarray:
    """Density (m,) of area + c |K| with K the Gaussian curvature; with c = 1 half of a sphere's measure is curvature.

    positions (n,3), triangles (m,3)
    """
    area = face_areas(positions, triangles)
    return _curvature_density(area, triangles, curvature.gaussian_curvature(positions, triangles), c, 4 * np.pi)


def mean_curvature_density(positions: np.ndarray, triangles: np.ndarray, c: float = 1.0) -> np.ndarray:
    """Density (m,) of area + c |H| with H the mean curvature; with c = 1 half of a sphere's measure is curvature.

    positions (n,3), triangles (m,3)

    Mean curvature is one over a length: the surface is measured by the radius of the sphere that has its area.
    """
    area = face_areas(positions, triangles)
    whole = np.sqrt(4 * np.pi * area.sum())
    return _curvature_density(area, triangles, curvature.mean_curvature(positions, triangles), c, whole)


def means_of_corners(values: np.ndarray, corner_vertex: np.ndarray, face_start: np.ndarray) -> np.ndarray:
    """Means (f,) of values (n,) of vertices over the corners of polygons, which know no diagonal: see `Surface`."""
    sides = np.diff(face_start)
    total = np.bincount(np.repeat(np.arange(len(sides)), sides), values[corner_vertex], len(sides))
    return total / np.maximum(sides, 1)


def from_vertices(values: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Mean of the corners' values (n,) per triangle, (m,): weights of vertices as weights of faces."""
    return np.asarray(values, float)[triangles].mean(axis=1)


def from_polygons(values: np.ndarray, triangle_face: np.ndarray) -> np.ndarray:
    """Values (f,) of polygons for their triangles, (m,)."""
    return np.asarray(values, float)[triangle_face]


def means_of_polygons(values: np.ndarray, triangle_face: np.ndarray, count: int) -> np.ndarray:
    """Mean (f,) of what the triangles (m,) of each of `count` polygons have, 0 for one without triangles.

    >>> means_of_polygons(np.array([1.0, 3.0, 5.0]), np.array([0, 0, 1]), 2)
    array([2., 5.])
    """
    size = np.maximum(np.bincount(triangle_face, minlength=count), 1)
    return np.bincount(triangle_face, values, count) / size


def checked_density(values: np.ndarray) -> np.ndarray:
    """Any positive numbers (m,) as a density.

    Raises
    ------
    DensityError : a value that is not positive and finite, or values of more contrast than `CONTRAST`
    """
    density = positive_density(values)
    if density.max(initial=1.0) > CONTRAST * density.min(initial=np.inf):
        least = np.flatnonzero(density * CONTRAST < density.max())
        raise DensityError(f"A density varies by more than {CONTRAST:.0e}", "Raise the smallest values", "face", least)
    return density


def normalised_density(density: np.ndarray, area: np.ndarray) -> np.ndarray:
    """The density (m,) scaled so that the target measure sums to the area."""
    return density * (area.sum() / (area @ density))


def region_share(region: np.ndarray, area: np.ndarray) -> float:
    """Share sum(w a) / sum(a) of a softly painted region w (m,) in areas a (m,), in space or in a UV map."""
    return float(region @ area / area.sum())


def area_error_warnings(error: float, goal: float) -> tuple[str, ...]:
    """Warn where the area error of a map against its density is much above the goal.

    It is where the density varies more from face to face than shear can make up for.
    """
    if error <= INEXACT * goal:
        return ()
    return (
        f"Areas are {100 * error:.2g} % of the texture off: the density varies more than these faces can show. "
        "Soften the region, or choose a smaller factor",
    )


def relative_entropy(target: np.ndarray, area: np.ndarray) -> float:
    """Relative entropy sum(p log(p / q)) of a target measure (m,) against the areas (m,): 0 if all densities are 1."""
    p, q = target / target.sum(), area / area.sum()
    positive = (p > 0) & (q > 0)
    return float(p[positive] @ np.log(p[positive] / q[positive]))


def graded_density(
    density: np.ndarray, positions: np.ndarray, triangles: np.ndarray, limit: float, samples: int
) -> np.ndarray:
    """The least density (m,) above the given one (m,) whose spacing of samples grows by at most `limit` per length.

    With `samples` points the spacing is h = sqrt(area / (samples density)), and the result obeys
    h(x) <= h(y) + limit |x - y| along the surface (Persson 2006, "Mesh size functions for implicit geometries",
    eq. 6; here exactly, by shortest paths along edges). Neighbouring edges then differ by a factor of about 1 + limit.

    Raises
    ------
    DensityError : see `checked_density`; a limit that is not positive
    """
    if not limit > 0:
        raise DensityError(f"A spacing cannot grow by {limit}", remedy="Give a positive limit")
    density = normalised_density(checked_density(density), area := face_areas(positions, triangles))
    n, at = len(positions), vertex_areas(positions, triangles)
    mean = vertex_areas(positions, triangles, density) / np.where(at > 0, at, 1)
    spacing = np.sqrt(area.sum() / (samples * np.where(at > 0, mean, 1)))
    tail, head = halfedges(triangles)
    length = limit * np.linalg.norm(positions[tail] - positions[head], axis=1)
    # From one more node, whose edges are as long as the spacing given, every vertex is as far as its spacing may be.
    rows = np.concatenate([tail, head, np.full(n, n)])
    columns = np.concatenate([head, tail, np.arange(n)])
    key, first = np.unique(rows * (n + 1) + columns, return_index=True)
    data = np.concatenate([length, length, spacing])[first]
    graph = csr_matrix((data, (key // (n + 1), key % (n + 1))), shape=(n + 1, n + 1))
    allowed = dijkstra(graph, indices=n)[:n]
    finer = (spacing / allowed) ** 2
    return density * from_vertices(finer, triangles)


def check_region(region: np.ndarray, kind: str = "face") -> np.ndarray:
    """The weights (m,) of a painted region as float64, all of them in [0, 1] and not the same everywhere.

    Raises
    ------
    WeightError : anything else, with the indices of what is wrong as elements of this kind
    """
    region = np.asarray(region, float)
    wrong = np.flatnonzero(~np.isfinite(region))
    if len(wrong):
        raise WeightError("A weight is not a finite number", kind=kind, elements=wrong)
    wrong = np.flatnonzero((region < 0) | (region > 1))
    if len(wrong):
        raise WeightError("A weight is not between 0 and 1", kind=kind, elements=wrong)
    if not region.any():
        raise NoRegionError("All weights are zero: there is no region")
    if np.ptp(region) == 0:
        raise UniformWeightsError("All weights are the same: there is nothing around the region")
    return region


def check_factor(factor: float) -> None:
    """Raise ShareError unless a factor is positive and finite."""
    if not (np.isfinite(factor) and factor > 0):
        raise ShareError(f"A region cannot have {factor:g} times its share", "Choose a factor above 0")


def density_of_vertices(vertices: np.ndarray, triangles: np.ndarray, target: np.ndarray, goal: int) -> np.ndarray:
    """Density (n,) of the `goal` vertices of a coarse mesh of a surface (n,3), (m,3): as the map stretches what is to
    get the areas target (m,)."""
    area = face_areas(vertices, triangles)
    stretch = target / area
    stretch = np.maximum(stretch, LEAST_DENSITY * stretch.max())
    density = area * graded_density(stretch, vertices, triangles, np.sqrt(AROUND / goal), goal)
    has, all_of_it = (np.bincount(triangles.ravel(), np.repeat(x, 3), len(vertices)) for x in (density, area))
    return has / all_of_it
