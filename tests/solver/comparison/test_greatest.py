"""The greatest distance is bounded from both sides, and distances are exact."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.comparison import comparison_figures, greatest
from omt_uv.solver.comparison.comparison_figures import compare
from omt_uv.solver.comparison.greatest import by_position, exact_distances, farthest, greatest_distance
from omt_uv.solver.mesh.closest_point import ClosestPoint, closest_on_triangles, random_points
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.progress import drain

SQUARE = (np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2], [0, 2, 3]]))


def cloud(seed, count=60):
    """Triangles of any shape in a box, which are no surface."""
    rng = np.random.default_rng(seed)
    V = (rng.random((count, 1, 3)) + 0.3 * rng.normal(size=(count, 3, 3))).reshape(-1, 3)
    return V, np.arange(3 * count).reshape(-1, 3)


def brute(V, F, points):
    a, b, c = (V[F[:, k]] for k in range(3))
    weights = closest_on_triangles(points[:, None], a, b, c)
    off = sum(weights[..., k, None] * x for k, x in enumerate((a, b, c))) - points[:, None]
    return np.linalg.norm(off, axis=2).min(axis=1)


def searched(source, target):
    index = ClosestPoint(*target, 0.05)
    found = by_position(index, source[0])
    distance = np.linalg.norm(found.points - source[0], axis=1)
    return drain(greatest_distance(*source, index, found.faces, (source[0], distance)))


def test_distances_are_those_of_trying_every_triangle():
    V, F = cloud(0)
    points = np.random.default_rng(1).normal(size=(40, 3))
    exact = brute(V, F, points)
    index = ClosestPoint(V, F, 0.05)
    for more in (0.0, 0.5):
        assert exact_distances(index, points, exact + more) == pytest.approx(exact, abs=1e-12)
    assert farthest(index, points, exact + np.random.default_rng(2).random(40)) == pytest.approx(exact.max())
    assert farthest(index, points, exact, least=100.0) == 100.0


@pytest.mark.parametrize("far", [0.6, 5.0, 100.0])
def test_a_vertex_far_away_asks_for_few_points(far, monkeypatch):
    """The bound comes down where the nearest triangles are known, not the ones that samples are nearest to."""
    V, F = meshes.bumpy(12, 12)
    W, asked = V.copy(), []
    W[60] += np.array([0.1, 0.2, 1.0]) * far
    index = ClosestPoint(V, F, 0.005)
    near = by_position(index, W).faces
    monkeypatch.setattr(greatest, "by_position", lambda i, points: asked.append(len(points)) or by_position(i, points))
    found = drain(greatest_distance(W, F, index, near, (W, np.linalg.norm(index.walk(W, near).points - W, axis=1))))
    assert found.distance == pytest.approx(brute(V, F, W).max())
    assert found.bound <= found.distance * 1.0011 and sum(asked) < 20_000


@pytest.mark.parametrize("seed", range(3))
def test_no_sample_is_above_the_bound_and_many_come_near(seed):
    source, target = cloud(seed), cloud(seed + 10)
    found = searched(source, target)
    owner, weights = random_points(face_areas(*source), 3000, np.random.default_rng(seed))
    points = sum(weights[:, k, None] * source[0][source[1][owner, k]] for k in range(3))
    most = brute(*target, np.concatenate([points, source[0]])).max()
    assert most <= found.bound and most > 0.9 * found.distance
    assert found.distance <= found.bound <= (1 + 1e-9) * (1 + 1e-3) * found.distance


@pytest.mark.parametrize("at_once", [4, 20_000])
def test_what_waits_until_others_are_cut_is_not_forgotten(at_once, monkeypatch):
    """A large triangle on many small ones has the highest bound for long, and lies on them; the peak is elsewhere."""
    W, G = meshes.grid(4, 4)
    plate, top = np.column_stack([9 * W[:, :2] + [3, 0], np.zeros(len(W))]), np.array([0.61, 0.23, -0.4])
    sides = np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]])
    target = np.vstack([SQUARE[0], top, plate]), np.concatenate([sides, G + 5])
    source = np.vstack([SQUARE[0], [[4, 1, 0], [11, 2, 0], [5, 8, 0]]]), np.concatenate([SQUARE[1], [[4, 5, 6]]])
    monkeypatch.setattr(greatest, "MOST_AT_ONCE", at_once)
    found = searched(source, target)
    alone = searched(SQUARE, (target[0][:5], sides))
    assert found.distance == pytest.approx(alone.distance, rel=2e-3) and alone.distance <= found.bound
    assert found.distance > 0.1 and found.bound <= (1 + 1e-9) * (1 + 1e-3) * found.distance


def test_a_peak_between_all_vertices_is_found():
    """Above a cone with its top within a face, no vertex is farthest."""
    top = np.array([0.61, 0.23, -0.4])
    cone = (np.vstack([SQUARE[0], top]), np.array([[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]))
    found = searched(SQUARE, cone)
    x, y = np.meshgrid(np.linspace(0, 1, 150), np.linspace(0, 1, 150))
    every = brute(*cone, np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()]))
    assert 0.99 * found.distance < every.max() <= found.bound <= 1.0011 * found.distance
    back = searched(cone, SQUARE)
    assert back.distance == pytest.approx(0.4)


def test_where_the_limit_is_reached_the_bound_says_so(monkeypatch):
    monkeypatch.setattr(greatest, "MOST_POINTS", 10)
    found = searched(cloud(3), cloud(4))
    assert found.bound > 1.01 * found.distance


def test_equal_surfaces_with_other_triangles_end(monkeypatch):
    monkeypatch.setattr(greatest, "MOST_POINTS", 10_000)
    other = (SQUARE[0], np.array([[0, 1, 3], [1, 2, 3]]))
    found = searched(SQUARE, other)
    assert found.distance < 1e-12 and found.bound < 0.01


def test_samples_alone_have_no_bound_and_are_less(monkeypatch):
    monkeypatch.setattr(comparison_figures, "POINTS", 1000)
    source, target = cloud(5, 20), cloud(6, 20)
    sampled, searched_for = (drain(compare(source, target, n)) for n in (200, 0))
    assert sampled.hausdorff_bound is None and sampled.hausdorff <= searched_for.hausdorff
    assert searched_for.hausdorff <= searched_for.hausdorff_bound
