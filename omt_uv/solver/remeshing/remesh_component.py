"""Remesh one component in its unit box: a first mesh, relaxed on the surface, brought to its count, and fitted."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from ..mesh.closest_point import ClosestPoint, SurfacePoints
from ..mesh.geometry import vertex_normals
from ..progress import Steps, part_of
from .components.coincident_boundaries import reopened
from .components.components import Component
from .edits.vertex_count import SizingField, StuckError, reach_vertex_count
from .edits.working_mesh import WorkingMesh
from .fitting.fit import fit_to_surface
from .fitting.retreat import retreated
from .initial.component_maps import ComponentMaps
from .initial.initial_mesh import InitialMesh, make_initial_mesh
from .initial.options import RemeshOptions
from .relaxation.cvt import Relaxation, relax_cvt
from .relaxation.surface_carrier import SurfaceCarrier
from .relaxation.vertex_balance import balance_vertices

# Rounds of relaxation before carrying vertices to where the measure asks for them: the first mesh is uneven,
FIRST_ROUNDS = 24
# and between.
SHORT_ROUNDS = 6
# How often vertices are carried at most.
MAX_BALANCES = 6
# How often boundaries and features are sampled more sparsely to reach a count, before faces may fold.
MAX_ATTEMPTS = 3
# By how much then, in distance between samples.
SPARSER = 2.0
# No point of a surface is farther from the vertices of its new mesh than this many edges: they are 0.6 to 0.8.
FAR = 1.5


@dataclass(frozen=True)
class RemeshedComponent:
    """A new mesh of a component, points (k,3) in the common unit box, and where in the input; as in `Remesh`."""

    points: np.ndarray
    triangles: np.ndarray
    faces: np.ndarray
    barycentric: np.ndarray
    residual: float
    warnings: tuple[str, ...]


def remesh_component(
    maps: ComponentMaps, count: int, density: np.ndarray, options: RemeshOptions
) -> Steps[RemeshedComponent]:
    """Remesh one component with density (m,) by about `count` vertices, or faces.

    Boundaries and features get fewer samples where the count cannot be reached; what can be is the count in the end.
    """
    component = maps.component
    level = density / (component.area @ density / component.area.sum())
    at_vertices = _at_vertices(component, level)
    spacing, attempt = 1.0, 0
    while True:
        attempt += 1
        start = yield from part_of(make_initial_mesh(maps, count, level, at_vertices, options, spacing), 0.0, 0.3)
        allow_folds = attempt >= MAX_ATTEMPTS or not start.mesh.fixed.any()
        try:
            return (yield from part_of(_settled(component, start, level, options, allow_folds), 0.3, 0.7))
        except StuckError as error:
            if allow_folds:
                mesh = error.mesh
                count = len(mesh.points) + start.reopened_copies if options.counts_vertices else len(mesh.triangles)
        spacing = start.line_spacing * SPARSER


def _settled(
    component: Component, start: InitialMesh, level: np.ndarray, options: RemeshOptions, allow_folds: bool
) -> Steps[RemeshedComponent]:
    """Relax a first mesh, bring it to its count, and fit it."""
    index = ClosestPoint(component.vertices, component.triangles, start.size)
    sizing = SizingField(index, level, start.size)
    mesh, residual = start.mesh, 0.0
    if options.rounds:
        carrier = SurfaceCarrier(index, level, start.vertex_count)
        mesh, residual = yield from _relaxed(start, carrier, sizing, options, allow_folds)
    mesh = reach_vertex_count(mesh, start.vertex_count, sizing, allow_folds)
    if options.fit:
        fitted = yield from part_of(fit_to_surface(mesh, index, level), 0.57, 0.43)
        mesh = retreated(mesh, fitted, component.vertices, component.triangles)
    points, triangles = reopened(mesh.points, mesh.triangles, start.to_reopen)
    thin = _too_thin(component, points, start.size / np.sqrt(level))
    on = _on_surface(index, mesh, points, triangles)
    return RemeshedComponent(
        points=points - component.shift[on.faces],
        triangles=triangles,
        faces=component.faces[on.faces],
        barycentric=np.einsum("kc,kcj->kj", on.barycentric, component.input_barycentric[on.faces]),
        residual=residual,
        warnings=(*start.warnings, *thin),
    )


def _on_surface(index: ClosestPoint, mesh: WorkingMesh, points: np.ndarray, triangles: np.ndarray) -> SurfacePoints:
    """The closest points to points (k,3) of triangles (m,3), those of a mesh that may have been cut open."""
    if mesh.near is None:
        return index(points, vertex_normals(points, triangles))
    near = np.zeros(len(points), np.int64)
    near[triangles] = mesh.near[mesh.triangles]
    return index.walk(points, near)


def _too_thin(component: Component, points: np.ndarray, edge: np.ndarray) -> list[str]:
    """A warning where vertices of a component are far from all points (k,3) of a new mesh whose edges are to be so long
    in its triangles, (m,): what is thinner than these, as strings are, ends too early or is in folds."""
    reach = np.zeros(len(component.vertices))
    np.maximum.at(reach, component.triangles, FAR * edge[:, None])
    far = cKDTree(points).query(component.vertices)[0] > reach
    if not far.any():
        return []
    return [
        "A part is thinner than the new triangles and does not keep its shape. Ask for more, or remesh it by itself"
    ]


def _relaxed(
    start: InitialMesh, carrier: SurfaceCarrier, sizing: SizingField, options: RemeshOptions, allow_folds: bool
) -> Steps[tuple[WorkingMesh, float]]:
    """Relax a mesh and carry vertices in turns, until they are where the measure asks for them; and the last step."""
    mesh, _ = yield from part_of(relax_cvt(start.mesh, FIRST_ROUNDS, carrier), 0.0, 0.07)
    mesh = reach_vertex_count(mesh, start.vertex_count, sizing, allow_folds)
    demand, balanced = None, True
    for k in range(MAX_BALANCES):
        relaxation = Relaxation(mesh, carrier)
        mesh, _ = yield from part_of(relaxation.run(SHORT_ROUNDS), 0.07 + 0.038 * k, 0.038)
        if not options.samples_by_measure:
            break
        found = balance_vertices(mesh, carrier, sizing, demand)
        mesh, demand, balanced = found.mesh, found.demand, found.was_balanced
        if balanced:
            break
    if balanced:
        # The short rounds are the first ones, and these go on from there.
        mesh, residual = yield from part_of(relaxation.run(max(options.rounds - SHORT_ROUNDS, 1)), 0.3, 0.2)
    else:
        mesh, residual = yield from part_of(relax_cvt(mesh, options.rounds, carrier), 0.3, 0.2)
        # Along jumps of the density that took vertices away again.
        mesh = balance_vertices(mesh, carrier, sizing, demand).mesh
        mesh, residual = yield from part_of(relax_cvt(mesh, SHORT_ROUNDS, carrier), 0.5, 0.07)
    return mesh, residual


def _at_vertices(component: Component, density: np.ndarray) -> np.ndarray:
    """Density (n,) at the vertices, the mean of that of their triangles (m,) by area."""
    corner, n = component.triangles.ravel(), len(component.vertices)
    area = np.maximum(component.area, 1e-300)
    total = np.bincount(corner, np.repeat(area * density, 3), n)
    return total / np.maximum(np.bincount(corner, np.repeat(area, 3), n), 1e-300)
