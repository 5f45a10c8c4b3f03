"""Several regions get their exact shares together, or are refused with factors that would go."""

from __future__ import annotations

import re

import numpy as np
import pytest

from omt_uv.solver.analysis.joint_density import joint_density, shares_of
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.errors import ShareError, WeightError


@pytest.fixture
def painted():
    rng = np.random.default_rng(3)
    area = rng.uniform(0.5, 2.0, 2000)
    place = rng.random((2000, 2))
    centres = np.array([[0.2, 0.3], [0.7, 0.6], [0.4, 0.8]])
    distance = np.linalg.norm(place[:, None] - centres, axis=2)
    return np.clip(1.5 - distance / 0.14, 0, 1).T, area


@pytest.mark.parametrize("factors", [[3, 0.5, 2], [1, 1, 1], [2, 3, 2], [0.1, 6, 1]])
def test_shares_are_exact_together_whether_regions_overlap_or_not(painted, factors):
    regions, area = painted
    found = joint_density(regions, area, factors)
    got = shares_of(regions, area * found.density)
    assert got == pytest.approx(np.array(factors) * shares_of(regions, area), rel=1e-8)
    assert got == pytest.approx(found.target_shares)
    # Of all such measures it is the nearest: its logarithm is spanned by the weights.
    log = np.log(found.density) - np.log(found.density)[0]
    assert log == pytest.approx(found.tilts @ (regions - regions[:, :1]), abs=1e-9)


def test_one_region_is_what_it_is_alone(painted):
    regions, area = painted
    one, alone = joint_density(regions[:1], area, [2.5]), exact_density(regions[0], area, 2.5)
    assert one.density / one.density[0] == pytest.approx(alone.density / alone.density[0], rel=1e-8)


def test_densities_without_exact_shares_are_multiplied(painted):
    regions, area = painted
    found = joint_density(regions, area, [3, 0.5, 2], exact=False)
    expected = np.prod([1 + (f - 1) * w for f, w in zip([3, 0.5, 2], regions, strict=True)], axis=0)
    assert found.density == pytest.approx(expected)


def test_what_does_not_go_is_refused_with_factors_that_do(painted):
    regions, area = painted
    with pytest.raises(ShareError, match="together") as error:
        joint_density(regions, area, [9, 9, 9])
    text = str(error.value)
    assert "--no-exact" in text
    named = [float(x) for x in re.search(r"such as ([\d., ]+), or", text)[1].split(",")]
    assert all(1 < factor < 9 for factor in named)
    joint_density(regions, area, named)


def test_weights_and_factors_that_are_none_are_refused(painted):
    regions, area = painted
    with pytest.raises(WeightError, match="All weights are zero"):
        joint_density(np.array([regions[0], 0 * regions[0]]), area, [2, 2])
    with pytest.raises(ShareError, match="A region cannot have"):
        joint_density(regions, area, [2, -1, 2])
