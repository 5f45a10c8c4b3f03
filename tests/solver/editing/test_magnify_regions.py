"""Several regions of a map are magnified by factors of their own at once: shares exact, no folds, outline kept."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.joint_density import shares_of
from omt_uv.solver.editing import magnify_regions as magnify_regions_module
from omt_uv.solver.editing.magnify_regions import magnify_regions
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.progress import drain


def painted(V, F):
    centres = np.array([[0.25, 0.3], [0.7, 0.65], [0.3, 0.75]])
    distance = np.linalg.norm(V[F].mean(axis=1)[:, None, :2] - centres, axis=2)
    return np.clip(1.6 - distance / 0.11, 0, 1).T


@pytest.mark.parametrize("factors", [[3.0, 2.0, 0.5], [1.0, 4.0, 1.0]])
def test_shares_of_three_regions_are_exact_together(factors):
    V, F = meshes.grid(24, 24)
    regions, uv = painted(V, F), V[:, :2]
    found = drain(magnify_regions(uv, F, regions, factors))
    area = signed_areas(found.uv, F)
    assert (area > 0).all() and found.outline == "sides" and area.sum() == pytest.approx(1)
    asked = np.array(factors) * shares_of(regions, signed_areas(uv, F))
    assert shares_of(regions, area) == pytest.approx(asked, rel=1.5e-3)
    assert found.target.target_shares == pytest.approx(asked)


def test_without_exact_shares_the_factor_is_that_between_the_weights():
    V, F = meshes.grid(24, 24)
    regions = painted(V, F)
    found = drain(magnify_regions(V[:, :2], F, regions, [2.0, 3.0, 1.5], exact=False))
    area = signed_areas(found.uv, F)
    outside, inside = (regions == 0).all(axis=0), regions[1] == 1
    ratio = area[inside].sum() / inside.sum() / (area[outside].sum() / outside.sum())
    assert ratio == pytest.approx(3, rel=0.03)


@pytest.mark.parametrize("factor", [1.0, 1.5, 6.0, 40.0])
def test_no_step_changes_densities_by_more_than_it_may_and_none_is_idle(factor, monkeypatch):
    """Steps are as many as the range of what is asked has parts of the largest step, each of which moves the map."""
    V, F = meshes.grid(8, 8)
    calls = []
    whole = magnify_regions_module.magnify_map
    monkeypatch.setattr(magnify_regions_module, "magnify_map", lambda *a, **k: calls.append(a[2]) or whole(*a, **k))
    regions = np.clip(1.5 - 3 * np.linalg.norm(V[F].mean(axis=1)[:, :2] - 0.5, axis=1), 0, 1)[None]
    drain(magnify_regions(V[:, :2], F, regions, [factor], exact=False))
    spread = np.log(max(np.ptp(np.log(density)) for density in calls) + 1e-300) if factor > 1 else -np.inf
    asked = np.log(factor)
    assert len(calls) == max(1, int(np.ceil(asked / magnify_regions_module.LARGEST_STEP - 1e-9)))
    assert np.exp(spread) <= magnify_regions_module.LARGEST_STEP + 1e-9
