"""How much work the solver does, in counts that are the same on every machine; seconds are never asserted."""

import meshes
import numpy as np
import pytest
from scipy.sparse import csc_matrix, diags
from work import counted_work

from omt_uv.solver.linalg.nested_dissection import Dissection
from omt_uv.solver.linalg.sparse import Factor, minimum_degree
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import halfedges
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.transport.convex_domain import Disk
from omt_uv.solver.transport.regular_triangulation import by_hull
from omt_uv.solver.transport.semidiscrete import transport


def random_sites(count):
    rng = np.random.default_rng(0)
    radius, angle = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def test_transport_of_random_sites():
    sites = random_sites(10_000)
    with counted_work() as tally:
        found = drain(transport(sites, np.ones(len(sites)), Disk()))
    assert found.iterations <= 9 and found.diagrams <= 11 and found.hulls <= 2
    assert found.flips <= 5000
    assert tally.factorisations <= 4 and tally.nonzeros <= 3 * tally.factorisations * len(sites)
    assert tally.cycles <= 25 * found.iterations


def test_the_order_of_large_meshes_gives_the_same_maps(monkeypatch):
    from omt_uv.solver.linalg import nested_dissection as dissection
    from omt_uv.solver.maps import tutte as embedding

    V, F = meshes.head(40)
    (reference,) = drain(unwrap(triangle_surface(V, F))).maps
    for module in (dissection, embedding):
        monkeypatch.setattr(module, "LARGE", 100)
    (dissected,) = drain(unwrap(triangle_surface(V, F))).maps
    np.testing.assert_allclose(dissected.uv, reference.uv, atol=1e-6 * np.abs(reference.uv).max())


def test_dissection_fills_little_more_than_minimum_degree():
    sites = random_sites(5000)
    tail, head = halfedges(by_hull(sites, np.zeros(len(sites))).triangles)
    order = Dissection(sites).order(tail, head)
    np.testing.assert_array_equal(np.sort(order), np.arange(len(sites)))
    graph = csc_matrix((-np.ones(2 * len(tail)), (np.r_[tail, head], np.r_[head, tail])), shape=(len(sites),) * 2)
    matrix = (graph + diags(1e-3 - np.asarray(graph.sum(axis=1)).ravel())).tocsc()
    counts = []
    for permutation in (order, minimum_degree(matrix)):
        with counted_work() as tally:
            Factor(matrix, permutation)
        counts.append(tally.nonzeros)
    assert counts[0] <= 2.2 * counts[1]


@pytest.mark.parametrize(("count", "steps"), [(60, 12), (90, 14)])
def test_newton_steps_do_not_grow_with_the_mesh(count, steps):
    V, F = meshes.head(count)
    with counted_work() as tally:
        (chart_map,) = drain(unwrap(triangle_surface(V, F))).maps
    assert chart_map.newton_refinement <= steps and (chart_map.newton_conformal or 0) <= 12
    assert tally.nonzeros <= 4000 * len(V)


@meshes.models_missing
def test_lion():
    with counted_work() as tally:
        (chart_map,) = drain(unwrap(triangle_surface(*meshes.load_model("lion")))).maps
    assert chart_map.newton_refinement <= 10
    assert tally.factorisations <= 50 and tally.nonzeros <= 20e6
