"""Correspondences: a mesh on itself, its seams, and points that lie where they are said to lie."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.mesh.topology import pair_keys, twins
from omt_uv.solver.transfer import correspondence
from omt_uv.solver.transfer.correspondence import correspond

NO_SEAMS = np.zeros((0, 2), np.int64)


def on_itself(V, F, seams=NO_SEAMS):
    """The correspondence of a mesh with itself, every vertex in a corner of its first face."""
    first = np.unique(F.ravel(), return_index=True)[1]
    return correspond(V, F, seams, V, F, first // 3, np.eye(3)[first % 3])


def points(at, V, F):
    """Positions of the new corners (t,3,3) and of the new vertices (k,3) on the old mesh."""
    corners = np.einsum("tkc,tkcj->tkj", at.corner_weights, V[F[at.corner_triangle]])
    return corners, np.einsum("kc,kcj->kj", at.vertex_weights, V[F[at.vertex_triangle]])


MESHES = {"sphere": meshes.icosphere(2), "torus": meshes.torus(), "grid": meshes.grid(), "cube": meshes.cube()}


@pytest.mark.parametrize("name", MESHES)
def test_a_mesh_lies_on_itself(name):
    V, F = MESHES[name]
    V = np.column_stack([V, np.zeros(len(V))]) if V.shape[1] == 2 else V
    at = on_itself(V, F)
    np.testing.assert_array_equal(at.face_triangle, np.arange(len(F)))
    corners, vertices = points(at, V, F)
    np.testing.assert_allclose(corners, V[F], atol=1e-12)
    np.testing.assert_allclose(vertices, V, atol=1e-12)
    assert at.extended == 0 and not len(at.seams)


@pytest.mark.parametrize("name", ["sphere", "torus"])
def test_the_seams_of_a_mesh_on_itself_are_its_own(name):
    V, F = MESHES[name]
    # A closed path: the edges between the faces on both sides of a plane.
    side = V[F].mean(axis=1)[:, 2] > 0.1
    twin, h = twins(F), np.arange(3 * len(F))
    cut = h[side[h // 3] & ~side[twin[h] // 3]]
    seams = np.column_stack([F.ravel()[cut], F[:, [1, 2, 0]].ravel()[cut]])
    at = on_itself(V, F, seams)
    assert set(pair_keys(*at.seams.T)) == set(pair_keys(*seams.T))
    tail, head = F.ravel()[at.seam_origin], F[:, [1, 2, 0]].ravel()[at.seam_origin]
    np.testing.assert_array_equal(pair_keys(tail, head), pair_keys(*at.seams.T))
    # No corner is looked up across the seam.
    np.testing.assert_array_equal(side[at.corner_triangle], np.repeat(side[:, None], 3, axis=1))
    np.testing.assert_array_equal(at.face_triangle, np.arange(len(F)))
    assert at.extended == 0


@pytest.mark.parametrize("scale", [0.25, 1024.0])
def test_the_unit_of_length_does_not_count(scale):
    V, F = meshes.icosphere(3)
    W, G = meshes.icosphere(1)
    on = ClosestPoint(V, F, 0.2)(W, vertex_normals(W, G))
    found, scaled = (correspond(s * V, F, NO_SEAMS, s * W, G, on.faces, on.barycentric) for s in (1.0, scale))
    for name in ("face_triangle", "corner_triangle", "corner_weights", "vertex_triangle", "vertex_weights"):
        np.testing.assert_array_equal(getattr(found, name), getattr(scaled, name))


@pytest.mark.parametrize("offset", [0.0, 40.0])
def test_the_largest_triangle_of_each_polygon_leads_wherever_it_lies(offset):
    rng = np.random.default_rng(5)
    owner, corners = rng.integers(12, size=60), rng.random((60, 3, 3))
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    lead = correspondence._leading(owner, corners + [offset, -2 * offset, 0])
    np.testing.assert_array_equal(owner[lead], owner)
    np.testing.assert_array_equal(area[lead], [area[owner == k].max() for k in owner])
