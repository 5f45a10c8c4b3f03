"""The first mesh of a part: charts, their two maps, samples, triangles, and the charts glued again."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...errors import CrowdedError, PrecisionError
from ...mesh.charts import Chart
from ...mesh.geometry import face_areas
from ...mesh.topology import pair_keys
from ...progress import Progress, Steps, part_of
from ..components.coincident_boundaries import copies
from ..components.components import Part
from ..edits.vertex_count import edge_size
from ..edits.working_mesh import Draft
from .arc_network import ArcSamples, Border, Network, border, network, sample_arcs
from .boundary_samples import smooth_rims
from .component_maps import PartMaps
from .decimation import simplified, simplified_between
from .disk_samples import STRATEGIES, Patch, even_map, triangulate_chart
from .sphere_samples import sample_sphere
from .stitching import glue

# Vertices that every part has at first, and parts of a pile in the mean.
FEWEST, FEWEST_IN_PILE = 100, 24
# Charts with up to so many inner samples need no maps: what relaxation makes of them is the same.
FEW = 50
NO_MAPS = "A part has no maps to the disk in double precision and was remeshed without"
# Samples on boundaries and features that are too many move apart by this factor, again and again, up to so many edges.
STRETCH, LONGEST = 1.25, 1e3


@dataclass(frozen=True)
class Options:
    """How to remesh a part; see `remesh.remesh`."""

    count_of: str
    strategy: str
    fit: bool
    rounds: int
    corners: bool

    @property
    def by_measure(self) -> bool:
        """Whether vertices are where the measure of the surface asks for them, or where a conformal map puts them."""
        return self.strategy.startswith("app")

    @property
    def delaunay(self) -> bool:
        """Whether triangles are Delaunay on the surface, as in a conformal map, or in a measure-preserving one."""
        return self.strategy.endswith("cfp")


@dataclass(frozen=True)
class Tessellation:
    """A mesh of a part with about the vertices asked for, samples on boundaries and features fixed, edges there locked.

    count: the exact number of vertices to reach; size: edge length at density 1; stretch: that of the samples on
    boundaries and features next to it; slits: sorted keys of the edges to open at the end; copies: vertices that adds.
    """

    draft: Draft
    count: int
    size: float
    stretch: float
    warnings: tuple[str, ...]
    slits: np.ndarray
    copies: int


def tessellate(
    maps: PartMaps, count: int, density: np.ndarray, at_vertices: np.ndarray, options: Options, stretch: float = 1.0
) -> Steps[Tessellation]:
    """Samples of a part with density (m,), and at_vertices (n,), of mean 1, triangulated by the strategy.

    Closed parts of genus 0 without features go by way of the sphere, disks without features by way of a chart, and all
    others, or where that fails, by collapses of their own edges.
    On boundaries and features samples are `stretch` edges apart, or more where there would be too many.

    There may be more than asked for, where boundaries and features take as many. Raises PrecisionError where a chart
    cannot be triangulated.
    """
    found = (yield from _by_sphere(maps, count, density, options)) if maps.spherical else None
    if found is None and _any_mesh_will_do(options) and not maps.part.lined:
        yield Progress("Samples", 0.0)
        return _without_maps(maps, count, density, options)
    return found or (yield from _by_charts(maps, count, density, at_vertices, options, stretch))


def _any_mesh_will_do(options: Options) -> bool:
    """Whether nobody asks for two maps in particular, or for what they make of a part before it is relaxed."""
    return options.rounds > 0 and options.strategy == STRATEGIES[0]


def _by_sphere(maps: PartMaps, count: int, density: np.ndarray, options: Options) -> Steps[Tessellation | None]:
    """The part by way of the sphere; None where that has no room for it."""
    part = maps.part
    found = yield from maps.of_sphere(density)
    if found is None:
        return None
    vertices = count if options.count_of == "vertices" else max(count // 2 + 2, 4)
    try:
        samples = sample_sphere(part.vertices, part.triangles, *found.pair(options.strategy), max(vertices, FEWEST))
    except PrecisionError as error:
        maps.give_up(error.cause)
        return None
    points = samples.points
    draft = Draft(points, samples.triangles, np.zeros(len(points), dtype=bool), np.zeros(0, np.int64), options.delaunay)
    size = edge_size(float(part.area @ density), 0.0, vertices)
    return Tessellation(draft, vertices, size, 1.0, found.warnings, part.slits, 0)


def _without_maps(maps: PartMaps, count: int, density: np.ndarray, options: Options) -> Tessellation:
    part = maps.part
    vertices = count if options.count_of == "vertices" else count // 2 + part.euler
    size, finer = (edge_size(float(part.area @ density), 0.0, n) for n in (vertices, max(vertices, _fewest(part))))
    draft = simplified(part, max(vertices, _fewest(part)), density, finer)
    return Tessellation(draft, vertices, size, 1.0, maps.warnings, part.slits, 0)


def _fewest(part: Part) -> int:
    return FEWEST_IN_PILE * len(part.members) if part.members else FEWEST


@dataclass(frozen=True)
class _Plan:
    """Arcs of a part and samples on them, and how many vertices there are to be; see `Tessellation`.

    fewest: vertices to begin with; finer: edge length with those next to `size`
    """

    lines: Network
    samples: ArcSamples
    vertices: int
    fewest: int
    size: float
    finer: float
    stretch: float
    warnings: tuple[str, ...]


def _by_charts(
    maps: PartMaps, count: int, density: np.ndarray, at_vertices: np.ndarray, options: Options, stretch: float
) -> Steps[Tessellation]:
    """The part by way of charts; by its own triangles where some of them have no maps, and relaxation follows."""
    yield Progress("Charts", 0.0)
    plan = _planned(maps, count, density, at_vertices, options, stretch)
    lines, part = plan.lines, maps.part
    if _any_mesh_will_do(options) and not part.disk:
        return _between_lines(maps, plan, density)
    borders = [border(sides, plan.samples, lines.arcs) for sides in lines.sides]
    inner = _inner_counts(maps.charts, borders, density, max(plan.vertices, plan.fewest) - len(plan.samples.points))
    patches: list[Patch] = []
    done = 0.0
    said: tuple[str, ...] = ()
    for k, (loop, edge, number) in enumerate(zip(lines.loops, borders, inner, strict=True)):
        share = len(maps.charts[k].triangles) / len(part.triangles)
        steps = _patch(maps, k, loop, edge, int(number), density, options)
        patch, warnings = yield from part_of(steps, done, share)
        if patch is None or (warnings and _any_mesh_will_do(options)):
            return _between_lines(maps, replace(plan, warnings=(*plan.warnings, NO_MAPS)), density)
        patches.append(patch)
        said += warnings
        done += share
    points, triangles = glue(plan.samples.points, borders, patches)
    return _glued(part, plan, points, triangles, maps.warnings + plan.warnings + said, options.delaunay)


def _planned(
    maps: PartMaps, count: int, density: np.ndarray, at_vertices: np.ndarray, options: Options, stretch: float
) -> _Plan:
    part, charts, held = maps.part, maps.charts, _held(maps.part)
    # A slit is a boundary on both sides.
    rim = _weighted_length(part.vertices, np.concatenate([part.rim, part.slits, part.slits]), at_vertices)
    measure = float(part.area @ density)
    vertices = count if options.count_of == "vertices" else max(count // 2 + part.euler, 3)
    size, total = edge_size(measure, rim, vertices), vertices
    fewest = _fewest(part)
    # A few samples make no sound mesh of a surface, so these are taken away only afterwards.
    finer = edge_size(measure, rim, max(vertices, fewest)) / size
    lengths = size / np.sqrt(at_vertices)
    first, corners = stretch, options.corners
    while True:
        lines = network(part.vertices, charts, held, part.slits, stretch * lengths if corners else None)
        samples = sample_arcs(part.vertices, lines.arcs, finer * lengths, stretch=stretch / finer)
        vertices = total - _copies(part, lines, samples)
        if options.count_of == "faces":
            samples, vertices = _for_faces(part, lines, samples, count, finer * lengths, stretch / finer)
        if samples.fixed.sum() <= vertices:
            break
        stretch *= STRETCH
        if stretch > LONGEST:
            if not corners:
                break
            stretch, corners = first, False
    if not options.corners:
        samples = smooth_rims(part, lines, samples, lengths)
    lost = f"{vertices} vertices for a part are too few to keep the corners of its boundaries and features"
    warnings = (lost,) if options.corners and not corners else ()
    return _Plan(lines, samples, vertices, fewest, size, finer, stretch, warnings)


def _between_lines(maps: PartMaps, plan: _Plan, density: np.ndarray) -> Tessellation:
    """The part by its own triangles, between the samples on its boundaries and features."""
    part, count = maps.part, max(plan.vertices, plan.fewest)
    found = simplified_between(part, plan.lines.arcs, plan.samples, count, density, plan.finer * plan.size)
    warnings, more = maps.warnings + plan.warnings, _copies(part, plan.lines, plan.samples)
    return Tessellation(found[0], plan.vertices, plan.size, plan.stretch, warnings, found[1], more)


def _glued(
    part: Part, plan: _Plan, points: np.ndarray, triangles: np.ndarray, warnings: tuple[str, ...], delaunay: bool
) -> Tessellation:
    lines, samples = plan.lines, plan.samples
    # Those that stay come first, so that their numbers stay as well.
    rank = np.arange(len(points)) + len(points) * ~np.pad(samples.fixed, (0, len(points) - len(samples.fixed)))
    order = np.argsort(rank, kind="stable")
    number = np.empty(len(points), np.int64)
    number[order] = np.arange(len(points))
    fixed = np.arange(len(points)) < samples.fixed.sum()
    held_arcs = [k for k, arc in enumerate(lines.arcs) if arc.held]
    draft = Draft(points[order], number[triangles], fixed, _kept(held_arcs, samples, number), delaunay)
    slits = _kept(_along(lines, part.slits), samples, number)
    more = _copies(part, lines, samples)
    return Tessellation(draft, plan.vertices, plan.size, plan.stretch, warnings, slits, more)


def _held(part: Part) -> np.ndarray:
    """Sorted keys of the edges on boundaries and features."""
    return np.union1d(part.rim, pair_keys(part.features[:, 0], part.features[:, 1]))


def least_samples(maps: PartMaps, corners: bool) -> int:
    """Samples that the boundaries and features of a part take at least, with their corners or without."""
    part, held = maps.part, _held(maps.part)
    if len(held) == 0:
        return 0
    endless = np.full(len(part.vertices), np.inf)
    lines = network(part.vertices, maps.charts, held, part.slits, endless if corners else None)
    samples = sample_arcs(part.vertices, lines.arcs, endless)
    return int(samples.fixed.sum()) + _copies(part, lines, samples)


def _weighted_length(positions: np.ndarray, keys: np.ndarray, density: np.ndarray) -> float:
    a, b = keys >> 32, keys & 0xFFFFFFFF
    length = np.linalg.norm(positions[a] - positions[b], axis=1)
    return float(length @ np.sqrt((density[a] + density[b]) / 2))


def _for_faces(part: Part, lines: Network, samples: ArcSamples, count: int, size, stretch) -> tuple[ArcSamples, int]:
    """Samples whose boundary fits a number of faces, F = 2 V - 2 euler - b, and the number of vertices."""
    rim = _along(lines, part.rim)
    b = sum(len(samples.along[k]) - 1 for k in rim)
    if (count + b) % 2 and rim:
        longest = max(rim, key=lambda k: len(samples.along[k]))
        samples = sample_arcs(part.vertices, lines.arcs, size, longer=longest, stretch=stretch)
        b += 1
    return samples, (count + b) // 2 + part.euler


def _inner_counts(charts: list[Chart], borders: list[Border], density: np.ndarray, count: int) -> np.ndarray:
    """Inner samples of every chart, (c,): its measure, but for half of the cell of every sample on its border."""
    measure = np.array([face_areas(c.vertices, c.triangles) @ density[c.faces] for c in charts])
    half = np.array([len(b.samples) for b in borders]) / 2
    total = count + half.sum()
    ideal = np.maximum(total * measure / measure.sum() - half, 0)
    ideal *= max(count, 0) / max(ideal.sum(), 1e-300)
    return np.diff(np.concatenate([[0], np.round(np.cumsum(ideal))])).astype(np.int64)


def _patch(
    maps: PartMaps, k: int, loop: np.ndarray, edge: Border, number: int, density: np.ndarray, options: Options
) -> Steps[tuple[Patch | None, tuple[str, ...]]]:
    """A chart triangulated, and warnings; None where that fails and relaxation would make up for another way."""
    if len(edge.samples) == 3 and number == 0:
        return Patch(np.zeros((0, 3)), np.arange(3)[None]), ()
    chart = maps.charts[k]
    # Charts with triangles that had no area lie a little aside.
    places = maps.part.vertices[chart.vertex_ids]
    if number > FEW or not options.rounds:
        found = yield from maps.of_chart(k, density)
        patch = triangulate_chart(places, chart.disk, loop, found.pair(options.strategy), edge, number)
        if patch is not None:
            return patch, found.warnings
    even = even_map(chart.vertices, chart.disk, loop, edge)
    patch = triangulate_chart(places, chart.disk, loop, (even, even), edge, number)
    if patch is not None:
        return patch, ()
    if options.rounds:
        return None, ()
    elements = maps.part.faces[chart.faces]
    raise CrowdedError(
        f"A piece of {len(elements)} triangles leaves no room for {number} vertices in double precision",
        kind="face",
        elements=elements,
    )


def _kept(arcs: list[int], samples: ArcSamples, number: np.ndarray) -> np.ndarray:
    """Sorted keys of the edges between the samples on some arcs, after renumbering by `number` (s,)."""
    held = [number[samples.along[k]] for k in arcs]
    keys = [pair_keys(along[:-1], along[1:]) for along in held]
    return np.sort(np.concatenate(keys)) if keys else np.zeros(0, np.int64)


def _copies(part: Part, lines: Network, samples: ArcSamples) -> int:
    """How many samples there are on slits in addition to those given, once they are open."""
    if len(part.slits) == 0:
        return 0
    chains = [samples.along[k] for k in _along(lines, part.slits)]
    on_boundary = np.zeros(len(samples.points), dtype=bool)
    for k in _along(lines, part.rim):
        on_boundary[samples.along[k]] = True
    return copies(np.concatenate([end for chain in chains for end in (chain[:-1], chain[1:])]), on_boundary)


def _along(lines: Network, keys: np.ndarray) -> list[int]:
    """The arcs along edges with the keys (k,), as those of boundaries or of slits."""
    return [k for k, arc in enumerate(lines.arcs) if np.isin(pair_keys(*arc.vertices[:2, None]), keys)[0]]
