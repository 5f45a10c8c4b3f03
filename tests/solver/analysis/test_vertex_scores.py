"""Scores of vertices: what they do not depend on, and weights from them by area."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.density import region_share
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.analysis.vertex_scores import distance, scaled_vertex_areas, soft_weights, vertex_score
from omt_uv.solver.errors import EmptyMeshError, WeightError
from omt_uv.solver.mesh.geometry import vertex_areas


@pytest.mark.parametrize("kind", ["saliency", "gaussian", "mean", "sharpness"])
def test_scores_do_not_depend_on_place_direction_or_size(kind):
    V, F, _ = meshes.single_bump(40)
    q, _ = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))
    q = q * np.sign(np.linalg.det(q))
    before, after = vertex_score(kind, V, F), vertex_score(kind, 137 * V @ q.T + 20, F)
    np.testing.assert_allclose(after, before, atol=1e-6 * before.max())


def test_distance_along_the_surface():
    V, F = meshes.grid(40, 40)
    d = distance(V, F, np.array([0]))
    straight = np.linalg.norm(V, axis=1)
    assert (d >= straight - 1e-12).all()
    assert (d <= 1.09 * straight + 1e-12).all()


@pytest.mark.parametrize("invert", [False, True])
def test_soft_weights_by_area(invert):
    V, F, _ = meshes.single_bump()
    area = vertex_areas(V, F)
    w = soft_weights(V[:, 0], area, 0.4, 0.8, invert)
    assert (w.min(), w.max()) == (0, 1)
    assert area[w == (1 if invert else 0)].sum() / area.sum() == pytest.approx(0.4, abs=0.03)
    assert area[w == (0 if invert else 1)].sum() / area.sum() == pytest.approx(0.2, abs=0.03)


@pytest.mark.parametrize("seed", range(5))
def test_weights_as_they_come_leave_room_for_four_times_their_share(seed):
    random = np.random.default_rng(seed)
    scores, area = random.lognormal(size=500) ** random.uniform(0.2, 4), random.uniform(0.5, 2, 500)
    share = region_share(soft_weights(scores, area, 0.8, 0.98), area)
    assert 0.01 < share < 0.2
    assert exact_density(soft_weights(scores, area, 0.8, 0.98), area, 4.0).target_share == pytest.approx(4 * share)


def test_weights_of_nothing():
    V, F = meshes.grid(10, 10)
    area = vertex_areas(V, F)
    with pytest.raises(WeightError, match="same everywhere"):
        soft_weights(vertex_score("saliency", V, F), area, 0.8, 0.98)
    with pytest.raises(WeightError, match="no range"):
        soft_weights(V[:, 0], area, 0.9, 0.1)
    with pytest.raises(EmptyMeshError, match="selected"):
        vertex_score("distance", V, F, np.zeros(len(V), bool))
    cube = soft_weights(np.where(np.arange(100) < 95, 0.0, 1.0), np.ones(100), 0.8, 0.98)
    assert cube.sum() == 5


@pytest.mark.parametrize("kind", ["gaussian", "mean"])
def test_planes_have_no_curvature_in_single_precision(kind):
    V, F = meshes.grid(60, 60)
    q, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    assert not vertex_score(kind, (V @ q + 5).astype(np.float32).astype(float), F).any()
    assert vertex_score(kind, *meshes.bumpy(60, 60, height=0.02)).any()


def test_scaled_areas_are_areas_at_any_scale():
    V, F = meshes.bumpy()
    area = scaled_vertex_areas(V, F)
    np.testing.assert_allclose(area / area.sum(), vertex_areas(V, F) / vertex_areas(V, F).sum(), rtol=1e-12)
    np.testing.assert_allclose(scaled_vertex_areas(1e200 * V, F), area, rtol=1e-9)


@pytest.mark.parametrize("invert", [False, True])
@pytest.mark.parametrize("low_high", [(0.0, 1.0), (0.0, 0.5), (0.4, 0.8), (0.8, 0.98), (0.5, 1.0)])
@pytest.mark.parametrize("score", [0.0, -1e6, 1e6, np.nan, np.inf])
def test_vertices_of_no_face_play_no_part_in_weights(score, low_high, invert):
    rng = np.random.default_rng(2)
    for values in (rng.normal(size=60), np.round(rng.normal(size=60)), np.repeat([0.0, 1.0], [59, 1])):
        area, loose = rng.uniform(0.5, 2, 60), rng.permutation(80) < 20
        more, place = np.full(80, score), np.zeros(80)
        more[~loose], place[~loose] = values, area
        found = soft_weights(more, place, *low_high, invert)
        np.testing.assert_array_equal(found[~loose], soft_weights(values, area, *low_high, invert))
        assert np.isfinite(found).all() and found.min() >= 0 and found.max() <= 1
        # Where all that has an area is alike, what has none makes no difference.
        with pytest.raises(WeightError, match="same everywhere"):
            soft_weights(np.where(loose, more, 3.0), place, *low_high, invert)


@pytest.mark.parametrize("kind", ["saliency", "gaussian", "mean", "sharpness", "distance"])
def test_vertices_of_no_face_play_no_part_in_scores(kind):
    V, F, _ = meshes.single_bump(12)
    far = np.array([[9.0, -7.0, 80.0], [0.1, 0.1, 0.1], [np.nan, 0.0, np.inf]])
    chosen = np.arange(len(V)) == 5
    found = vertex_score(kind, np.concatenate([V, far]), F, np.append(chosen, [True] * 3))
    np.testing.assert_allclose(found[: len(V)], vertex_score(kind, V, F, chosen), rtol=1e-8, atol=1e-10)


@pytest.mark.parametrize("pulled", range(4))
def test_of_several_ways_across_pairs_of_triangles_the_shortest_counts(pulled):
    """From pole to pole of an octahedron there are four, one over each edge of its equator."""
    angle = np.pi / 2 * np.arange(4)
    V = np.concatenate([np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]), [[0, 0, 1], [0, 0, -1]]])
    # Two edges of the equator come nearer to the axis, one of them the most.
    V[pulled] *= 0.5
    V[(pulled + 1) % 4] *= 0.7
    F = np.array([[k, (k + 1) % 4, 4] for k in range(4)] + [[(k + 1) % 4, k, 5] for k in range(4)])
    ways = []
    for k in range(4):
        along = np.linspace(0, 1, 20001)[:, None]
        on_edge = V[k] + along * (V[(k + 1) % 4] - V[k])
        ways.append(2 * np.linalg.norm(on_edge - V[4], axis=1).min())
    assert distance(V, F, np.array([4]))[5] == pytest.approx(min(ways), rel=1e-6) and max(ways) > 1.1 * min(ways)
