"""A mesh in the making keeps through an edit what must not change."""

from __future__ import annotations

import meshes
import numpy as np

from omt_uv.solver.remeshing.edits.split_collapse import interior_edges, split_edges
from omt_uv.solver.remeshing.edits.vertex_count import after_edit
from omt_uv.solver.remeshing.edits.working_mesh import WorkingMesh


def test_new_vertices_are_free_and_old_ones_as_before():
    V, F = meshes.grid(4, 4)
    mesh = WorkingMesh(V, F, np.arange(len(V)) < 9, np.zeros(0, np.int64), delaunay=False)
    h = interior_edges(F, mesh.locked)[:1]
    found = after_edit(mesh, edit := split_edges(V, F, h))
    np.testing.assert_array_equal(found.fixed, np.append(mesh.fixed, False))
    np.testing.assert_array_equal(found.triangles, edit.triangles)
    assert found.locked is mesh.locked and not found.delaunay and mesh.delaunay is False
