"""Coarser meshes and the way back."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.density import Target, region_share
from omt_uv.solver.analysis.region_density import exact_density
from omt_uv.solver.maps.contacts import crossings
from omt_uv.solver.maps.energy import elements, energy
from omt_uv.solver.mesh.charts import triangle_rows
from omt_uv.solver.mesh.geometry import face_areas, signed_areas
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops, twins
from omt_uv.solver.parameterization.initial_map import DIRECT_WITH_ROOM, mean_value_sites
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import mesh_hierarchy
from omt_uv.solver.refinement.mesh_hierarchy import Collapsing, coarsen_disk
from omt_uv.solver.refinement.vertex_sweeps import smoothed
from omt_uv.solver.transport.convex_domain import Disk

SHAPES = ["head", "random_disk", "cap", "bumpy", "grid"]


def coarse_of(name, share=8):
    V, F = getattr(meshes, name)()
    flat = mean_value_sites(V, F, boundary_loops(F)[0], None, Disk())
    mass = face_areas(V, F)
    return V, F, flat, mass, drain(coarsen_disk(V, F, flat, mass, len(V) // share))


@pytest.mark.parametrize("name", SHAPES)
def test_a_coarser_mesh_is_the_same_disk(name):
    V, F, flat, mass, coarse = coarse_of(name)
    T = coarse.triangles
    assert len(coarse.kept) < len(V) / 2 and len(boundary_loops(T)) == 1
    assert len(coarse.kept) - (3 * len(T) + (twins(T) < 0).sum()) // 2 + len(T) == 1  # Euler
    assert (signed_areas(flat[coarse.kept], T) > 0).all()
    assert coarse.mass.sum() == pytest.approx(mass.sum()) and (coarse.mass > 0).all()


def bare(name, share=8, **options):
    """The coarser mesh of one that is not embedded."""
    V, F = getattr(meshes, name)()
    mass = face_areas(V, F)
    return V, F, mass, drain(coarsen_disk(V, F, None, mass, len(V) // share, **options))


@pytest.mark.parametrize("name", [*SHAPES, "comb", "two_bumps", "hemisphere"])
def test_a_coarser_mesh_of_one_that_is_not_embedded_is_the_same_disk(name):
    """Any map of it without folds is carried back without folds."""
    V, F, mass, coarse = bare(name)
    T = coarse.triangles
    loops = boundary_loops(T)
    assert len(coarse.kept) < 0.7 * len(V) and len(loops) == 1
    edges = np.sort(np.concatenate([T, np.roll(T, -1, axis=1)]).reshape(2, -1).T, axis=1)
    assert np.unique(edges, axis=0, return_counts=True)[1].max() <= 2
    assert len(coarse.kept) - (3 * len(T) + (twins(T) < 0).sum()) // 2 + len(T) == 1  # Euler
    assert coarse.mass.sum() == pytest.approx(mass.sum()) and (coarse.mass > 0).all()
    flat = mean_value_sites(V[coarse.kept], T, loops[0], None, Disk())
    assert (signed_areas(flat, T) > 0).all()
    uv = drain(coarse.prolonged(flat, len(V)))
    assert (signed_areas(uv, F) > 0).all()
    np.testing.assert_array_equal(uv[coarse.kept], flat)


def test_no_edge_is_made_twice_by_collapses_of_one_round():
    """Vertices of a coarse ring around another hang together by what would be doubled."""
    V, F = meshes.random_disk(400)
    for seed in range(6):
        flat = V[np.random.default_rng(seed).permutation(len(V))]
        coarse = drain(coarsen_disk(flat, F, None, np.ones(len(F)), 12))
        T = coarse.triangles
        assert len(boundary_loops(T)) == 1
        assert len(coarse.kept) - (3 * len(T) + (twins(T) < 0).sum()) // 2 + len(T) == 1  # Euler
        edges = np.sort(np.stack([T.ravel(), np.roll(T, -1, axis=1).ravel()], axis=1), axis=1)
        assert np.unique(edges, axis=0, return_counts=True)[1].max() <= 2


@pytest.mark.parametrize("name", SHAPES)
def test_the_whole_boundary_of_a_mesh_that_is_not_embedded_stays_where_it_is_asked_to(name):
    _, F, _, coarse = bare(name, 40, how=Collapsing(whole_boundary=True))
    assert np.isin(boundary_loops(F)[0], coarse.kept).all()


@pytest.mark.parametrize("name", SHAPES)
def test_no_face_folds_on_the_way_back(name):
    V, F, flat, _, coarse = coarse_of(name)
    uv = drain(coarse.prolonged(flat[coarse.kept], len(V)))
    assert (signed_areas(uv, F) > 0).all()
    np.testing.assert_array_equal(uv[coarse.kept], flat[coarse.kept])


@pytest.mark.parametrize("name", SHAPES)
def test_the_whole_boundary_stays_where_it_is_asked_to(name):
    """However few inner vertices are left beside it; otherwise some of it goes, too."""
    V, F, flat, mass, less = coarse_of(name, 40)
    loop = boundary_loops(F)[0]
    coarse = drain(coarsen_disk(V, F, flat, mass, len(V) // 40, how=Collapsing(whole_boundary=True)))
    assert np.isin(loop, coarse.kept).all() and not np.isin(loop, less.kept).all()
    kept = coarse.kept[boundary_loops(coarse.triangles)[0]]
    np.testing.assert_array_equal(np.roll(kept, -int(np.argmax(kept == loop[0]))), loop)
    assert coarse.mass.sum() == pytest.approx(mass.sum()) and len(coarse.kept) < len(V)
    uv = drain(coarse.prolonged(flat[coarse.kept], len(V)))
    assert (signed_areas(uv, F) > 0).all()
    np.testing.assert_array_equal(uv[loop], flat[loop])


@pytest.mark.parametrize("name", ["head", "random_disk", "grid"])
def test_vertices_are_left_where_the_density_asks_for_them(name):
    """Of a part that is to have eight times as many vertices for its area a greater share stays than of the rest."""
    V, F, flat, mass, _ = coarse_of(name)
    inside = np.linalg.norm(V - V[np.argmax(V @ [1.0, 0.6, 0.3])], axis=1) < 0.35 * np.ptp(V, axis=0).max()
    coarse = drain(coarsen_disk(V, F, flat, mass, len(V) // 5, density=np.where(inside, 8.0, 1.0)))
    kept = np.zeros(len(V), bool)
    kept[coarse.kept] = True
    assert kept[inside].mean() > 2 * kept[~inside].mean()
    assert (signed_areas(flat[coarse.kept], coarse.triangles) > 0).all()
    assert (signed_areas(drain(coarse.prolonged(flat[coarse.kept], len(V))), F) > 0).all()


def test_places_are_found_even_in_stars_without_room():
    V, F, flat, _, coarse = coarse_of("head")
    squeezed = flat[coarse.kept] * [1.0, 1e-3]
    squeezed[:, 0] += squeezed[:, 1] * 1e3
    assert (signed_areas(drain(coarse.prolonged(squeezed, len(V))), F) > 0).all()


def test_large_charts_come_by_way_of_coarser_ones():
    V, F = meshes.head(96)
    assert len(V) > DIRECT_WITH_ROOM
    (chart_map,) = drain(unwrap(triangle_surface(V, F))).maps
    assert "coarsening" in chart_map.seconds and chart_map.newton_refinement <= 25
    assert chart_map.folds == 0 and chart_map.area_l1 <= 0.01 and not chart_map.warnings
    moved = drain(unwrap(triangle_surface(1e3 * V + 2e3, F))).maps[0].uv / 1e3
    a, b = (x[:, 0] + 1j * x[:, 1] for x in (moved, chart_map.uv))
    turn = np.vdot(a, b)
    np.testing.assert_allclose(a * turn / abs(turn), b, atol=1e-5 * np.abs(b).max())


@pytest.mark.parametrize("boundary", ["disk", "square"])
def test_domains_are_reached_by_way_of_coarser_charts_too(boundary):
    V, F = meshes.head(96)
    (chart_map,) = drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(boundary, "draft"))).maps
    assert "coarsening" in chart_map.seconds
    assert chart_map.folds == 0 and chart_map.area_l1 <= 0.05 and not chart_map.warnings


def test_coarser_meshes_keep_their_boundary():
    V, F, _, _, coarse = coarse_of("head")
    np.testing.assert_array_equal(
        np.sort(coarse.kept[boundary_loops(coarse.triangles)[0]]), np.sort(boundary_loops(F)[0])
    )


def test_a_region_of_most_of_the_texture_gets_it_by_way_of_coarser_charts():
    V, F = meshes.head(96)
    surface = triangle_surface(V, F)
    centre = V[F].mean(axis=1)
    w = np.clip(2 - 4 * np.linalg.norm(centre - V[np.argmax(V[:, 2])], axis=1) / np.ptp(V[:, 2]), 0, 1)
    found = exact_density(w, area := face_areas(V, F), 0.8 / region_share(w, area))
    mapped = drain(unwrap(surface, target=Target(found.density, w), options=UnwrapOptions(quality="draft")))
    (chart,), (chart_map,) = mapped.charts, mapped.maps
    assert chart_map.folds == 0 and "coarsening" in chart_map.seconds
    has = signed_areas(chart_map.uv, chart.triangles)
    assert region_share(w[triangle_rows(surface, chart)], has) == pytest.approx(0.8, rel=0.02)


def test_smoothing_lowers_the_energy_and_folds_nothing():
    V, F, flat, mass, coarse = coarse_of("head")
    uv = drain(coarse.prolonged(flat[coarse.kept], len(V)))
    faces, outline = elements(V, F, mass), boundary_loops(F)[0]
    w = uv @ [1, 1j] * np.sqrt(mass.sum() / signed_areas(uv, F).sum())
    smooth = drain(smoothed(faces, w, 100.0, 2))
    assert (faces.areas(smooth) > 0).all() and energy(faces, smooth, 100.0) < energy(faces, w, 100.0)
    np.testing.assert_array_equal(smooth[outline], w[outline])


def test_what_returns_to_the_boundary_crosses_nothing():
    V, F = meshes.head(60)
    flat = mean_value_sites(V, F, boundary_loops(F)[0], None, Disk())
    coarse = drain(coarsen_disk(V, F, flat, face_areas(V, F), len(V) // 12))
    # A conformal map whose boundary is not convex.
    w = flat[coarse.kept] @ [1, 1j]
    w = w + 0.12 * w**5
    assert (signed_areas(np.column_stack([w.real, w.imag]), coarse.triangles) > 0).all()
    fine = drain(coarse.prolonged(np.column_stack([w.real, w.imag]), len(V)))
    assert not len(crossings(fine @ [1, 1j], boundary_loops(F)[0]))


@pytest.mark.parametrize("make", [lambda: meshes.bumpy(24, 24), meshes.comb, lambda: meshes.random_disk(900)])
def test_what_returns_to_the_boundary_stays_inside(make):
    """Also where the faces along its chord have no room: beyond it may be another part of the map."""
    V, F = make()
    flat = mean_value_sites(V, F, boundary_loops(F)[0], None, Disk())
    coarse = drain(coarsen_disk(V, F, flat, face_areas(V, F), len(V) // 8))
    squeezed = flat[coarse.kept] @ [[1, 0.3], [-0.3, 1]] * [1.0, 1e-3]
    fine = drain(coarse.prolonged(squeezed, len(V)))
    assert (signed_areas(fine, F) > 0).all()
    assert signed_areas(fine, F).sum() <= signed_areas(squeezed, coarse.triangles).sum() * (1 + 1e-9)


@pytest.mark.parametrize("name", SHAPES)
def test_a_region_keeps_its_share_of_the_mass_on_the_way_up(name):
    V, F, flat, mass, _ = coarse_of(name)
    weights = np.random.default_rng(0).random(len(F))
    coarse = drain(coarsen_disk(V, F, flat, mass, len(V) // 8, weights))
    assert (coarse.region >= 0).all() and (coarse.region <= 1 + 1e-12).all()
    assert coarse.region @ coarse.mass == pytest.approx(weights @ mass, rel=1e-9)


def test_the_coarser_mesh_does_not_hang_on_the_parts_in_which_its_stars_are_compared(monkeypatch):
    whole = coarse_of("bumpy")[-1]
    monkeypatch.setattr(mesh_hierarchy, "PART", 37)
    parts = coarse_of("bumpy")[-1]
    np.testing.assert_array_equal(parts.kept, whole.kept)
    np.testing.assert_array_equal(parts.triangles, whole.triangles)
    np.testing.assert_array_equal(parts.mass, whole.mass)
