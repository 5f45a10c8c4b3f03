"""How right UVs of a cage can be: what is minimised, and that it becomes less."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.parts import cage
from omt_uv.solver.subdivision.modifier import SubdivisionModifier


def test_areas_have_their_slopes_and_steps_make_them_less_wrong(monkeypatch):
    fine, uv = cage._subdivided_head(SubdivisionModifier(1))
    direction = np.random.default_rng(0).normal(size=uv.shape)
    difference = (fine.areas(uv + 1e-6 * direction) - fine.areas(uv - 1e-6 * direction)) / 2e-6
    np.testing.assert_allclose(fine.slopes(uv) @ direction.T.ravel(), difference, atol=1e-7)
    assert fine.areas(uv).sum() == pytest.approx(1) and fine.share.sum() == pytest.approx(1)
    monkeypatch.setattr(cage, "LEAST_STEPS", 4)
    before, after = (fine.figures(x) for x in (uv, cage._with_least_error(fine, uv)))
    assert after.area_l1 < before.area_l1 and after.angle_mean > before.angle_mean
