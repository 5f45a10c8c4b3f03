"""Sites that repeat are replaced by others, each once, for as long as there are any."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.partition.sites import _distinct


@pytest.mark.parametrize("n", [1, 2, 7, 40])
@pytest.mark.parametrize("seed", range(4))
def test_numbers_that_repeat_are_replaced_and_the_first_of_each_stays(n, seed):
    rng = np.random.default_rng(seed)
    for k in (0, 1, n // 2, n):
        # Few different ones, so that many repeat; and just one of all.
        for few in (1, max(n // 3, 1), n):
            chosen = rng.integers(0, few, k)
            found = _distinct(chosen, n)
            assert len(set(found.tolist())) == k and set(found.tolist()) <= set(range(n))
            first = np.unique(chosen, return_index=True)[1]
            np.testing.assert_array_equal(found[first], chosen[first])
