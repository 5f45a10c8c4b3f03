"""A half and its mirror image: a coarse surface that is exactly symmetric, of one that may only nearly be."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from scipy.spatial import cKDTree
from scripted_steps import told, worked
from short_cuts import component_of

from omt_uv.solver.analysis.symmetry_plane import SymmetryPlane
from omt_uv.solver.mesh.geometry import below_one, face_areas, vertex_normals
from omt_uv.solver.mesh.topology import boundary_loops, halfedges, pair_keys, twins
from omt_uv.solver.seams import search as searches
from omt_uv.solver.seams.coarse_cut import spread_along
from omt_uv.solver.seams.coarse_surface import _without_chords, half_coarsening
from omt_uv.solver.seams.fine_paths import fine_mirror
from omt_uv.solver.seams.search import SeamSearch

X = np.array([1.0, 0, 0])


def euler(triangles):
    edges = (len(halfedges(triangles)[0]) + (twins(triangles) < 0).sum()) // 2
    return len(np.unique(triangles)) - edges + len(triangles)


def ball(subdivisions):
    """An octahedron on its way to a sphere: its mirror planes run along edges."""
    V = np.concatenate([np.eye(3), -np.eye(3)])
    F = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])
    for _ in range(subdivisions):
        V, F = meshes.subdivide(V, F)
    return V / np.linalg.norm(V, axis=1, keepdims=True), F


def bodies():
    return {
        "sphere": ball(4),
        "ring across": meshes.torus(32, 16),
        "ring along": (meshes.torus(32, 16)[0][:, [2, 0, 1]], meshes.torus(32, 16)[1]),
        "open": meshes.two_bumps(24),
        "cap": meshes.cap(20, 40, 0.8),
    }


def mirrored(V, F):
    """The component of a surface, of about unit size as components are, and its mirror at the middle."""
    component = component_of(below_one(V)[0], F)
    plane = SymmetryPlane(X, (V[:, 0].min() + V[:, 0].max()) / 2, 0.0, None)
    return component, fine_mirror(component, plane, V[component.vertex_ids], np.ones(len(V), dtype=bool))


def half_of(component, mirror, count=200):
    seen = mirror.plane, mirror.image, mirror.height, mirror.normal
    return half_coarsening(component.positions, component.triangles, count, *seen)


def bent(V, seed, amount):
    """The same, no more than nearly symmetric: smooth waves move it."""
    rng = np.random.default_rng(seed)
    waves, phase = rng.normal(size=(3, 3)) / np.ptp(V, axis=0).max() * 4, rng.random(3) * 7
    return V + amount * np.ptp(V, axis=0).max() * np.sin(V @ waves + phase)


@pytest.mark.parametrize("amount", [0.0, 0.004])
@pytest.mark.parametrize("name", bodies())
def test_a_half_and_its_image_are_the_surface_again_and_exactly_symmetric(name, amount):
    V, F = bodies()[name]
    component, mirror = mirrored(bent(V, 3, amount), F)
    assert mirror.exact == (amount == 0)
    F, coarse = component.triangles, half_of(component, mirror).ended(200)
    there, n = coarse.images, len(coarse.kept)
    assert 100 < n < 260
    # Images go both ways, and are where they belong.
    own = there.image == np.arange(n)
    assert np.array_equal(there.image[there.image], np.arange(n)) and own.any() and there.side[own].all()
    assert (there.side[there.image] != there.side)[~own].all()
    level = coarse.positions[own, 0].mean()
    assert np.allclose(coarse.positions[own, 0], level, atol=1e-9)
    reflected = coarse.positions * [-1, 1, 1] + [2 * level, 0, 0]
    assert np.allclose(coarse.positions[there.image], reflected, atol=1e-9)
    # So are the triangles, the other way round.
    turned = np.sort(coarse.triangles, axis=1), np.sort(there.image[coarse.triangles], axis=1)
    assert np.array_equal(*(np.unique(t, axis=0) for t in turned))
    # It is a manifold like the fine one, with the same sums.
    tail, head = halfedges(coarse.triangles)
    assert len(np.unique(tail * n + head)) == len(tail)
    assert euler(coarse.triangles) == euler(F)
    assert len(boundary_loops(coarse.triangles)) == len(boundary_loops(F))
    on_boundary = np.zeros(n, dtype=bool)
    on_boundary[tail[twins(coarse.triangles) < 0]] = True
    assert np.array_equal(coarse.boundary, on_boundary)
    assert np.isclose(coarse.area.sum(), 1) and np.allclose(coarse.area[there.image], coarse.area)
    assert np.allclose(coarse.curvature[there.image], coarse.curvature)
    assert np.isclose(coarse.size**2, face_areas(component.positions, F).sum(), rtol=0.03)
    assert np.isclose(coarse.curvature.sum(), 2 * np.pi * euler(F))
    # Every vertex stands for one on its own side that is near.
    far = np.linalg.norm(component.positions[coarse.kept] - coarse.positions, axis=1)
    assert far.max() < (0.05 if amount else 1e-9)
    assert np.array_equal((mirror.height[coarse.kept] >= 0)[~own], there.side[~own])


def test_a_half_has_the_plane_where_it_is_and_every_vertex_of_what_is_small():
    V, F = ball(2)
    component, mirror = mirrored(V, F)
    coarse = half_of(component, mirror, 2000).ended(2000)
    assert np.array_equal(np.sort(coarse.kept), np.arange(len(V)))
    assert np.allclose(coarse.positions, component.positions[coarse.kept], atol=1e-9)


def test_what_is_no_half_is_none():
    V, F = meshes.icosphere(3)
    component, mirror = mirrored(V, F)
    plane = np.abs(mirror.height - 0.3 * mirror.height.max()) < 0.1 * mirror.height.max()
    seen = mirror.image, mirror.height - 0.3 * mirror.height.max(), X
    assert half_of(component, mirror) is None  # The plane runs across edges.
    # Less than half of the area; and no line at all.
    assert half_coarsening(component.positions, component.triangles, 200, plane, *seen) is None
    none = np.zeros(len(V), dtype=bool)
    assert half_coarsening(component.positions, component.triangles, 200, none, *seen) is None


def test_an_edge_across_a_half_is_flipped_and_where_it_cannot_be_there_is_none():
    plane = np.array([True, True, False, False, True])
    flipped = _without_chords(np.array([[0, 2, 1], [0, 1, 3]]), plane)
    assert set(pair_keys(*halfedges(flipped))) >= set(pair_keys(np.array([2]), np.array([3])))
    assert not set(pair_keys(*halfedges(flipped))) & set(pair_keys(np.array([0]), np.array([1])))
    # The other edge would have both its ends in the plane, too.
    assert _without_chords(np.array([[0, 2, 1], [0, 1, 4]]), plane | [False, False, True, False, False]) is None
    # Or be there already.
    closed = np.array([[0, 2, 1], [0, 1, 3], [2, 3, 1], [2, 0, 3]])
    assert _without_chords(closed, plane) is None
    plain = np.array([[0, 2, 1]])
    assert _without_chords(plain, plane) is plain


@pytest.mark.parametrize("seed", range(3))
def test_images_of_what_is_thin_are_on_the_same_side_of_it(seed):
    """A plate thinner than it misses its mirror image by: the nearest vertex is as often that beneath."""
    V, F = meshes.icosphere(4)
    component, mirror = mirrored(bent(V * [1, 0.7, 0.01], seed, 0.006), F)
    assert not mirror.exact
    N = vertex_normals(component.positions, component.triangles)
    facing = (N[mirror.image] * (N * [-1, 1, 1])).sum(axis=1)
    flat = np.abs(N[:, 2]) > 0.9
    assert (facing[flat] > 0).mean() > 0.99
    nearest = cKDTree(component.positions).query(component.positions - 2 * mirror.height[:, None] * X)[1]
    assert ((N[nearest] * (N * [-1, 1, 1])).sum(axis=1)[flat] > 0).mean() < 0.95


def with_fin(width, side, height=0.6):
    """A sphere, no more than nearly symmetric, with a fin on one flank alone; its component, and mirror."""
    V, F = bodies()["sphere"]
    off = np.arccos(np.clip(V @ [0.8 * side, 0.6, 0], -1, 1))
    V = V * (
        1 + 0.002 * np.sin(5 * V[:, 1:2] + V[:, :1]) + height * (np.maximum(1 - off / max(width, 1e-9), 0))[:, None]
    )
    component = component_of(below_one(V)[0], F)
    plane = SymmetryPlane(X, 0.0, 0.0, None)
    return component, fine_mirror(component, plane, V[component.vertex_ids], np.ones(len(V), dtype=bool))


@pytest.mark.parametrize(("width", "alike"), [(0.0, True), (0.3, True), (0.45, False)])
@pytest.mark.parametrize("side", [-1, 1])
def test_whether_halves_are_alike_is_in_doubt_where_one_has_a_limb_of_its_own(width, alike, side, monkeypatch):
    component, mirror = with_fin(width, side)
    assert not mirror.exact and mirror.halved and mirror.alike == alike
    asked = []
    monkeypatch.setattr(searches, "half_coarsening", lambda *given: asked.append("half"))
    mine = SeamSearch(np.zeros(1), None, None)
    for halved in (True, False):
        coarse, _ = mine._modelled(component, replace(mirror, halved=halved))
        assert coarse.images is None and asked == ["half"]


@pytest.mark.parametrize("side", [-1, 1])
def test_a_cut_holds_for_both_halves_that_leaves_about_as_much_of_the_whole(side):
    component, _ = with_fin(0.45, side, 1.5)
    mine, ends = SeamSearch(np.zeros(1), None, None), component.positions[component.ends]
    far = np.linalg.norm(ends, axis=2).max(axis=1)
    along = np.abs(ends[:, :, 2]).max(axis=1) < 0.03

    def found(edges, left):
        return SimpleNamespace(
            cut=SimpleNamespace(spread=left),
            task=SimpleNamespace(bound=0.0),
            carried=lambda component: SimpleNamespace(edges=edges),
        )

    coarse, model = mine._modelled(component)
    left = spread_along(coarse, model, ends[along])
    assert left < model.spread / 20
    assert mine._holds_for_both(component, found(along, left))
    # The same cut without what of it goes to the tip of the fin.
    assert not mine._holds_for_both(component, found(along & (far < 1.1 * np.median(far)), left))


@pytest.mark.parametrize("alike", [True, False])
@pytest.mark.parametrize("halved", [True, False])
@pytest.mark.parametrize("holds", [True, False])
def test_what_one_half_does_not_stand_for_is_searched_as_a_whole(alike, halved, holds, monkeypatch):
    asked = []

    def several(self, component, base, mirror, bound, trials):
        asked.append(mirror.halved)
        return worked([mirror.halved])

    monkeypatch.setattr(SeamSearch, "_several_grown", several)
    monkeypatch.setattr(SeamSearch, "_trials", lambda *_: 1)
    monkeypatch.setattr(SeamSearch, "_rehearsal", lambda *_: SimpleNamespace(best_of=lambda cuts, _: worked(cuts[0])))
    monkeypatch.setattr(SeamSearch, "_shortened", lambda self, found: worked(found))
    monkeypatch.setattr(SeamSearch, "_holds_for_both", lambda self, component, found: holds)
    mirror = replace(with_fin(0.3, 1)[1], alike=alike, halved=halved)
    found, fractions = told(SeamSearch(np.zeros(1), None, None)._symmetric(None, None, 1.0, mirror))
    again = halved and not alike and not holds
    assert asked == [halved, False][: 1 + again] and found == asked[-1]
    assert (np.diff(fractions) > -1e-9).all() and fractions[-1] <= 1


def test_scale_and_place_do_not_matter():
    V, F = meshes.icosphere(3)
    V = bent(V, 1, 0.004)
    found = [half_of(*mirrored(W, F)).ended(150) for W in (V, 1024 * V, V + [8, 4, 2])]
    for other in found[1:]:
        assert np.array_equal(other.kept, found[0].kept) and np.array_equal(other.triangles, found[0].triangles)
