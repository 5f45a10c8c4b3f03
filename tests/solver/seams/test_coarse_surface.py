"""Coarse surfaces: sums, topology, lines and boundaries stay."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.topology import boundary_loops, halfedges, twins
from omt_uv.solver.seams.coarse_surface import coarsening


def euler(triangles):
    edges = (len(halfedges(triangles)[0]) + (twins(triangles) < 0).sum()) // 2
    return len(np.unique(triangles)) - edges + len(triangles)


@pytest.mark.parametrize("name", ["icosphere", "cap", "torus"])
def test_topology_area_and_curvature_stay(name):
    V, F = {"icosphere": lambda: meshes.icosphere(3), "cap": lambda: meshes.cap(20, 40, 0.8), "torus": meshes.torus}[
        name
    ]()
    coarse = coarsening(V, F, 100).ended(100)
    assert len(coarse.kept) < 0.5 * len(V)
    assert euler(coarse.triangles) == euler(F)
    assert len(boundary_loops(coarse.triangles)) == len(boundary_loops(F))
    assert (twins(coarse.triangles)[twins(coarse.triangles)] == np.arange(3 * len(coarse.triangles)))[
        twins(coarse.triangles) >= 0
    ].all()
    assert np.isclose(coarse.area.sum(), 1)
    if name != "cap":
        assert np.isclose(coarse.curvature.sum(), 2 * np.pi * euler(F))
    assert np.array_equal(coarse.positions, V[coarse.kept])


def test_a_small_surface_stays_as_it_is():
    V, F = meshes.icosphere(1)
    coarse = coarsening(V, F, 1000).ended(1000)
    assert np.array_equal(coarse.kept, np.arange(len(V))) and np.array_equal(coarse.triangles, F)


def test_a_line_stays_a_line():
    V, F = meshes.grid(20, 20)
    line = np.isclose(V[:, 0], np.median(V[:, 0]))
    coarse = coarsening(V, F, 120, line).ended(120)
    kept = line[coarse.kept] & ~coarse.boundary
    tail, head = halfedges(coarse.triangles)
    beside = line[coarse.kept][head]
    # Every vertex inside has two neighbours on it.
    assert 2 <= kept.sum() < line.sum() and (np.bincount(tail[beside], minlength=len(kept))[kept] == 2).all()


def test_scale_does_not_matter():
    V, F = meshes.icosphere(3)
    a, b = (coarsening(scale * V, F, 100).ended(100) for scale in (1.0, 64.0))
    assert np.array_equal(a.kept, b.kept) and np.array_equal(a.triangles, b.triangles)
    assert np.isclose(b.size, 64 * a.size)
