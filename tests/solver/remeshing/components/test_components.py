"""Components keep the surface: its areas, its features, and where every triangle lies in the input."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.errors import OrientationError
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import pair_keys
from omt_uv.solver.remeshing.components.components import split_components

NONE = np.zeros((0, 2), np.int64)


@pytest.mark.parametrize("name, kind", [("icosphere", "sphere"), ("torus", None), ("bumpy", "disk"), ("annulus", None)])
def test_areas_and_positions_are_the_inputs(name, kind):
    V, F = getattr(meshes, name)()
    V = 7 * V + [100, 0, 0]
    found = split_components(V, F, NONE)
    (component,) = found.components
    assert np.ptp(component.vertices, axis=0).max() == pytest.approx(1)
    np.testing.assert_allclose(component.area * found.size**2, face_areas(V, F)[component.faces], rtol=1e-9)
    places = np.einsum("mkc,mcj->mkj", component.input_barycentric, V[F[component.faces]])
    corners = component.vertices[component.triangles] * found.size + found.centre
    np.testing.assert_allclose(corners, places, atol=1e-12 * 100)
    assert (component.is_sphere, component.is_disk) == (kind == "sphere", kind == "disk")


def test_turned_faces_are_turned_over_and_told():
    V, F = meshes.icosphere(1)
    F[::5] = F[::5, ::-1]
    found = split_components(V, F, NONE)
    assert (
        len(found.components) == 1
        and found.components[0].euler == 2
        and any("turned over" in w for w in found.warnings)
    )


def test_features_are_pairs_of_the_components_vertices():
    V, F = meshes.grid(3, 3)
    E = np.array([[5, 6], [6, 10]])
    (component,) = split_components(V, F, E).components
    at = {
        tuple(np.round(p, 9))
        for p in component.vertices[component.features].reshape(-1, 3) - component.vertices.min(axis=0)
    }
    assert at == {tuple(np.round(p, 9)) for p in V[np.unique(E)]} and component.has_lines
    assert len(np.unique(pair_keys(*component.features.T))) == 2


def test_one_sided_surfaces_are_refused():
    ring = np.arange(6)
    V = np.column_stack([np.cos(ring), np.sin(ring), ring / 7])
    # The least Moebius strip: five triangles on five vertices.
    F = np.array([[0, 1, 2], [1, 2, 3], [2, 3, 4], [3, 4, 0], [4, 0, 1]])
    with pytest.raises(OrientationError, match="A part of the mesh has only one side, like a"):
        split_components(V[:5], F, NONE)
