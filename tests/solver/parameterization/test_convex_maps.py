"""Maps whose polygons become convex keep their place, their size and what is pinned."""

from dataclasses import replace

import hard_meshes
import meshes
import numpy as np
import polygons
import pytest

from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.mesh.charts import strict_charts
from omt_uv.solver.mesh.geometry import signed_areas
from omt_uv.solver.parameterization import convex_maps
from omt_uv.solver.parameterization.chart_indices import ChartPins
from omt_uv.solver.parameterization.chart_map import FOLDED, map_chart, measured_map
from omt_uv.solver.parameterization.convex_maps import (
    OTHERWISE,
    with_convex_polygons,
    with_dents_told,
    with_drawn_triangles,
    with_figures,
)
from omt_uv.solver.parameterization.options import MapOptions, UnwrapOptions
from omt_uv.solver.parameterization.polygons import convexity, corner_solver
from omt_uv.solver.parameterization.polygons.convexity import dented_faces, keep_convex, reflex_triangles
from omt_uv.solver.parameterization.polygons.polygon_corners import convex_corners
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement.continuation_rules import QUALITIES


def darts():
    """A flat square of quads, and a map of it with darts that says its areas are good enough to lose some."""
    V, _ = meshes.grid(6, 6)
    a = (7 * np.arange(6)[:, None] + np.arange(6)).ravel()
    surface = meshes.polygon_surface(V, np.column_stack([a, a + 1, a + 8, a + 7]).tolist())
    (chart,) = strict_charts(surface)
    uv = chart.vertices[:, :2].copy()
    uv[np.isin(chart.vertex_ids, [24])] += 0.1
    found = drain(map_chart(chart))
    return surface, chart, replace(found, uv=uv, area_l1=0.1, area_weight=500.0)


def reflex(surface, chart, uv):
    corner, _, _ = convex_corners(surface)
    vertex = np.empty(len(surface.corner_vertex), int)
    vertex[chart.corners] = chart.triangles
    return (signed_areas(uv, vertex[corner]) <= 0).sum()


@pytest.mark.parametrize("turn", [1.0, 1j, -1.0])
def test_place_direction_and_area_stay(turn):
    surface, chart, chart_map = darts()
    w = 3 * turn * (chart_map.uv @ [1, 1j]) + (5 - 2j)
    chart_map = replace(chart_map, uv=np.column_stack([w.real, w.imag]))
    (found,) = drain(with_convex_polygons(surface, [chart], [chart_map], [None], MapOptions()))
    assert reflex(surface, chart, chart_map.uv) and not reflex(surface, chart, found.uv)
    np.testing.assert_allclose(found.uv.mean(0), chart_map.uv.mean(0))
    area, before = signed_areas(found.uv, chart.triangles), signed_areas(chart_map.uv, chart.triangles)
    assert area.sum() == pytest.approx(before.sum(), rel=1e-9) and (area > 0).all()
    centred = (x @ [1, 1j] - (x @ [1, 1j]).mean() for x in (found.uv, chart_map.uv))
    assert np.angle(np.vdot(*centred)) == pytest.approx(0, abs=1e-12)


def test_pins_stay_to_the_bit():
    surface, chart, chart_map = darts()
    at = np.flatnonzero(np.isin(chart.vertex_ids, [0, 6, 48]))
    pins = ChartPins(at, chart_map.uv[at], chart_map.uv[chart.triangles])
    (found,) = drain(with_convex_polygons(surface, [chart], [chart_map], [pins], MapOptions()))
    assert not np.array_equal(found.uv, chart_map.uv)
    np.testing.assert_array_equal(found.uv[at], chart_map.uv[at])


def test_what_stays_folded_does_not_keep_the_rest_from_being_opened():
    surface, chart, chart_map = darts()
    uv = chart_map.uv.copy()
    uv[np.isin(chart.vertex_ids, [40])] += [0.18, 0.0]
    around = np.flatnonzero(np.isin(chart.vertex_ids, [32, 33, 34, 39, 40, 41, 46, 47, 48]))
    pins = ChartPins(around, uv[around], uv[chart.triangles])
    folds = np.unique(chart.faces[signed_areas(uv, chart.triangles) <= 0]).size
    (found,) = drain(
        with_convex_polygons(
            surface, [chart], [replace(chart_map, uv=uv, folds=folds, area_l1=0.3)], [pins], MapOptions()
        )
    )
    assert 0 < found.folds <= folds
    assert 0 < reflex(surface, chart, found.uv) < reflex(surface, chart, uv)


@pytest.mark.parametrize(
    "quality, seed", [("standard", 8), ("standard", 25), ("exact", 3), ("exact", 15), ("exact", 26), ("exact", 33)]
)
def test_no_polygon_of_a_body_with_limbs_folds_whichever_way_it_is_cut(quality, seed):
    """Corners were opened by the areas of triangles, and the map thrown away by those of polygons."""
    surface = meshes.polygon_surface(*polygons.with_limbs(seed))
    result = drain(unwrap(surface, options=UnwrapOptions(quality=quality)))
    for chart, chart_map in zip(result.charts, result.maps, strict=True):
        assert chart_map.folds == 0 and not chart_map.warnings
        assert reflex(surface, chart, chart_map.uv) == 0 and (signed_areas(chart_map.uv, chart.triangles) > 0).all()
        assert chart_map.area_l1 <= (0.01 if quality == "standard" else 0.001)


def test_polygons_that_fold_along_another_diagonal_are_told_where_they_stay():
    surface, chart, chart_map = darts()
    everything = np.arange(len(chart.vertices))
    pins = ChartPins(everything, chart_map.uv, chart_map.uv[chart.triangles])
    (found,) = drain(with_convex_polygons(surface, [chart], [chart_map], [pins], MapOptions()))
    count = len(dented_faces(surface, chart, found.uv))
    assert count == 1 and (signed_areas(found.uv, chart.triangles) > 0).all()
    assert [text for text in found.warnings if "1 face folds" in text]
    (opened,) = drain(with_convex_polygons(surface, [chart], [chart_map], [None], MapOptions()))
    assert not opened.warnings


def test_triangles_are_left_alone():
    surface = meshes.polygon_surface(*meshes.grid(3, 3))
    (chart,) = strict_charts(surface)
    maps = [drain(map_chart(chart))]
    assert drain(with_convex_polygons(surface, [chart], maps, [None], MapOptions())) is maps


def test_folds_that_were_mended_are_not_warned_of():
    V, quads = hard_meshes.percolation(64, 0.12)
    result = drain(unwrap(hard_meshes.surface(V, quads), options=UnwrapOptions()))
    (chart,), (chart_map,) = result.charts, result.maps
    folded = (signed_areas(chart_map.uv, chart.triangles) <= 0).sum()
    assert folded == chart_map.folds == 0
    assert not chart_map.warnings


@pytest.mark.parametrize("boundary", ["square", "disk", "rectangle"])
@pytest.mark.parametrize("seed", range(4))
def test_sieves_fold_nothing_in_any_shape(seed, boundary):
    """They have room there, or their boundary is free: dozens of folds and shear above 100 were the rule."""
    surface = hard_meshes.surface(*hard_meshes.percolation(14, 0.2, seed))
    found = drain(unwrap(surface, options=UnwrapOptions(boundary=boundary)))
    for chart, chart_map in zip(found.charts, found.maps, strict=True):
        assert chart_map.folds == 0 and (signed_areas(chart_map.uv, chart.triangles) > 0).all()
        assert chart_map.angle_mean < (30 if boundary == "disk" else 20)
        assert not any(text.endswith(FOLDED) for text in chart_map.warnings)


def test_maps_that_are_squeezed_to_rounding_stay_as_they_are():
    """Newton's steps have no energy to lower there: a singular system ended the run."""
    surface = hard_meshes.surface(*hard_meshes.terrain(4))
    charts = strict_charts(surface)
    uv = charts[0].vertices[:, :2].copy()
    corner = surface.corner_vertex[:4]
    first = np.flatnonzero(np.isin(charts[0].vertex_ids, corner))
    uv[first] *= [1, 1e-17]
    assert keep_convex(surface, charts, [uv], [np.zeros(len(uv), bool)], [None], [1.0], [1.0]) == {}


def test_folds_of_a_map_that_takes_the_place_of_another_are_told():
    surface, chart, chart_map = darts()
    uv = chart_map.uv.copy()
    uv[np.isin(chart.vertex_ids, [24])] += 0.3
    folded = with_figures(chart_map, uv, measured_map(chart, uv, None))
    assert folded.folds and folded.warnings == (f"{folded.folds} {FOLDED}",)
    flat = measured_map(chart, chart.vertices[:, :2], None)
    assert with_figures(folded, chart.vertices[:, :2], flat).warnings == ()


def test_both_bottoms_of_a_cup_stay_convex():
    """Its map is that of a disk about one of them, in which the wall squeezes the other."""
    sides, (k, turn) = 48, np.divmod(np.arange(4 * 48), 48)
    radius, height = np.array([1, 1, 0.88, 0.88])[k], np.array([0, 2, 2, 0.15])[k]
    angle = 2 * np.pi * turn / sides
    V = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    here, after = k * sides + turn, k * sides + (turn + 1) % sides
    walls = np.column_stack([here, after, after + sides, here + sides])[k < 3].tolist()
    surface = meshes.polygon_surface(V, [list(range(sides))[::-1], *walls, list(range(3 * sides, 4 * sides))])
    found = drain(unwrap(surface))
    assert not reflex_triangles(surface, found.charts, [m.uv for m in found.maps]).any()
    assert all(m.folds == 0 and m.area_l1 <= 0.01 and not m.warnings for m in found.maps)


@pytest.mark.parametrize(("sides", "first"), [(32, 8), (32, 16), (48, 24)])
@pytest.mark.parametrize("top", [0.0, 1.0])
def test_long_polygons_do_not_fold_as_they_are_drawn(sides, first, top):
    """One seam leaves both ends of a turned body to a map that makes neither convex; 1 or 2 of them folded.

    first : the corner from which the polygons are cut into triangles
    """
    (k, turn), rings = np.divmod(np.arange(4 * sides), sides), sides * np.arange(4)
    radius, height = np.array([1, 1, 0.7, 0.7])[k], np.array([-0.5, 0.5, 0.5, top])[k]
    angle = 2 * np.pi * turn / sides
    V = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    here, after = k * sides + turn, k * sides + (turn + 1) % sides
    walls = np.column_stack([here, after, after + sides, here + sides])[k < 3].tolist()
    ends = [np.roll(x, first).tolist() for x in (np.arange(sides)[::-1], np.arange(3 * sides, 4 * sides))]
    surface = meshes.polygon_surface(V, [ends[0], *walls, ends[1]], np.column_stack([rings[:-1], rings[1:]]))
    found = drain(unwrap(surface))
    for chart, one in zip(found.charts, found.maps, strict=True):
        assert one.folds == 0 and not any(text.endswith(FOLDED) for text in one.warnings)
        assert (signed_areas(one.uv, chart.triangles) > 0).all()
        assert one.area_l1 <= 0.01


def test_warnings_of_other_diagonals_are_those_of_the_map_that_is_kept():
    surface, chart, chart_map = darts()
    told = with_dents_told(surface, chart, chart_map)
    assert sum(text.endswith(OTHERWISE) for text in told.warnings) == 1
    assert with_dents_told(surface, chart, told).warnings == told.warnings
    flat = replace(told, uv=chart.vertices[:, :2])
    assert not any(text.endswith(OTHERWISE) for text in with_dents_told(surface, chart, flat).warnings)


def test_what_is_open_at_little_cost_is_not_refined_again(monkeypatch):
    surface, chart, chart_map = darts()
    monkeypatch.setattr(convex_maps, "refined_again", pytest.fail)
    (found,) = drain(with_convex_polygons(surface, [chart], [chart_map], [None], MapOptions()))
    assert reflex(surface, chart, chart_map.uv) and not reflex(surface, chart, found.uv)


def test_corners_are_forced_open_once_and_what_no_refinement_keeps_stays(monkeypatch):
    surface, chart, chart_map = darts()
    forced, real, refined = [], corner_solver.CornerPatches._forced_anew, []

    def force(patches, w):
        forced.append(w)
        return real(patches, w)

    def refuse(*arguments):
        refined.append(arguments)
        raise FoldedUVError("refused")
        yield

    monkeypatch.setattr(corner_solver.CornerPatches, "_forced_anew", force)
    monkeypatch.setattr(convex_maps, "refined_again", refuse)
    monkeypatch.setattr(convex_maps, "SHEAR_KEPT", 0.0)
    (found,) = drain(with_convex_polygons(surface, [chart], [chart_map], [None], MapOptions()))
    assert len(forced) == len(refined) == 1 and not reflex(surface, chart, found.uv)


@pytest.mark.parametrize("folds, kept", [((2, 4, 4), 2), ((4, 2, 3), 2), ((5, 5, 1), 1), ((6, 7, 8), 5)])
def test_of_several_rounds_that_with_fewest_folds_is_kept(monkeypatch, folds, kept):
    surface, chart, start = darts()
    start = replace(start, folds=5)
    rounds = iter(range(1, 4))

    def by_triangles(*_):
        yield from ()
        return start.uv + next(rounds)

    def measured(_chart, uv, _density):
        return replace(measured_map(chart, start.uv, None), folds=folds[round((uv - start.uv).max()) - 1])

    later = iter(np.eye(len(chart.triangles), dtype=bool))
    monkeypatch.setattr(convex_maps, "_by_triangles", by_triangles)
    monkeypatch.setattr(convex_maps, "measured_map", measured)
    monkeypatch.setattr(convex_maps, "_dented", lambda *_: next(later))
    monkeypatch.setattr(convex_maps, "_keeps", lambda *_: True)
    (found,) = drain(with_drawn_triangles(surface, [chart], [start], [None], MapOptions()))
    assert found.folds == kept


@pytest.mark.parametrize("quality", ["draft", "standard", "exact"])
def test_what_is_spared_and_what_is_off_are_together_all_that_may_be_off(quality, monkeypatch):
    """Of several maps each by itself: by what its own areas allow, or the goal where these are better."""
    surface, chart, chart_map = darts()
    goal = QUALITIES[quality].area_error
    maps = [replace(chart_map, area_l1=share * goal) for share in (0.0, 0.3, 1.0, 1.1, 2.0, 50.0)]
    given = []
    monkeypatch.setattr(convexity, "keep_convex", lambda *words: given.append(words) or {})
    options, count = MapOptions(quality=quality), len(maps)
    task = convex_maps._Opening(surface, [chart] * count, [None] * count, options, [None] * count, {})
    for which in (np.arange(count), np.array([4, 1])):
        some = [maps[k] for k in which]
        assert task.kept(some, which) == some
        off = np.array([m.area_l1 for m in some])
        spare = np.array(given.pop()[6])
        assert (spare >= 0).all()
        assert spare + off == pytest.approx(convex_maps.AREA_KEPT * np.maximum(off, goal))
