"""What the pipelines make of a Subdivision Surface modifier: its surface, its UVs, and areas asked for on it."""

from __future__ import annotations

from dataclasses import replace

import meshes
import numpy as np
import pytest

from omt_uv.pipelines import subdivision
from omt_uv.pipelines.layout import UnwrapJob
from omt_uv.pipelines.reading import Reading
from omt_uv.pipelines.subdivision import (
    evaluated,
    on_subdivided_surface,
    polygon_uv_areas,
    refinable,
    refined_on_subdivision,
    subdivided_target,
    target_of,
)
from omt_uv.pipelines.unwrap import lay_out
from omt_uv.settings import Settings
from omt_uv.solver.analysis.density import Target
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import Surface
from omt_uv.solver.progress import drain
from omt_uv.solver.subdivision.modifier import SubdivisionModifier

MODIFIER = SubdivisionModifier(levels=2)


def bowl(rows: int = 4, columns: int = 5) -> Surface:
    """A curved patch of quads of all sizes, and a vertex that nothing uses."""
    x, y = (np.linspace(-1, 1, k + 1) ** 3 * 0.5 + np.linspace(-1, 1, k + 1) * 0.7 for k in (rows, columns))
    u, v = (w.ravel() for w in np.meshgrid(x, y, indexing="ij"))
    V = np.concatenate([np.column_stack([u, v, 1.5 * (u**2 + v**2) + 0.3 * u * v]), [[9.0, 9.0, 9.0]]])
    i = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    quads = np.column_stack([i, i + columns + 1, i + columns + 2, i + 1])
    return meshes.polygon_surface(V, quads.tolist())


def read(surface: Surface, uv=None, modifier=MODIFIER) -> Reading:
    count = len(surface.face_start) - 1
    faces = np.arange(count) % 3 > 0
    return Reading(surface, faces, uv, None, subdivision=modifier)


def areas_of_polygons(fine: Surface, count: int) -> np.ndarray:
    """Areas (f,) of the polygons of a cage whose quads lie in turn in the subdivided surface, as many for each."""
    area = face_areas(fine.positions, fine.corner_vertex[fine.triangles])
    return area.reshape(count, -1).sum(axis=1)


def test_without_a_modifier_all_is_as_it_is():
    plain = read(bowl(), modifier=None)
    assert evaluated(plain) is plain and target_of(plain) is None
    assert on_subdivided_surface(plain.surface, None) is plain.surface
    nothing = read(meshes.polygon_surface(np.zeros((0, 3)), []))
    assert evaluated(nothing) is nothing


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_what_is_evaluated_has_the_quads_of_every_polygon_in_turn(levels):
    surface = bowl()
    count = len(surface.face_start) - 1
    uv = np.random.default_rng(0).random((4 * count, 2)).astype(np.float32)
    found = evaluated(read(surface, uv, replace(MODIFIER, levels=levels)))
    each = 4**levels
    assert len(found.surface.face_start) - 1 == each * count
    np.testing.assert_array_equal(found.faces, np.repeat(np.arange(count) % 3 > 0, each))
    assert found.uv.shape == (4 * each * count, 2) and found.subdivision is None
    # Triangles are the halves of quads, none twice.
    quads = found.surface.triangles.reshape(-1, 6) // 4
    np.testing.assert_array_equal(quads, np.repeat(np.arange(each * count), 6).reshape(-1, 6))
    assert (np.sort(found.surface.triangles % 4, axis=1)[:, 0] == 0).sum() >= each * count
    np.testing.assert_array_equal(found.surface.triangle_face, np.repeat(np.arange(each * count), 2))


def test_areas_asked_for_are_those_on_the_subdivided_surface():
    surface = bowl()
    count = len(surface.face_start) - 1
    target = subdivided_target(surface, MODIFIER)
    own = face_areas(surface.positions, surface.corner_vertex[surface.triangles])
    asked = np.bincount(surface.triangle_face, own * target.density, count)
    # Half by half they differ a little from the mean of both ways to cut a quad.
    fine = areas_of_polygons(evaluated(read(surface)).surface, count)
    np.testing.assert_allclose(asked, fine, rtol=0.02)
    assert np.ptp(asked / np.bincount(surface.triangle_face, own, count)) > 0.05
    assert target.region is None
    np.testing.assert_array_equal(target_of(read(surface)).density, target.density)
    # Another density multiplies it, and a region is kept.
    more, region = np.linspace(1, 3, len(own)), np.arange(len(own)) % 2.0
    both = subdivided_target(surface, MODIFIER, Target(more, region))
    np.testing.assert_allclose(both.density, more * target.density)
    np.testing.assert_array_equal(both.region, region)


def test_polygons_that_vanish_are_given_a_place():
    surface = bowl()
    count = len(surface.face_start) - 1
    points = surface.positions.copy()
    points[surface.corner_vertex[4 * 7 : 4 * 8]] = points[surface.corner_vertex[4 * 7]]
    flat = replace(surface, positions=points)
    density = subdivided_target(flat, MODIFIER).density
    middle = np.median(density[flat.triangle_face != 7])
    assert (density >= 0.0099 * middle).all() and (density <= 101 * middle).all()
    # Nor is one asked for that is a needle on either side, so that nothing else would be left for the others.
    thin = surface.positions.copy()
    corners = surface.corner_vertex[4 * 7 : 4 * 8]
    thin[corners[2:]] = thin[corners[[1, 0]]] + 1e-7 * (thin[corners[2:]] - thin[corners[[1, 0]]])
    density = subdivided_target(replace(surface, positions=thin), MODIFIER).density
    middle = np.median(density)
    assert density.max() > 99 * middle and (density >= 0.0099 * middle).all() and (density <= 101 * middle).all()
    # Where none has an area, all are alike.
    nowhere = replace(surface, positions=0 * surface.positions)
    np.testing.assert_array_equal(subdivided_target(nowhere, MODIFIER).density, np.ones(2 * count))


def test_vertices_lie_on_the_subdivided_surface_and_those_of_nothing_stay():
    surface = bowl()
    found, fine = on_subdivided_surface(surface, MODIFIER), evaluated(read(surface)).surface
    n = len(surface.positions) - 1
    np.testing.assert_allclose(found.positions[:n], fine.positions[:n])
    assert np.abs(found.positions[:n] - surface.positions[:n]).max() > 0.01
    np.testing.assert_array_equal(found.positions[n], [9.0, 9.0, 9.0])
    np.testing.assert_array_equal(found.corner_vertex, surface.corner_vertex)


def test_areas_of_uvs_are_those_of_what_is_evaluated():
    surface = bowl()
    count = len(surface.face_start) - 1
    flat = surface.positions[surface.corner_vertex][:, :2]
    uv = flat + 0.1 * np.sin(3 * flat[:, ::-1])
    fine = evaluated(read(surface, uv))
    corners = fine.uv[fine.surface.triangles].reshape(-1, 2)
    area = np.abs(signed_areas(corners, np.arange(len(corners)).reshape(-1, 3)))
    found = polygon_uv_areas(surface, uv, MODIFIER)
    np.testing.assert_allclose(found, area.reshape(count, -1).sum(axis=1), rtol=1e-6)


def test_cages_of_up_to_so_many_corners_are_refined(monkeypatch):
    surface = bowl()
    assert refinable(surface) and not refinable(meshes.polygon_surface(np.zeros((0, 3)), []))
    for most, expected in ((len(surface.corner_vertex), True), (len(surface.corner_vertex) - 1, False)):
        monkeypatch.setattr(subdivision, "REFINED_QUADS", most)
        assert refinable(surface) == expected


@pytest.mark.parametrize("most", [40_000, 0])
def test_areas_on_the_subdivided_surface_are_kept_whether_cages_are_refined_or_are_too_dense(most, monkeypatch):
    """Dense cages get the areas of their subdivided polygons: UVs have no part in it that are refined for them."""
    surface = bowl(6, 6)
    count = len(surface.face_start) - 1
    given = Settings(quality="exact")
    plain = drain(lay_out([UnwrapJob(surface)], given))
    monkeypatch.setattr(subdivision, "REFINED_QUADS", most)
    found = drain(lay_out([UnwrapJob(surface, subdivision=MODIFIER)], given))
    assert (most == 0) == (refined_as_it_is(surface, found) is found.maps[0])
    asked = areas_of_polygons(evaluated(read(surface)).surface, count)

    def error(layout):
        uv = np.zeros((len(surface.corner_vertex), 2))
        uv[layout.corners[0]] = layout.uv[0]
        if most:
            area = polygon_uv_areas(surface, uv, MODIFIER)
        else:
            corners = uv[surface.triangles].reshape(-1, 2)
            signed = signed_areas(corners, np.arange(len(corners)).reshape(-1, 3))
            area = np.bincount(surface.triangle_face, np.abs(signed), count)
        return np.abs(area / area.sum() - asked / asked.sum()).sum()

    assert error(found) < 0.01 < 0.5 * error(plain)


def refined_as_it_is(surface, layout):
    """The map of a layout after another refinement: itself where there is none."""
    return drain(refined_on_subdivision(surface, layout.maps[0], MODIFIER, None, "free"))


@pytest.mark.parametrize("most", [1, 100, 400, 10**6])
def test_uvs_have_as_many_levels_as_the_surface_also_where_these_are_fewer_than_asked_for(monkeypatch, most):
    monkeypatch.setattr(subdivision, "MOST_QUADS", most)
    surface = bowl()
    uv = np.random.default_rng(0).random((len(surface.corner_vertex), 2)).astype(np.float32)
    found = evaluated(read(surface, uv, replace(MODIFIER, levels=3)))
    assert found.uv.shape == (len(found.surface.corner_vertex), 2)
    quads = {1: 1, 100: 1, 400: 2, 10**6: 3}
    assert len(found.surface.face_start) - 1 == 20 * 4 ** quads[most]
