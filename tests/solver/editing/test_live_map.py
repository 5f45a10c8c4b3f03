"""A map that follows a slider: never a fold on the way, in place, and at rest where the refinement is."""

from __future__ import annotations

import meshes
import numpy as np
import pytest
from polygons import cut, wavy_quads

from omt_uv.solver.editing.live_map import LiveMap
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.maps.distortion import distortion
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.progress import drain


def seen_from_above(V):
    return V[:, :2] * [1.0, 0.6]


def at_rest(live, balance, places=None):
    for _ in range(200):
        uv = live.follow(balance, places, seconds=0.0)
        if live.at_rest:
            return uv
    raise AssertionError("it never comes to rest")


@pytest.mark.parametrize("mirror", [1, -1])
def test_no_fold_on_the_way_and_in_place(mirror):
    V, F = meshes.bumpy(14, 14)
    start = seen_from_above(V) * [mirror, 1] + [5, -2]
    live, area = LiveMap(V, F, start), face_areas(V, F)
    centre = area @ start[F].mean(1) / area.sum()
    errors = []
    for balance in np.concatenate([np.linspace(0, 1, 12), np.linspace(1, 0, 7)]):
        uv = live.follow(balance, seconds=0.0)
        signed = signed_areas(uv, F)
        assert (np.sign(signed) == np.sign(mirror)).all()
        assert np.abs(signed).sum() == pytest.approx(np.abs(signed_areas(start, F)).sum())
        assert area @ uv[F].mean(1) / area.sum() == pytest.approx(centre)
    for balance in (0.0, 0.5, 1.0):
        figures = distortion(V, F, at_rest(live, balance)[F])
        errors.append((figures.area_l1, -figures.angle_mean))
    assert errors == sorted(errors)  # along the slider areas get worse and angles better


def test_at_rest_it_is_where_refine_area_ends():
    V, F = meshes.bumpy(12, 12)
    uv = seen_from_above(V)
    live = LiveMap(V, F, uv)
    at_rest(live, 0.9)
    mine, theirs = at_rest(live, 0.4), drain(refine_island(V, F, uv, balance=0.4)).uv
    assert np.abs(mine - theirs).max() < 0.01 * np.ptp(uv)


def test_pins_are_where_they_are_dragged_to():
    V, F = meshes.bumpy(12, 12)
    uv = seen_from_above(V)
    pins = np.array([0, 12, 84])
    places = uv[pins].copy()
    live = LiveMap(V, F, uv, (pins, places))
    for _ in range(6):
        places = places + [[0, 0], [0, 0], [0.01, 0.02]]
        moved = live.follow(0.2, places, seconds=0.0)
        assert (signed_areas(moved, F) > 0).all()
    moved = at_rest(live, 0.2, places)
    assert np.abs(moved[pins] - places).max() < 1e-5


def test_a_start_with_folds_is_straightened_and_said():
    V, F = meshes.bumpy(10, 10)
    uv = seen_from_above(V)
    uv[60] += [0.4, 0.1]
    live = LiveMap(V, F, uv)
    assert live.warnings
    assert (signed_areas(live.uv, F) > 0).all()


def test_quads_go_where_the_refinement_takes_them():
    V, Q, uv = wavy_quads()
    F, faces = cut(Q)
    mine = at_rest(LiveMap(V, F, uv, polygons=faces), 0.4)
    theirs = drain(refine_island(V, F, uv, balance=0.4, polygons=faces)).uv
    assert np.abs(mine - theirs).max() < 5e-3 * np.ptp(theirs)
