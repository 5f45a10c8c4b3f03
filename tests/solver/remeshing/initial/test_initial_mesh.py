"""First meshes have the topology of their component by every way, and no fewer vertices than there are to be."""

from __future__ import annotations

import types

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.topology import halfedges, pair_keys
from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing.initial import initial_mesh
from omt_uv.solver.remeshing.initial.component_maps import RemeshSource
from omt_uv.solver.remeshing.initial.initial_mesh import make_initial_mesh
from omt_uv.solver.remeshing.initial.options import STRATEGIES, RemeshOptions


@pytest.mark.parametrize("name", ["bumpy", "icosphere", "torus", "annulus"])
@pytest.mark.parametrize("strategy", STRATEGIES[:2])
def test_topology_and_what_is_fixed(name, strategy):
    """The first strategy takes any mesh where there is no map, the second goes by charts throughout."""
    V, F = getattr(meshes, name)()
    maps = RemeshSource(V, F).maps[0]
    component = maps.component
    one, at_vertices = np.ones(len(component.triangles)), np.ones(len(component.vertices))
    found = drain(make_initial_mesh(maps, 150, one, at_vertices, RemeshOptions(strategy=strategy)))
    mesh = found.mesh
    assert found.vertex_count == 150 and topology(mesh.triangles) == topology(F)
    assert abs(len(mesh.points) - 150) < 15
    # Those that stay come first, and stay joined by edges.
    k = mesh.fixed.sum()
    assert mesh.fixed[:k].all() and (k > 0) == (len(component.boundary_edges) > 0)
    assert np.isin(mesh.locked, pair_keys(*halfedges(mesh.triangles))).all() and len(mesh.locked) == k
    assert mesh.delaunay == strategy.endswith("cfp")


def test_options_say_what_is_wrong():
    for wrong in ({"strategy": "cfp"}, {"count_of": "edges"}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            RemeshOptions(**wrong)


@pytest.mark.parametrize("strategy, by_sphere", [(STRATEGIES[0], False), (STRATEGIES[1], True)])
def test_limbs_go_by_their_own_triangles_unless_maps_are_asked_for(monkeypatch, strategy, by_sphere):
    V, F = meshes.icosphere(3)
    maps = RemeshSource(V * [9, 1, 1], F).maps[0]
    asked = []
    of_sphere = maps.of_sphere
    monkeypatch.setattr(maps, "of_sphere", lambda density: asked.append(1) or of_sphere(density))
    one, at_vertices = np.ones(len(maps.component.triangles)), np.ones(len(maps.component.vertices))
    found = drain(make_initial_mesh(maps, 200, one, at_vertices, RemeshOptions(strategy=strategy)))
    assert bool(asked) == by_sphere and topology(found.mesh.triangles) == topology(F)


def test_samples_go_by_measure_and_what_boundaries_have_taken_counts():
    """A chart whose boundary has more than its share gets none, and all together are as many as asked for."""
    V, F = meshes.grid(2, 2)
    chart = types.SimpleNamespace(
        vertices=np.column_stack([V[:, :2], 0 * V[:, 0]]), triangles=F, faces=np.zeros(len(F), int)
    )
    small = types.SimpleNamespace(**{**vars(chart), "vertices": 1e-3 * chart.vertices, "faces": chart.faces + 1})
    boundaries = [types.SimpleNamespace(samples=np.arange(k)) for k in (8, 8, 100)]
    for density in (np.array([1.0, 1.0]), np.array([2.0, 1.0])):
        counts = initial_mesh._inner_counts([chart, chart, small], boundaries, density, 50)
        assert counts.tolist() == [25, 25, 0]
    assert initial_mesh._inner_counts([chart, small], boundaries[:2], np.array([1.0, 1e6]), 40).tolist() == [20, 20]
    assert initial_mesh._inner_counts([chart, small], boundaries[:2], np.array([1.0, 3e6]), 40).tolist() == [8, 32]
    assert initial_mesh._inner_counts([chart], boundaries[:1], np.ones(1), 0).tolist() == [0]
    many = initial_mesh._inner_counts([chart, *[small] * 12], [boundaries[0], *[boundaries[2]] * 12], np.ones(2), 50)
    assert many.tolist() == [50] + [0] * 12


def test_only_the_first_strategy_may_be_replaced_and_only_where_its_mesh_is_relaxed():
    for strategy in STRATEGIES:
        for rounds in (0, 1, 2):
            options = RemeshOptions(strategy=strategy, rounds=rounds)
            assert options.any_mesh_will_do == (strategy == STRATEGIES[0] and rounds > 0)
