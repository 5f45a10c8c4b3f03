"""Decimation has the count, the topology, and vertices on the surface; lines stay where they are."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.mesh.topology import halfedges, pair_keys, paired, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import RemeshOptions, remesh
from omt_uv.solver.remeshing.edits.vertex_count import edge_length
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh
from omt_uv.solver.remeshing.initial.arc_network import find_arcs, sample_arcs
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.decimation import _working_mesh, decimated, decimated_between_lines
from omt_uv.solver.remeshing.initial.feature_lines import LineMesh


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


def between_lines(V, F, count):
    """A mesh decimated to so many vertices between the boundaries of a surface, the keys to reopen, and the samples."""
    maps = RemeshSource(V, F).maps[0]
    component = maps.component
    size = edge_length(component.area.sum(), 0.0, count)
    lengths = np.full(len(component.vertices), size)
    network = find_arcs(component.vertices, maps.charts, component.boundary_edges, np.zeros(0, np.int64), lengths)
    samples = sample_arcs(component.vertices, network.arcs, lengths)
    density = np.ones(len(component.triangles))
    return *decimated_between_lines(component, network.arcs, samples, count, density, size), samples


def test_samples_on_lines_are_fixed_and_joined_by_locked_edges():
    mesh, to_reopen, samples = between_lines(*meshes.annulus(), 200)
    assert len(mesh.points) == 200 and topology(mesh.triangles) == (0, 2) and len(to_reopen) == 0
    k = samples.fixed.sum()
    assert mesh.fixed[:k].all() and not mesh.fixed[k:].any() and len(mesh.locked) == k
    fixed = {tuple(p) for p in samples.points[samples.fixed]}
    assert {tuple(p) for p in mesh.points[:k]} == fixed
    assert np.isin(mesh.locked, pair_keys(*halfedges(mesh.triangles))).all()


@pytest.mark.parametrize("make", [meshes.annulus, meshes.bumpy, meshes.comb])
def test_keys_of_every_mesh_in_the_making_are_in_order_and_vertices_on_lines_come_first(monkeypatch, make):
    """Edits look keys up by halving: of those out of order they would find some alone."""
    made, begin = [], WorkingMesh.__init__
    monkeypatch.setattr(WorkingMesh, "__init__", lambda self, *a, **k: (begin(self, *a, **k), made.append(self))[0])
    V, F = make()
    mesh, to_reopen, _ = between_lines(V, F, 60)
    assert mesh.fixed.any() and not (np.diff(mesh.fixed.astype(int)) > 0).any()
    drain(remesh(RemeshSource(V, F), 60, RemeshOptions(rounds=2)))
    assert len(made) > 3 and sum(len(mesh.locked) > 2 for mesh in made) > 3
    for keys in (to_reopen, *(mesh.locked for mesh in made)):
        assert (np.diff(keys) > 0).all()


@pytest.mark.parametrize("seed", range(3))
def test_keys_of_lines_stay_sorted_however_vertices_are_numbered(seed):
    """Vertices on lines come first, and keys are looked for in their rows."""
    V, F = meshes.grid(4, 4)
    edges = paired(np.unique(pair_keys(*halfedges(F))))
    lines = np.random.default_rng(seed).permutation(edges)[:9]
    mesh = LineMesh(V, F, lines, lines[::2], np.array([3]), twins(F))
    working, to_reopen = _working_mesh(mesh)
    for keys, ends in ((working.locked, lines), (to_reopen, lines[::2])):
        assert (np.diff(keys) > 0).all() and len(keys) == len(ends)
        found, expected = (np.sort(places.reshape(-1, 6).round(9), axis=0) for places in
                           (np.sort(working.points[paired(keys)], axis=1), np.sort(V[ends], axis=1)))  # fmt: skip
        np.testing.assert_array_equal(found, expected)
