"""Surfaces with handles, cut alike: matched chart by chart, the same from both sides of a seam, near the truth."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import bumpy, torus
from sphere_shapes import random_rotation

from omt_uv.solver.errors import LandmarkError, TopologyMismatchError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import on_boundary, twins
from omt_uv.solver.progress import drain
from omt_uv.solver.registration import RegistrationOptions, vertex_landmarks
from omt_uv.solver.registration.charts import register_charts
from omt_uv.solver.registration.charts.chart_maps import _at_vertices, without_chords
from omt_uv.solver.registration.charts.seam_arcs import corresponding_arcs, seam_arcs
from omt_uv.solver.registration.landmarks import split_at


def cut_torus(major, minor, meridians=(0.0, 0.5)):
    """A torus with one long seam and some short ones, and the parameters (n,2) of its vertices."""
    V, F = torus(major, minor)
    V = V * [1.3, 1.0, 1.0]
    i, j = np.arange(major), np.arange(minor)
    seams = [np.column_stack([i * minor, (i + 1) % major * minor])]
    seams += [int(at * major) * minor + np.column_stack([j, (j + 1) % minor]) for at in meridians]
    u, v = np.divmod(np.arange(len(V)), minor)
    return V, F, np.concatenate(seams), np.column_stack([u / major, v / minor])


def placed(at):
    """Positions (n,3) of parameters (n,2)."""
    u, v = 2 * np.pi * at.T
    return np.column_stack(
        [(1 + 0.4 * np.cos(v)) * np.cos(u) * 1.3, (1 + 0.4 * np.cos(v)) * np.sin(u), 0.4 * np.sin(v)]
    )


@pytest.fixture(scope="module")
def tori():
    return cut_torus(24, 12), cut_torus(36, 16)


@pytest.fixture(scope="module")
def matched(tori):
    (V, F, seams, _), (W, G, others, _) = tori
    landmarks = vertex_landmarks((np.array([4 * 12 + 6, 18 * 12 + 3]), F), (np.array([6 * 16 + 8, 27 * 16 + 4]), G))
    return drain(register_charts((V, F, seams), (3 * W + 1, G, others), landmarks))


def test_a_surface_with_a_handle_is_matched(tori, matched):
    (_, _, _, at), (W, G, _, _) = tori
    off = np.linalg.norm(matched.forward.positions(W, G) - placed(at), axis=1)
    assert off.max() < 0.1 and off.mean() < 0.03
    assert matched.flipped == 0 and matched.met.all() and matched.domain == "charts"
    assert matched.stretches.shape == (len(tori[0][1]), 2) and (matched.stretches > 0).all()


def test_seams_go_onto_seams_and_back(tori, matched):
    (V, F, seams, _), (W, G, others, _) = tori
    there, back = matched.forward.positions(W, G), matched.backward.positions(V, F)
    begin, way = W[others[:, 0]], W[others[:, 1]] - W[others[:, 0]]
    off = there[np.unique(seams)][:, None] - begin
    along = np.clip((off * way).sum(axis=2) / (way**2).sum(axis=1), 0, 1)
    assert np.linalg.norm(off - along[..., None] * way, axis=2).min(axis=1).max() < 1e-9
    again = np.einsum("nc,ncd->nd", matched.forward.barycentric, back[G[matched.forward.faces]])
    assert np.linalg.norm(again - V, axis=1).mean() < 0.03
    assert np.allclose(back[0], V[0]) and np.allclose(there[0], W[0])


def test_what_is_not_cut_alike_is_named(tori):
    (V, F, seams, _), _ = tori
    W, G, others, _ = cut_torus(24, 12, (0.0, 0.25, 0.5))
    with pytest.raises(TopologyMismatchError, match="into 2 charts with 8 sides, the target into 3 with 12"):
        drain(register_charts((V, F, seams), (W, G, others)))
    with pytest.raises(TopologyMismatchError, match="without a corner"):
        drain(register_charts((*bumpy(4, 4), seams[:0]), (W, G, others)))
    far = vertex_landmarks((np.array([4 * 12 + 6]), F), (np.array([18 * 12 + 6]), F))
    with pytest.raises(LandmarkError, match="do not correspond"):
        drain(register_charts((V, F, seams), (V, F, seams), far))


def test_arcs_of_a_surface_are_its_own(tori):
    V, F, seams, _ = tori[0]
    arcs = seam_arcs(strict_charts(triangle_surface(V, F, seams)), np.zeros(0, np.int64), "source")
    assert len(arcs.paths) == 8 and (arcs.other[arcs.other] == np.arange(8)).all()
    assert (corresponding_arcs(arcs, arcs, np.zeros((0, 2), np.int64)) == np.arange(8)).all()


def test_no_edge_within_a_disk_ends_twice_on_its_boundary():
    V, F = bumpy(2, 2)
    none = np.zeros(0, np.int64)
    split = without_chords(split_at(V, F, none, np.zeros((0, 3))))
    tail, head = split.triangles.ravel(), split.triangles[:, [1, 2, 0]].ravel()
    outer = on_boundary(split.triangles, len(split.vertices))
    assert not (outer[tail] & outer[head] & (twins(split.triangles) >= 0)).any()
    corners = np.einsum("mkc,mcd->mkd", split.corners, V[F[split.parent]])
    assert np.allclose(corners, split.vertices[split.triangles])


def test_options_are_those_of_every_match(tori):
    (V, F, seams, _), _ = tori
    W, G = V * [-1, 1, 1], F[:, [0, 2, 1]]
    found = drain(register_charts((V, F, seams), (W, G, seams), None, RegistrationOptions("charts", mirrored=True)))
    assert np.linalg.norm(found.forward.positions(W, G) - W, axis=1).max() < 0.05
    # And back onto the source as it was given.
    assert np.linalg.norm(found.backward.positions(V, F) - V, axis=1).max() < 0.05


def test_points_at_vertices_are_those_all_of_whose_weight_is_at_one():
    triangles = np.array([[4, 7, 9], [7, 4, 2]])
    barycentric = np.array(
        [[1, 0, 0], [0, 1, 0], [0, 0, 1 - 1e-12], [0.5, 0.5, 0], [0.2, 0.3, 0.5], [0, 1 - 1e-6, 1e-6]]
    )
    faces = np.array([0, 1, 1, 0, 1, 0])
    np.testing.assert_array_equal(_at_vertices(triangles, faces, barycentric), [4, 4, 2, -1, -1, -1])
    none = _at_vertices(triangles, np.zeros(0, np.int64), np.zeros((0, 3)))
    assert none.shape == (0,)


def test_where_the_source_stands_does_not_count_with_landmarks_that_turn_it(tori):
    (V, F, seams, at), (W, G, others, _) = tori
    here = np.array([4 * 12 + 6, 18 * 12 + 3, 9 * 12 + 9])
    landmarks = vertex_landmarks((here, F), (np.array([6 * 16 + 8, 27 * 16 + 4, 13 * 16 + 12]), G))
    turned = 0.2 * V @ random_rotation(3).T + [7, -30, 2]
    found = drain(register_charts((turned, F, seams), (W + [5, -3, 8], G, others), landmarks))
    off = np.linalg.norm(found.forward.positions(W, G) - placed(at), axis=1)
    assert found.met.all() and found.flipped == 0 and off.max() < 0.2 and off.mean() < 0.05


def test_landmarks_that_are_no_corners_tell_how_far_they_are_off(tori):
    """In shares of the greatest extent of the target; within charts they are met."""
    (V, F, seams, _), (W, G, others, _) = tori
    here = np.array([4 * 12 + 6, 18 * 12 + 3, 9 * 12 + 9, 15 * 12 + 8, 2 * 12 + 2])
    there = np.array([6 * 16 + 8, 27 * 16 + 4, 13 * 16 + 12, 22 * 16 + 11, 3 * 16 + 3])
    found = drain(register_charts((V, F, seams), (W, G, others), vertex_landmarks((here, F), (there, G))))
    off = np.linalg.norm(found.forward.positions(W, G)[here] - W[there], axis=1) / np.ptp(W, axis=0).max()
    assert found.residuals.shape == (5,) and found.residuals == pytest.approx(off, abs=1e-9)
    assert found.met.all()
