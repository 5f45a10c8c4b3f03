"""What a batch measures of its charts is what each alone has, with a region or without; and when maps are smoothed."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps import energy
from omt_uv.solver.maps.energy import energies, missing_tilt, target_error, target_error_but_share, tilted
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import batch_refine
from omt_uv.solver.refinement import refine as refinement

COUNT = 4


def together(regions):
    """Some charts as one, maps of them, and each alone; `regions` says which have a region."""
    rng = np.random.default_rng(len(regions))
    alone, begin = [], 0
    for k in range(COUNT):
        V, F = meshes.grid(3 + k, 4)
        V = V + rng.normal(size=V.shape) * 0.02
        w = (V[:, 0] + 1j * V[:, 1]) * rng.uniform(0.5, 2) + 0.02 * rng.normal(size=(len(V), 2)) @ [1, 1j]
        # A region all over, or nowhere, has no share to be missing.
        region = {"some": rng.random(len(F)) < 0.4, "all": np.ones(len(F)), "none": np.zeros(len(F))}[regions[k]]
        alone.append((energy.elements(V, F, rng.uniform(0.5, 2, len(F)), region.astype(float)), w, begin))
        begin += len(V)
    faces = [of for of, _, _ in alone]
    joined = replace(
        faces[0],
        triangles=np.concatenate([of.triangles + at for of, _, at in alone]),
        **{
            name: np.concatenate([getattr(of, name) for of in faces])
            for name in ("area", "hats", "ratio", "weight", "region")
        },
    )
    charts = object.__new__(batch_refine._ActiveCharts)
    charts.faces, charts.count = joined, COUNT
    charts.of_face = np.repeat(np.arange(COUNT), [len(of.triangles) for of in faces])
    charts.share = np.bincount(charts.of_face, joined.weight)
    return charts, np.concatenate([w for _, w, _ in alone]), alone


@pytest.mark.parametrize("regions", [["some"] * 4, ["all", "some", "none", "some"]])
def test_errors_and_tilts_are_those_of_each_chart_alone(regions):
    charts, w, alone = together(regions)
    found = charts._area_errors(w)
    for k, (faces, mine, _) in enumerate(alone):
        assert found.error[k] == pytest.approx(target_error(faces, mine), rel=1e-9)
        if regions[k] == "some":
            assert found.tilt[k] == pytest.approx(missing_tilt(faces, mine), rel=1e-9)
            assert abs(found.tilt[k]) > 1e-3
            assert found.error_but_share[k] == pytest.approx(target_error_but_share(faces, mine), rel=1e-9)
    charts.faces = replace(charts.faces, region=None)
    plain = charts._area_errors(w)
    for k, (faces, mine, _) in enumerate(alone):
        assert plain.error[k] == plain.error_but_share[k] and plain.tilt[k] == 0
        assert plain.error[k] == pytest.approx(target_error(replace(faces, region=None), mine), rel=1e-9)


def test_tilted_targets_and_energies_are_those_of_each_chart_alone():
    charts, w, alone = together(["some"] * 4)
    area_weight, multiplier = np.array([1.0, 3.0, 10.0, 0.5]), np.array([0.0, 2.0, -5.0, 0.7])
    found = charts._tilted(SimpleNamespace(multiplier=multiplier), area_weight)
    value = charts._energies(found, w, area_weight[charts.of_face])
    for k, (faces, mine, _) in enumerate(alone):
        expected = tilted(faces, multiplier[k] / area_weight[k])
        np.testing.assert_allclose(found.ratio[charts.of_face == k], expected.ratio, rtol=1e-12)
        assert value[k] == pytest.approx(energies(expected, mine, area_weight[k]).sum(), rel=1e-9)
    charts.faces = replace(charts.faces, region=None)
    assert charts._tilted(SimpleNamespace(multiplier=multiplier), area_weight) is charts.faces


@pytest.mark.parametrize("tense, crosses, folds, ends_crossing", list(product([False, True], repeat=4)))
def test_a_map_is_smoothed_where_it_is_tense_and_valid_before_and_after(
    monkeypatch, tense, crosses, folds, ends_crossing
):
    before, after = np.array([0, 1, 1j]), np.array([0, 1.1, 1j])

    def smoothed(*_):
        yield from ()
        return after

    monkeypatch.setattr(refinement, "smoothed", smoothed)
    level = 3.0 * (1.01 if tense else 0.99)
    problem = SimpleNamespace(
        newton_problem=lambda *_: SimpleNamespace(energy=lambda _w: level),
        boundary_crosses=lambda w: crosses if w is before else ends_crossing,
        symmetry=None,
        loop=None,
    )
    by_triangle = SimpleNamespace(areas=lambda _w: np.array([0.5, -0.1 if folds else 0.1]))

    def run():
        yield from ()
        return (yield from refinement._smoothed_if_tense(problem, by_triangle, before, 1.0))

    found = drain(run())
    assert (found is after) == (tense and not crosses and not folds and not ends_crossing)
    assert found is before or found is after


def test_energies_of_quads_that_are_measured_anew_are_those_of_tilted_targets(monkeypatch):
    """As those before and after them: a chart that is not on its way any more keeps its own."""
    charts, w, _ = together(["some"] * 4)
    area_weight, multiplier = np.array([1.0, 3.0, 10.0, 0.5]), np.array([0.0, 2.0, -5.0, 0.7])
    live, old = np.array([True, True, False, True]), np.array([1.0, 2.0, 3.0, 4.0])
    continuation = SimpleNamespace(multiplier=multiplier, area_weight=area_weight, live=live, value=old)
    new = replace(charts.faces, area=1.1 * charts.faces.area)
    monkeypatch.setattr(batch_refine, "with_convex_quads", lambda faces, _: new)
    charts._select_quads(w, area_weight[charts.of_face], continuation)
    assert charts.faces is new
    expected = charts._energies(charts._tilted(continuation, area_weight), w, area_weight[charts.of_face])
    np.testing.assert_array_equal(continuation.value, np.where(live, expected, old))
    plain = charts._energies(new, w, area_weight[charts.of_face])
    assert (np.isfinite(expected) & (plain != expected) & live).sum() >= 1
