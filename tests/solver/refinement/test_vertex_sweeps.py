"""Newton steps of single vertices."""

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.contacts import crossings
from omt_uv.solver.maps.energy import area_error, elements, energies, energy
from omt_uv.solver.maps.tutte import arc_length_parameters, tutte
from omt_uv.solver.mesh import geometry
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.progress import drain
from omt_uv.solver.refinement import vertex_sweeps as smoothing

WEIGHT = 30.0
NEVER = 1e-12  # an area error that no map has


@pytest.fixture(scope="module")
def chart():
    """Elements of a head with uneven targets, an embedding in the disk, and its boundary."""
    V, F = meshes.head(16)
    loop = boundary_loops(F)[0]
    turn = 2 * np.pi * arc_length_parameters(V, loop)
    w = tutte(V, F, loop, np.column_stack([np.cos(turn), np.sin(turn)])) @ [1, 1j]
    density = np.random.default_rng(0).uniform(0.5, 2, len(F))
    return elements(V, F, face_areas(V, F) * density), w, loop


def test_sweeps_lower_the_energy_and_leave_the_boundary(chart):
    faces, w, loop = chart
    before = energy(faces, w, WEIGHT)
    for sweeps in (1, 4):
        smooth = drain(smoothing.smoothed(faces, w, WEIGHT, sweeps))
        after = energy(faces, smooth, WEIGHT)
        assert after < before
        np.testing.assert_array_equal(smooth[loop], w[loop])
        before = after


def test_sweeps_end_at_the_first_map_that_has_its_areas(chart):
    faces, w, _ = chart
    maps = [drain(smoothing.smoothed(faces, w, WEIGHT, k, goal=NEVER)) for k in range(1, 7)]
    errors = [area_error(faces, one) for one in maps]
    assert (np.diff(errors) < 0).all()
    before = area_error(faces, w)
    for k, error in enumerate(errors):
        goal = error * (1 + 1e-9)
        if before <= smoothing.NEARLY * goal:
            continue
        steps = list(smoothing.smoothed(faces, w, WEIGHT, len(maps), goal=goal))
        assert len(steps) == k + 1
        np.testing.assert_array_equal(drain(smoothing.smoothed(faces, w, WEIGHT, len(maps), goal=goal)), maps[k])
    far = drain(smoothing.smoothed(faces, w, WEIGHT, len(maps), goal=errors[-1] / 2))
    np.testing.assert_array_equal(far, maps[-1])


def test_a_map_with_its_areas_stays_and_one_that_has_nearly_takes_a_part_of_a_sweep(chart):
    faces, w, _ = chart
    before, swept = area_error(faces, w), drain(smoothing.smoothed(faces, w, WEIGHT, 1, goal=NEVER))
    once = area_error(faces, swept)
    assert list(smoothing.smoothed(faces, w, WEIGHT, 6, goal=before)) == []
    np.testing.assert_array_equal(drain(smoothing.smoothed(faces, w, WEIGHT, 6, goal=before)), w)
    for share in (0.1, 0.5, 0.9):
        goal = max(before - share * (before - once), before / smoothing.NEARLY)
        found = drain(smoothing.smoothed(faces, w, WEIGHT, 6, goal=goal))
        moved = found != w
        assert 0 < moved.sum() < (swept != w).sum()
        # What has moved went as it does in a whole sweep.
        np.testing.assert_array_equal(found[moved], swept[moved])
        assert area_error(faces, found) <= goal and (faces.areas(found) > 0).all()


def test_sweeps_to_an_area_error_go_beyond_the_least_energy_but_for_the_first(chart):
    faces, w, loop = chart
    once, plain = (drain(smoothing.smoothed(faces, w, WEIGHT, 1, goal=goal)) for goal in (NEVER, 0.0))
    np.testing.assert_array_equal(once, plain)
    for sweeps in (2, 4, 6):
        near, far = (drain(smoothing.smoothed(faces, w, WEIGHT, sweeps, goal=goal)) for goal in (NEVER, 0.0))
        assert area_error(faces, near) < area_error(faces, far)
        assert (faces.areas(near) > 0).all()
        np.testing.assert_array_equal(near[loop], w[loop])


def test_boundaries_move_and_do_not_come_to_cross_themselves(chart):
    faces, w, loop = chart
    smooth = drain(smoothing.smoothed(faces, w, WEIGHT, 8, loop))
    assert (faces.areas(smooth) > 0).all() and energy(faces, smooth, WEIGHT) < energy(faces, w, WEIGHT)
    assert (smooth[loop] != w[loop]).mean() > 0.5
    assert not len(crossings(smooth, loop))


def test_what_would_cross_is_taken_back():
    # Two tips of a square notch that go past each other, and one corner that is in nobody's way.
    before = np.array([-3, 5, 5 + 1j, 1.2 + 0.9j, 1 + 0.2j, 0.8 + 1.1j, -3 + 1j])
    after = before + np.array([-0.1, 0, 0, -0.4, 0, 0.4, 0])
    loop = np.arange(7)
    assert len(crossings(after, loop))
    smoothing._uncross(after, before, loop)
    np.testing.assert_array_equal(after[1:], before[1:])
    assert after[0] == -3.1


def test_what_goes_over_a_narrow_part_is_taken_back():
    # The tip of a finger swings into a spike from above; six times as far it would be past this again, below.
    before = np.array([0, 0.1 + 1j, 0.2, 5, 5 + 3j, 0.55 + 3j, 0.5 + 0.9j, 0.45 + 3j, -3 + 3j, -3])
    after = before + np.eye(10)[1] * 0.4
    loop = np.arange(10)
    assert len(crossings(after, loop)) and not len(crossings(before + 6.0 * (after - before), loop))
    smoothing._uncross(after, before, loop)
    np.testing.assert_array_equal(after, before)


def test_sets_are_independent_and_hold_nearly_all_vertices_once(chart):
    faces, w, loop = chart
    held = np.concatenate([vertex for vertex, _, _ in smoothing._sets(faces, len(w))])
    assert len(np.unique(held)) == len(held) >= 0.97 * (len(w) - len(loop))
    for vertex, row, star in smoothing._sets(faces, len(w)):
        chosen = np.isin(star.triangles, vertex)
        assert (chosen.sum(1) == 1).all() and chosen[:, 0].all()
        np.testing.assert_array_equal(star.triangles[:, 0], vertex[row])


def test_a_step_is_newtons(chart):
    faces, w, _ = chart
    vertex, row, star = next(smoothing._sets(faces, len(w)))

    def at(move):
        moved = w.copy()
        moved[vertex] += move
        return np.bincount(row, energies(star, moved, WEIGHT), len(vertex))

    def slope(move):
        return (at(move) - at(-move)) / (2 * abs(move))

    def bend(move):
        return (at(move) + at(-move) - 2 * at(0)) / abs(move) ** 2

    h = 1e-4
    xx, yy, xy = bend(h), bend(1j * h), (bend(h + 1j * h) - bend(h - 1j * h)) / 2
    hessian = np.stack([np.stack([xx, xy], 1), np.stack([xy, yy], 1)], 1)
    convex = np.linalg.eigvalsh(hessian)
    convex = convex[:, 0] > 2 * 0.01 * convex[:, 1]
    assert convex.mean() > 0.8
    gradient = np.stack([slope(1e-5), slope(1e-5j)], 1)
    expected = -np.linalg.solve(hessian, gradient[..., None])[..., 0] @ [1, 1j]
    found = smoothing._directions(row, smoothing._around(star, w), WEIGHT, len(vertex))
    np.testing.assert_allclose(found[convex], expected[convex], atol=1e-3 * np.abs(expected).max())


def test_of_many_triangles_stars_and_gradients_are_taken_as_they_are_asked_for(chart, monkeypatch):
    """The maps are the same to the bit."""
    faces, w, loop = chart
    V, F = meshes.head(16)
    density = np.random.default_rng(0).uniform(0.5, 2, len(F))
    expected = [drain(smoothing.smoothed(faces, w, WEIGHT, 3, edge)) for edge in (None, loop)]
    monkeypatch.setattr(geometry, "KEPT_HATS", 100)
    monkeypatch.setattr(smoothing, "KEPT_HATS", 100)
    many = elements(V, F, face_areas(V, F) * density)
    np.testing.assert_array_equal(many.gradient, faces.gradient)
    many.let_go()
    some = np.array([3, 77, 8])
    np.testing.assert_array_equal(many.gradient_at(some), faces.gradient[some])
    for smooth, edge in zip(expected, (None, loop), strict=True):
        np.testing.assert_array_equal(drain(smoothing.smoothed(many, w, WEIGHT, 3, edge)), smooth)
