"""Divide a surface into cells of prescribed masses, and relax their sites: `divide`.

Between two solutions of the dual (`transport/damped_newton`) every site moves to the Karcher mean of its cell, by the
mean of geodesic polar coordinates: blue noise on the surface (de Goes, Breeden, Ostromoukhov, Desbrun 2012).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..counts import check_memory
from ..errors import CountError, EmptyMeshError, positive_density
from ..mesh.geometry import face_areas
from ..mesh.surface import with_loose_placed
from ..progress import Progress, Steps, part_of
from ..transport.damped_newton import DualSolution, solve_dual
from .cells import DivisionProblem, GeodesicCells, GeodesicDual
from .polar_coordinates import PolarCoordinates, WindowMesh, polar_coordinates
from .relaxation import karcher_means, spaced
from .sites import Sites, allot, parts, spread

# Windows reach so many radii of a round cell at first.
REACH = 2.2
# Masses while sites still move need not be exact.
ROUGH = 0.1
# As often sites move to the means of Voronoi cells first: cells of equal mass around bad sites are long and thin.
UNWEIGHTED = 1
# What a cell takes at least: 40 samples are drawn to find where it begins.
BYTES_PER_CELL = 1_000


@dataclass(frozen=True)
class DivisionOptions:
    """relax : how often sites move to the means of their cells; tolerance : of the masses, relative; seed : of the
    first sites"""

    relax: int = 10
    tolerance: float = 1e-4
    seed: int = 0


@dataclass(frozen=True)
class Division:
    """Cells of prescribed masses.

    sites; asked (k,): masses as asked, which are equal within a part of the mesh; cells; pairs; residual: largest
    |mass / asked - 1|; iterations: Newton steps of the last solution; steps: of all; unequal: by how much masses asked
    differ between parts, as a share
    """

    sites: Sites
    site_weights: np.ndarray
    asked: np.ndarray
    cells: GeodesicCells
    pairs: PolarCoordinates
    residual: float
    iterations: int
    steps: int
    unequal: float


def divide(
    positions: np.ndarray,
    triangles: np.ndarray,
    count: int,
    density: np.ndarray | None = None,
    options: DivisionOptions | None = None,
) -> Steps[Division]:
    """Divide a mesh (n,3), (m,3) of any topology into `count` cells of equal mass: area times density (m,).

    Every separate part gets whole cells, as many as its mass asks for; those of one part are equal.

    Raises
    ------
    EmptyMeshError, NonFiniteError : no area, or vertices that are nowhere
    CountError : fewer cells than separate parts, or more than this machine has memory for
    DensityError : a density that is not positive and finite
    TransportError : no convergence

    >>> import numpy as np
    >>> from omt_uv.solver.partition import divide
    >>> from omt_uv.solver.progress import drain
    >>> square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
    >>> found = drain(divide(square, np.array([[0, 1, 2], [0, 2, 3]]), 5))
    >>> np.allclose(found.cells.area, 1 / 5, rtol=1e-3)
    True
    """
    options = options or DivisionOptions()
    positions, triangles = np.asarray(positions, float), np.asarray(triangles, np.int64)
    if count < 1:
        raise CountError(f"{count} cells are none", "Ask for one cell or more")
    check_memory(count, BYTES_PER_CELL, "A division into {} cells")
    if not len(triangles):
        raise EmptyMeshError("There are no faces to divide")
    positions = with_loose_placed(positions, triangles)
    yield Progress("Sites", 0.0)
    scale = float(np.ptp(positions[np.unique(triangles)], axis=0).max()) or 1.0
    problem, counts = _problem(positions / scale, triangles, count, density)
    sites = spread(problem.mesh.positions, problem.mesh.triangles, problem.mass, problem.part, counts, options.seed)
    steps = 0
    for k in range(options.relax + 1):
        dual = _dual(problem, sites, even=k > 0 and k == options.relax)
        weights = np.zeros(count)
        cells = dual.cells(weights)
        if k < min(options.relax, UNWEIGHTED):
            yield Progress("Relaxation", k / (options.relax + 1))
            sites = karcher_means(dual.sites, dual.pairs, cells)
            continue
        tolerance = options.tolerance if k == options.relax else ROUGH
        solving = solve_dual(dual, weights, cells, problem.asked, tolerance)
        found = yield from part_of(solving, k / (options.relax + 1), 1 / (options.relax + 1))
        steps += found.iterations
        if k < options.relax:
            sites = karcher_means(dual.sites, dual.pairs, found.cells)
    return _scaled(dual, found, steps, scale * scale)


def _problem(
    positions: np.ndarray, triangles: np.ndarray, count: int, density: np.ndarray | None
) -> tuple[DivisionProblem, np.ndarray]:
    """What is divided, and how many cells each part gets (k,)."""
    mass = face_areas(positions, triangles)
    mass = mass if density is None else mass * positive_density(density)
    if not mass.sum() > 0:
        raise EmptyMeshError("The faces have no area to divide", "Give at least one face with area")
    mesh = WindowMesh(positions, triangles)
    part = _with_mass(parts(mesh.triangles, len(mesh.positions)), mass)
    of_part = np.bincount(part, mass)
    counts = allot(of_part, count)
    asked = np.repeat(of_part / counts, counts)
    return DivisionProblem(mesh, mass, part, asked), counts


def _scaled(dual: GeodesicDual, found: DualSolution, steps: int, square: float) -> Division:
    """What was found on a mesh of extent 1, with its areas times `square`."""
    pairs = replace(
        dual.pairs,
        squared=dual.pairs.squared * square,
        log=dual.pairs.log * np.sqrt(square),
        nearest=dual.pairs.nearest * square,
        farthest=dual.pairs.farthest * square,
    )
    cells = replace(found.cells, area=found.cells.area * square, part=found.cells.part * square)
    return Division(
        sites=dual.sites,
        site_weights=found.site_weights * square,
        asked=dual.asked * square,
        cells=cells,
        pairs=pairs,
        residual=found.residual,
        iterations=found.iterations,
        steps=steps,
        unequal=float(dual.asked.max() / dual.asked.min() - 1),
    )


def _with_mass(part: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Parts (m,) of triangles; those without any mass are counted with the first that has one."""
    total = np.bincount(part, mass)
    sound = total > 1e-12 * total.sum()
    number = np.where(sound, np.cumsum(sound) - 1, 0)
    return number[part]


def _dual(problem: DivisionProblem, sites: Sites, even: bool) -> GeodesicDual:
    """The dual of sites, with windows for round cells; even: sites are pushed apart first."""
    mesh, area, mass = problem.mesh, problem.mesh.areas, problem.mass
    with np.errstate(divide="ignore", invalid="ignore"):
        density = np.where(area > 0, mass / area, 0)[sites.triangle]
    usual = mass.sum() / area.sum()
    size = np.sqrt(problem.asked / np.maximum(density, 1e-3 * usual) / np.pi)
    radius = np.maximum(REACH * size, mesh.to_a[sites.triangle].max(axis=1))
    pairs = polar_coordinates(mesh, sites, radius, np.arange(len(radius)))
    if even:
        sites, pairs = spaced(mesh, sites, pairs, size, radius)
    return GeodesicDual(problem, sites, pairs, radius)
