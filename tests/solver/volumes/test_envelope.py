"""Broken surfaces are filled where fTetWild is installed, and refused by name where it is not."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from bodies import icosphere

from omt_uv.solver.errors import LibraryError, NonFiniteError, TetrahedraError
from omt_uv.solver.progress import drain
from omt_uv.solver.volumes import envelope
from omt_uv.solver.volumes.body_map import volume_map
from omt_uv.solver.volumes.envelope import filled
from omt_uv.solver.volumes.tet_mesh import tet_volumes


def tetrahedron(points, _triangles, _edge):
    """What fTetWild would make: a point in the middle of the box around, and its corners."""
    corner = np.stack(np.meshgrid(*zip(points.min(axis=0), points.max(axis=0), strict=True)), axis=-1).reshape(-1, 3)
    from scipy.spatial import ConvexHull

    p = np.concatenate([corner.mean(axis=0, keepdims=True), corner])
    hull = ConvexHull(p)
    tets = np.column_stack([np.zeros(len(hull.simplices), int), hull.simplices])
    return p, np.where((tet_volumes(p, tets) < 0)[:, None], tets[:, [0, 2, 1, 3]], tets)


def test_the_boundary_of_what_is_filled_comes_first_and_looks_outwards(monkeypatch):
    monkeypatch.setattr(envelope, "_tetwild", tetrahedron)
    V, F = icosphere(2)
    body = filled(7 * V + [40, -30, 5], F[12:], 50)
    assert len(body.vertices) == 8 and body.triangles.max() == 7
    np.testing.assert_array_equal(body.mesh.points[:8], body.vertices)
    assert (tet_volumes(body.mesh.points, body.mesh.tets) > 0).all()
    p = body.vertices[body.triangles]
    volume = np.einsum("ij,ij->", p[:, 0] - [40, -30, 5], np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])) / 6
    assert volume == pytest.approx(tet_volumes(body.mesh.points, body.mesh.tets).sum())
    found = drain(volume_map(body.vertices, body.triangles, mesh=body.mesh, held=True))
    np.testing.assert_allclose(found.points, body.mesh.points, atol=1e-9)


def test_what_cannot_be_filled_is_named(monkeypatch):
    V, F = icosphere(1)
    monkeypatch.setitem(sys.modules, "pytetwild", None)
    with pytest.raises(LibraryError, match="pip install pytetwild"):
        filled(V, F)
    with pytest.raises(NonFiniteError, match="Coordinates are not finite numbers"):
        filled(np.where(np.arange(len(V))[:, None] == 3, np.nan, V), F)
    nothing = np.zeros((0, 3)), np.zeros((0, 4), int)
    monkeypatch.setattr(envelope, "_tetwild", lambda *_: nothing)
    with pytest.raises(TetrahedraError, match="nothing"):
        filled(V, F)


def test_an_open_body_and_two_that_cross_are_mapped():
    pytest.importorskip("pytetwild", reason="fTetWild is optional: python -m pip install pytetwild pyvista")
    V, F = icosphere(2)
    two = np.concatenate([V, V + [1, 0.1, 0.05]]), np.concatenate([F, F + len(V)])
    for v, f, volume in ((V, F[12:], 4.05), (*two, 6.9)):
        body = filled(v, f, 1500)
        assert tet_volumes(body.mesh.points, body.mesh.tets).sum() == pytest.approx(volume, rel=0.06)
        found = drain(volume_map(body.vertices, body.triangles, mesh=body.mesh, held=False))
        assert found.inverted == 0 and found.shares < 0.05
