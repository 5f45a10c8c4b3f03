"""Make the first mesh of a component: by way of the sphere, of charts that are stitched again, or by decimation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...errors import CrowdedError, PrecisionError
from ...mesh.charts import Chart
from ...mesh.geometry import face_areas
from ...mesh.topology import pair_keys, paired
from ...progress import Progress, Steps, part_of
from ..components.coincident_boundaries import reopened_copies
from ..edits.vertex_count import edge_length
from ..edits.working_mesh import WorkingMesh
from .arc_network import ArcSamples, ChartBoundary, chart_boundary
from .component_maps import ComponentMaps
from .decimation import decimated, decimated_between_lines
from .disk_samples import ChartMesh, even_image, triangulate_chart
from .options import RemeshOptions
from .sample_plan import INITIAL_VERTICES, SamplePlan, copies_of, initial_vertex_count, plan_samples
from .sphere_samples import sample_sphere
from .stitching import stitch

# Charts with up to so many inner samples need no maps: what relaxation makes of them is the same.
FEW = 50
NO_MAPS = "A part has no maps to the disk in double precision and was remeshed without"


@dataclass(frozen=True)
class InitialMesh:
    """A mesh of a component with about the target count, samples on boundaries and features fixed, edges there locked.

    vertex_count: to reach exactly; size: edge length at density 1; line_spacing: that of the samples on boundaries and
    features, in edges; to_reopen: sorted keys of the edges to cut at the end; reopened_copies: vertices that adds
    """

    mesh: WorkingMesh
    vertex_count: int
    size: float
    line_spacing: float
    warnings: tuple[str, ...]
    to_reopen: np.ndarray
    reopened_copies: int


def make_initial_mesh(
    maps: ComponentMaps,
    count: int,
    density: np.ndarray,
    at_vertices: np.ndarray,
    options: RemeshOptions,
    line_spacing: float = 1.0,
) -> Steps[InitialMesh]:
    """Sample a component with density (m,), and at_vertices (n,), of mean 1, and triangulate by the options' strategy.

    Where any mesh will do it comes of collapses of the component's own edges. Otherwise closed components of genus 0
    without features go by way of the sphere, all others by way of charts, and by collapses where that fails. On
    boundaries and features samples are `line_spacing` edges apart, or more where there would be too many.

    There may be more vertices than the count, where boundaries and features take as many. Raises PrecisionError where a
    chart cannot be triangulated.
    """
    if options.any_mesh_will_do and not maps.component.has_lines:
        yield Progress("Samples", 0.0)
        return _by_decimation(maps, count, density, options)
    found = None
    if maps.by_sphere and not options.any_mesh_will_do:
        found = yield from _by_sphere(maps, count, density, options)
    return found or (yield from _by_charts(maps, count, density, at_vertices, options, line_spacing))


def _by_sphere(
    maps: ComponentMaps, count: int, density: np.ndarray, options: RemeshOptions
) -> Steps[InitialMesh | None]:
    """The component by way of the sphere; None where that has no room for it."""
    component = maps.component
    found = yield from maps.of_sphere(density)
    if found is None:
        return None
    vertex_count = count if options.counts_vertices else max(count // 2 + 2, 4)
    images, sample_count = found.pair(options.strategy), max(vertex_count, INITIAL_VERTICES)
    try:
        samples = sample_sphere(component.vertices, component.triangles, *images, sample_count)
    except PrecisionError as error:
        maps.give_up(error.cause)
        return None
    n = len(samples.points)
    none_fixed, none_locked = np.zeros(n, dtype=bool), np.zeros(0, np.int64)
    mesh = WorkingMesh(samples.points, samples.triangles, none_fixed, none_locked, options.delaunay)
    size = edge_length(float(component.area @ density), 0.0, vertex_count)
    return InitialMesh(
        mesh=mesh,
        vertex_count=vertex_count,
        size=size,
        line_spacing=1.0,
        warnings=found.warnings,
        to_reopen=component.to_reopen,
        reopened_copies=0,
    )


def _by_decimation(maps: ComponentMaps, count: int, density: np.ndarray, options: RemeshOptions) -> InitialMesh:
    """A component without boundaries and features by its own triangles."""
    component = maps.component
    vertex_count = count if options.counts_vertices else count // 2 + component.euler
    at_first = max(vertex_count, initial_vertex_count(component))
    size, initial_size = (edge_length(float(component.area @ density), 0.0, n) for n in (vertex_count, at_first))
    return InitialMesh(
        mesh=decimated(component, at_first, density, initial_size),
        vertex_count=vertex_count,
        size=size,
        line_spacing=1.0,
        warnings=maps.warnings,
        to_reopen=component.to_reopen,
        reopened_copies=0,
    )


def _by_charts(
    maps: ComponentMaps,
    count: int,
    density: np.ndarray,
    at_vertices: np.ndarray,
    options: RemeshOptions,
    line_spacing: float,
) -> Steps[InitialMesh]:
    """The component by way of charts; by its own triangles where any mesh will do, or some have no maps and relaxation
    follows."""
    yield Progress("Charts", 0.0)
    plan = plan_samples(maps, count, density, at_vertices, options, line_spacing)
    network, component = plan.network, maps.component
    if options.any_mesh_will_do:
        return _by_decimation_between_lines(maps, plan, density, count, options)
    boundaries = [chart_boundary(sides, plan.samples, network.arcs) for sides in network.sides]
    left = max(plan.vertex_count, plan.initial_vertex_count) - len(plan.samples.points)
    inner = _inner_counts(maps.charts, boundaries, density, left)
    chart_meshes: list[ChartMesh] = []
    chart_warnings: tuple[str, ...] = ()
    done = 0.0
    for k, (loop, boundary, inner_count) in enumerate(zip(network.loops, boundaries, inner, strict=True)):
        share = len(maps.charts[k].triangles) / len(component.triangles)
        steps = _chart_mesh(maps, k, loop, boundary, int(inner_count), density, options)
        chart_mesh, warnings = yield from part_of(steps, done, share)
        if chart_mesh is None:
            plan = replace(plan, warnings=(*plan.warnings, NO_MAPS))
            return _by_decimation_between_lines(maps, plan, density, count, options)
        chart_meshes.append(chart_mesh)
        chart_warnings += warnings
        done += share
    points, triangles = stitch(plan.samples.points, boundaries, chart_meshes)
    return _stitched(maps, plan, points, triangles, chart_warnings, options.delaunay)


def _by_decimation_between_lines(
    maps: ComponentMaps, plan: SamplePlan, density: np.ndarray, count: int, options: RemeshOptions
) -> InitialMesh:
    """The component by its own triangles, between the samples on its boundaries and features, for a final `count` of
    vertices or faces."""
    component, at_first = maps.component, max(plan.vertex_count, plan.initial_vertex_count)
    mesh, to_reopen = decimated_between_lines(
        component, plan.network.arcs, plan.samples, at_first, density, plan.initial_size
    )
    # Not every vertex between samples can collapse along its line, so that there may be more there than was planned.
    boundary, on_boundary = mesh.twin < 0, np.zeros(len(mesh.points), dtype=bool)
    on_boundary[mesh.triangles.ravel()[boundary]] = True
    copies = reopened_copies(paired(to_reopen).ravel(), on_boundary)
    vertex_count = count - copies
    if not options.counts_vertices:
        vertex_count = (count + int(boundary.sum())) // 2 + component.euler
    start = _of_plan(maps, plan, mesh, to_reopen, maps.warnings + plan.warnings)
    return replace(start, vertex_count=vertex_count, reopened_copies=copies)


def _stitched(
    maps: ComponentMaps,
    plan: SamplePlan,
    points: np.ndarray,
    triangles: np.ndarray,
    chart_warnings: tuple[str, ...],
    delaunay: bool,
) -> InitialMesh:
    """Order the vertices of stitched charts, points (n,3) and triangles (m,3): those that stay come first."""
    network, samples = plan.network, plan.samples
    rank = np.arange(len(points)) + len(points) * ~np.pad(samples.fixed, (0, len(points) - len(samples.fixed)))
    order = np.argsort(rank, kind="stable")
    number = np.empty(len(points), np.int64)
    number[order] = np.arange(len(points))
    fixed = np.arange(len(points)) < samples.fixed.sum()
    locked = _edge_keys([k for k, arc in enumerate(network.arcs) if arc.kept], samples, number)
    mesh = WorkingMesh(points[order], number[triangles], fixed, locked, delaunay)
    to_reopen = _edge_keys(network.along(maps.component.to_reopen), samples, number)
    return _of_plan(maps, plan, mesh, to_reopen, maps.warnings + plan.warnings + chart_warnings)


def _of_plan(
    maps: ComponentMaps, plan: SamplePlan, mesh: WorkingMesh, to_reopen: np.ndarray, warnings: tuple[str, ...]
) -> InitialMesh:
    return InitialMesh(
        mesh=mesh,
        vertex_count=plan.vertex_count,
        size=plan.size,
        line_spacing=plan.line_spacing,
        warnings=warnings,
        to_reopen=to_reopen,
        reopened_copies=copies_of(maps.component, plan.network, plan.samples),
    )


def _inner_counts(charts: list[Chart], boundaries: list[ChartBoundary], density: np.ndarray, count: int) -> np.ndarray:
    """Inner samples of every chart, (c,): its measure, but for half of the cell of every sample on its boundary."""
    measure = np.array([face_areas(c.vertices, c.triangles) @ density[c.faces] for c in charts])
    half = np.array([len(b.samples) for b in boundaries]) / 2
    total = count + half.sum()
    ideal = np.maximum(total * measure / measure.sum() - half, 0)
    ideal *= max(count, 0) / max(ideal.sum(), 1e-300)
    return np.diff(np.concatenate([[0], np.round(np.cumsum(ideal))])).astype(np.int64)


def _chart_mesh(
    maps: ComponentMaps,
    k: int,
    loop: np.ndarray,
    boundary: ChartBoundary,
    inner_count: int,
    density: np.ndarray,
    options: RemeshOptions,
) -> Steps[tuple[ChartMesh | None, tuple[str, ...]]]:
    """Triangulate a chart, and warnings; None where that fails and relaxation would make up for another way."""
    if len(boundary.samples) == 3 and inner_count == 0:
        return ChartMesh(np.zeros((0, 3)), np.arange(3)[None]), ()
    chart = maps.charts[k]
    # Charts with triangles that had no area lie a little aside.
    places = maps.component.vertices[chart.vertex_ids]
    if inner_count > FEW or not options.rounds:
        found = yield from maps.of_chart(k, density)
        mesh = triangulate_chart(places, chart.disk, loop, found.pair(options.strategy), boundary, inner_count)
        if mesh is not None:
            return mesh, found.warnings
    even = even_image(chart.vertices, chart.disk, loop, boundary)
    mesh = triangulate_chart(places, chart.disk, loop, (even, even), boundary, inner_count)
    if mesh is not None:
        return mesh, ()
    if options.rounds:
        return None, ()
    elements = maps.component.faces[chart.faces]
    raise CrowdedError(
        f"A piece of {len(elements)} triangles leaves no room for {inner_count} vertices in double precision",
        kind="face",
        elements=elements,
    )


def _edge_keys(arcs: list[int], samples: ArcSamples, number: np.ndarray) -> np.ndarray:
    """Sorted keys of the edges between the samples on some arcs, after renumbering by `number` (s,)."""
    chains = [number[samples.along[k]] for k in arcs]
    keys = [pair_keys(chain[:-1], chain[1:]) for chain in chains]
    return np.sort(np.concatenate(keys)) if keys else np.zeros(0, np.int64)
