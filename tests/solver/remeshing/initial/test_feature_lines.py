"""Lines get a vertex at every sample and lose all others; the mesh keeps its area and its topology."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np
import pytest
from mesh_checks import topology
from scipy.spatial import cKDTree

from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.remeshing.initial.arc_network import find_arcs, sample_arcs
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.feature_lines import collapse_along_lines, collapse_short_edges, insert_samples


@pytest.fixture
def square():
    """A square with its boundary in 16 edges: 20 samples, 5 on each side."""
    maps = RemeshSource(*meshes.grid(4, 4)).maps[0]
    component = maps.component
    size = np.full(len(component.vertices), 0.2)
    network = find_arcs(component.vertices, maps.charts, component.boundary_edges, np.zeros(0, np.int64), size)
    return component, network.arcs, sample_arcs(component.vertices, network.arcs, size)


def test_samples_become_vertices(square):
    component, arcs, samples = square
    cut, vertex = insert_samples(component, arcs, samples)
    assert (vertex >= 0).all() and len(np.unique(vertex)) == 20
    np.testing.assert_allclose(cut.vertices[vertex], samples.points, atol=1e-9)
    np.testing.assert_allclose(np.bincount(cut.faces, cut.area, 32), np.bincount(component.faces, component.area, 32))
    assert topology(cut.triangles) == (1, 1)


def test_other_vertices_leave_the_lines(square):
    component, arcs, samples = square
    cut, vertex = insert_samples(component, arcs, samples)
    mesh = collapse_along_lines(cut, vertex)
    assert len(mesh.lines) == 20 and set(np.unique(mesh.lines)) == set(mesh.vertices)
    np.testing.assert_allclose(mesh.points[mesh.vertices], samples.points, atol=1e-9)
    assert topology(mesh.triangles) == (1, 1)
    # Faces may fold, but the boundary stays where it is.
    assert signed_areas(mesh.points[:, :2], mesh.triangles).sum() == pytest.approx(component.area.sum())
    fewer = collapse_short_edges(mesh, lambda points: np.full(len(points), 9.0))
    assert len(fewer.points) < len(mesh.points) and len(fewer.lines) == 20 and topology(fewer.triangles) == (1, 1)
    asked = []

    def shortest(points):
        asked.append(points)
        return np.full(len(points), 0.0)

    far = replace(mesh, points=mesh.points + [5.0, -3.0, 2.0])
    assert len(collapse_short_edges(far, shortest).points) == len(far.points)
    # The places asked about are middles of edges.
    (tree,) = {cKDTree((far.points[:, None] + far.points[None]).reshape(-1, 3) / 2)}
    assert tree.query(np.concatenate(asked))[0].max() < 1e-12
