"""Parts of a match against plain ways: nearest rows, peaks walked to, walks unfolded, fields of kernels."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from scipy.linalg import eigh
from sphere_shapes import blob

from omt_uv.solver.errors import HandednessError
from omt_uv.solver.mesh.geometry import cotangent_laplacian, vertex_areas
from omt_uv.solver.registration import functional_maps, landmark_flow, suggestions
from omt_uv.solver.registration.alignment import MoebiusMap, moebius_of_pairs
from omt_uv.solver.registration.landmarks import Landmarks, check_handedness
from omt_uv.solver.registration.straight_walks import StraightWalks, _within


def test_nearest_rows_are_those_of_least_distance(monkeypatch):
    rng = np.random.default_rng(0)
    points, others = rng.normal(size=(40, 6)), rng.normal(size=(23, 6))
    expected = ((points[:, None] - others) ** 2).sum(axis=2).argmin(axis=1)
    for chunk in (7, 250):
        monkeypatch.setattr(functional_maps, "CHUNK", chunk)
        np.testing.assert_array_equal(functional_maps._nearest(points, others), expected)


def test_eigenfunctions_are_those_of_the_dense_problem():
    V, F = blob(2)
    count, area = 12, vertex_areas(V, F)
    found = functional_maps.eigenfunctions(V, F, count)
    L = cotangent_laplacian(V, F).toarray()
    value, vector = eigh(L, np.diag(area))
    np.testing.assert_allclose(np.einsum("nk,nk->k", found, L @ found) / area.sum(), value[:count] / 1, atol=1e-3)
    # Of mean square 1, and the same spans wherever values part.
    np.testing.assert_allclose(area @ found**2 / area.sum(), 1, atol=1e-6)
    for k in range(1, count + 1):
        if k == len(value) or value[k] - value[k - 1] > 1e-3:
            span = np.sqrt(area.sum()) * vector[:, :k]
            left = found[:, k - 1] - span @ (span.T @ (area * found[:, k - 1])) / area.sum()
            assert np.sqrt(area @ left**2 / area.sum()) < 1e-3
    assert functional_maps.eigenfunctions(V, F, 10**6).shape[1] == len(V) // 2


def test_descriptors_have_mean_nothing_and_spread_one():
    V, F = blob(3)
    found, area = functional_maps.descriptors(V, F), vertex_areas(V, F)
    assert found.shape == (len(V), 4) and np.abs(found).max() <= 3.0
    inside = np.abs(found).max(axis=0) < 3.0
    assert inside.any()
    mean, square = area @ found[:, inside] / area.sum(), area @ found[:, inside] ** 2 / area.sum()
    np.testing.assert_allclose(mean, 0, atol=1e-9)
    np.testing.assert_allclose(square, 1, atol=1e-9)


def test_correspondences_follow_landmarks_and_functions():
    """Of rows in another order, with signs and a mixing of the functions: found again from a start that is half
    wrong."""
    rng = np.random.default_rng(0)
    source = rng.normal(size=(60, 12 + 4))
    order = rng.permutation(60)
    mixing = np.linalg.qr(rng.normal(size=(12,) * 2))[0]
    target = source[order].copy()
    target[:, :12] = target[:, :12] @ mixing
    truth = np.argsort(order)
    start = np.where(rng.random(60) < 0.3, rng.integers(0, 60, 60), truth)
    found = functional_maps.refined_correspondence(source, target, start, (source[:5], target[truth[:5]]))
    assert (found == truth).mean() > 0.9


def test_peaks_are_highest_around_and_apart():
    V, F = blob(3)
    value = V @ [0.3, 0.5, 0.8] + 0.3 * np.sin(7 * V[:, 0])
    found = suggestions._peaks(value, V, F)
    expected = []
    for v in np.argsort(-value):
        around = F[(v == F).any(axis=1)]
        near = any(np.linalg.norm(V[v] - V[w]) <= 0.05 for w in expected)
        if value[v] > 0 and value[v] >= value[around].max() and not near:
            expected.append(v)
    assert found.tolist() == expected[:40] and len(found) > 1


def test_suggestions_are_each_others_best():
    one, other = blob(3), blob(3, seed=1)
    found = suggestions.suggest_landmarks(one, other, 5)
    (a, first), (b, second) = (suggestions._described(*mesh) for mesh in (one, other))
    away = ((first[:, None] - second) ** 2).sum(axis=2)
    pairs = [(away[i, j], a[i], b[j]) for i in range(len(a)) for j in range(len(b))
             if away[i, j] == away[i].min() == away[:, j].min() < 4.0]  # fmt: skip
    expected = sorted(pairs)[:5]
    assert list(zip(found.source, found.target, strict=True)) == [pair[1:] for pair in expected]
    assert found.difference.tolist() == pytest.approx([pair[0] for pair in expected])


def test_steps_are_turned_into_planes_at_their_length():
    rng = np.random.default_rng(0)
    normal = rng.normal(size=(20, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    step = rng.normal(size=(20, 3))
    found = _within(step, normal)
    np.testing.assert_allclose(np.einsum("kd,kd->k", found, normal), 0, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), np.linalg.norm(step, axis=1))
    assert (np.einsum("kd,kd->k", found, step - np.einsum("kd,kd->k", step, normal)[:, None] * normal) > 0).all()


def test_walks_in_a_plane_are_straight_and_end_at_its_boundary():
    V, F = meshes.random_disk(150, height=0.0)
    V = np.column_stack([V[:, :2], np.zeros(len(V))])
    walks = StraightWalks(V, F)
    rng = np.random.default_rng(0)
    faces, bary = rng.integers(0, len(F), 100), rng.dirichlet([1, 1, 1], 100)
    step = np.column_stack([0.5 * rng.normal(size=(100, 2)), np.zeros(100)])
    begin = np.einsum("kc,kcd->kd", bary, V[F[faces]])
    end_faces, end_bary = walks(faces, bary, step)
    end = np.einsum("kc,kcd->kd", end_bary, V[F[end_faces]])
    gone = np.einsum("kd,kd->k", end - begin, step) / np.einsum("kd,kd->k", step, step)
    np.testing.assert_allclose(end - begin, gone[:, None] * step, atol=1e-8)
    assert (gone <= 1 + 1e-8).all() and (gone > 0.999).any()
    # What ended sooner is on a side that has no other triangle.
    short = gone < 1 - 1e-6
    assert short.any()
    for f, b in zip(end_faces[short], end_bary[short], strict=True):
        k = int(b.argmin())
        assert b[k] < 1e-9 and walks.twin[3 * f + (k + 1) % 3] < 0


@pytest.mark.parametrize("count", [1, 2, 6])
def test_fields_take_landmarks_where_they_go_and_fade(count):
    rng = np.random.default_rng(0)
    positions = rng.normal(size=(40, 3))
    positions /= np.linalg.norm(positions, axis=1, keepdims=True)
    vertices, move = np.arange(count) * 5, rng.normal(size=(count, 3))
    found = landmark_flow._field(positions, vertices, move)
    np.testing.assert_allclose(found[vertices], move, atol=1e-6)
    at = positions[vertices]
    away = np.linalg.norm(at[:, None] - at, axis=2) + np.diag(np.full(count, np.inf))
    width = min(1.0 * away.min(axis=1).mean(), 1.0) if count > 1 else 1.0
    kernel = np.exp(-((np.linalg.norm(at[:, None] - at, axis=2) / width) ** 2)) + 1e-8 * np.eye(count)
    factor = np.linalg.solve(kernel, move)
    expected = np.exp(-((np.linalg.norm(positions[:, None] - at, axis=2) / width) ** 2)) @ factor
    np.testing.assert_allclose(found, expected, atol=1e-9)


@pytest.mark.parametrize("mirrored", [False, True])
def test_moebius_maps_keep_the_circle_and_cross_ratios(mirrored):
    """And take their centre to 0, and what lies inside to inside."""
    rng = np.random.default_rng(0)
    moved = MoebiusMap(0.4 - 0.5j, complex(np.exp(0.7j)), mirrored)
    circle, inside = (r * np.exp(2j * np.pi * rng.random(40)) for r in (1.0, rng.random(40)))
    np.testing.assert_allclose(np.abs(moved(circle)), 1, atol=1e-12)
    assert (np.abs(moved(inside)) < 1).all()
    assert abs(moved(np.array([0.4 + 0.5j if mirrored else 0.4 - 0.5j]))[0]) < 1e-12

    def ratio(z):
        return (z[0] - z[2]) * (z[1] - z[3]) / ((z[1] - z[2]) * (z[0] - z[3]))

    before = ratio(inside)
    assert ratio(moved(inside)) == pytest.approx(before.conjugate() if mirrored else before)
    pairs = moebius_of_pairs(inside[:6], moved(inside[:6]), mirrored)
    np.testing.assert_allclose(pairs(inside), moved(inside), atol=1e-3)


@pytest.mark.parametrize("closed", [True, False])
def test_peaks_are_vertices_above_all_neighbours_and_apart(closed):
    V, F = blob(2, seed=3) if closed else meshes.bumpy(9, 9)
    value = np.random.default_rng(4).uniform(0, 1, len(V))
    found = suggestions._peaks(value, 10 * V, F)
    around = [set(F[(v == F).any(axis=1)].ravel()) - {v} for v in range(len(V))]
    tops = {v for v in range(len(V)) if all(value[v] >= value[u] for u in around[v])}
    assert set(found.tolist()) <= tops and len(found) == min(len(tops), 40)
    assert (np.diff(value[found]) <= 0).all() and found[0] == value.argmax()
    # Near one another, the higher one stays.
    near = suggestions._peaks(value, 1e-6 * V, F)
    assert near.tolist() == [value.argmax()]
    assert not len(suggestions._peaks(0 * value, V, F))


@pytest.mark.parametrize("count", [2, 3, 4, 7])
def test_mirrored_landmarks_are_refused_from_three_pairs_on(count):
    rng = np.random.default_rng(count)
    points = rng.normal(size=(count, 3))
    points[:3] = np.eye(3)[: min(count, 3)]
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    row = np.zeros(count, int)
    marks = Landmarks(row, np.eye(3)[row], row, np.eye(3)[row])
    check_handedness(marks, points, points @ np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0.0]]))
    if count == 2:
        # Two pairs fit either way.
        check_handedness(marks, points, points * [-1, 1, 1])
    else:
        with pytest.raises(HandednessError):
            check_handedness(marks, points, points * [-1, 1, 1])
