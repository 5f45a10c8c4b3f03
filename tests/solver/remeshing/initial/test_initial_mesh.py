"""First meshes have the topology of their component by every way, and no fewer vertices than there are to be."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from mesh_checks import topology

from omt_uv.solver.mesh.topology import halfedges, pair_keys
from omt_uv.solver.progress import drain
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
