"""The Beltrami coefficient of known maps, regions, histograms of a match, and the mean of shapes."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import bumpy, icosphere
from sphere_shapes import random_rotation

from omt_uv.solver.strain.beltrami import beltrami, corner_beltrami
from omt_uv.solver.strain.collection import LEAST_DEVIATION, mean_shape
from omt_uv.solver.strain.figures import match_figures
from omt_uv.solver.strain.regions import compare_regions, region_strain


def test_the_coefficient_of_a_linear_map_is_known():
    rng = np.random.default_rng(0)
    z = rng.normal(size=(20, 3)) + 1j * rng.normal(size=(20, 3))
    z *= np.where((np.conj(z[:, 1] - z[:, 0]) * (z[:, 2] - z[:, 0])).imag > 0, 1, 1j * 0 + 1)[:, None]
    turned = (np.conj(z[:, 1] - z[:, 0]) * (z[:, 2] - z[:, 0])).imag < 0
    z[turned] = z[turned][:, [0, 2, 1]]
    w = 2 * np.exp(1j) * (z + 0.4 * np.exp(0.3j) * z.conj())
    corners = np.stack([z.real, z.imag, 0 * z.real], axis=2)
    found = corner_beltrami(corners, np.stack([w.real, w.imag], axis=2))
    assert np.allclose(found.size, 0.4)
    expected = np.array([np.cos(0.15), np.sin(0.15), 0])
    assert np.allclose(np.abs(found.direction @ expected), 1)
    # The size is that of the singular values, and does not change when the image is turned in space.
    again = corner_beltrami(corners, np.stack([w.real, w.imag, 0 * w.real], axis=2) @ random_rotation().T)
    assert np.allclose(again.size, found.size) and np.allclose(again.direction, found.direction)


def test_a_fold_is_beyond_one_and_an_isometry_nothing():
    V, F = bumpy(6, 6)
    assert beltrami(V, F, V @ random_rotation().T).size.max() < 1e-9
    assert (beltrami(V, F, V[:, :2] * [-1, 1]).size > 1).all()
    flat = beltrami(V, F, np.zeros((len(V), 3)))
    assert flat.mean <= 1 and flat.histogram().sum() == pytest.approx(1)


def test_regions_are_told_apart():
    V, F = bumpy(10, 10)
    side = V[F].mean(axis=1)[:, 0] > np.median(V[:, 0])
    image = V * np.where(V[:, [0]] > np.median(V[:, 0]), [[1, 3, 1]], [[1, 1, 1]])
    still, moved = (region_strain(beltrami(V, F, x), {"left": ~side * 1.0, "none": 0 * side}) for x in (V, image))
    assert [row.name for row in still] == ["all", "left"]
    apart = compare_regions(still, moved)
    assert apart["left"] < 0.2 < apart["all"]


def test_figures_of_the_identity_are_one():
    V, F = icosphere(3)
    V = V * [1, 1.5, 0.7]
    corner = np.array([np.argwhere(v == F)[0] for v in range(len(V))])
    found = match_figures((V, F), (V, F), (corner[:, 0], np.eye(3)[corner[:, 1]]), V)
    assert found.mean_curvature == pytest.approx(1) and found.mean_area == pytest.approx(1)
    assert found.area[0] == pytest.approx(1) and found.curvature.sum() == pytest.approx(1)


def test_the_mean_of_turned_copies_is_the_shape_and_what_is_off_stands_out():
    V, _ = icosphere(2)
    V = V * [1, 1.4, 0.6]
    shapes = np.array([V @ random_rotation(k).T + k for k in range(5)])
    found = mean_shape(shapes, np.ones(len(V)))
    assert found.deviation.max() < 1e-9
    rng = np.random.default_rng(0)
    shapes = shapes + 0.01 * rng.normal(size=shapes.shape)
    shapes[3, 7] *= 1.5
    found = mean_shape(shapes, np.ones(len(V)))
    assert found.score.argmax() == 3 * len(V) + 7 and found.score.max() > 5
    sizes = np.arange(1, 5)[:, None, None]
    assert mean_shape(sizes * np.delete(shapes, 3, axis=0), np.ones(len(V)), True).deviation.max() < 0.2
    # Neither of two is the rule for the other.
    two, three = (mean_shape(shapes[:k], np.ones(len(V))) for k in (2, 3))
    assert not two.score.any() and two.deviation.max() > 0 and 0 < three.score.max() < 1e3
    with pytest.raises(ValueError, match="two shapes"):
        mean_shape(shapes[:1], np.ones(len(V)))


def test_a_mean_over_faces_that_fold_is_still_a_share():
    """What is folded, or has no area in the map, counts as the worst that does not fold, in the mean as in the
    histogram."""
    V, F = bumpy(6, 6)
    image = V[:, :2].copy()
    image[10] += [1.5, 0.3]
    found = beltrami(V, F, image)
    assert (found.size > 1).any() and (found.size < 1).any()
    middles = (np.arange(2000) + 0.5) / 2000
    assert 0 < found.mean <= 1 and found.mean == pytest.approx(found.histogram(2000) @ middles, abs=1e-3)
    assert (beltrami(V, F, V[:, :2] * [-1, 1]).mean, beltrami(V, F, V).mean) == pytest.approx((1, 0), abs=1e-9)


@pytest.mark.parametrize("count", [3, 5])
def test_scores_are_distances_over_deviations_of_others_that_are_not_too_small(count):
    """Against loops; least deviations are means over the surface, of which some vertices have more than others."""
    rng = np.random.default_rng(count)
    V, _ = icosphere(1)
    # What swells at both ends turns and shifts nothing.
    ends = np.abs(V[:, 2]) > 0.8
    weight = np.where(ends, 3.0, 0.5)
    swollen = 1 + 0.3 * rng.random(count)[:, None, None] * ends[:, None]
    shapes = V * [1, 1.4, 0.6] * swollen + 1e-5 * rng.normal(size=(count, len(V), 3))
    found = mean_shape(shapes, weight)
    least = 0
    for k in range(count):
        others = [j for j in range(count) if j != k]
        mean = found.aligned[others].mean(axis=0)
        off = np.sqrt(((found.aligned[others] - mean) ** 2).sum(axis=2).mean(axis=0))
        bound = LEAST_DEVIATION * (weight @ off) / weight.sum()
        least += (off < bound).sum()
        far = np.linalg.norm(found.aligned[k] - mean, axis=1)
        np.testing.assert_allclose(found.score[k], far / np.maximum(off, bound), rtol=1e-5)
    assert least > 5


@pytest.mark.parametrize("scaled", [False, True])
def test_a_vertex_that_weighs_as_much_as_several_counts_as_these(scaled):
    """In the centre, the size, the turn, and what is least."""
    rng = np.random.default_rng(3)
    V, _ = icosphere(1)
    times = np.where(V[:, 2] > 0.5, 7, rng.integers(1, 3, len(V)))
    shapes = np.stack([(1 + k) * (V * [1, 1.4, 0.6] + 0.1 * rng.normal(size=V.shape)) + k for k in range(4)])
    shapes = np.einsum("kij,knj->kni", [random_rotation(k) for k in range(4)], shapes)
    one = mean_shape(shapes, times / 5, scaled)
    several = mean_shape(np.repeat(shapes, times, axis=1), np.ones(times.sum()), scaled)
    for name in ("mean", "aligned", "distance", "deviation", "score"):
        value, other = getattr(one, name), getattr(several, name)
        axis = 0 if name in ("mean", "deviation") else 1
        np.testing.assert_allclose(np.repeat(value, times, axis=axis), other, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("kind", ["sheared", "folded"])
def test_a_region_has_the_figures_of_its_own_faces_alone(kind):
    """As if there were no others; weights that are no whole faces count by their share of the area."""
    V, F = bumpy(7, 6)
    rng = np.random.default_rng(2)
    image = V[:, :2] * [1, 1.5] + (0.3 if kind == "folded" else 0.03) * rng.normal(size=(len(V), 2))
    chosen = rng.random(len(F)) < 0.4
    whole = beltrami(V, F, image)
    chosen &= whole.size < min(np.sort(whole.size)[-5], 0.9)
    everything, region, half = region_strain(whole, {"some": chosen * 1.0, "half": 0.5 * chosen})
    (alone,) = region_strain(beltrami(V, F[chosen], image), {})
    assert region.mean == pytest.approx(alone.mean) and region.greatest == pytest.approx(alone.greatest)
    np.testing.assert_allclose(region.histogram, alone.histogram)
    assert half.mean == pytest.approx(region.mean) and half.share == pytest.approx(region.share / 2)
    assert region.share == pytest.approx(whole.area[chosen].sum() / whole.area.sum())
    assert region.greatest < everything.greatest <= 1 and everything.share == pytest.approx(1)
