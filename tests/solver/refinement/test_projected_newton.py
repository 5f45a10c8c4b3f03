"""Newton's steps: they go down, fold nothing, and keep to the curves on which vertices slide."""

from dataclasses import replace
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.maps.energy import elements
from omt_uv.solver.maps.tutte import tutte
from omt_uv.solver.maps.untangle import arc_length_boundary
from omt_uv.solver.mesh.geometry import face_areas
from omt_uv.solver.mesh.topology import boundary_loops
from omt_uv.solver.refinement.hessian_blocks import Assembly
from omt_uv.solver.refinement.projected_newton import (
    CircleMotion,
    FreeMotion,
    LineMotion,
    NewtonProblem,
    first_fold,
    fold_shares,
    linear_forms,
    newton_direction,
    newton_step,
)


def complex_map(V, F):
    """Tutte's map to the unit disk."""
    loop = boundary_loops(F)[0]
    return tutte(V, F, loop, arc_length_boundary(V, loop, 1.0)) @ [1, 1j]


def elements_of(V, F):
    return elements(V, F, face_areas(V, F))


def test_assembly_sums_what_a_dense_sum_does():
    V, F = meshes.grid(3, 2)
    n = len(V)
    blocks = np.random.default_rng(0).normal(size=(len(F), 6, 6))
    blocks = blocks + np.swapaxes(blocks, 1, 2)
    dense = np.zeros((2 * n, 2 * n))
    for face, block in zip(F, blocks, strict=True):
        unknowns = (2 * face[:, None] + [0, 1]).ravel()
        dense[np.ix_(unknowns, unknowns)] += block
    matrix = Assembly(F, n).matrix(blocks, np.arange(2 * n))
    assert np.allclose(matrix.toarray(), dense + np.diag(np.arange(2 * n)))


def test_assembly_of_quads_and_of_corners_that_follow_one_vertex_sums_what_a_dense_sum_does():
    """Of half of a mirrored mesh two corners of a triangle may be one vertex, and some vertices in no cell."""
    F, Q, n = np.array([[0, 1, 2], [2, 1, 1], [4, 2, 0]]), np.array([[0, 1, 2, 4], [4, 4, 1, 0]]), 6
    rng = np.random.default_rng(0)
    given = [rng.normal(size=(len(cells), 2 * cells.shape[1], 2 * cells.shape[1])) for cells in (F, Q)]
    given = [blocks + np.swapaxes(blocks, 1, 2) for blocks in given]
    dense = np.diag(np.arange(12.0))
    for cells, blocks in zip((F, Q), given, strict=True):
        for cell, block in zip(cells, blocks, strict=True):
            unknowns = (2 * cell[:, None] + [0, 1]).ravel()
            np.add.at(dense, np.ix_(unknowns, unknowns), block)
    matrix = Assembly(F, n, None, Q).matrix(given[0], np.arange(12.0), given[1])
    assert np.allclose(matrix.toarray(), dense) and matrix.has_sorted_indices


def test_first_fold_is_where_the_first_face_has_no_area():
    V, F = meshes.random_disk()
    w = complex_map(V, F)
    rng = np.random.default_rng(1)
    step = rng.normal(size=len(w)) + 1j * rng.normal(size=len(w))
    faces = elements_of(V, F)
    t = first_fold(faces, w, step)
    smallest = [faces.areas(w + s * step).min() for s in (0.0, 0.5 * t, 0.999 * t, 1.001 * t)]
    assert min(smallest[:3]) > 0 > smallest[3]


@pytest.mark.parametrize("kind", ["free", "circle"])
def test_newton_direction_descends_along_the_motion(kind):
    V, F = meshes.bumpy()
    faces, w, loop = elements_of(V, F), complex_map(V, F), boundary_loops(F)[0]
    motion = CircleMotion(loop, 1.0, len(w)) if kind == "circle" else FreeMotion(np.zeros(len(w), bool))
    problem = NewtonProblem(faces, Assembly(F, len(w)), motion, 5.0)
    step, slope = newton_direction(problem, w)
    h = 1e-6
    difference = (problem.energy(motion.move(w, h * step)) - problem.energy(motion.move(w, -h * step))) / (2 * h)
    assert slope < 0
    assert difference == pytest.approx(slope, rel=1e-4)


def test_what_follows_a_step_has_its_energy_where_it_leaves_the_map():
    V, F = meshes.bumpy()
    w, still = complex_map(V, F), np.zeros(len(V), bool)
    smoother = SimpleNamespace(smoothed=lambda faces, w, weight: 1.01 * w)
    plain = NewtonProblem(elements_of(V, F), Assembly(F, len(w)), FreeMotion(still), 5.0)
    one, other = (problem.step(w, plain.energy(w), 0.0) for problem in (plain, replace(plain, smoother=smoother)))
    np.testing.assert_array_equal(other.w, 1.01 * one.w)
    assert other.energy == plain.energy(other.w) != one.energy == plain.energy(one.w)
    assert (other.decrement, other.share) == (one.decrement, one.share)


def test_newton_converges_fast_near_its_minimum():
    V, F = meshes.bumpy()
    w = complex_map(V, F)
    problem = NewtonProblem(elements_of(V, F), Assembly(F, len(w)), FreeMotion(np.zeros(len(w), bool)), 5.0)
    value, decrements = problem.energy(w), []
    while not decrements or decrements[-1] > 1e-13:
        step = newton_step(problem, w, value)
        w, value = step.w, step.energy
        decrements.append(step.decrement)
        assert len(decrements) < 60
    assert (np.divide(decrements[-3:], decrements[-4:-1]) < 0.1).all()


def test_a_circle_is_kept_and_arcs_have_the_length_of_the_step():
    w = np.array([2, 2j, -2, 0.3 + 0.1j])
    motion = CircleMotion(np.arange(3), 2.0, 4)
    moved = motion.move(w, np.array([0.5, -0.2, 0.1, 1j]))
    np.testing.assert_allclose(np.abs(moved[:3]), 2, rtol=1e-15)
    np.testing.assert_allclose(2 * np.angle(moved[:3] / w[:3]), [0.5, -0.2, 0.1])
    assert moved[3] == 0.3 + 1.1j


def test_vertices_on_lines_stay_on_them_and_fixed_ones_do_not_move():
    motion = LineMotion(np.array([0, 1]), np.array([1.0, 1j]), np.array([2]), 4)
    w, step = np.zeros(4, complex), np.where(motion.free @ [1, 1j] != 0, 1.0, 0)
    np.testing.assert_array_equal(motion.move(w, step), [1, 1j, 0, 1])
    np.testing.assert_array_equal(motion.free, [[True, False], [True, False], [False, False], [True, True]])


def test_a_face_that_only_grows_never_folds():
    one, none = np.ones(3, complex), np.zeros(3, complex)
    t = fold_shares(one, none, np.array([1.0, -1, 0]) + 0j, np.array([0, 0, 2.0]) + 0j)
    np.testing.assert_allclose(t, [np.inf, 1, 0.5])


def test_linear_forms_are_real_parts():
    random = np.random.default_rng(0)
    vertices, rows = random.integers(0, 9, (20, 3)), random.normal(size=(20, 3, 2)) @ [1, 1j]
    w = random.normal(size=(9, 2)) @ [1, 1j]
    np.testing.assert_allclose(linear_forms(vertices, rows, 9) @ w.view(float), (rows * w[vertices]).sum(axis=1).real)
