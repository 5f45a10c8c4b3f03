"""Whether a layout is one to one: exactly, and as the samples say where it is not."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from omt_uv.solver.maps import boxes, embedding
from omt_uv.solver.maps.embedding import check_layout
from omt_uv.solver.maps.overlap import overlap_share


def grid(n):
    """Positions ((n+1)^2,2) of a square of n x n quads, and its triangles."""
    y, x = np.mgrid[0 : n + 1, 0 : n + 1]
    corner = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    quads = np.stack([corner, corner + 1, corner + n + 2, corner + n + 1], 1)
    F = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    return np.stack([x, y], -1).reshape(-1, 2) / n, F


def never(*_, **__):
    raise AssertionError("samples were drawn although the map is one to one")


def turned(uv, angle):
    c, s = np.cos(angle), np.sin(angle)
    return uv @ np.array([[c, s], [-s, c]])


@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("mirrored", [False, True])
def test_maps_that_are_one_to_one_need_no_samples(monkeypatch, angle, mirrored):
    P, F = grid(12)
    monkeypatch.setattr("omt_uv.solver.maps.embedding.overlap_share", never)
    P = turned(P * [-1 if mirrored else 1, 1], angle)
    annulus = np.exp((0.1 + P[:, :1]) * [[1]]) * np.column_stack([np.cos(5 * P[:, 1]), np.sin(5 * P[:, 1])])
    for uv in (P, annulus):
        found = check_layout(F, uv.astype(np.float32)[F])
        assert found.overlap == 0 and not found.folded.any()


def test_a_hole_with_an_island_in_it_is_one_to_one(monkeypatch):
    P, F = grid(9)
    middle = np.abs(P[F].mean(1) - 0.5).max(1)
    ring, inner = F[middle > 1 / 6], F[middle < 1 / 6]
    monkeypatch.setattr("omt_uv.solver.maps.embedding.overlap_share", never)
    uv = np.concatenate([P[ring], 0.5 + 0.8 * (P[inner] - 0.5)])
    assert check_layout(np.concatenate([ring, inner + len(P)]), uv).overlap == 0


@pytest.mark.parametrize("shift, share", [((0.0, 0.0), 1.0), ((0.2, 0.3), 0.56), ((0.5, 0.0), 0.5), ((1.0, 0.0), 0.0)])
def test_islands_over_one_another_by_their_share(shift, share):
    """Also where outlines lie on one another, so that no edges cross; islands side by side touch and do not overlap."""
    P, F = grid(4)
    F, uv = np.concatenate([F, F + len(P)]), np.concatenate([P[F], P[F] + shift])
    found = check_layout(F, uv)
    assert found.overlap == pytest.approx(share, abs=0.01) and not found.folded.any()
    assert check_layout(F, uv, apart=True).overlap == 0


def test_an_island_inside_another_is_found():
    P, F = grid(6)
    uv = np.concatenate([P[F], 0.45 + 0.1 * P[F]])
    assert check_layout(np.concatenate([F, F + len(P)]), uv).overlap == pytest.approx(0.02 / 1.01, rel=0.1)


def test_a_strip_that_goes_around_twice_and_a_vertex_with_two_turns_are_found():
    P, F = grid(40)
    angle = 4 * np.pi * P[:, 0]
    spiral = (1 + 0.2 * P[:, 1:]) * np.column_stack([np.cos(angle), np.sin(angle)])
    assert check_layout(F, spiral[F]).overlap > 0.9
    wheel = np.array([[0, k, k % 8 + 1] for k in range(1, 9)])
    angle = np.pi / 2 * np.arange(8)
    twice = np.concatenate(
        [[[0, 0]], np.column_stack([np.cos(angle), np.sin(angle)]) * (1 + np.arange(8)[:, None] / 20)]
    )
    assert check_layout(wheel, twice[wheel]).overlap > 0.5


@pytest.mark.parametrize("seed", range(2))
def test_random_maps_agree_with_samples(seed):
    """A smooth random warp, from gentle to wild: exactly 0 where samples say so, and never where they do not."""
    rng = np.random.default_rng(seed)
    P, F = grid(25)
    for strength in (0.1, 0.4, 1.0):
        uv = P + strength * sum(
            np.outer(np.sin(P @ rng.normal(size=2) * 4 + rng.random()), rng.normal(size=2)) / 3 for _ in range(3)
        )
        uv = uv.astype(np.float32)[F]
        e, f = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        area = e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0]
        found, sampled = check_layout(F, uv), overlap_share(uv)
        assert found.overlap == sampled or (found.overlap == 0 and sampled < 1e-4)
        assert found.folded.sum() == min((area <= 0).sum(), (area >= 0).sum()) or abs(area.sum()) < 1e-3


def test_folds_are_counted_chart_by_chart():
    """A mirrored chart has none; a triangle over its neighbour and one without area are folded."""
    P, F = grid(5)
    uv = np.concatenate([P[F], P[F] * [-1, 1] - [0.5, 0]])
    assert not check_layout(np.concatenate([F, F + len(P)]), uv).folded.any()
    P[7] = P[13]
    found = check_layout(F, P[F])
    e, f = P[F][:, 1] - P[F][:, 0], P[F][:, 2] - P[F][:, 0]
    assert (found.folded == (e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0] <= 0)).all() and found.folded.any()


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_uvs_that_are_no_numbers_are_folds(value):
    P, F = grid(5)
    uv = P[F]
    uv[[3, 7], 1] = value
    assert np.flatnonzero(check_layout(F, uv).folded).tolist() == [3, 7]


@pytest.mark.parametrize("far", [2**8, 2**16, 2**20, 9_000_000])
def test_corners_of_one_vertex_are_one_where_their_uvs_are_and_nowhere_else(far):
    """Also where what is to the right of one by a little lies below it by a lot, as one number of both may weld."""
    steps = np.array([[0, far], [1, 0], [0, 0], [2, 0], [1, far], [0, 10**7], [10**7, 0]]) * embedding.WELD
    rng = np.random.default_rng(far)
    F = rng.integers(0, 5, (60, 3))
    uv = steps[rng.integers(0, len(steps), (60, 3))]
    uv[0], uv[1] = steps[[5, 6, 2]], steps[[0, 1, 2]]
    F[1] = 0
    found = embedding._uv_vertices(F, uv).ravel()
    place = np.round(uv.reshape(-1, 2) / embedding.WELD).astype(int)
    expected = np.unique(np.column_stack([F.ravel(), place]), axis=0, return_inverse=True)[1].ravel()
    assert len(np.unique(found)) == expected.max() + 1
    assert len(np.unique(np.column_stack([found, expected]), axis=0)) == expected.max() + 1


def test_thousands_of_triangles_over_one_another_take_little_memory():
    """As Blender's Reset lays every face: each boundary edge meets each other one."""
    rng = np.random.default_rng(0)
    uv = rng.random((3000, 3, 2))
    turned_over = np.linalg.det(uv[:, 1:] - uv[:, :1]) < 0
    uv[turned_over] = uv[turned_over][:, ::-1]
    tracemalloc.start()
    found = check_layout(np.arange(9000).reshape(-1, 3), uv)
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found.overlap > 0.99 and not found.folded.any()
    assert most < 200e6


@pytest.mark.parametrize("swept", [boxes.SWEPT_PER_BOX, 0])
def test_boxes_that_are_not_crowded_meet_as_any_do(swept, monkeypatch):
    monkeypatch.setattr(boxes, "SWEPT_PER_BOX", swept)
    rng = np.random.default_rng(1)
    low = rng.random((1000, 2))
    high = low + 0.02 * rng.random((1000, 2))
    found = boxes.box_pairs(low, high, low, high)
    for one, other in zip(found, boxes.pairs_up_to(2e5, low, high, low, high), strict=True):
        np.testing.assert_array_equal(one, other)
    high = low + 1
    assert boxes.pairs_up_to(2e5, low, high, low, high) is None
    assert len(boxes.box_pairs(low, high, low, high)[0]) > 2e5
