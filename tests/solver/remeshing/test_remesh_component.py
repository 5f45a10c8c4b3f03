"""One component remeshed: its count, its place on the surface, and lines that give way where the count asks for it."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.progress import drain
from omt_uv.solver.remeshing import RemeshOptions, RemeshSource
from omt_uv.solver.remeshing.remesh_component import remesh_component


@pytest.mark.parametrize("count", [60, 200])
def test_the_vertices_are_counted_and_lie_where_they_say(count):
    V, F = meshes.bumpy(10, 10)
    source = RemeshSource(V, F)
    (maps,) = source.maps
    found = drain(remesh_component(maps, count, np.ones(len(maps.component.triangles)), RemeshOptions()))
    assert len(found.points) == count
    np.testing.assert_allclose(found.barycentric.sum(axis=1), 1, atol=1e-9)
    # In the common unit box of the surface's own frame.
    corners = source.frame.vertices[source.frame.triangles[found.faces]]
    on = (np.einsum("kc,kcd->kd", found.barycentric, corners) - source.components.centre) / source.components.size
    edge = np.linalg.norm(found.points[found.triangles[:, 0]] - found.points[found.triangles[:, 1]], axis=1).mean()
    assert np.linalg.norm(on - found.points, axis=1).max() < 0.2 * edge
