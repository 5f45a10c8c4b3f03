"""Decimation has the count, the topology, and vertices on the surface; lines stay where they are."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.mesh.topology import halfedges, pair_keys
from omt_uv.solver.remeshing.edits.vertex_count import edge_length
from omt_uv.solver.remeshing.initial.arc_network import find_arcs, sample_arcs
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.decimation import decimated, decimated_between_lines


@pytest.mark.parametrize("count", [60, 700])
def test_a_torus_has_the_count(count):
    component = RemeshSource(*meshes.torus()).maps[0].component
    size = edge_length(component.area.sum(), 0.0, count)
    mesh = decimated(component, count, np.ones(len(component.triangles)), size)
    assert len(mesh.points) == count and topology(mesh.triangles) == (0, 0) and mesh.delaunay
    found = ClosestPoint(component.vertices, component.triangles, size)(
        mesh.points, vertex_normals(mesh.points, mesh.triangles)
    )
    # Halved edges lie on the surface, collapsed ones a chord's height away.
    assert np.linalg.norm(found.points - mesh.points, axis=1).max() < 0.5 * size


def test_samples_on_lines_are_fixed_and_joined_by_locked_edges():
    maps = RemeshSource(*meshes.annulus()).maps[0]
    component = maps.component
    size = edge_length(component.area.sum(), 0.0, 200)
    lengths = np.full(len(component.vertices), size)
    network = find_arcs(component.vertices, maps.charts, component.boundary_edges, np.zeros(0, np.int64), lengths)
    samples = sample_arcs(component.vertices, network.arcs, lengths)
    density = np.ones(len(component.triangles))
    mesh, to_reopen = decimated_between_lines(component, network.arcs, samples, 200, density, size)
    assert len(mesh.points) == 200 and topology(mesh.triangles) == (0, 2) and len(to_reopen) == 0
    k = samples.fixed.sum()
    assert mesh.fixed[:k].all() and not mesh.fixed[k:].any() and len(mesh.locked) == k
    fixed = {tuple(p) for p in samples.points[samples.fixed]}
    assert {tuple(p) for p in mesh.points[:k]} == fixed
    assert np.isin(mesh.locked, pair_keys(*halfedges(mesh.triangles))).all()
