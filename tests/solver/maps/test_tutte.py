"""Mean value embeddings: no folds, whatever is convex around them, and what is flat comes back."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps import tutte as module
from omt_uv.solver.maps.energy import area_error, elements, energy
from omt_uv.solver.maps.tutte import arc_length_parameters, arcs_of_parts, evened_tutte, mean_value_weights, tutte
from omt_uv.solver.mesh.geometry import face_areas, halfedge_lengths, signed_areas
from omt_uv.solver.mesh.topology import boundary_loops


def circle(V, loop):
    angle = 2 * np.pi * arc_length_parameters(V, loop)
    return np.column_stack([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("mesh", [meshes.bumpy(), meshes.cone(), meshes.head(24), meshes.spiral_strip()])
def test_embeddings_have_no_folds(mesh):
    V, F = mesh
    loop = boundary_loops(F)[0]
    uv = tutte(V, F, loop, circle(V, loop))
    assert (signed_areas(uv, F) > 0).all()
    np.testing.assert_array_equal(uv[loop], circle(V, loop))


@pytest.mark.parametrize("graded", [False, True])
@pytest.mark.parametrize("mesh", [meshes.bumpy(), meshes.cone(), meshes.head(24), meshes.spiral_strip()])
def test_evened_weights_leave_less_to_do_and_fold_nothing(mesh, graded):
    V, F = mesh
    loop = boundary_loops(F)[0]
    x = V[F].mean(axis=1)[:, 0]
    target = face_areas(V, F) * (np.exp(2 * (x - x.mean()) / np.ptp(x)) if graded else 1)
    faces = elements(V, F, target)
    before = tutte(V, F, loop, circle(V, loop))
    after = evened_tutte(V, loop, before, faces, 30.0)
    assert (signed_areas(after, F) > 0).all()
    np.testing.assert_array_equal(after[loop], circle(V, loop))
    root = np.sqrt(target.sum() / np.abs(signed_areas(after, F)).sum())
    has, had = (energy(faces, root * (uv @ [1, 1j]), 30.0) for uv in (after, before))
    assert has <= had * (1 + 1e-6)
    if len(np.unique(F)) > len(loop):
        assert area_error(faces, after @ [1, 1j]) <= area_error(faces, before @ [1, 1j]) + 1e-9


def test_maps_that_keep_too_much_energy_are_none():
    V, F = meshes.head(24)
    loop = boundary_loops(F)[0]
    faces = elements(V, F, face_areas(V, F))
    start = tutte(V, F, loop, circle(V, loop))
    given = start.copy()
    after = evened_tutte(V, loop, start, faces, 30.0)
    has = energy(faces, np.sqrt(face_areas(V, F).sum() / signed_areas(after, F).sum()) * (after @ [1, 1j]), 30.0)
    assert evened_tutte(V, loop, start, faces, 30.0, most=0.9 * has) is None
    np.testing.assert_array_equal(evened_tutte(V, loop, start, faces, 30.0, most=1.1 * has), after)
    np.testing.assert_array_equal(start, given)


def test_who_is_patient_gets_what_more_rounds_win_and_is_asked_for_nothing_else():
    V, F = meshes.head(24)
    loop = boundary_loops(F)[0]
    faces = elements(V, F, face_areas(V, F))
    start = tutte(V, F, loop, circle(V, loop))
    asked: list[bool] = []

    def patient(answer):
        asked.append(answer)
        return answer

    def energy_of(uv):
        root = np.sqrt(face_areas(V, F).sum() / signed_areas(uv, F).sum())
        return energy(faces, root * (uv @ [1, 1j]), 30.0)

    plain = evened_tutte(V, loop, start, faces, 30.0)
    assert not asked
    most = 0.999 * energy_of(plain)
    assert evened_tutte(V, loop, start, faces, 30.0, most, None, lambda: patient(False)) is None
    assert asked == [False]
    more = evened_tutte(V, loop, start, faces, 30.0, most, None, lambda: patient(True))
    assert energy_of(more) <= most and (signed_areas(more, F) > 0).all()
    np.testing.assert_array_equal(evened_tutte(V, loop, start, faces, 30.0, np.inf, None, lambda: patient(True)), plain)


@pytest.mark.parametrize("mesh", [meshes.bumpy(), meshes.head(24)])
def test_an_order_that_is_given_changes_no_map(mesh):
    V, F = mesh
    loop, order = boundary_loops(F)[0], np.random.default_rng(0).permutation(len(V))
    faces, start = elements(V, F, face_areas(V, F)), tutte(V, F, loop, circle(V, loop))
    np.testing.assert_allclose(tutte(V, F, loop, circle(V, loop), order=order), start, atol=1e-9)
    again = evened_tutte(V, loop, start, faces, 30.0, np.inf, order)
    np.testing.assert_allclose(again, evened_tutte(V, loop, start, faces, 30.0), atol=1e-9)


def test_what_is_flat_comes_back():
    """Mean value coordinates are exact on linear functions."""
    V, F = meshes.random_disk(height=0.0)
    loop = boundary_loops(F)[0]
    turn = np.array([[2.0, 1.0], [-0.5, 1.5]])
    np.testing.assert_allclose(tutte(V, F, loop, V[loop, :2] @ turn), V[:, :2] @ turn, atol=1e-9)


def test_the_order_of_large_meshes_gives_the_same_map(monkeypatch):
    V, F = meshes.head(24)
    loop = boundary_loops(F)[0]
    expected = tutte(V, F, loop, circle(V, loop))
    monkeypatch.setattr(module, "LARGE", 10)
    np.testing.assert_allclose(tutte(V, F, loop, circle(V, loop)), expected, atol=1e-9)


def test_weights_are_positive_and_fall_with_scale():
    length = halfedge_lengths(*meshes.spiral_strip()).reshape(-1, 3)
    for near, far in zip(mean_value_weights(length), mean_value_weights(10 * length), strict=True):
        assert (near > 0).all() and np.isfinite(near).all()
        np.testing.assert_allclose(far, near / 10, rtol=1e-9)
    degenerate = mean_value_weights(np.array([[1.0, 1.0, 2.0], [0.0, 1.0, 1.0]]))
    assert all((w > 0).all() and np.isfinite(w).all() for w in degenerate)


def test_parameters_are_shares_of_the_length():
    V, F = meshes.grid(4, 4)
    loop = boundary_loops(F)[0]
    np.testing.assert_allclose(arc_length_parameters(V, loop), np.arange(16) / 16)
    np.testing.assert_allclose(arc_length_parameters(7 * V + 3, loop), np.arange(16) / 16)


def test_sides_without_length_have_room_on_a_convex_boundary():
    V, F = meshes.cone()
    (loop,) = boundary_loops(F)
    V[loop[1:9]] = V[loop[1]] + 1e-13 * np.arange(8)[:, None]
    places = circle(V, loop)
    step = np.linalg.norm(np.roll(places, -1, axis=0) - places, axis=1)
    assert step.min() > 1e-5 * step.mean()
    assert (signed_areas(tutte(V, F, loop, places, equal=True), F) > 0).all()


def with_ears(V, F, ears):
    """A disk mesh with triangles (ears,) glued to boundary edges far from each other."""
    loop = boundary_loops(F)[0]
    at = np.arange(ears) * (len(loop) // max(ears, 1))
    tail, head = loop[at], loop[(at + 1) % len(loop)]
    tip = (V[tail] + V[head]) / 2 + [0, 0, 0.2]
    return np.vstack([V, tip]), np.vstack([F, np.column_stack([head, tail, len(V) + np.arange(ears)])])


def test_several_boundaries_at_once_are_those_one_by_one():
    V, F = meshes.bumpy()
    loop = boundary_loops(F)[0]
    first = circle(V, loop)
    both = tutte(V, F, loop, np.concatenate([first, 2 * first[:, ::-1]], axis=1))
    np.testing.assert_allclose(both[:, :2], tutte(V, F, loop, first), atol=1e-12)
    np.testing.assert_allclose(both[:, 2:], 2 * both[:, 1::-1], atol=1e-12)


@pytest.mark.parametrize("ears", [0, 1, 5])
def test_parts_behind_single_edges_take_more_of_a_circle_than_of_the_area(ears):
    V, F = with_ears(*meshes.grid(), ears)
    area = np.ones(len(F))
    arcs, shares = arcs_of_parts(F, boundary_loops(F)[0], area)
    # Corners of a grid, too, are triangles behind one edge.
    assert len(shares) >= ears
    np.testing.assert_allclose(shares, 1 / len(F))
    angle = 2 * np.pi * arcs
    assert (angle - np.sin(angle) <= 2 * np.pi * shares).all() and (arcs > 5 * shares).all()


def test_what_hangs_behind_a_part_counts_with_it():
    V, F = with_ears(*meshes.grid(), 1)
    ear = len(F) - 1
    tail, tip = F[ear, 1], F[ear, 2]
    F = np.vstack([F, [tip, tail, len(V)]])
    area = np.ones(len(F))
    area[-2:] = 3.0
    _, shares = arcs_of_parts(F, boundary_loops(F)[0], area)
    assert np.isclose(shares, 6.0 / area.sum()).sum() == 1
    # All triangles of a fan without inner vertices are parts; what hangs on the largest has the rest.
    _, shares = arcs_of_parts(np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4]]), np.arange(5), np.array([1.0, 2.0, 1.0]))
    np.testing.assert_allclose(shares, [0.25, 0.25])
