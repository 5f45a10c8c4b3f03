"""Overlap: shares that are known, and what they do not depend on."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.overlap import overlap_share


def square(n=8):
    V, F = meshes.grid(n, n)
    return V[:, :2][F]


def test_a_map_that_covers_nothing_twice():
    assert overlap_share(square()) == 0


@pytest.mark.parametrize("shift", [0.0, 0.25, 0.5, 1.0])
def test_two_squares_that_are_shifted(shift):
    """Both lie under two faces where they meet, (1 - shift) of each."""
    uv = np.concatenate([square(), square() + [shift, 0]])
    assert overlap_share(uv) == pytest.approx(1 - shift, abs=0.01)


def test_mirror_images_turns_and_scales_change_nothing():
    uv = np.concatenate([square(), square() + [0.5, 0.3]])
    expected = overlap_share(uv)
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    for other in (uv * [-1, 1], 1e6 * uv + 1e7, uv @ turn):
        assert overlap_share(other) == pytest.approx(expected, abs=0.01)


def test_the_same_seed_gives_the_same_share():
    uv = np.random.default_rng(0).random((50, 3, 2))
    assert overlap_share(uv, samples=1000, seed=3) == overlap_share(uv, samples=1000, seed=3)
    assert 0 < overlap_share(uv, samples=1000) <= 1


def test_a_map_without_area():
    assert overlap_share(np.zeros((4, 3, 2))) == 0
