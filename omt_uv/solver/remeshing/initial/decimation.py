"""Decimate a component's own triangles, for a first mesh without maps: long edges halved, short ones collapsed.

It needs no cut, lies on the surface from the beginning, and does not fold, of whatever topology and however thin.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...mesh.closest_point import ClosestPoint
from ...mesh.topology import pair_keys, twins
from ..components.components import Component
from ..edits.delaunay_flips import make_delaunay_embedded
from ..edits.long_edges import split_long_edges
from ..edits.vertex_count import SizingField, StuckError, reach_vertex_count
from ..edits.working_mesh import WorkingMesh
from .arc_network import Arc, ArcSamples
from .feature_lines import LineMesh, collapse_along_lines, collapse_short_edges, insert_samples

# Edges up to so many times as long as their target need not be halved,
LONGEST = 1.3
# and shorter ones than so many collapse before.
SHORTEST = 0.3
# Needles may take many halvings: no more than so many times as many as there are to be vertices.
MAX_NEW = 3


def decimated(component: Component, count: int, density: np.ndarray, size: float) -> WorkingMesh:
    """Decimate a closed component to `count` vertices, or a few more where no edge collapses any more.

    density (m,) of the component's triangles, of mean 1; size: edge length at density 1
    """
    none = np.zeros((0, 2), np.int64)
    mesh = LineMesh(
        points=component.vertices,
        triangles=component.triangles,
        lines=none,
        to_reopen=none,
        vertices=none.ravel(),
        twin=twins(component.triangles),
    )
    return _reached(component, mesh, count, _sizing(component, density, size))[0]


def decimated_between_lines(
    component: Component, arcs: list[Arc], samples: ArcSamples, count: int, density: np.ndarray, size: float
) -> tuple[WorkingMesh, np.ndarray]:
    """Decimate between the samples of kept arcs, which are fixed, and edges between them locked, for a density (m,) of
    the component's triangles; and the keys (k,) of edges to reopen, sorted."""
    cut, vertex = insert_samples(component, arcs, samples)
    mesh = collapse_along_lines(cut, vertex[samples.fixed])
    mesh.points[mesh.vertices] = samples.points[samples.fixed]
    return _reached(component, mesh, count, _sizing(component, density, size))


def _sizing(component: Component, density: np.ndarray, size: float) -> SizingField:
    return SizingField(ClosestPoint(component.vertices, component.triangles, size), density, size)


def _reached(component: Component, mesh: LineMesh, count: int, sizing: SizingField) -> tuple[WorkingMesh, np.ndarray]:
    # Needles would be halved again and again.
    mesh = collapse_short_edges(mesh, lambda points: SHORTEST * sizing(points))
    fine = split_long_edges(_as_component(component, mesh), LONGEST * sizing(mesh.points), MAX_NEW * count)
    working, to_reopen = _working_mesh(collapse_along_lines(fine, mesh.vertices))
    try:
        return reach_vertex_count(working, count, sizing), to_reopen
    except StuckError as error:
        return error.mesh, to_reopen


def _as_component(component: Component, mesh: LineMesh) -> Component:
    """The mesh with its lines as features; where its triangles lie in the input is of no interest any more."""
    m = len(mesh.triangles)
    to_reopen = np.sort(pair_keys(*mesh.to_reopen.T))
    nowhere = {"faces": np.zeros(m, np.int64), "input_barycentric": np.zeros((m, 3, 3)), "shift": np.zeros((m, 3))}
    return replace(
        component,
        vertices=mesh.points,
        triangles=mesh.triangles,
        features=mesh.lines,
        to_reopen=to_reopen,
        members=(),
        **nowhere,
    )


def _working_mesh(mesh: LineMesh) -> tuple[WorkingMesh, np.ndarray]:
    """The mesh, Delaunay, with all vertices on lines fixed and first, and the keys of edges to reopen."""
    fixed = np.zeros(len(mesh.points), dtype=bool)
    fixed[mesh.lines] = fixed[mesh.vertices] = True
    order = np.argsort(~fixed, kind="stable")
    number = np.argsort(order, kind="stable")
    triangles, points = number[mesh.triangles], mesh.points[order]
    locked, to_reopen = (np.sort(pair_keys(*number[pairs].T)) for pairs in (mesh.lines, mesh.to_reopen))
    working = WorkingMesh(points, triangles, fixed[order], locked)
    make_delaunay_embedded(points, triangles, working.twin, locked)
    return working, to_reopen
