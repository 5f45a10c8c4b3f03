"""Lengths at the same energy: what is told of maps between which the one asked for lies."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from benchmarks.parts.level import Tried, energy_of, length_at


def test_a_length_is_told_from_the_next_longer_and_the_next_shorter():
    far, above, below = (Tried(e, s, 1, 1.0) for e, s in ((4.9, 1.0), (4.4, 2.0), (4.1, 3.0)))
    assert length_at([far, above, below], 4.1) == pytest.approx(3.0)
    assert length_at([far, below, above], 4.2) == pytest.approx(np.sqrt(6)), "halfway in the logarithm"
    assert length_at([far, above], 4.2) == 2.0, "the nearest where none is below"


def test_the_energy_is_four_for_any_size_and_more_where_it_shears():
    V, F = meshes.grid(4, 3)
    assert energy_of(V, F, 7 * V[F][..., :2]) == pytest.approx(4)
    stretched = V[F][..., :2] * [2.0, 0.5]
    assert energy_of(V, F, stretched) == pytest.approx(2 * (4 + 1 / 4))
