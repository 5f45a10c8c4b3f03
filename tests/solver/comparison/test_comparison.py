"""Figures of one surface beside another, where they are known."""

from __future__ import annotations

import numpy as np
import pytest
from scripted_steps import done

from omt_uv.solver.comparison import comparison_figures
from omt_uv.solver.comparison.bumps import bumps_of, curvature_error
from omt_uv.solver.comparison.comparison_figures import compare, distances_to
from omt_uv.solver.comparison.triangle_shapes import compare_shapes, topology_of
from omt_uv.solver.errors import EmptyMeshError, NonFiniteError
from omt_uv.solver.progress import drain


def icosphere(levels, radius=1.0):
    """Positions and triangles of a sphere."""
    g = (1 + 5**0.5) / 2
    V = np.array([[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g], [0, 1, -g],
                  [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]], float)  # fmt: skip
    F = np.array([[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2],
                  [10, 7, 6], [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11],
                  [6, 2, 10], [8, 6, 7], [9, 8, 1]])  # fmt: skip
    for _ in range(levels):
        edges = np.sort(np.concatenate([F[:, [0, 1]], F[:, [1, 2]], F[:, [2, 0]]]), axis=1)
        unique, inverse = np.unique(edges, axis=0, return_inverse=True)
        middle = inverse.reshape(3, -1) + len(V)
        V = np.concatenate([V, V[unique].mean(axis=1)])
        a, b, c = F.T
        x, y, z = middle
        F = np.concatenate([np.stack(t, axis=1) for t in ((a, x, z), (b, y, x), (c, z, y), (x, y, z))])
    return radius * V / np.linalg.norm(V, axis=1, keepdims=True), F


def grid(n, height=0.0):
    """A square with two triangles a cell, at a height."""
    x, y = np.meshgrid(np.linspace(0, 1, n + 1), np.linspace(0, 1, n + 1))
    V = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, height)])
    i = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).ravel()
    return V, np.concatenate([np.stack([i, i + 1, i + n + 2], 1), np.stack([i, i + n + 2, i + n + 1], 1)])


def test_a_surface_is_no_way_from_itself():
    found = drain(compare(icosphere(3), icosphere(3), 4000))
    assert found.hausdorff < 1e-12 and found.normal_p99 < 1e-4 and found.topology_kept
    assert found.gaussian_error < 1e-9 and found.mean_error < 1e-9 and found.boundary is None


def test_parallel_surfaces_are_as_far_apart_as_they_are():
    found = drain(compare(grid(20), grid(7, height=0.1), 4000))
    away = 0.1 / 2**0.5
    for name in ("hausdorff", "hausdorff_a", "hausdorff_b", "rms", "rms_a", "rms_b", "boundary"):
        assert getattr(found, name) == pytest.approx(away, rel=1e-3), name
    assert found.normal_mean == pytest.approx(0, abs=1e-6)


def test_distances_are_one_sided_where_one_surface_is_a_part_of_the_other():
    V, F = grid(20)
    part = F[(V[F, 0] <= 0.5 + 1e-9).all(axis=1)]
    found = drain(compare((V, F), (V, part), 4000))
    assert found.hausdorff_b < 1e-12 and found.hausdorff_a == pytest.approx(0.5 / 2**0.5)
    # The root of the mean of x^2 from 0 to 1/2, over half of the area.
    assert found.rms_a == pytest.approx(np.sqrt(0.5**3 / 3) / 2**0.5, rel=1e-2)
    assert found.vertices == 11 * 21


@pytest.mark.parametrize("levels, order", [(1, 2.0)])
def test_errors_of_spheres_fall_as_they_should(levels, order):
    """Faces of a sphere are off by h^2; so is its Hausdorff distance, and normals by h."""
    fine = icosphere(4)
    rows = [drain(compare(fine, icosphere(k), 4000)) for k in (levels, levels + 1)]
    assert np.log2(rows[0].hausdorff / rows[1].hausdorff) == pytest.approx(order, abs=0.25)
    assert np.log2(rows[0].normal_mean / rows[1].normal_mean) == pytest.approx(1, abs=0.15)
    assert rows[0].gaussian_error > rows[1].gaussian_error


def test_bumps_cover_a_sphere_and_add_up_to_its_curvature():
    V, F = icosphere(3)
    bumps = drain(bumps_of(V, F, 50))
    assert bumps.values.shape == (50, len(V)) and len(set(bumps.centres.tolist())) == 50
    assert bumps.values.max() == 1 and (bumps.values.sum(axis=0) > 0).all()
    assert curvature_error(np.array([1.0, -1.0]), np.array([1.5, -1.0])) == pytest.approx(0.25)


def test_bumps_reach_every_component():
    V, F = icosphere(1)
    bumps = drain(bumps_of(np.concatenate([V, V + 9]), np.concatenate([F, F + len(V)]), 8))
    assert set((bumps.centres >= len(V)).tolist()) == {True, False}


def test_shapes_of_equilateral_triangles():
    x = np.array([[0, 0, 0], [1, 0, 0], [0.5, 3**0.5 / 2, 0], [1.5, 3**0.5 / 2, 0]])
    shapes = compare_shapes(x, np.array([[0, 1, 2], [1, 3, 2]]))
    assert (shapes.angle_min, shapes.quality) == (pytest.approx(60), pytest.approx(1))
    assert shapes.edge_cv == pytest.approx(0, abs=1e-9) and shapes.below_30 == 0


def test_topology_counts_loops_components_and_what_is_no_surface():
    V, F = grid(4)
    ring = F[~((V[F, :2] > 0.2) & (V[F, :2] < 0.8)).all(axis=(1, 2))]
    found = topology_of(ring)
    assert (found.components, found.loops, found.euler) == (1, 2, 0)
    assert topology_of(icosphere(1)[1]).euler == 2
    assert topology_of(np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])).crowded == 1
    assert topology_of(np.array([[0, 1, 2], [0, 1, 3]])).disagreeing == 1


def test_distances_to_a_surface():
    points = np.array([[0.5, 0.5, 0.3], [2.0, 0.5, 0.0], [0.1, 0.9, 0.0]])
    assert distances_to(*grid(3), points) == pytest.approx([0.3, 1.0, 0.0], abs=1e-9)


def test_what_cannot_be_compared_is_refused_by_name():
    V, F = grid(2)
    with pytest.raises(EmptyMeshError, match="There are no faces to compare"):
        drain(compare((V, F), (V, F[:0]), 4000))
    with pytest.raises(EmptyMeshError, match="There are no faces to compare"):
        drain(compare((V, np.array([[0, 0, 1]])), (V, F), 4000))
    V = V.copy()
    V[3] = np.nan
    with pytest.raises(NonFiniteError, match="3"):
        drain(compare((V, F), grid(2), 4000))


@pytest.mark.parametrize("change", ["nothing", "a face turned over", "a half turned over", "all turned over", "a hole",
                                    "a part more", "a fin"])  # fmt: skip
def test_topology_is_kept_where_nothing_was_cut_joined_or_turned_over(change, monkeypatch):
    # Curvature takes its time, and is not asked for here.
    monkeypatch.setattr(comparison_figures, "bumps_of", lambda *_: done(None))
    monkeypatch.setattr(comparison_figures, "_curvature_errors", lambda *_: (0.0, 0.0))
    monkeypatch.setattr(comparison_figures, "POINTS", 400)
    V, F = icosphere(0)
    W, G = V.copy(), F.copy()
    if change == "a face turned over":
        G[7] = G[7, ::-1]
    elif change == "a half turned over":
        G[V[F].mean(axis=1)[:, 2] > 0] = G[V[F].mean(axis=1)[:, 2] > 0][:, ::-1]
    elif change == "all turned over":
        G = G[:, ::-1]
    elif change == "a hole":
        G = G[1:]
    elif change == "a part more":
        W, G = np.concatenate([V, V[:3] + 9]), np.concatenate([G, [[len(V), len(V) + 1, len(V) + 2]]])
    elif change == "a fin":
        W, G = np.concatenate([V, [[0, 0, 2.0]]]), np.concatenate([G, [[G[0, 0], G[0, 1], len(V)]]])
    kept = drain(compare((V, F), (W, G), 400)).topology_kept
    assert kept == (change in ("nothing", "all turned over"))
