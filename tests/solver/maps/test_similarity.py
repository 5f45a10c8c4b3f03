"""One fit of a similarity for all that is laid on something else."""

import numpy as np
import pytest

from omt_uv.solver.maps.similarity import Similarity, fit_similarity

RNG = np.random.default_rng(0)
POINTS = RNG.standard_normal(20) + 1j * RNG.standard_normal(20)
MASS = RNG.random(20) / 20
MASS /= MASS.sum()


@pytest.mark.parametrize("mass", [None, MASS], ids=["alike", "weighted"])
@pytest.mark.parametrize("factor", [2 - 3j, 1e-6j, 1e6, -1.0])
def test_a_similarity_is_found_again(mass, factor):
    found = fit_similarity(POINTS, factor * POINTS + (5 - 7j), mass)
    assert found.factor == pytest.approx(factor, rel=1e-9)
    np.testing.assert_allclose(found(POINTS), factor * POINTS + (5 - 7j), rtol=1e-9)


@pytest.mark.parametrize("mass", [None, MASS], ids=["alike", "weighted"])
def test_nothing_fits_better(mass):
    aim = POINTS + 0.3 * RNG.standard_normal(20) + 0.2j * RNG.standard_normal(20)
    weight = np.full(20, 1 / 20) if mass is None else mass
    found = fit_similarity(POINTS, aim, mass)
    least = weight @ np.abs(found(POINTS) - aim) ** 2
    for change in 1e-3 * np.array([1, -1, 1j, -1j]):
        for other in (Similarity(found.factor + change, found.centre, found.goal),
                      Similarity(found.factor, found.centre, found.goal + change)):  # fmt: skip
            assert weight @ np.abs(other(POINTS) - aim) ** 2 > least


def test_a_rigid_fit_keeps_lengths_and_the_turn_of_the_best():
    aim = (2 + 1j) * POINTS + 4
    rigid, best = fit_similarity(POINTS, aim, MASS, rigid=True), fit_similarity(POINTS, aim, MASS)
    assert abs(rigid.factor) == pytest.approx(1, rel=1e-15)
    assert np.angle(rigid.factor) == pytest.approx(np.angle(best.factor), abs=1e-12)
    assert MASS @ rigid(POINTS) == pytest.approx(MASS @ aim)


def test_a_centre_goes_where_it_is_told():
    found = fit_similarity(POINTS, 1j * POINTS, rigid=True, about=(2.0, 3 + 1j))
    assert found(np.array([2.0 + 0j]))[0] == 3 + 1j


@pytest.mark.parametrize("quarters", range(4))
@pytest.mark.parametrize("off", [0.0, 0.4, -0.4, 0.78, -0.78])
def test_turns_are_rounded_to_the_nearest_quarter(quarters, off):
    found = fit_similarity(POINTS, 3 * np.exp(1j * (np.pi / 2 * quarters + off)) * POINTS).in_quarter_turns()
    assert found.factor == pytest.approx(3 * 1j**quarters, abs=1e-12)


def test_points_without_a_direction_are_scaled_and_not_turned():
    square = np.array([1, 1j, -1, -1j])
    assert fit_similarity(square, 2 * square.conj()).factor == pytest.approx(2)
    assert fit_similarity(square, 2 * square.conj(), rigid=True).factor == 1


@pytest.mark.parametrize("turn", [1, np.exp(2j)])
@pytest.mark.parametrize("share, directed", [(1e-1, True), (1e-5, True), (1e-7, False), (0.0, False)])
def test_a_direction_is_one_down_to_a_millionth(share, directed, turn):
    square = np.array([1, 1j, -1, -1j])
    aim = 2 * (square.conj() + share * turn * square)
    expected = 2 * share * turn if directed else 2
    assert fit_similarity(square, aim).factor == pytest.approx(expected, rel=1e-4)
    # In any unit.
    assert fit_similarity(1e-9 * square, 1e9 * aim).factor == pytest.approx(1e18 * expected, rel=1e-4)


@pytest.mark.parametrize(("share", "told"), [(1.5e-6, True), (0.7e-6, False)])
def test_a_mirror_image_has_no_direction_but_keeps_its_size(share, told):
    """Of points on a circle, a mirror image fits in no direction; a share of a turn beside it is one from 1e-6 on."""
    w = np.exp(2j * np.pi * np.arange(12) / 12)
    found = fit_similarity(w, 3 * (share * 1j * w + w.conj()))
    assert found.factor == pytest.approx(3j * share if told else 3.0, rel=1e-3)
