"""Boxes that overlap: all of them, each once, whatever their sizes."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.contact import box_pairs as finding
from omt_uv.solver.contact.box_pairs import box_pairs


def by_comparison(low, high, concerned=None):
    meet = ((low[:, None] <= high[None]) & (high[:, None] >= low[None])).all(axis=2)
    if concerned is not None:
        meet &= concerned[:, None] | concerned[None]
    return np.argwhere(np.triu(meet, 1)).tolist()


@pytest.mark.parametrize("spread", [0.0, 1.0, 3.0])
def test_all_pairs_once_for_boxes_of_any_sizes(spread):
    rng = np.random.default_rng(int(spread))
    low = rng.uniform(-3, 5, size=(400, 3))
    high = low + 0.4 * rng.uniform(size=(400, 3)) * np.exp(spread * rng.normal(size=(400, 1)))
    found = box_pairs(low, high)
    assert sorted(found.tolist()) == by_comparison(low, high)
    for share in (0.02, 0.5):
        concerned = rng.uniform(size=400) < share
        found = box_pairs(low, high, concerned)
        assert sorted(found.tolist()) == by_comparison(low, high, concerned)


def test_boxes_without_size_and_none_at_all():
    points = np.zeros((3, 3))
    assert sorted(box_pairs(points, points).tolist()) == [[0, 1], [0, 2], [1, 2]]
    assert box_pairs(points[:0], points[:0]).shape == (0, 2)
    assert box_pairs(points, points, np.zeros(3, bool)).shape == (0, 2)
    far = np.array([[0.0, 0, 0], [1e12, 0, 0], [1e12, 0, 0]])
    assert box_pairs(far, far + 1e-9).tolist() == [[1, 2]]


@pytest.mark.parametrize("block", [1, 2, 3, 7])
def test_pairs_are_the_same_however_many_are_looked_at_together(block, monkeypatch):
    """Also where just so many are left in the end."""
    rng = np.random.default_rng(block)
    low = rng.uniform(0, 1, size=(40, 3))
    high = low + rng.uniform(0, 0.5, size=(40, 3))
    expected = by_comparison(low, high)
    monkeypatch.setattr(finding, "BLOCK", block)
    for count in range(30, 41):
        found = box_pairs(low[:count], high[:count])
        assert sorted(found.tolist()) == [pair for pair in expected if max(pair) < count]
