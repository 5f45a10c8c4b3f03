"""Pockets of faces: cut off where that is cheapest, deep ones and no others, and their holes are left open."""

from dataclasses import replace
from types import SimpleNamespace

import bodies
import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.seam_costs import seam_costs
from omt_uv.solver.mesh.geometry import edge_lengths
from omt_uv.solver.mesh.surface import triangle_surface
from omt_uv.solver.mesh.topology import boundary_loops, pair_keys
from omt_uv.solver.parameterization import shear_search
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.pockets import pocket_borders
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import drain


def jug(mouth=12.0, size=0.4, rows=10, sides=24):
    """A sphere (n,3), polygons, with a spherical pocket of that size behind a mouth at +x, so many degrees around, and
    how far its vertices are in it (n,) in [0,1]; no body of revolution quite."""
    mouth = np.radians(mouth)
    opening = np.arcsin(np.sin(mouth) / size)
    middle = np.cos(mouth) - size * np.cos(opening)
    outer, inner = np.linspace(np.pi, mouth, 2 * rows), np.linspace(opening, np.pi, rows)[1:]
    r, x = np.append(np.sin(outer), size * np.sin(inner)), np.append(np.cos(outer), middle + size * np.cos(inner))
    r[[0, -1]] = 0
    points, polygons = bodies.turned(np.column_stack([r, x]), sides)
    row = np.append(0, np.repeat(np.arange(1, len(r) - 1), sides))
    row = np.append(row, len(r) - 1)
    within = np.clip((row - 2 * rows + 4) / 4, 0, 1)
    V = points[:, [2, 0, 1]]
    return V + 0.03 * np.sin(3 * V[:, [1, 2, 0]]) * [0, 1, 1], polygons, within


def costs_of(within, cost=None):
    """Costs of which only what is within, (n,), is asked, and those of the vertices (n,)."""
    cost = np.ones(len(within)) if cost is None else cost
    return SimpleNamespace(within=within, within_face=within > 0.5, vertex_cost=cost)


def test_a_pocket_is_cut_off_around_its_mouth():
    V, F, within = jug()
    edges = pocket_borders(meshes.polygon_surface(V, F), None, costs_of(within))
    assert edge_lengths(V, edges).sum() == pytest.approx(2 * np.pi * np.sin(np.radians(12)), rel=0.1)
    degree = np.bincount(edges.ravel(), minlength=len(V))
    assert set(degree) == {0, 2} and np.abs(V[edges, 0] - np.cos(np.radians(12))).max() < 0.1


def test_it_is_cut_where_that_costs_least():
    V, F, within = jug()
    dear = np.where((within > 0.3) | (within == 0), 5.0, 0.2)
    edges = pocket_borders(meshes.polygon_surface(V, F), None, costs_of(within, dear))
    assert len(edges) and (dear[edges] < 1).all()


def test_order_mirrors_place_and_size_do_not_matter():
    V, F, within = jug()
    mixed = [F[k] for k in np.random.default_rng(0).permutation(len(F))]
    first = np.sort(pair_keys(*pocket_borders(meshes.polygon_surface(V, F), None, costs_of(within)).T))
    assert len(first)
    for points, faces in (
        (V, mixed),
        (V * [1, 1, -1], [face[::-1] for face in F]),
        (1e3 * V + 50, [face[1:] + face[:1] for face in F]),
    ):
        edges = pocket_borders(meshes.polygon_surface(points, faces), None, costs_of(within))
        assert np.array_equal(np.sort(pair_keys(*edges.T)), first)


@pytest.mark.parametrize(
    "mouth, size, found", [(12.0, 0.4, True), (2.0, 0.09, False), (24.0, 0.42, False), (20.0, 0.5, True)]
)
def test_only_what_is_large_and_deeper_than_half_a_sphere_is_a_pocket(mouth, size, found):
    V, F, within = jug(mouth, size)
    assert bool(len(pocket_borders(meshes.polygon_surface(V, F), None, costs_of(within)))) == found


def test_what_is_in_no_face_has_no_pocket_nor_has_what_is_not_chosen():
    V, F, within = jug()
    assert not len(pocket_borders(meshes.polygon_surface(V, F), None, costs_of(0 * within)))
    assert not len(pocket_borders(meshes.polygon_surface(V, F), None, costs_of(0.9 * within)))
    outside = np.array([within[face].max() < 0.5 for face in F])
    assert not len(pocket_borders(meshes.polygon_surface(V, F), outside, costs_of(within)))


def test_all_of_something_is_no_pocket():
    """A second body that is within all over, as an eye in its socket, stays as it is."""
    V, F, within = jug()
    ball, triangles = bodies.icosphere(2)
    both = meshes.polygon_surface(np.concatenate([V, 0.2 * ball]), [*F, *(triangles + len(V)).tolist()])
    edges = pocket_borders(both, None, costs_of(np.append(within, np.ones(len(ball)))))
    assert np.array_equal(edges, pocket_borders(meshes.polygon_surface(V, F), None, costs_of(within)))


@pytest.mark.parametrize("kept_free", [False, True])
def test_a_face_stays_whole_around_the_hole_that_a_pocket_leaves(monkeypatch, kept_free):
    V, F, within = jug()
    face = np.clip(3 * V[:, 0], 0, 1)

    def with_a_face(surface, preferences, faces):
        known = seam_costs(surface, preferences, faces)
        seen = face[known.edges].mean(axis=1) * (within[known.edges].mean(axis=1) < 0.5)
        return replace(known, face=face, within=within, cost=1 + 5 * seen, vertex_cost=1 + 5 * face * (within < 0.5))

    monkeypatch.setattr(shear_search, "seam_costs", with_a_face)
    # Whoever paints what stays free says where else seams may be.
    avoid = np.full(len(V), 1e-3) if kept_free else None
    found = drain(unwrap(meshes.polygon_surface(V, F), options=UnwrapOptions(max_shear=1.35), avoid=avoid))
    pocket = [c for c in found.charts if within[c.vertex_ids].mean() > 0.5]
    assert (len(found.charts) == 2 and len(pocket) == 1) != kept_free
    if kept_free:
        return
    around = pocket_borders(meshes.polygon_surface(V, F), None, with_a_face(meshes.polygon_surface(V, F), None, None))
    inner = ~np.isin(pair_keys(*found.seams.T), pair_keys(*around.T))
    on_face = (V[found.seams, 0].max(axis=1) > 0.7) & (within[found.seams].max(axis=1) < 0.5)
    assert not (inner & on_face).any()
    (rest,) = [c for c in found.charts if c is not pocket[0]]
    real = rest.triangles[np.flatnonzero(rest.faces >= 0)] if (rest.faces < 0).any() else rest.triangles
    assert len(boundary_loops(real)) == 2
    assert all(one.folds == 0 and one.angle_mean <= 1.35 for one in found.maps)


def test_surfaces_without_a_face_ask_for_no_pockets(monkeypatch):
    def never(*_):
        raise AssertionError("nobody has to know")

    monkeypatch.setattr(shear_search.ShearSearch, "pockets", property(never))
    V, F = meshes.grid(6, 6)
    assert len(drain(unwrap(triangle_surface(V, F), options=UnwrapOptions(max_shear=1.35))).charts) == 1
