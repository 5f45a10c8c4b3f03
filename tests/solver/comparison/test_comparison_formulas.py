"""Figures of meshes against plain formulas: triangle by triangle, edge by edge, point by point."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.comparison import comparison_figures
from omt_uv.solver.comparison.bumps import bumps_of, curvature_error
from omt_uv.solver.comparison.comparison_figures import compare, distances_to
from omt_uv.solver.comparison.greatest import exact_distances, farthest, nearest_of_all
from omt_uv.solver.comparison.triangle_shapes import compare_shapes, topology_of
from omt_uv.solver.errors import EmptyMeshError, NonFiniteError
from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.progress import drain


def crooked(seed=0):
    V, F = meshes.bumpy(5, 4)
    return V + 0.03 * np.random.default_rng(seed).normal(size=V.shape), F


def test_shapes_triangle_by_triangle():
    V, F = crooked()
    least, quality, area, edges = [], [], [], {}
    for f in F:
        p = V[f]
        side = [np.linalg.norm(p[(k + 1) % 3] - p[k]) for k in range(3)]
        a, b, c = side
        angles = [np.arccos((y * y + z * z - x * x) / (2 * y * z)) for x, y, z in ((a, b, c), (b, c, a), (c, a, b))]
        s = sum(side) / 2
        area.append(np.sqrt(s * (s - a) * (s - b) * (s - c)))
        least.append(np.degrees(min(angles)))
        quality.append(2 * (area[-1] / s) / (a * b * c / (4 * area[-1])))
        edges.update({frozenset((f[k], f[(k + 1) % 3])): side[k] for k in range(3)})
    found, length = compare_shapes(V, F), np.array(list(edges.values()))
    assert found.angle_min == pytest.approx(min(least)) and found.angle_mean == pytest.approx(np.mean(least))
    assert found.angle_p1 == pytest.approx(np.percentile(least, 1))
    assert found.below_30 == pytest.approx(np.mean(np.array(least) < 30)) and 0 < found.below_30 < 1
    assert found.quality == pytest.approx(np.mean(quality))
    assert found.edge_cv == pytest.approx(length.std() / length.mean())
    assert found.area_cv == pytest.approx(np.std(area) / np.mean(area))
    regular = compare_shapes(np.array([[0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0]]), np.array([[0, 1, 2]]))
    assert (regular.angle_min, regular.quality, regular.edge_cv, regular.area_cv) == pytest.approx((60, 1, 0, 0))
    assert regular.below_30 == 0


def test_topology_by_hand():
    strip = np.array([[0, 1, 2], [2, 1, 3], [4, 5, 6]])
    found = topology_of(strip + 7)
    assert (found.components, found.loops, found.euler, found.crowded, found.disagreeing) == (2, 2, 2, 0, 0)
    found = topology_of(np.array([[0, 1, 2], [2, 3, 1], [1, 2, 4]]))
    assert (found.components, found.crowded) == (1, 1)
    found = topology_of(np.array([[0, 1, 2], [1, 2, 3]]))
    assert (found.disagreeing, found.crowded, found.loops, found.euler) == (1, 0, 1, 1)
    V, F = meshes.torus()
    assert (topology_of(F).euler, topology_of(F).loops) == (0, 0)
    ring = np.array(
        [[k, (k + 1) % 4, 4 + k] for k in range(4)] + [[(k + 1) % 4, 4 + (k + 1) % 4, 4 + k] for k in range(4)]
    )
    assert (topology_of(ring).loops, topology_of(ring).euler) == (2, 0)


@pytest.mark.parametrize("count", [1, 7, 30])
def test_bumps_are_hats_around_vertices_far_from_one_another(count):
    V, F = meshes.bumpy(5, 4)
    V = np.concatenate([V, V[F[0]] + 50, [[9.0, 9, 9]]])
    n = len(V)
    F = np.concatenate([F, [[n - 4, n - 3, n - 2]]])
    found = drain(bumps_of(V, F, count))
    # Lengths along edges, by the formula of Floyd and Warshall.
    apart = np.full((n, n), np.inf)
    apart[np.arange(n), np.arange(n)] = 0
    for f in F:
        for a, b in ((0, 1), (1, 2), (2, 0)):
            apart[f[a], f[b]] = apart[f[b], f[a]] = np.linalg.norm(V[f[a]] - V[f[b]])
    for k in range(n):
        apart = np.minimum(apart, apart[:, k : k + 1] + apart[k])
    p = V[F]
    area = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1).sum() / 2
    assert found.radius == pytest.approx(2 * np.sqrt(area / count / np.pi))
    values = found.values.toarray()
    assert values.shape == (count, n) and len(set(found.centres)) == count
    np.testing.assert_allclose(values, np.maximum(1 - apart[found.centres] / found.radius, 0), atol=1e-12)
    # The first is the farthest from vertex 0 among those that are connected with it.
    connected = np.isfinite(apart[0])
    assert apart[0, found.centres[0]] == apart[0, connected].max()
    for k in range(1, count):
        before = apart[found.centres[:k]].min(axis=0)
        before[n - 1] = -1
        assert before[found.centres[k]] == pytest.approx(before.max()) or np.isinf(before[found.centres[k]])
    assert n - 1 not in found.centres
    assert curvature_error(np.array([1.0, -2, 0]), np.array([1.5, -2, 1])) == pytest.approx(0.5)
    assert curvature_error(np.zeros(2), np.zeros(2)) == 0


def plain_distances(V, F, points):
    """Of points from triangles, by many points of each: no less than what it is, and little more."""
    t = np.linspace(0, 1, 25)
    a, b = (x.ravel() for x in np.meshgrid(t, t))
    inside = a + b <= 1 + 1e-12
    w = np.stack([1 - a - b, a, b], axis=1)[inside]
    samples = np.einsum("sc,mcd->msd", w, V[F]).reshape(-1, 3)
    return np.linalg.norm(points[:, None] - samples, axis=2).min(axis=1)


def test_distances_are_those_of_the_nearest_of_many_points(monkeypatch):
    monkeypatch.setattr(comparison_figures, "POINTS", 5000)
    V, F = crooked()
    V = np.concatenate([V, V[F[3]] + [0.3, 0, 2]])
    F = np.concatenate([F, [[len(V) - 3, len(V) - 2, len(V) - 1]]])
    points = np.random.default_rng(1).uniform(-1, 2.5, (60, 3))
    plain = plain_distances(V, F, points)
    found = distances_to(V, F, points)
    assert (found <= plain + 0.01).all() and (found > plain - 0.05).all()
    index = ClosestPoint(V, F, 0.01)
    exact = exact_distances(index, points, plain + 1e-9)
    assert (exact <= found + 1e-12).all() and np.median(found - exact) < 1e-12
    distance, nearest = nearest_of_all(index, points, plain + 1e-9)
    assert (nearest >= 0).all()
    for point, d, face in zip(points, distance, nearest, strict=True):
        assert plain_distances(V, F[face : face + 1], point[None])[0] == pytest.approx(d, abs=0.05)
    # What is known to be nearer stays as it is known.
    less = 0.5 * exact
    distance, nearest = nearest_of_all(index, points, less)
    assert np.array_equal(distance, less) and (nearest == -1).all()
    assert farthest(index, points, plain + 1e-9) == pytest.approx(exact.max())
    # Bounds that are too great by half are no reason to miss one of seventy.
    many = np.concatenate([points, points[:20] * 0.5])
    bound = plain_distances(V, F, many)
    truth = exact_distances(index, many, bound + 1e-9)
    loose = truth * np.random.default_rng(2).uniform(1, 1.5, len(many))
    assert farthest(index, many, loose) == pytest.approx(truth.max())
    assert farthest(index, many, loose, least=9.0) == 9.0


def test_every_figure_of_two_flat_squares(monkeypatch):
    """One a third smaller, a tenth above, turned by a quarter: all figures are known."""
    monkeypatch.setattr(comparison_figures, "POINTS", 20_000)
    V, F = meshes.grid(12, 12)
    small = (V - 0.5) * [2 / 3, 2 / 3, 0] @ [[0, 1, 0], [-1, 0, 0], [0, 0, 1]] + [0.5, 0.5, 0.1]
    found = drain(compare((V, F), (small, F)))
    size, corner = 2**0.5, np.hypot(np.hypot(1 / 6, 1 / 6), 0.1)
    assert found.hausdorff == found.hausdorff_a == pytest.approx(corner / size, rel=1e-2)
    assert found.hausdorff_b == pytest.approx(0.1 / size, rel=1e-2) and found.rms_b == pytest.approx(
        0.1 / size, rel=1e-3
    )
    t = np.abs(np.linspace(0, 1, 401) - 0.5)
    out = np.maximum(t - 1 / 3, 0) ** 2
    rms = np.sqrt((out[:, None] + out + 0.01).mean())
    assert found.rms_a == pytest.approx(rms / size, rel=5e-3)
    assert found.rms == pytest.approx(np.sqrt((rms**2 + 0.01) / 2) / size, rel=5e-3)
    assert found.hausdorff <= found.hausdorff_bound < 1.02 * found.hausdorff
    assert found.boundary == pytest.approx(corner / size, rel=1e-2)
    assert (
        found.normal_mean < 1e-6 and found.topology_kept and (found.components, found.loops, found.euler) == (1, 1, 1)
    )
    assert (found.vertices, found.faces) == (len(V), len(F)) and found.angle_min == pytest.approx(45)
    assert drain(compare((V, F), (small, F), 500)).hausdorff_bound is None
    # From the other side faces look away: the angle is half a turn.
    assert drain(compare((V, F), (small, F[:, ::-1]), 500)).normal_mean == pytest.approx(180)


def test_what_is_no_surface_is_refused(monkeypatch):
    monkeypatch.setattr(comparison_figures, "POINTS", 1000)
    V, F = meshes.grid(2, 2)
    bad = V.copy()
    bad[4, 1] = np.nan
    for one, other in (((bad, F), (V, F)), ((V, F), (bad, F))):
        with pytest.raises(NonFiniteError) as error:
            drain(compare(one, other, 10))
        assert np.asarray(error.value.elements).tolist() == [4]
    for nothing in ((V, F[:0]), (V * 0, F)):
        with pytest.raises(EmptyMeshError, match="There are no faces to compare"):
            drain(compare((V, F), nothing, 10))
    with_more = np.concatenate([[[99.0, 99, 99]], V])
    loose = drain(compare((with_more, F + 1), (V, F), 100))
    assert loose.hausdorff < 1e-12 and loose.vertices == len(V)
