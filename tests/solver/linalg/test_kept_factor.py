"""Factors that are kept: nearly the solution of systems like the one before, and new ones for all others."""

import meshes
import numpy as np
import pytest
import scipy.sparse as sp
from work import counted_work

from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.linalg import kept_factor
from omt_uv.solver.linalg.additive_schwarz import FEW, MOST_KEPT, RENEWED, AdditiveSchwarz
from omt_uv.solver.linalg.kept_factor import KEPT_ENOUGH, WINDOW, KeptFactor, by_gradients


def stiff_matrix(triangles, n, weight):
    """Two unknowns a vertex, symmetric positive definite, with random weights (m,) of the triangles."""
    tail, head = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    rows = np.arange(len(tail))
    ends = np.concatenate([tail, head])
    difference = sp.csr_matrix((np.repeat([1.0, -1.0], len(tail)), (np.tile(rows, 2), ends)), (len(tail), n))
    single = difference.T @ sp.diags(np.repeat(weight, 3)) @ difference + 1e-3 * sp.identity(n)
    return sp.kron(single, sp.identity(2)).tocsc()


@pytest.fixture
def systems():
    """Points, triangles, a matrix, one whose faces have changed by up to a fifth, one that is another, and a side."""
    V, F = meshes.bumpy(24, 24)
    rng = np.random.default_rng(0)
    weight = np.exp(rng.normal(0, 1, len(F)))
    matrices = [
        stiff_matrix(F, len(V), w) for w in (weight, weight * rng.uniform(0.8, 1.2, len(F)), np.flip(weight) ** 4)
    ]
    return V, F, *matrices, rng.normal(0, 1, 2 * len(V))


def fall(matrix, b, x):
    """How far the quadratic model falls from 0 to x, times two."""
    return 2 * b @ x - x @ (matrix @ x)


def test_systems_like_the_one_before_need_no_new_factors(systems):
    _, _, first, like, _, b = systems
    solver = KeptFactor()
    np.testing.assert_allclose(first @ solver.solve(first, b, b, lambda: b), b, atol=1e-9)
    with counted_work() as work:
        x = solver.solve(like, b, b, lambda: b)
    assert work.factorisations == 0
    exact = KeptFactor().solve(like, b, b, lambda: b)
    assert (1 - KEPT_ENOUGH) * fall(like, b, exact) <= fall(like, b, x) <= (1 + 1e-9) * fall(like, b, exact)
    assert b @ x > 0


def test_the_last_solution_is_where_the_next_search_looks_first(systems, monkeypatch):
    """Whether that came by new factors or by kept ones."""
    _, _, first, like, _, b = systems
    looked = []

    def found(matrix, b, precondition, most, enough, guess):
        looked.append(guess)
        return by_gradients(matrix, b, precondition, most, enough, guess)

    monkeypatch.setattr(kept_factor, "by_gradients", found)
    solver = KeptFactor()
    answers = [solver.solve(matrix, b, b, lambda: b).copy() for matrix in (first, like, 1.01 * like, like)]
    assert len(looked) == 3
    for guess, answer in zip(looked, answers, strict=False):
        np.testing.assert_array_equal(guess, answer)


def test_others_are_factored_anew_and_serve_from_then_on(systems):
    _, _, first, _, other, b = systems
    solver = KeptFactor()
    solver.solve(first, b, b, lambda: b)
    np.testing.assert_allclose(other @ solver.solve(1e6 * other, b, b, lambda: b), 1e-6 * b, atol=1e-12)
    with counted_work() as work:
        solver.solve(1.01e6 * other, b, b, lambda: b)
    assert work.factorisations == 0


def test_a_singular_system_is_refused_by_name_and_leaves_the_factors(systems):
    _, _, first, _, _, b = systems
    solver = KeptFactor()
    with pytest.raises(PrecisionError, match="A linear system is singular in double"):
        solver.solve(sp.csc_matrix(first.shape), b, b, lambda: b)
    np.testing.assert_allclose(first @ solver.solve(first, b, b, lambda: b), b, atol=1e-9)


def test_parts_keep_their_factors_where_they_are_told_to(systems):
    V, F, first, like, _, b = systems
    w, axes = V[:, 0] + 1j * V[:, 1], np.tile([1, 1j], (len(V), 1))
    for keep in (True, False):
        parts = AdditiveSchwarz(V, F, 200, keep)
        parts.solve(first, b, w, lambda: axes)
        with counted_work() as work:
            x = parts.solve(like, b, w, lambda: axes)
        assert (work.factorisations == 0) == keep
        exact = KeptFactor().solve(like, b, b, lambda: b)
        assert fall(like, b, x) >= 0.85 * fall(like, b, exact)


def test_parts_whose_factors_will_not_do_take_steps_and_new_ones_some_at_a_time(systems):
    V, F, first, _, other, b = systems
    w, axes = V[:, 0] + 1j * V[:, 1], np.tile([1, 1j], (len(V), 1))
    far = other + sp.diags(np.geomspace(1, 1e6, len(b)) * other.diagonal())
    exact, falls, factored = KeptFactor().solve(far, b, b, lambda: b), [], []
    parts = AdditiveSchwarz(V, F, 200, True)
    parts.solve(first, b, w, lambda: axes)
    for _ in range(6):
        with counted_work() as work:
            x = parts.solve(far, b, w, lambda: axes)
        factored.append(work.factorisations)
        assert b @ x > 0
        falls.append(fall(far, b, x) / fall(far, b, exact))
    # None for the first, some for each of the next until all are new, and then no more. The second has iterations too
    # few by some that are new: all are asked for once more.
    every = len(parts._kept.groups) + 1
    assert factored == [0, RENEWED, RENEWED, RENEWED, every - 2 * RENEWED, 0] and every > 2 * RENEWED
    assert 0 < falls[0] < falls[-1] and falls[-1] >= 1 - KEPT_ENOUGH


def test_a_step_with_new_factors_has_iterations_less(systems):
    V, F, first, _, other, b = systems
    w, axes = V[:, 0] + 1j * V[:, 1], np.tile([1, 1j], (len(V), 1))
    far = other + sp.diags(np.geomspace(1, 1e6, len(b)) * other.diagonal())
    parts = AdditiveSchwarz(V, F, 200, True)
    parts.solve(first, b, w, lambda: axes)
    for most in (MOST_KEPT, MOST_KEPT - RENEWED):
        parts.solve(far, b, w, lambda: axes)
        assert parts._kept.most == most and parts._kept.calls <= most + 1


def test_new_factors_are_as_good_as_those_of_a_first_matrix(systems):
    V, F, first, like, _, b = systems
    w, axes = V[:, 0] + 1j * V[:, 1], np.tile([1, 1j], (len(V), 1))
    old, new = (AdditiveSchwarz(V, F, 200, True) for _ in range(2))
    old.solve(first, b, w, lambda: axes)
    for _ in old._kept.groups + [None]:
        old._kept.calls = FEW
        old._renew(old._kept, like, 1j * w, lambda: axes)
    new.solve(like, b, 1j * w, lambda: axes)
    np.testing.assert_allclose(old._kept(b), new._kept(b), rtol=1e-4)


def test_an_order_that_is_found_before_changes_no_solution(systems):
    V, F, first, _, _, b = systems
    w, axes = V[:, 0] + 1j * V[:, 1], np.tile([1, 1j], (len(V), 1))
    ready, late = AdditiveSchwarz(V, F, 200), AdditiveSchwarz(V, F, 200)
    ready.prepare(first.tocsr())
    np.testing.assert_allclose(ready.solve(first, b, w, lambda: axes), late.solve(first, b, w, lambda: axes))


def test_a_guess_that_is_the_solution_needs_the_fewest_iterations(systems):
    _, _, first, _, other, b = systems
    exact, used = KeptFactor().solve(other, b, b, lambda: b), []

    def precondition(r):
        used.append(r)
        return r / other.diagonal()

    for guess in (3 * exact, None):
        used.clear()
        x = by_gradients(other, b, precondition, 200, KEPT_ENOUGH, guess)
        assert 0 < fall(other, b, x) <= (1 + 1e-9) * fall(other, b, exact)
        if guess is not None:
            assert len(used) == WINDOW
            np.testing.assert_allclose(x, exact, atol=1e-6 * np.abs(exact).max())
    assert len(used) > WINDOW
    assert by_gradients(other, b, precondition, 2) is None


def test_a_guess_that_says_nothing_is_none(systems):
    _, _, first, _, _, b = systems
    plain, zero = (by_gradients(first, b, lambda r: r, 50, KEPT_ENOUGH, guess) for guess in (None, np.zeros(len(b))))
    np.testing.assert_array_equal(plain, zero)
