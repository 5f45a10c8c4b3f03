"""Samples stand for the whole area, lie on the surface, and crests are where faces meet at an angle."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.mesh.closest_point import ClosestPoint
from omt_uv.solver.mesh.geometry import face_areas, face_normals
from omt_uv.solver.remeshing.relaxation import surface_samples
from omt_uv.solver.remeshing.relaxation.surface_samples import (
    BLUNT,
    area_samples,
    crest_samples,
    join_samples,
    merged_samples,
    select_samples,
    sharpness,
    tip_samples,
)


def index_of(V, F, spacing=0.1):
    return ClosestPoint(V, F, spacing)


@pytest.mark.parametrize("name", ["icosphere", "torus", "bumpy"])
def test_areas_sum_to_the_surfaces(name):
    V, F = getattr(meshes, name)()
    samples = area_samples(index_of(V, F), 3000, np.ones(len(F)))
    area = face_areas(V, F)
    assert samples.area.sum() == pytest.approx(area.sum())
    if name == "icosphere":
        # Near equilateral triangles no sample has to stand for others.
        np.testing.assert_allclose(np.bincount(samples.faces, samples.area, len(F)), area)
    off = np.einsum("sj,sj->s", samples.points - V[F[samples.faces, 0]], face_normals(V, F)[samples.faces])
    assert np.abs(off).max() < 1e-12


def test_few_samples_stand_for_the_measure():
    V, F = meshes.icosphere(4)
    density = np.where(V[F].mean(axis=1)[:, 2] > 0, 9.0, 1.0)
    density /= face_areas(V, F) @ density / face_areas(V, F).sum()
    samples = area_samples(index_of(V, F), 500, density)
    measure = samples.area * density[samples.faces]
    assert len(measure) == 500 and measure.sum() == pytest.approx(face_areas(V, F) @ density)
    np.testing.assert_allclose(measure, measure[0])


@pytest.mark.parametrize("contrast", [1.0, 9.0, 100.0])
@pytest.mark.parametrize("scale", [1.0, 1e3])
def test_where_more_is_asked_for_there_are_more_samples(contrast, scale):
    """As dense as asked for where the density is greatest, in any unit."""
    V, F = meshes.icosphere(3)
    V = scale * V
    area, upper = face_areas(V, F), V[F].mean(axis=1)[:, 2] > 0
    density = np.where(upper, contrast, 1.0)
    density /= area @ density / area.sum()
    samples = area_samples(index_of(V, F, 0.1 * scale), 4000, density)
    share = np.bincount(samples.faces, minlength=len(F))[upper].sum() / 4000
    asked = (area @ np.where(upper, density, 0)) / area.sum()
    assert 0.8 * asked < share < 2 * asked and 3200 < len(samples.points) <= 8000


def test_crests_are_the_edges_of_a_cube():
    V, F = meshes.cube()
    for _ in range(4):
        V, F = meshes.subdivide(V, F)
    index = index_of(V, F, 0.2)
    sharp, low, high = sharpness(index), V.min(axis=0), V.max(axis=0)
    on_edge = ((low == V) | (high == V)).sum(axis=1) >= 2
    inside = (np.minimum(V - low, high - V) > 0.2).sum(axis=1) == 2
    assert sharp[on_edge].min() > 0.05 and sharp[inside].max() < BLUNT
    samples = crest_samples(index)
    distance = np.sort(np.minimum(samples.points - low, high - samples.points), axis=1)[:, 1]
    assert len(samples.points) > 50 and distance.max() < 0.2
    # A flat mesh has none.
    assert len(crest_samples(index_of(*meshes.grid(6, 6))).points) == 0


def test_tips_are_the_corners_of_a_cube_first():
    V, F = meshes.cube()
    for _ in range(3):
        V, F = meshes.subdivide(V, F)
    tips = tip_samples(index_of(V, F), 8)
    corners = (np.abs(V - V.mean(axis=0)) > 0.5 - 1e-12).all(axis=1)
    assert {tuple(p) for p in tips.points} == {tuple(p) for p in V[corners]}
    # However few there are, each counts for a quarter of what as many as were asked for have.
    V, F = meshes.cube()
    for most in (5, 8, 40):
        few = tip_samples(index_of(V, F), most)
        assert len(few.points) == min(most, 8)
        np.testing.assert_allclose(few.area, face_areas(V, F).sum() / (4 * most))
    assert len(tip_samples(index_of(*meshes.grid(6, 6)), 8).points) == 0


def test_samples_are_joined_and_selected_by_rows():
    V, F = meshes.torus()
    one = area_samples(index_of(V, F), 100, np.ones(len(F)))
    both = join_samples(one, one)
    again = select_samples(both, len(one.area) + np.arange(len(one.area)))
    np.testing.assert_array_equal(again.points, one.points)
    np.testing.assert_array_equal(again.faces, one.faces)


def test_sharpness_is_the_same_by_gradients(monkeypatch):
    """Large surfaces are diffused without factors, small ones with."""
    V, F = meshes.bumpy()
    index = index_of(V, F)
    factored = sharpness(index)
    monkeypatch.setattr(surface_samples, "LARGE", 0)
    assert factored.max() > 0.01
    np.testing.assert_allclose(sharpness(index), factored, atol=1e-5)


def test_samples_in_a_cube_that_look_the_same_way_are_merged_into_their_mean():
    """As a thin plate has them: two sides, which stay apart."""
    rng = np.random.default_rng(0)
    side = np.repeat([1.0, -1.0], 300)
    points = np.column_stack([rng.random((600, 2)), 0.01 * side + 0.5])
    normals = np.column_stack([np.zeros((600, 2)), side])
    samples = surface_samples.SurfaceSamples(points, normals, rng.random(600), np.arange(600))
    found = merged_samples(samples, 0.25)
    assert 2 * 16 <= len(found.area) <= 2 * 25
    assert found.area.sum() == pytest.approx(samples.area.sum())
    np.testing.assert_allclose(found.area @ found.points, samples.area @ points)
    for way in (1, -1):
        mine = found.normals[:, 2] == way
        np.testing.assert_allclose(found.points[mine, 2], 0.5 + 0.01 * way)
        assert found.area[mine].sum() == pytest.approx(samples.area[side == way].sum())
    # Each has the triangle of one of those it is made of.
    assert (np.abs(points[found.faces] - found.points).max(axis=1) < 0.25).all()
    np.testing.assert_array_equal(side[found.faces], found.normals[:, 2])
    # With cubes that hold one each nothing changes but the order.
    same = merged_samples(samples, 1e-9)
    order = np.argsort(same.faces)
    np.testing.assert_allclose(same.points[order], points)
    np.testing.assert_allclose(same.area[order], samples.area)
