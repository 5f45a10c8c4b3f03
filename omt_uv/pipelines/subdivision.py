"""Judge UVs, and make them, on the subdivided surface that a Subdivision Surface modifier shows."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..solver.analysis.density import Target
from ..solver.errors import APPLY_LEVEL, plural, two_digits
from ..solver.maps.distortion import distortion
from ..solver.maps.mirror_symmetry import MirrorSymmetry
from ..solver.mesh.charts import turned_polygons
from ..solver.mesh.geometry import cross2, face_areas, signed_areas
from ..solver.mesh.surface import Surface
from ..solver.mesh.topology import boundary_loops, next_corners
from ..solver.parameterization.chart_indices import CornerPins, pins_of_chart
from ..solver.parameterization.chart_map import ChartMap
from ..solver.parameterization.mirrored_charts import mirror_partners
from ..solver.parameterization.unwrap import SurfaceMap
from ..solver.progress import Steps
from ..solver.subdivision.cage_refinement import CageElements, refine_cage, subdivided_elements
from ..solver.subdivision.cage_symmetry import CageChart, cage_symmetry
from ..solver.subdivision.catmull_clark import Subdivision
from ..solver.subdivision.modifier import SubdividedSurface, SubdivisionModifier, subdivided_surface, subdivided_uv
from ..solver.subdivision.quad_areas import HALVES, half_areas, quad_areas
from .reading import Reading

# Quads of the subdivided surface at most: fewer levels stand for all where there are more.
MOST_QUADS = 250_000
# And where the UVs of the cage are refined for them; denser cages get the areas of their subdivided polygons alone,
# whose UVs are smoothed by little.
REFINED_QUADS = 40_000
# The area's weight at first, and the factors by which it grows while the error is above the goal. It ends where more
# weight leaves more than this share of the error: what the cage cannot express would be bought by shear alone.
AREA_WEIGHT = 100.0
MOST_WEIGHT = 1e4
GROWTH = 4.0
GOAL = 0.01
WORTHWHILE = 0.75
# Area error on the subdivided surface that is worth a warning.
INEXACT = 0.02
# Where its triangles miss that by no more than the first factor, weights grow by the second, then as that says is
# needed to reach AIM of it, up to AREA_WEIGHT times the third: what is out of reach, or dear, stays as it is.
CLOSE = 1.3
NUDGE = 1.5
MOST_NUDGE = 8.0
AIM = 0.995
COARSE = "Areas on the subdivided surface are {} off: the mesh is too coarse for its UVs to follow that surface; {}"
# How warnings about the areas of a cage begin.
AREA_WARNING = "Areas are"
# Corners of one vertex closer than this have one UV, as for Blender.
SAME_UV = 1e-4


def evaluated(reading: Reading) -> Reading:
    """The reading of the subdivided mesh with its smoothed UVs, as the renderer has it; itself without a modifier."""
    return evaluated_polygons(reading)[0]


def evaluated_polygons(reading: Reading) -> tuple[Reading, np.ndarray]:
    """The same, and for each of its polygons that of the cage (q,) which it is a part of."""
    modifier, surface = reading.subdivision, reading.surface
    if modifier is None or not len(surface.corner_vertex):
        return reading, np.arange(len(reading.faces))
    fine = subdivided_surface(surface, modifier, MOST_QUADS)
    quads, polygon = fine.subdivision.quads, fine.subdivision.polygon
    corner = 4 * np.arange(len(quads))[:, None, None] + HALVES
    subdivided = Surface(
        positions=fine.subdivision.matrix @ surface.positions,
        corner_vertex=quads.ravel(),
        face_start=np.arange(0, 4 * len(quads) + 1, 4),
        triangles=corner.reshape(-1, 3),
        triangle_face=np.repeat(np.arange(len(quads)), 2),
        seams=np.zeros((0, 2), np.int64),
        sharp=np.zeros((0, 2), np.int64),
    )
    uv = None
    if reading.uv is not None:
        uv = _quad_uvs(surface, reading.uv, modifier, fine.levels).reshape(-1, 2)
    return Reading(subdivided, reading.faces[polygon], uv, None), polygon


def _quad_uvs(surface: Surface, uv: np.ndarray, modifier: SubdivisionModifier, levels: int) -> np.ndarray:
    """UVs (q,4,2) of the quads of a subdivided surface whose cage has the UVs (c,2)."""
    values = np.asarray(uv, float)
    vertex, first = _uv_vertices(surface.corner_vertex, surface.face_start, values)
    mapped = subdivided_uv(vertex, surface.face_start, surface.corner_vertex[first], modifier, levels)
    return (mapped.matrix @ values[first])[mapped.quads]


def polygon_uv_areas(surface: Surface, uv: np.ndarray, modifier: SubdivisionModifier) -> np.ndarray:
    """Areas (f,) of the polygons of a cage in the UVs that the modifier makes of its own, (c,2)."""
    fine = subdivided_surface(surface, modifier, MOST_QUADS)
    quads = _quad_uvs(surface, uv, modifier, fine.levels)
    areas = quad_areas(np.pad(quads, ((0, 0), (0, 0), (0, 1))))
    return np.bincount(fine.subdivision.polygon, areas, len(surface.face_start) - 1)


def subdivided_target(surface: Surface, modifier: SubdivisionModifier, other: Target | None = None) -> Target:
    """What every polygon of a cage shall get: its area on the subdivided surface, times the density of another target,
    with whose region."""
    count = len(surface.face_start) - 1
    fine = subdivided_surface(surface, modifier, MOST_QUADS).polygon_areas(count)
    area = face_areas(surface.positions, surface.corner_vertex[surface.triangles])
    own = np.bincount(surface.triangle_face, area, count)
    usable = (own > 0) & (fine > 0)
    density = np.where(usable, fine / np.where(usable, own, 1), 1.0)
    middle = np.median(density[usable]) if usable.any() else 1.0
    # A polygon that vanishes on either side still needs a place.
    density = np.clip(density, 1e-2 * middle, 1e2 * middle)[surface.triangle_face]
    return Target(density) if other is None else Target(density * other.density, other.region)


def target_of(reading: Reading) -> Target | None:
    """What the polygons of a reading ask for on the surface of its modifier; None for their own areas."""
    if reading.subdivision is None:
        return None
    return subdivided_target(reading.surface, reading.subdivision)


def on_subdivided_surface(surface: Surface, modifier: SubdivisionModifier | None) -> Surface:
    """The cage with its vertices where they are on the subdivided surface, whose curvature and lengths it has then;
    as it is without a modifier."""
    if modifier is None:
        return surface
    used = np.unique(surface.corner_vertex)
    positions, n = surface.positions.copy(), len(surface.positions)
    fine = subdivided_surface(surface, modifier, MOST_QUADS).subdivision
    positions[used] = (fine.matrix[:n] @ surface.positions)[used]
    return replace(surface, positions=positions)


def refinable(surface: Surface) -> bool:
    """Whether the subdivided surface is small enough to refine the UVs of the cage for it."""
    return 0 < len(surface.corner_vertex) <= REFINED_QUADS


def refined_on_subdivision(
    surface: Surface,
    found: SurfaceMap,
    modifier: SubdivisionModifier,
    pins: CornerPins | None,
    boundary: str,
    density: np.ndarray | None = None,
    areas_first: bool = False,
) -> Steps[SurfaceMap]:
    """The maps of the charts of a cage refined for the areas of the subdivided surface, with its figures.

    Pinned vertices stay, and so do the outlines of disks and squares. density (m,): of the cage's triangles, which
    multiplies the area on the subdivided surface that their polygons ask for; areas_first: whether no
    shear was preferred to exact areas; then a little is paid where that brings its triangles to INEXACT
    """
    if not refinable(surface):
        return found
    fine = subdivided_surface(surface, modifier, REFINED_QUADS)
    part = _mapped_part(surface, found, fine, modifier)
    if density is not None:
        of_polygon = np.ones(len(surface.face_start) - 1)
        of_polygon[surface.triangle_face] = density
        part = replace(part, density=of_polygon[part.polygon])
    if not len(part.corners):
        return found
    fixed = _fixed(found, pins, boundary)
    found = part.resized(found, fixed)
    uv = np.concatenate([m.uv for m in found.maps])
    asked = max(m.area_weight for m in found.maps)
    refined = yield from _refined_in_stages(part, found, uv, fixed, asked, areas_first)
    maps, fine_uv = [], part.mapping.matrix @ refined
    for k, old in enumerate(found.maps):
        mine, own = part.chart == k, slice(part.first[k], part.first[k + 1])
        maps.append(_with_figures(old, refined[own], part.corners[mine], part.mapping.quads[mine], fine_uv))
    error = part.area_error(refined)
    more = (COARSE.format(two_digits(error), APPLY_LEVEL),) if areas_first and error > INEXACT else ()
    return replace(found, maps=maps, warnings=(*found.warnings, *more))


def _refined_in_stages(
    part: _MappedQuads, found: SurfaceMap, uv: np.ndarray, fixed: np.ndarray, asked: float, areas_first: bool
) -> Steps[np.ndarray]:
    """UVs (n,2) of all charts refined with growing weights of the area, as far as these are asked for and of use."""
    elements, weight = part.elements(found, uv, fixed), min(AREA_WEIGHT, asked)
    uv, symmetry = part.symmetry(found, uv, fixed)
    outlines = [boundary_loops(c.disk)[0] + k for c, k in zip(found.charts, part.first, strict=False)]

    def stage(start: np.ndarray, weight: float) -> Steps[np.ndarray]:
        return (yield from refine_cage(elements, part.mapping.matrix, start, fixed, weight, symmetry, outlines)).uv

    refined, error = uv, np.inf
    while True:
        new = yield from stage(refined, weight)
        before, error = error, part.area_error(new)
        if error > WORTHWHILE * before:
            break
        refined, weight = new, weight * GROWTH
        if error <= GOAL or weight > min(MOST_WEIGHT, asked) or part.inner_error(new) > WORTHWHILE * error:
            break
    return (yield from _nudged(part, refined, weight / GROWTH, stage)) if areas_first else refined


def _nudged(
    part: _MappedQuads, refined: np.ndarray, weight: float, stage: Callable[[np.ndarray, float], Steps[np.ndarray]]
) -> Steps[np.ndarray]:
    """UVs (n,2) whose triangles miss their areas by INEXACT at most, where those of an area weight nearly do and a
    few times as much weight gets there; as they are elsewhere. stage: refines UVs with a weight."""
    new, error, factor, most = refined, part.triangle_error(refined), NUDGE, MOST_NUDGE * max(weight, AREA_WEIGHT)
    if error > CLOSE * INEXACT:
        return refined
    while error > INEXACT and factor * weight <= most:
        weight *= factor
        new = yield from stage(new, weight)
        before, error = error, part.triangle_error(new)
        if error >= before:
            return refined
        # Errors fall about evenly with the logarithm of the weight.
        needed = (error - AIM * INEXACT) / (before - error) * np.log(factor)
        factor = float(np.exp(min(needed, MOST_NUDGE)))
    return new if error <= INEXACT else refined


@dataclass(frozen=True)
class _MappedQuads:
    """The quads of a subdivided surface that charts map: corners (q,4,3) in space, the polygon and the chart (q,) of
    each, the density (q,) by which its area counts, the UVs' subdivision, and the first (k+1,) of each chart's vertices
    among all."""

    corners: np.ndarray
    polygon: np.ndarray
    chart: np.ndarray
    density: np.ndarray
    mapping: Subdivision
    first: np.ndarray

    @property
    def areas(self) -> np.ndarray:
        """Areas (q,) that the quads ask for."""
        return quad_areas(self.corners) * self.density

    def resized(self, found: SurfaceMap, fixed: np.ndarray) -> SurfaceMap:
        """The maps with the area of the subdivided surface, where no vertex (n,) bool is fixed."""
        space = np.bincount(self.chart, self.areas, len(found.charts))
        maps = []
        for k, (chart, old) in enumerate(zip(found.charts, found.maps, strict=True)):
            covered = signed_areas(old.uv, chart.triangles).sum()
            free = not fixed[self.first[k] : self.first[k + 1]].any() and covered > 0 and space[k] > 0
            maps.append(replace(old, uv=old.uv * np.sqrt(space[k] / covered)) if free else old)
        return replace(found, maps=maps)

    def area_error(self, uv: np.ndarray) -> float:
        """Share of the area of the quads that is in the wrong place in UVs (n,2) of the cage."""
        area, space = self._shares(uv)
        return float(np.abs(area - space).sum())

    def triangle_error(self, uv: np.ndarray) -> float:
        """That share by the triangles of the quads, as they are drawn."""
        area = half_areas(self._mapped(uv))
        space = half_areas(self.corners) * np.repeat(self.density, 2)
        return float(np.abs(area / area.sum() - space / space.sum()).sum())

    def inner_error(self, uv: np.ndarray) -> float:
        """What is left of that if every polygon of the cage gets its share."""
        area, space = self._shares(uv)
        of_polygon = [np.bincount(self.polygon, x)[self.polygon] for x in (area, space)]
        return float(np.abs(area * (of_polygon[1] / np.maximum(of_polygon[0], 1e-300)) - space).sum())

    def _shares(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Shares (q,) that quads have of the area in UVs (n,2) of the cage, and in space."""
        area, space = quad_areas(self._mapped(uv)), self.areas
        return area / area.sum(), space / space.sum()

    def _mapped(self, uv: np.ndarray) -> np.ndarray:
        """Corners (q,4,3) of the quads in UVs (n,2) of the cage, at height 0."""
        return np.pad((self.mapping.matrix @ uv)[self.mapping.quads], ((0, 0), (0, 0), (0, 1)))

    def symmetry(
        self, found: SurfaceMap, uv: np.ndarray, fixed: np.ndarray
    ) -> tuple[np.ndarray, MirrorSymmetry | None]:
        """UVs (n,2) about the axes of their charts, and their symmetry; as they are, and none, with fixed vertices."""
        if fixed.any():
            return uv, None
        polygon_area = np.bincount(self.polygon, self.areas, int(self.polygon.max()) + 1)
        around = []
        for chart in found.charts:
            n = len(chart.vertices)
            pairs = np.unique(np.repeat(chart.faces, 3).astype(np.int64) * n + chart.triangles.ravel())
            around.append(np.bincount(pairs % n, polygon_area[pairs // n], n))
        charts = [CageChart(c.vertices, c.triangles, c.faces, a) for c, a in zip(found.charts, around, strict=True)]
        partners = mirror_partners(found.charts, [None] * len(charts))
        symmetry, w = cage_symmetry(charts, uv @ [1, 1j], partners)
        return np.column_stack([w.real, w.imag]), symmetry

    def elements(self, found: SurfaceMap, uv: np.ndarray, fixed: np.ndarray) -> CageElements:
        """Those of the quads and of the triangles of the charts; a chart with fixed vertices keeps its area."""
        count = len(found.charts)
        owner = np.repeat(np.arange(count), np.diff(self.first))
        triangles = np.concatenate([c.triangles + k for c, k in zip(found.charts, self.first, strict=False)])
        covered = np.bincount(owner[triangles[:, 0]], signed_areas(uv, triangles), count)
        upright, polygon = signed_areas(uv, triangles) > 0, np.concatenate([c.faces for c in found.charts])
        triangles, polygon = triangles[upright], polygon[upright]
        space = np.bincount(self.chart, self.areas, count)
        bound = np.bincount(owner, fixed, count) > 0
        scale = np.where(bound & (space > 0), covered / np.where(space > 0, space, 1), 1.0)
        positions = np.concatenate([c.vertices for c in found.charts])
        scales = np.concatenate([scale[self.chart] * self.density, scale[owner[triangles[:, 0]]]])
        return subdivided_elements(self.corners, self.mapping.quads, positions[triangles], triangles, scales, polygon)


def _mapped_part(
    surface: Surface, found: SurfaceMap, fine: SubdividedSurface, modifier: SubdivisionModifier
) -> _MappedQuads:
    """The quads of the polygons whose corners all have a vertex of a chart."""
    first = np.cumsum([0, *(len(c.vertices) for c in found.charts)])
    vertex = np.full(len(surface.corner_vertex), -1)
    for chart, offset in zip(found.charts, first, strict=False):
        vertex[chart.corners.ravel()] = chart.triangles.ravel() + offset
    whole = np.logical_and.reduceat(vertex >= 0, surface.face_start[:-1])
    sides = np.diff(surface.face_start)
    start = np.concatenate([[0], np.cumsum(sides[whole])])
    vertex = vertex[np.repeat(whole, sides)]
    ids = np.concatenate([c.vertex_ids for c in found.charts])
    mapping = subdivided_uv(vertex, start, ids, modifier, fine.levels)
    owner = np.repeat(np.arange(len(found.charts)), np.diff(first))
    chart = owner[vertex[start[:-1]]][mapping.polygon]
    mine = whole[fine.subdivision.polygon]
    polygon = fine.subdivision.polygon[mine]
    # What looks to the other side than its chart is turned over, as it is there.
    turned = turned_polygons(found.charts, len(sides))[polygon]
    order = np.where(turned[:, None], [0, 3, 2, 1], [0, 1, 2, 3])
    mapping = replace(mapping, quads=np.take_along_axis(mapping.quads, order, axis=1))
    corners = np.take_along_axis(fine.corners[mine], order[:, :, None], axis=1)
    return _MappedQuads(corners, polygon, chart, np.ones(len(polygon)), mapping, first)


def _with_figures(
    old: ChartMap, uv: np.ndarray, corners: np.ndarray, quads: np.ndarray, fine_uv: np.ndarray
) -> ChartMap:
    """The map of a chart with its UVs and the figures of its quads (q,4), with corners (q,4,3) in space, in UVs (n,2)
    of the subdivided surface."""
    if not len(quads):
        return old
    # By the numbers of their vertices quads hang together: those turned over are told from the rest.
    points = np.zeros((len(fine_uv), 3))
    points[quads.ravel()] = corners.reshape(-1, 3)
    triangles = quads[:, HALVES].reshape(-1, 3)
    polygons = np.repeat(np.arange(len(quads)), 2)
    found = distortion(points, triangles, fine_uv[triangles], overlap=False, polygons=polygons)
    # What was said about the target of the cage is said about the subdivided surface instead.
    warnings = tuple(text for text in old.warnings if not text.startswith(AREA_WARNING))
    if found.folds:
        who = plural(found.folds, "A face of the subdivided surface is", "{} faces of the subdivided surface are")
        warnings += (f"{who} folded",)
    figures = {name: getattr(found, name) for name in ("area_l1", "area_sd", "angle_mean", "folds")}
    return replace(old, uv=uv, warnings=warnings, **figures)


def _fixed(found: SurfaceMap, pins: CornerPins | None, boundary: str) -> np.ndarray:
    """Vertices (n,) bool of all charts in turn that stay."""
    every = []
    for chart in found.charts:
        fixed = np.zeros(len(chart.vertices), bool)
        mine = pins_of_chart(pins, chart)
        if mine is not None:
            fixed[mine.vertices] = True
        if boundary != "free":
            fixed[boundary_loops(chart.disk)[0]] = True
        every.append(fixed)
    return np.concatenate(every)


def _uv_vertices(corner_vertex: np.ndarray, face_start: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The UV vertex (c,) of every corner, and the first corner (n,) of each: equal vertex, UVs that agree, and polygons
    that lie the same way up, as for Blender."""
    owner = np.repeat(np.arange(len(face_start) - 1), np.diff(face_start))
    upright = np.bincount(owner, cross2(uv, uv[next_corners(face_start)]))[owner] > 0
    key = np.column_stack([corner_vertex, np.round(uv / SAME_UV), upright]).astype(np.int64)
    _, first, vertex = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return vertex.ravel(), first
