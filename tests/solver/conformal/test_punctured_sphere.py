"""A sphere without one vertex: flat inside, and its boundary a closed polygon."""

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.solver.conformal.intrinsic_triangulation import euclidean_diagonal, from_mesh, make_delaunay
from omt_uv.solver.conformal.punctured_sphere import _inversion, flatten_punctured_sphere
from omt_uv.solver.mesh.geometry import angles_from_lengths
from omt_uv.solver.progress import drain


@pytest.fixture(params=[0, 17, 100])
def flat(request):
    V, F = meshes.icosphere(2)
    tri, _ = make_delaunay(from_mesh(V * [1, 2, 0.7], F), euclidean_diagonal)
    return drain(flatten_punctured_sphere(tri, request.param)), request.param, len(V)


def test_angles_around_inner_vertices_are_full(flat):
    polygon, puncture, n = flat
    corners = polygon.triangulation.triangles[polygon.inner][:, [2, 0, 1]]
    sums = np.bincount(corners.ravel(), angles_from_lengths(polygon.length[polygon.inner]).ravel(), n)
    inner = ~np.isin(np.arange(n), [*polygon.boundary, puncture])
    np.testing.assert_allclose(sums[inner], 2 * np.pi, atol=1e-9)
    np.testing.assert_allclose(sums[polygon.boundary], polygon.angle, atol=1e-12)


def test_the_boundary_is_a_closed_polygon(flat):
    polygon, _, _ = flat
    assert (np.pi - polygon.angle).sum() == pytest.approx(2 * np.pi)
    heading = np.concatenate([[0.0], np.cumsum(np.pi - polygon.angle[1:])])
    assert abs((polygon.side_length * np.exp(1j * heading)).sum()) < 1e-9 * polygon.side_length.sum()


def test_all_spokes_to_infinity_are_equal(flat):
    """Neighbours of the puncture are held at the scale that makes the half-strips parallel."""
    polygon, puncture, _ = flat
    tri = polygon.triangulation
    spokes = np.flatnonzero(tri.triangles.ravel() == puncture)
    np.testing.assert_allclose(tri.scaled(polygon.log_scale)[spokes], 0, atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_scales_of_the_inversion_go_by_the_shortest_of_several_edges(seed):
    """Distances by Bellman and Ford's loop over all edges, of which several may join the same two vertices."""
    V, F = meshes.icosphere(1)
    rng = np.random.default_rng(seed)
    tri = from_mesh(V, F)
    tri = replace(tri, triangles=F % 17, log_length=rng.normal(0, 0.5, F.size))
    tail, head = tri.triangles.ravel(), tri.triangles[:, [1, 2, 0]].ravel()
    assert len({frozenset(pair) for pair in zip(tail, head, strict=True)}) < F.size // 2
    n = 17
    for puncture in range(n):
        distance, first = np.full(n, np.inf), np.full(n, np.inf)
        distance[puncture] = 0
        for _ in range(n):
            for a, b, log in zip(tail, head, tri.log_length, strict=True):
                distance[b] = min(distance[b], distance[a] + np.exp(log))
                distance[a] = min(distance[a], distance[b] + np.exp(log))
                if a == puncture:
                    first[b] = min(first[b], log)
        distance[puncture] = 1
        expected = [-first[k] if np.isfinite(first[k]) else -np.log(distance[k]) for k in range(n)]
        np.testing.assert_allclose(_inversion(tri, puncture), expected, rtol=1e-12)
