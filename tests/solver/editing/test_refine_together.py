"""Islands side by side: each as it would be alone, in its place, and what needs more is given back."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.pipelines.refine import refine_islands
from omt_uv.settings import RefineSettings
from omt_uv.solver.editing.refine_island import refine_island
from omt_uv.solver.editing.refine_together import GivenIsland, refine_together
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.parameterization.chart_indices import CornerPins
from omt_uv.solver.progress import drain


def island(seed, **change):
    """A small bumpy disk in some unit, its map sheared, turned, moved and, every third, mirrored."""
    rng = np.random.default_rng(seed)
    V, F = meshes.bumpy(3 + seed % 4, 4, height=0.3 + 0.1 * (seed % 3))
    angle = rng.uniform(0, 6)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    mirror = [-1 if seed % 3 == 0 else 1, 1]
    uv = (V[:, :2] * [1.0, 0.6]) @ turn * mirror * rng.uniform(0.1, 3) + rng.normal(size=2)
    given = GivenIsland(V * 10.0 ** rng.integers(-6, 6), F, uv, np.arange(len(F)))
    return replace(given, **change)


def ratios(given, uv):
    """UV area over area asked for, up to a factor."""
    asked = face_areas(given.vertices, given.triangles)
    if given.density is not None:
        asked = asked * given.density
    ratio = signed_areas(uv, given.triangles) / asked
    return ratio / np.median(ratio)


@pytest.mark.parametrize("balance", [0.0, 0.5])
def test_each_is_what_it_would_be_alone(balance):
    islands = [island(seed) for seed in range(9)]
    together = drain(refine_together(islands, balance=balance))
    for given, found in zip(islands, together, strict=True):
        alone = drain(refine_island(given.vertices, given.triangles, given.uv, balance=balance))
        extent = np.ptp(given.uv, axis=0).max()
        assert np.abs(found.uv - alone.uv).max() < 0.02 * extent
        assert found.status == "converged" and not found.overlap and found.warnings == ()
        assert found.energy == pytest.approx(alone.energy, rel=0.05)
        before, after = (signed_areas(uv, given.triangles).sum() for uv in (given.uv, found.uv))
        assert after == pytest.approx(before, rel=1e-9)


def test_densities_are_asked_for_where_they_are_given():
    islands = [island(seed) for seed in range(8)]
    weight = 1 + np.linspace(0, 1, len(islands[2].triangles))
    islands[2] = replace(islands[2], density=weight)
    found = drain(refine_together(islands))
    for given, refinement in zip(islands, found, strict=True):
        assert np.abs(ratios(given, refinement.uv) - 1).max() < 0.02
    assert np.ptp(ratios(replace(islands[2], density=None), found[2].uv)) > 0.6


def test_what_needs_more_is_given_back():
    folded = island(1)
    folded = replace(folded, uv=np.where(np.arange(len(folded.uv))[:, None] == 6, folded.uv + 100, folded.uv))
    V, F = meshes.annulus(12, 2)
    ring = GivenIsland(V, F, V[:, :2].copy(), np.arange(len(F)))
    flat = island(2, uv=np.zeros_like(island(2).uv))
    wrong = island(4, uv=np.full_like(island(4).uv, np.nan))
    found = drain(refine_together([folded, ring, flat, wrong, island(5)]))
    assert [refinement is None for refinement in found] == [True, True, True, True, False]
    assert drain(refine_together([ring, folded])) == [None, None] and drain(refine_together([])) == []


def test_a_density_that_is_none_sends_all_of_them_alone():
    islands = [island(seed) for seed in range(3)]
    wrong = replace(islands[1], density=np.zeros(len(islands[1].triangles)))
    assert drain(refine_together([islands[0], wrong, islands[2]])) == [None] * 3


def surface(count):
    """Islands of one surface, its corners' UVs, and none of them pinned."""
    given = [island(seed) for seed in range(count)]
    first = np.cumsum([0, *(len(i.vertices) for i in given)])
    V = np.concatenate([i.vertices / np.ptp(i.vertices) for i in given])
    F = np.concatenate([i.triangles + k for i, k in zip(given, first, strict=False)])
    uv = np.concatenate([i.uv + [5 * k, 0] for k, i in enumerate(given)])[F].reshape(-1, 2)
    return triangle_surface(V, F), CornerPins(pinned=np.zeros(len(uv), bool), uv=uv)


@pytest.mark.parametrize("count", [3, 12])
def test_few_and_many_islands_of_a_surface_are_refined_alike(count, monkeypatch):
    """Twelve side by side, or one by one; with their outlines kept, always one by one."""
    calls = []

    def recorded(islands, **options):
        calls.append(len(islands))
        return refine_together(islands, **options)

    monkeypatch.setattr("omt_uv.pipelines.refine.refine_together", recorded)
    whole, pins = surface(count)
    done = drain(refine_islands([(whole, None, pins)], RefineSettings()))
    assert calls == ([12] if count == 12 else [])
    monkeypatch.setattr("omt_uv.solver.parameterization.small_charts.MANY", 99)
    alone = drain(refine_islands([(whole, None, pins)], RefineSettings()))
    np.testing.assert_allclose(done.uv[0], alone.uv[0], atol=0.02)
    assert [r["status"] for r in done.reports[0]] == ["converged"] * count
    for report in done.reports[0]:
        assert report["area_l1"] < 5e-3 < report["before"]["area_l1"] and report["folds"] == 0
    monkeypatch.setattr("omt_uv.solver.parameterization.small_charts.MANY", 1)
    calls.clear()
    drain(refine_islands([(whole, None, pins)], RefineSettings(keep_boundary=True)))
    assert calls == []


def test_batches_of_any_size_give_the_same(monkeypatch):
    whole, pins = surface(12)
    done = drain(refine_islands([(whole, None, pins)], RefineSettings()))
    monkeypatch.setattr("omt_uv.solver.parameterization.small_charts.BATCH", 60)
    parted = drain(refine_islands([(whole, None, pins)], RefineSettings()))
    np.testing.assert_allclose(done.uv[0], parted.uv[0], atol=1e-3)
