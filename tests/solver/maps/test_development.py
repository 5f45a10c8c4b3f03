"""Flat surfaces developed triangle by triangle."""

import hard_meshes
import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.development import developed, unrolled
from omt_uv.solver.mesh.geometry import halfedge_lengths
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.refinement.initial_maps import unroll


def test_edges_of_a_developable_surface_keep_their_lengths():
    V, F = meshes.bumpy(20, 6)
    V[:, 2] = 0.3 * np.sin(7 * V[:, 0])
    both = np.concatenate([V, V[:, [1, 2, 0]] + 5]), np.concatenate([F, F + len(V)])
    w, gap = developed(*both)
    assert gap.max() < 1e-13
    flat = np.column_stack([w.real, w.imag, 0 * w.real])
    np.testing.assert_allclose(halfedge_lengths(flat, both[1]), halfedge_lengths(*both), rtol=1e-12)


def test_triangles_of_a_curved_surface_disagree():
    V, F = meshes.bumpy(12, 12)
    assert developed(V, F)[1].max() > 1e-3


def test_a_strip_is_developed_exactly_however_long():
    V, quads = hard_meshes.strip(50_000)
    # Wound into a helix, whose ends no system of equations would bring together.
    angle = V[:, 0] / 40
    helix = np.column_stack([40 * np.cos(angle), 40 * np.sin(angle), V[:, 1] + 0 * angle])
    F = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    w, gap = developed(helix, F)
    chord = np.linalg.norm(helix[1] - helix[0])
    assert gap.max() < 1e-12 * 50_000
    np.testing.assert_allclose(np.abs(w[50_000] - w[0]), 50_000 * chord, rtol=1e-12)


def test_a_long_strip_is_unrolled():
    V, quads = hard_meshes.strip(4000)
    F = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    uv = unroll(V / 4000, F, boundary_loops(F)[0])
    length = halfedge_lengths(V, F) / 4000
    np.testing.assert_allclose(halfedge_lengths(np.column_stack([uv, 0 * uv[:, 0]]), F), length, rtol=1e-8)


def test_what_curves_in_small_patches_disagrees_there_alone_where_the_tree_crosses_long_edges():
    """Three sides of a box that bevels join, slit along one of these to the small triangle at the corner."""
    b = 0.02
    side = np.array([[b, b, 0], [1, b, 0], [1, 1, 0], [b, 1, 0]])
    V = np.concatenate([np.roll(side, k, axis=1) for k in range(3)])
    faces = [[4 * k + np.array(t) for t in ((0, 1, 2), (0, 2, 3))] for k in range(3)]
    for one, other in ((0, 1), (1, 2)):
        # The last edge of the one and the first of the other lie beside one another.
        a, d, c, e = 4 * one, 4 * one + 3, 4 * other, 4 * other + 1
        faces.append([np.array([a, d, e]), np.array([a, e, c])])
    faces.append([np.array([0, 4, 8])])
    F = np.array([t for some in faces for t in some])
    _, gap = developed(V, F, across_long=True)
    corner = np.isin(np.arange(len(V)), [0, 4, 8])
    assert gap[corner].max() > 1e-4 and gap[~corner].max() < 1e-12


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_a_disk_without_curvature_is_unrolled_whatever_its_size(scale):
    V, F = meshes.bumpy(20, 6)
    V[:, 2] = 0.3 * np.sin(7 * V[:, 0])
    uv = unrolled(scale * V, F)
    assert uv is not None and uv.shape == (len(V), 2)
    flat = np.column_stack([uv, np.zeros(len(V))])
    np.testing.assert_allclose(halfedge_lengths(flat, F), scale * halfedge_lengths(V, F), rtol=1e-9)
    assert unrolled(scale * meshes.bumpy(12, 12)[0], meshes.bumpy(12, 12)[1]) is None
