"""Embeddings in a disk and a rectangle: no folds, the boundary where it shall be, and room for every triangle."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.canonical.embeddings import evened_sites, mean_value_sites
from omt_uv.solver.conformal.disk_map import sharpest_corners
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.maps.energy import elements, energy
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.transport.convex_domain import Disk, Rectangle


def given(mesh, domain):
    V, F = mesh
    loop = boundary_loops(F)[0]
    corners = sharpest_corners(V, F, loop) if isinstance(domain, Rectangle) else None
    return elements(V, F, face_areas(V, F)), V, F, (loop, corners, domain)


def has(faces, uv):
    w = uv @ [1, 1j]
    return energy(faces, w * np.sqrt(faces.area.sum() / faces.areas(w).sum()), 30.0)


@pytest.mark.parametrize("domain", [Disk(), Rectangle()])
@pytest.mark.parametrize("mesh", [meshes.head(24), meshes.cone(), meshes.bumpy()])
def test_evened_embeddings_leave_less_to_do_and_fold_nothing(mesh, domain):
    faces, V, F, outline = given(mesh, domain)
    loop, corners, _ = outline
    uv = evened_sites(faces, V, outline, 30.0, np.inf)
    assert (signed_areas(uv, F) > 0).all()
    plain = mean_value_sites(V, F, *outline)
    if (signed_areas(plain, F) > 0).all():
        assert has(faces, uv) <= has(faces, plain) * (1 + 1e-6)
        np.testing.assert_allclose(uv[loop], plain[loop], atol=1e-12)
    if corners is not None:
        np.testing.assert_allclose(np.abs(uv[corners]), 0.5, atol=1e-12)


def eared():
    """A flat square with one triangle more, of two boundary edges, in the middle of its lower side."""
    V, F = meshes.grid(6, 6)
    ear = np.array([[2, len(V), 3]])
    return np.concatenate([V, [[(V[2, 0] + V[3, 0]) / 2, -0.1, 0]]]), np.concatenate([F, ear])


def test_a_vertex_leaves_a_side_where_a_face_would_lie_along_it():
    V, F = eared()
    outline = (boundary_loops(F)[0], np.array([0, 6, 48, 42]), Rectangle())
    assert signed_areas(mean_value_sites(V, F, *outline), F).min() < 1e-9
    uv = evened_sites(elements(V, F, face_areas(V, F)), V, outline, 30.0, np.inf)
    assert (signed_areas(uv, F) > 1e-9).all()


def test_an_edge_between_two_corners_is_refused():
    V, F = eared()
    outline = (boundary_loops(F)[0], np.array([2, 3, 48, 42]), Rectangle())
    with pytest.raises(FoldedUVError, match="joined by an edge"):
        evened_sites(elements(V, F, face_areas(V, F)), V, outline, 30.0, np.inf)


def test_what_has_no_room_is_none():
    faces, V, _, outline = given(meshes.spiral_strip(), Disk())
    assert evened_sites(faces, V, outline, 30.0, 9.0) is None
