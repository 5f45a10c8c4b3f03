"""What is exactly at the bound of a warning is not yet worth one, and the next number is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.pipelines import layout, subdivision, texel_density
from omt_uv.pipelines.gate import Gate
from omt_uv.pipelines.layout import OVERLAP


def test_overlap_is_told_above_its_bound_and_as_before_up_to_as_much_more():
    assert Gate(9, 0, OVERLAP).warnings() == ()
    (told,) = Gate(9, 0, float(np.nextafter(OVERLAP, 1))).warnings()
    assert "under several faces" in told and "as before" not in told
    (told,) = Gate(9, 0, 0.5 + OVERLAP).warnings(Gate(9, 0, 0.5))
    assert told.endswith(", as before")
    (told,) = Gate(9, 0, float(np.nextafter(0.5 + OVERLAP, 1))).warnings(Gate(9, 0, 0.5))
    assert "as before" not in told


@pytest.mark.parametrize(("folds", "before", "same"), [(2, 2, True), (3, 2, False), (1, 2, True), (2, None, False)])
def test_folds_are_as_before_where_there_are_no_more(folds, before, same):
    (told,) = Gate(9, folds, 0.0).warnings(None if before is None else Gate(9, before, 0.0))
    assert ("as before" in told) == same and "folded in the UVs" in told
    assert Gate(9, 0, 0.0).warnings(Gate(9, 2, 0.0)) == ()


@pytest.mark.parametrize(("more", "told"), [(0.0, True), (-1e-9, False)])
def test_islands_grow_together_from_the_bound_of_overlap_on(monkeypatch, more, told):
    island = SimpleNamespace(
        uv=np.zeros((3, 2)), before=np.zeros((3, 2)), chart=SimpleNamespace(triangles=np.zeros((1, 3), int))
    )
    shares = iter([0.0, OVERLAP + more])
    monkeypatch.setattr(layout, "overlap_share", lambda *_: next(shares))
    assert bool(layout.grown_together([island, island])) == told
    assert layout.grown_together([island]) == ""


@pytest.mark.parametrize(("beyond", "told"), [(0.0, False), (1e-12, True)])
def test_uvs_reach_beyond_their_tile_by_more_than_rounding(monkeypatch, beyond, told):
    uv = np.array([[0.25, 0.25], [1.125, 0.75]])
    monkeypatch.setattr(texel_density, "ROUNDING", 0.125 - beyond)
    assert texel_density.beyond_tile(uv) == (0.125 if told else 0.0)
    assert texel_density.beyond_tile(1 - uv) == (0.125 if told else 0.0)


@pytest.mark.parametrize(("corners", "refined"), [(0, False), (1, True), (8, True), (9, False)])
def test_cages_of_no_more_corners_than_is_said_are_refined(monkeypatch, corners, refined):
    monkeypatch.setattr(subdivision, "REFINED_QUADS", 8)
    assert subdivision.refinable(SimpleNamespace(corner_vertex=np.zeros(corners, int))) == refined
