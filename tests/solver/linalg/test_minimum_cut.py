"""Cheapest cuts of graphs, beside all others."""

from itertools import product

import numpy as np
import pytest

from omt_uv.solver.linalg.minimum_cut import capacities, least_cut


@pytest.mark.parametrize("seed", range(6))
def test_no_other_cut_is_cheaper(seed):
    rng = np.random.default_rng(seed)
    count = 9
    joined = np.array([(a, b) for a in range(count) for b in range(a) if rng.random() < 0.5 or b == a - 1])
    capacity = rng.integers(1, 9, len(joined)).astype(np.int32)
    one, other = np.array([0, 1]), np.array([8])
    side = least_cut(joined, capacity, count, one, other)

    def price(side):
        return capacity[side[joined[:, 0]] != side[joined[:, 1]]].sum()

    assert side[one].all() and not side[other].any()
    inner = product([False, True], repeat=6)
    assert price(side) == min(price(np.array([True, True, *some, False])) for some in inner)


def test_what_is_joined_to_both_ends_is_cut_from_the_one_that_it_hangs_on_less():
    joined, capacity = np.array([[0, 1], [1, 2], [0, 2]]), np.array([3, 2, 7], np.int32)
    assert least_cut(joined, capacity, 3, np.array([0]), np.array([2])).tolist() == [True, True, False]
    assert least_cut(joined, capacity[[1, 0, 2]], 3, np.array([0]), np.array([2])).tolist() == [True, False, False]


def test_capacities_are_prices_in_whole_numbers():
    price = np.array([1.0, 2.0, 3.0, 0.0, 1e9])
    found = capacities(price[:4])
    assert found.tolist() == [6667, 13333, 20000, 1] and found.dtype == np.int32
    assert capacities(price).max() == 50_000 and capacities(1e-3 * price).tolist() == capacities(price).tolist()
    assert capacities(np.append(np.zeros(4999), 1.0)).max() == 10_000_000


def test_no_edges_have_no_capacities():
    assert capacities(np.zeros(0)).shape == (0,)
