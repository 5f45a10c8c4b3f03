"""Patches whose corners become convex, each for itself."""

from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.solver.parameterization.polygons.corner_solver import CornerMesh, CornerPatches, affordable
from omt_uv.solver.parameterization.polygons.polygon_corners import PolygonCorners


@pytest.mark.parametrize("seed", range(5))
def test_the_cheapest_patches_that_a_chart_can_spare(seed):
    rng = np.random.default_rng(seed)
    gain, cost, chart = rng.integers(-2, 5, 40), rng.normal(size=40), rng.integers(0, 3, 40)
    spare = np.array([0.0, 1.5, np.inf])
    good = affordable(gain, cost, chart, spare)
    paid = np.maximum(cost, 0)
    assert (np.bincount(chart[good], paid[good], 3) <= spare).all()
    assert not good[gain <= 0].any() and good[(gain > 0) & (cost <= 0)].all() and good[(gain > 0) & (chart == 2)].all()
    mine, left = (good & (chart == 1) & (cost > 0)), (~good & (chart == 1) & (gain > 0))
    assert (paid / np.maximum(gain, 1))[mine].max() <= (paid / np.maximum(gain, 1))[left].min()


def two_darts(spare, area_weight=(10.0, 10.0)):
    """Two quads, each of which is a dart in the map, in charts of their own: the patches, and the map."""
    quad = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    dart = np.array([0, 1, 0.3 + 0.3j, 1j])
    triangles, ears = np.array([[0, 1, 2], [0, 2, 3]]), np.array([[0, 1, 3], [1, 2, 0], [2, 3, 1], [3, 0, 2]])
    both = np.concatenate([quad, quad + [3, 0]])
    mesh = CornerMesh(
        positions=np.column_stack([both, np.zeros(8)]),
        triangles=np.concatenate([triangles, triangles + 4]),
        polygon=np.repeat([0, 1], 2),
        target=np.full(4, 0.5),
        area_weight=np.asarray(area_weight),
        chart=np.repeat([0, 1], 2),
        spare=np.asarray(spare, float),
    )
    corners = PolygonCorners(
        triangles=np.concatenate([ears, ears + 4]),
        polygon=np.repeat([0, 1], 4),
        target=np.full(8, 0.5),
        whole=np.ones(8),
        least=np.full(8, 0.01),
    )
    return CornerPatches(mesh, corners, np.ones(8, bool)), corners, np.concatenate([dart, dart + 3])


def test_darts_become_convex_each_as_if_it_were_alone():
    patches, corners, w = two_darts([np.inf, np.inf])
    assert patches.count == 2 and corners.reflex(w).sum() == 2
    found = patches.convexified(w)
    assert not corners.reflex(found).any()
    np.testing.assert_allclose(found[4:] - found[4], found[:4] - found[0], atol=1e-9)


@pytest.mark.parametrize("weights", [(0.3, 60.0), (60.0, 0.3)])
def test_every_chart_has_a_weight_of_its_own(weights):
    """Where all weights are one, whose they are is not seen. How many rounds there are, all decide together."""
    found = []
    for pair in (weights, weights[:1] * 2, weights[1:] * 2):
        patches, _, w = two_darts([np.inf, np.inf], pair)
        found.append(patches._stepped(w, patches.area_weight, patches._barrier(w, patches.strength)))
    found, first, second = found
    np.testing.assert_allclose(found[:4], first[:4], atol=2e-4)
    np.testing.assert_allclose(found[4:], second[4:], atol=2e-4)
    assert np.abs(first - second).reshape(2, 4).max(axis=1).min() > 2e-2


def test_charts_that_can_spare_no_area_stay_to_the_bit():
    patches, corners, w = two_darts([-np.inf, np.inf])
    found = patches.convexified(w)
    np.testing.assert_array_equal(found[:4], w[:4])
    assert not corners.reflex(found)[4:].any()


def test_costs_are_what_the_figures_of_the_whole_lose():
    """A quad that grows takes from the shares of all others."""
    patches, _, w = two_darts([np.inf, np.inf])
    grown = np.where(np.arange(8) < 4, 1.1 * w, w)
    (first, second), given = patches.of_face, patches.faces
    loss = (
        np.abs(given.areas(w) - given.area * given.ratio)[0] - np.abs(given.areas(grown) - given.area * given.ratio)[0]
    )
    costs = patches._costs(w, grown)
    assert costs[first] == pytest.approx(0.21 * given.areas(w)[0] - loss) and costs[second] == 0


def scripted_patches(lacking, reflex):
    """Patches whose maps are numbers of rounds: what corners lack after each, and which corners are reflex then."""
    taken = []

    def stepped(w, weight, strength):
        taken.append(strength.tolist())
        return w + 1

    return taken, SimpleNamespace(
        strength=np.array([30.0, 30.0]),
        area_weight=None,
        corners=SimpleNamespace(reflex=reflex),
        _lacking=lambda w, _: lacking(w),
        _barrier=lambda w, strength: strength,
        _stepped=stepped,
    )


@pytest.mark.parametrize("kept, rounds", [(0.94, 48), (0.96, 12), (1.0, 12)])
def test_rounds_go_on_while_they_bring_what_is_worth_it(kept, rounds):
    """The first dozen in any case, and no more than four dozens."""
    taken, patches = scripted_patches(lambda w: kept**w, lambda w: np.array([True, w < 3]))
    assert CornerPatches._forced_anew(patches, 0) == rounds == len(taken)
    assert taken == [[30.0 * 2**k, 30.0 * 2 ** min(k, 3)] for k in range(rounds)]


@pytest.mark.parametrize("rounds", [0, 1, 30])
def test_rounds_end_once_no_corner_is_reflex(rounds):
    taken, patches = scripted_patches(lambda w: 0.5**w, lambda w: np.array([False, w < rounds]))
    assert CornerPatches._forced_anew(patches, 0) == rounds == len(taken)


@pytest.mark.parametrize(
    "errors, weights, strengths",
    [
        # An error that is a quarter greater, and a little more: from the third round on the area weighs more.
        (1.25, [2, 2, 2, 2], [30, 3, 0.3, 0.03]),
        (1.26, [2, 2, 3, 4.5], [30, 3, 0.3, 0.03]),
    ],
)
def test_the_barrier_weakens_and_areas_weigh_more_where_they_suffer(errors, weights, strengths):
    taken, one = [], np.zeros(1, int)

    def stepped(w, weight, strength):
        taken.append((float(weight[0]), float(strength[0])))
        return w + 1

    patches = SimpleNamespace(
        strength=np.array([30.0]),
        area_weight=np.array([2.0]),
        of_face=one,
        of_vertex=one,
        chart=one,
        spare=np.array([1.0]),
        _forced=lambda w: w,
        _symmetric=lambda w: w,
        _area_errors=lambda w: np.array([errors if w[0] else 1.0]),
        _reflex_count=lambda w: np.array([0 if w[0] else 2]),
        _barrier=lambda w, strength: strength,
        _stepped=stepped,
        _costs=lambda given, w: np.array([0.5]),
    )
    given = np.zeros(1)
    # Forced, it has no reflex corner any more.
    patches._forced = lambda w: w + 1
    assert CornerPatches.convexified(patches, given) == [5]
    assert [w for w, _ in taken] == weights and [s for _, s in taken] == pytest.approx(strengths)
    # What costs more than can be spared goes on, and is not taken.
    taken.clear()
    patches._costs = lambda given, w: np.array([1.5])
    assert CornerPatches.convexified(patches, given) is not given and len(taken) == 12
    assert CornerPatches.convexified(patches, given) == [0]
    # Where no corner is the better for it, nothing is tried.
    taken.clear()
    patches._forced = lambda w: w
    assert CornerPatches.convexified(patches, given) is given and not taken
