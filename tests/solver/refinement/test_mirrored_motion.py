"""Maps of symmetric meshes are symmetric, in every outline; small defects and other targets leave them free."""

from __future__ import annotations

import meshes
import numpy as np
import pytest

from omt_uv.solver.analysis.density import Target
from omt_uv.solver.maps.energy import area_error, energy, gradient, has_folds, target_error
from omt_uv.solver.maps.mirror_symmetry import mirror_symmetry
from omt_uv.solver.maps.polygon_elements import polygon_elements, with_convex_quads
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.mirror import find_mirror
from omt_uv.solver.parameterization.options import UnwrapOptions
from omt_uv.solver.parameterization.unwrap import unwrap
from omt_uv.solver.progress import Progress, drain
from omt_uv.solver.refinement import refine as refinement
from omt_uv.solver.refinement.hessian_blocks import assembly_of, hessian_blocks
from omt_uv.solver.refinement.mirrored_motion import MirroredMotion, find_symmetry, halved, symmetric_start
from omt_uv.solver.refinement.projected_newton import CircleMotion, FreeMotion


def hill(count=14, height=1.0):
    """A patch of quads with a hill: its own image across x and y."""
    x, y = np.meshgrid(np.linspace(-1, 1, count + 1), np.linspace(-1, 1, count + 1), indexing="ij")
    V = np.stack([x, y, height * np.exp(-6 * (x**2 + 1.5 * y**2))], axis=-1).reshape(-1, 3)
    corner = ((count + 1) * np.arange(count)[:, None] + np.arange(count)).ravel()
    return V, np.column_stack([corner, corner + count + 1, corner + count + 2, corner + 1])


def mapped(V, Q, target=None, **options):
    """The chart and its map (n,) complex about the centre of its outline."""
    result = drain(unwrap(meshes.polygon_surface(V, Q.tolist()), options=UnwrapOptions(**options), target=target))
    (chart,), (found,) = result.charts, result.maps
    return chart, found.uv @ [1, 1j]


def deviation(chart, w, mirror):
    """How far a map is from its mirror image in the best axis, over its extent."""
    centred = w - w.mean()
    turn = (centred[mirror.image] * centred).sum()
    return np.abs(centred[mirror.image] - turn / abs(turn) * centred.conj()).max() / np.abs(centred).max()


@pytest.mark.parametrize("balance", [0.0, 0.2])
@pytest.mark.parametrize("boundary", ["free", "disk", "square"])
def test_maps_are_symmetric_in_both_mirrors(boundary, balance):
    V, Q = hill()
    chart, w = mapped(V, Q, boundary=boundary, balance=balance)
    first = find_mirror(chart.vertices, chart.triangles, chart.faces)
    second = find_mirror(chart.vertices, chart.triangles, chart.faces, across=first)
    assert max(deviation(chart, w, first), deviation(chart, w, second)) < 1e-9


def test_a_target_that_is_not_symmetric_is_met():
    V, Q = hill()
    density = np.repeat(np.where(V[Q].mean(axis=1)[:, 0] > 0, 2.0, 1.0), 2)
    chart, w = mapped(V, Q, Target(density, None))
    mirror = find_mirror(chart.vertices, chart.triangles, chart.faces)
    x = chart.vertices[:, 0]
    across = mirror.image if np.abs(x[mirror.image] + x).max() < 1e-9 else None
    if across is None:
        mirror = find_mirror(chart.vertices, chart.triangles, chart.faces, across=mirror)
    assert deviation(chart, w, mirror) > 0.05


def test_a_scar_changes_little():
    """Without the symmetry's help: the free solve next to it."""
    V, Q = hill()
    _, w = mapped(V, Q)
    W = V.copy()
    W[20, 2] += 0.002
    _, scarred = mapped(W, Q)
    a, b = (z - z.mean() for z in (w, scarred))
    turn = np.vdot(b, a)
    assert np.abs(a - b * turn / abs(turn)).max() < 0.05 * np.abs(a).max()


def test_which_corner_quads_begin_with_matters_little():
    """Newton stops at a few percent of the energy, and where it stops remembers where it began."""
    V, Q = hill()
    maps = []
    for k in range(2):
        chart, w = mapped(V, np.roll(Q, k, axis=1))
        maps.append((w - w.mean())[np.argsort(chart.vertex_ids)])
    turn = np.vdot(maps[1], maps[0])
    assert np.abs(maps[0] - maps[1] * turn / abs(turn)).max() < 1e-3 * np.abs(maps[0]).max()


def test_moves_of_representatives_keep_a_map_symmetric():
    V, Q = hill(6)
    T, faces = Q[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), np.repeat(np.arange(len(Q)), 2)
    elements = polygon_elements(V, T, face_areas(V, T), faces)
    found = find_symmetry(V, T, faces, elements)
    symmetry, w = symmetric_start(found, V[:, :2] @ [1, 1j] + 0.3, elements, "free", np.arange(0))
    motion = MirroredMotion(FreeMotion(np.zeros(len(V), bool)), symmetry, w)
    rng = np.random.default_rng(0)
    step = 0.01 * (rng.normal(size=len(V)) * motion.free[:, 0] + 1j * rng.normal(size=len(V)) * motion.free[:, 1])
    moved = motion.move(w, step)
    assert np.abs(moved - w).max() > 0
    np.testing.assert_allclose(symmetry.spread(moved), moved, atol=1e-12)
    # Both mirrors: a quarter of the vertices and their axes are all that is free.
    assert motion.free.sum() == 2 * 9 + 2 * 3


@pytest.mark.parametrize("cut", ["one way", "the other way in one half", "triangles"])
@pytest.mark.parametrize("mirrors", [1, 2])
def test_polygons_that_stand_for_their_images_have_energy_slopes_and_areas_of_all(cut, mirrors):
    """In maps in which some quads are not convex, too, and of densities and regions that are as symmetric."""
    V, Q = hill(6)
    V = V + np.array([0.0, 0.0, 0.3]) * (V[:, 1:2] ** 3 if mirrors == 1 else 0)
    Q = np.where((V[Q].mean(axis=1)[:, :1] > 0) & (cut != "one way"), np.roll(Q, 1, axis=1), Q)
    T, faces = Q[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), np.repeat(np.arange(len(Q)), 2)
    at = V[Q].mean(axis=1)[faces] if cut != "triangles" else V[T].mean(axis=1)
    polygons = None if cut == "triangles" else faces
    target, region = face_areas(V, T) * (1 + at[:, 0] ** 2), (np.abs(at[:, 0]) < 0.4) * 1.0
    elements = polygon_elements(V, T, target, polygons, region)
    found = find_symmetry(V, T, polygons, elements)
    assert len(found.images) == (1 if cut == "triangles" else mirrors)
    start = V[:, :2] @ [1, 1j] * np.exp(0.3j) * (1 + 0.2 * np.abs(V[:, 0]) ** 2)
    symmetry, w = symmetric_start(found, start, elements, "free", np.arange(0))
    elements = with_convex_quads(elements, w)
    half = halved(elements, symmetry)
    assert len(half.area) < (0.4 if len(found.images) == 2 else 0.6) * len(elements.area)
    motion = MirroredMotion(FreeMotion(np.zeros(len(V), bool)), symmetry, w)
    axes = motion.frame(w), motion.free.astype(float)
    slopes = [symmetry.folded(gradient(x, w, 30.0)) * axes[0].conj() for x in (elements, half)]
    along = [x.view(float).reshape(-1, 2) * axes[1] for x in slopes]
    np.testing.assert_allclose(along[1], along[0], atol=1e-12 * np.abs(along[0]).max())
    for measure in (lambda x: energy(x, w, 30.0), lambda x: area_error(x, w), lambda x: target_error(x, w)):
        np.testing.assert_allclose(measure(half), measure(elements), rtol=1e-12)
    matrices = []
    for x in (elements, half):
        blocks = hessian_blocks(x, w, 30.0, 0.5, axes, symmetry)
        assembly = assembly_of(x, len(V), symmetry=symmetry)
        matrices.append(assembly.matrix(blocks.triangles, np.zeros(2 * len(V)), blocks.quads).toarray())
    np.testing.assert_allclose(matrices[1], matrices[0], atol=1e-12 * np.abs(matrices[0]).max())


def test_quads_cut_otherwise_than_their_images_need_both_diagonals_where_one_would_do():
    """A symmetric map may not fold either of them, though only one is there."""
    V, Q = hill(6)
    Q = np.where(V[Q].mean(axis=1)[:, :1] > 0, np.roll(Q, 1, axis=1), Q)
    T, faces = Q[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), np.repeat(np.arange(len(Q)), 2)
    elements = polygon_elements(V, T, face_areas(V, T), faces)
    symmetry, w = symmetric_start(
        find_symmetry(V, T, faces, elements), V[:, :2] @ [1, 1j], elements, "free", np.arange(0)
    )
    half = halved(elements, symmetry)
    for vertex in range(len(V)):
        bent = w.copy()
        bent[vertex] += 0.7 * (1 + 1j) / 6
        bent = symmetry.spread(bent)
        whole, one = (has_folds(with_convex_quads(x, bent), bent) for x in (elements, half))
        assert whole == one


def test_long_polygons_that_are_not_convex_are_as_large_as_their_images_however_they_are_cut():
    """Two halves of a ring, each one polygon: their triangles are those of whoever drew them."""
    count = 20
    turn = np.exp(2j * np.pi * np.arange(count) / count)
    V = np.concatenate([np.column_stack([w.real, w.imag, 0 * w.real]) for w in (turn, 2 * turn)])
    V[:, 2] = 0.2 * V[:, 1] ** 3
    i, j = np.arange(count), np.roll(np.arange(count), -1)
    one = np.stack([np.column_stack([i, i + count, j + count]), np.column_stack([i, j + count, j])], axis=1)
    two = np.stack([np.column_stack([i, i + count, j]), np.column_stack([j, i + count, j + count])], axis=1)
    T = np.where((np.random.default_rng(0).random(count) < 0.5)[:, None, None], one, two).reshape(-1, 3)
    halves = np.repeat(i // (count // 2), 2)
    found = find_symmetry(V, T, halves, polygon_elements(V, T, face_areas(V, T), halves))
    np.testing.assert_allclose(V[found.images[0]], V * [-1, 1, 1], atol=1e-12)


def test_polygons_unlike_their_images_stand_for_themselves():
    """Within what is taken for a mirror image; their areas would be a little off otherwise."""
    V, Q = hill(8)
    V = V + np.array([0.0, 0.0, 1e-4]) * np.random.default_rng(0).normal(size=(len(V), 1))
    T, faces = Q[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), np.repeat(np.arange(len(Q)), 2)
    elements = polygon_elements(V, T, face_areas(V, T), faces)
    images = np.arange(81).reshape(9, 9)[::-1].ravel()[None]
    half = halved(elements, mirror_symmetry(images))
    assert len(half.area) > 0.9 * len(elements.area)
    np.testing.assert_allclose(half.area.sum(), 1)


def test_one_half_makes_a_symmetric_start_where_the_mean_of_both_folds():
    """Both halves are turned within the same way, so that images are turned the other way: the mean has folds."""
    V, Q = hill(24, 0.0)
    V = V * [1.0, 0.9, 1.0] + [0.0, 0.0, 1.0] * (0.3 * V[:, 1:2] ** 2 + 0.2 * V[:, 1:2] + 0.5 * V[:, :1] ** 2)
    T, faces = Q[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3), np.repeat(np.arange(len(Q)), 2)
    elements = polygon_elements(V, T, face_areas(V, T), faces)
    found = find_symmetry(V, T, faces, elements)
    w = V[:, :2] @ [1, 1j]
    away = w - np.where(w.real > 0, 0.5, -0.5)
    w = w - away + away * np.exp(2j * np.maximum(1 - np.abs(away) / 0.45, 0))
    assert len(found.images) == 1 and not has_folds(elements, w)
    assert has_folds(elements, mirror_symmetry(found.images, -1.0).averaged(w))
    symmetry, start = symmetric_start(found, w, elements, "free", np.arange(0))
    assert not has_folds(elements, start)
    np.testing.assert_allclose(symmetry.spread(start), start, atol=1e-12)
    # Not where it would cross itself, and the map given does not.
    asked = symmetric_start(found, w, elements, "free", np.arange(0), lambda z: not np.array_equal(z, w))
    assert asked is None


def test_where_no_map_nearby_is_symmetric_a_mean_value_map_is_the_start(monkeypatch):
    """What comes from a coarser mesh may have laid two limbs over each other's place, relaxed or not."""
    V, Q = hill(height=0.3)
    triangles = np.concatenate([Q[:, :3], Q[:, [0, 2, 3]]])
    polygons = np.tile(np.arange(len(Q)), 2)
    # Bent like an S.
    along = np.linspace(-1, 1, 2001)
    middle = np.cumsum(np.exp(3j * along**2)) * 8e-3
    at = np.searchsorted(along, V[:, 1] - 1e-9)
    bent = middle[at] + 0.3j * V[:, 0] * np.exp(3j * along[at] ** 2)

    def nothing(problem, symmetry, w, *rest):
        yield Progress("Refinement", 0.0)
        return None, w

    monkeypatch.setattr(refinement, "_relaxed_to_image", nothing)
    start = np.column_stack([bent.real, bent.imag])
    found = drain(refinement.refine(V, triangles, start, polygons=polygons))
    mirror = find_mirror(V, triangles, polygons)
    w = found.uv @ [1, 1j]
    centred = w - w.mean()
    turn = (centred[mirror.image] * centred).sum()
    assert np.abs(centred[mirror.image] - turn / abs(turn) * centred.conj()).max() < 1e-9


@pytest.mark.parametrize("phase", [1.0, np.exp(0.7j)])
def test_vertices_on_a_circle_go_along_it_by_the_length_of_their_step_and_images_with_them(phase):
    """On its own each representative moves as without the mirror, but for those on the axis, which stay on it."""
    turn = 2 * np.pi * np.arange(24) / 24
    axis = np.sqrt(phase)
    w = axis * np.concatenate([2 * np.exp(1j * turn), 1.1 * np.exp(1j * turn), [0.3, -0.4]])
    k = np.arange(24)
    images = np.concatenate([-k % 24, 24 + -k % 24, [48, 49]])[None]
    symmetry = mirror_symmetry(images, phase, w)
    circle = CircleMotion(np.arange(24), 2.0, len(w))
    motion = MirroredMotion(circle, symmetry, w)
    rng = np.random.default_rng(1)
    step = 0.1 * (rng.normal(size=(len(w), 2)) * motion.free) @ [1, 1j]
    moved = motion.move(w, step)
    np.testing.assert_allclose(moved, phase * moved[images[0]].conj(), atol=1e-12)
    np.testing.assert_allclose(np.abs(moved[:24]), 2)
    own = ~symmetry.follows & ~symmetry.on_axis
    around = own & (np.arange(len(w)) < 24)
    length = 2 * np.angle(moved[around] / w[around])
    assert around.sum() == 11
    np.testing.assert_allclose(length, step[around].real, atol=1e-12)
    inner = own & (np.arange(len(w)) >= 24)
    np.testing.assert_allclose((moved - w)[inner], step[inner])
    # Along the axis those upon it go by their step, too; where the circle meets it, they stay.
    upon = np.array([24, 36, 48, 49])
    np.testing.assert_allclose((moved - w)[upon], axis * step[upon].real, atol=1e-12)
    np.testing.assert_allclose(moved[[0, 12]], w[[0, 12]], atol=1e-12)
