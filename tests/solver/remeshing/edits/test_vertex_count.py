"""Counts are exact, however many vertices there are to begin with, and no bound is above what there is."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.topology import halfedges, pair_keys
from omt_uv.solver.remeshing.components.components import split_components
from omt_uv.solver.remeshing.edits.vertex_count import (
    SizingField,
    StuckError,
    apportion,
    edge_length,
    min_face_count,
    min_vertex_count,
    reach_vertex_count,
)
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh

NONE = np.zeros(0, np.int64)


def even(points):
    return np.ones(len(points))


def free_mesh(V, F):
    return WorkingMesh(V, F, np.zeros(len(V), dtype=bool), NONE)


@pytest.mark.parametrize("name", ["icosphere", "torus", "bumpy", "annulus"])
@pytest.mark.parametrize("factor", [0.7, 1.0, 1.9])
def test_counts_are_reached_exactly(name, factor):
    V, F = getattr(meshes, name)()
    count = round(factor * len(V))
    found = reach_vertex_count(free_mesh(V, F), count, even)
    assert len(found.points) == count == len(np.unique(found.triangles))
    assert topology(found.triangles) == topology(F)


def test_fixed_vertices_and_locked_edges_stay():
    V, F = meshes.grid(8, 8)
    boundary = (V[:, :2] == 0).any(axis=1) | (V[:, :2] == 1).any(axis=1)
    order = np.argsort(~boundary, kind="stable")
    number = np.argsort(order)
    V, F, boundary = V[order], number[F], boundary[order]
    locked = np.unique(pair_keys(*halfedges(F)))[:30]
    found = reach_vertex_count(WorkingMesh(V, F, boundary, locked), 50, even)
    np.testing.assert_array_equal(found.points[: boundary.sum()], V[boundary])
    assert len(found.points) == 50 and found.fixed[: boundary.sum()].all() and not found.fixed[boundary.sum() :].any()
    on_boundary = locked[boundary[locked >> 32] & boundary[locked & 0xFFFFFFFF]]
    assert np.isin(on_boundary, pair_keys(*halfedges(found.triangles))).all()
    with pytest.raises(StuckError):
        reach_vertex_count(
            WorkingMesh(V, F, np.ones(len(V), dtype=bool), locked), 50, lambda points: np.ones(len(points))
        )


def test_whole_numbers_sum_to_the_count_and_keep_to_their_least():
    rng = np.random.default_rng(0)
    for _ in range(50):
        k = rng.integers(1, 9)
        proportion, least = rng.random(k) ** 3 + 1e-6, rng.integers(0, 12, k)
        count = int(least.sum() + rng.integers(0, 40))
        whole = apportion(count, proportion, least)
        assert whole.sum() == count and (whole >= least).all()
    np.testing.assert_array_equal(apportion(12, np.array([1.0, 2, 3]), np.zeros(3, int)), [2, 4, 6])


def test_edge_lengths_fill_the_area():
    """A torus has two triangles for every vertex."""
    length = edge_length(10.0, 0.0, 500)
    assert 2 * 500 * np.sqrt(3) / 4 * length**2 == pytest.approx(10)
    assert edge_length(10.0, 4.0, 500) > length


def test_density_makes_edges_shorter():
    V, F = meshes.grid(4, 4)
    density = np.where(V[F].mean(axis=1)[:, 0] > 0.5, 4.0, 1.0)
    sizing = SizingField(ClosestPoint(V, F, 0.2), density, 0.3)
    np.testing.assert_allclose(sizing(np.array([[0.1, 0.5, 0], [0.9, 0.5, 0]])), [0.3, 0.15])


@pytest.mark.parametrize("name, vertices", [("icosphere", 4), ("torus", 7), ("bumpy", 3), ("annulus", 6)])
def test_bounds_are_those_of_topology(name, vertices):
    (component,) = split_components(*getattr(meshes, name)(), np.zeros((0, 2), int)).components
    assert min_vertex_count(component) == vertices
    assert min_face_count(component, vertices) == {"icosphere": 4, "torus": 14, "bumpy": 1, "annulus": 6}[name]


def test_edits_know_where_on_the_surface_vertices_are():
    """Those that stay where they were, new ones where an end of their edge was."""
    V, F = meshes.icosphere(2)
    mesh = WorkingMesh(V, F, np.zeros(len(V), dtype=bool), NONE, near=np.arange(len(V)))
    fewer, more = (reach_vertex_count(mesh, count, lambda points: np.ones(len(points))) for count in (120, 200))
    for found in (fewer, more):
        assert len(found.near) == len(found.points)
        # Vertices at one end of an edge of the mesh that was.
        far = np.linalg.norm(V[found.near] - found.points, axis=1)
        assert far.max() < 0.7 and (far == 0).mean() > 0.5
    np.testing.assert_array_equal(more.near[: len(V)], np.arange(len(V)))
    assert reach_vertex_count(WorkingMesh(V, F, mesh.fixed, NONE), 120, lambda p: np.ones(len(p))).near is None
