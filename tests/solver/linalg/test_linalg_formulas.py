"""Sparse solvers against dense ones: the same numbers where they are exact, the same bounds where they are not."""

from __future__ import annotations

from itertools import islice

import meshes
import numpy as np
import pytest
import scipy.sparse as sp

from omt_uv.solver.linalg import additive_schwarz, kept_factor, multigrid, sparse
from omt_uv.solver.linalg.lbfgs import LBFGS, MEMORY
from omt_uv.solver.linalg.nested_dissection import Dissection, kd_parts, vertex_graph
from omt_uv.solver.mesh.geometry import cotangent_laplacian
from omt_uv.solver.mesh.topology import halfedges


def positive(n, seed=0, density=0.1):
    """A random sparse symmetric matrix (n,n), positive definite."""
    A = sp.random(n, n, density, random_state=seed, format="csr")
    A = A + A.T
    return (A + sp.diags(1 + np.abs(A).sum(axis=1).A1)).tocsr()


def cholesky_entries(A):
    return int((np.abs(np.linalg.cholesky(A)) > 1e-14).sum())


@pytest.mark.parametrize("order", [None, "mmd", "colamd", "natural"])
@pytest.mark.parametrize("single", [False, True])
@pytest.mark.parametrize("columns", [(), (3,)])
def test_factors_solve_what_dense_ones_do(order, single, columns):
    A, b = positive(60), np.random.default_rng(1).normal(size=(60, *columns))
    x = sparse.Factor(A, order, single=single).solve(b)
    assert x.dtype == float
    np.testing.assert_allclose(x, np.linalg.solve(A.toarray(), b), rtol=1e-4 if single else 1e-10, atol=1e-6)


def test_a_permutation_changes_no_solution_and_fill_counts_what_cholesky_has():
    A = positive(50, 2, 0.05)
    order = np.random.default_rng(0).permutation(50)
    b = np.random.default_rng(1).normal(size=(50, 2))
    np.testing.assert_allclose(sparse.Factor(A, order).solve(b), np.linalg.solve(A.toarray(), b), rtol=1e-10)
    assert sparse.fill(A) == cholesky_entries(A.toarray())
    # An arrow fills altogether from its tip, and not at all towards it.
    arrow = sp.identity(30, format="lil") * 40
    arrow[0, :] = arrow[:, 0] = -1
    arrow[0, 0] = 40
    found = sparse.minimum_degree(arrow.tocsc())
    assert set(found.tolist()) == set(range(30)) and 0 in found[-2:]
    assert sparse.fill(arrow.tocsc()) == 30 * 31 // 2
    assert sparse.fill(arrow.tocsc()[found][:, found]) == 30 + 29


def test_steps_of_conjugate_gradients_are_best_in_their_subspace():
    """After k steps x is the least of the quadratic over the span of the first k preconditioned residuals, and what is
    told to have fallen is what has."""
    A, b = positive(40, 3), np.random.default_rng(0).normal(size=40)
    inverse = sp.diags(1 / A.diagonal())
    basis, dense = [], A.toarray()
    krylov = inverse @ b
    for k, (x, residual, fallen) in enumerate(islice(sparse.gradient_steps(A, b, lambda r: inverse @ r), 8)):
        np.testing.assert_allclose(residual, b - A @ x, atol=1e-10)
        assert fallen == pytest.approx(2 * (b @ x) - x @ A @ x, rel=1e-9, abs=1e-12)
        if k:
            span = np.linalg.qr(np.array(basis).T)[0]
            best = span @ np.linalg.solve(span.T @ dense @ span, span.T @ b)
            np.testing.assert_allclose(x, best, atol=1e-8)
        basis.append(krylov)
        krylov = inverse @ (A @ krylov)
        krylov = krylov / np.linalg.norm(krylov)


@pytest.mark.parametrize("most", [1, 3, 200])
def test_as_many_steps_as_are_allowed(most):
    A, b = positive(40, 4), np.random.default_rng(0).normal(size=40)
    seen = []

    def times(x):
        seen.append(len(seen))
        return A @ x

    x = sparse.conjugate_gradients(times, b, sp.diags(1 / A.diagonal()), 1e-9, most)
    steps = list(islice(sparse.gradient_steps(A, b, lambda r: r / A.diagonal()), len(seen) + 1))
    np.testing.assert_allclose(x, steps[-1][0], atol=1e-10)
    assert len(seen) == most if most < 10 else len(seen) < 40
    if most == 200:
        assert np.linalg.norm(b - A @ x) <= 1e-9 * np.linalg.norm(b)


def test_gradients_end_where_the_window_says_or_tell_that_they_did_not():
    A, b = positive(200, 5, 0.02), np.random.default_rng(0).normal(size=200)

    def falls():
        return [fallen for _, _, fallen in islice(sparse.gradient_steps(A, b, lambda r: r), 60)]

    fall = falls()
    for enough in (0.3, 0.03, 1e-3):
        window = 3
        end = next(k for k in range(window, 60) if fall[k] - fall[k - window] <= enough * fall[k])
        x = kept_factor.by_gradients(A, b, lambda r: r, end, enough)
        assert 2 * (b @ x) - x @ A @ x == pytest.approx(fall[end], rel=1e-9)
        assert kept_factor.by_gradients(A, b, lambda r: r, end - 1, enough) is None
        short, done = kept_factor.nearly(A, b, lambda r: r, end - 1, enough)
        assert not done and 2 * (b @ short) - short @ A @ short == pytest.approx(fall[end - 1], rel=1e-9)
    # A guess adds what it wins by itself.
    guess = np.linalg.solve(A.toarray(), b) + 0.1 * np.random.default_rng(1).normal(size=200)
    x = kept_factor.by_gradients(A, b, lambda r: r, 60, 1e-3, guess)
    assert np.linalg.norm(b - A @ x) < 0.5 * np.linalg.norm(b)


def directions_of_bfgs(points, gradients, diagonal):
    """The next direction by dense inverse Hessians, updated by the pairs of the last steps (Nocedal, Wright 6.17)."""
    n = points[0].size
    H = np.diag(np.repeat(diagonal.ravel(), 3))
    pairs = [((b - a).ravel(), (h - g).ravel()) for a, b, g, h in
             zip(points, points[1:], gradients, gradients[1:], strict=False)][-MEMORY:]  # fmt: skip
    for s, y in pairs:
        r = 1 / (s @ y)
        left = np.eye(n) - r * np.outer(s, y)
        H = left @ H @ left.T + r * np.outer(s, s)
    return -(H @ gradients[-1].ravel()).reshape(-1, 3)


def test_directions_are_those_of_dense_updates():
    rng = np.random.default_rng(0)
    A = positive(15, 6, 0.3).toarray()
    solver, points, gradients = LBFGS(), [], []
    x = rng.normal(size=(5, 3))
    for _ in range(MEMORY + 4):
        diagonal = rng.uniform(0.5, 2, (5, 1))
        gradient = (A @ x.ravel()).reshape(-1, 3)
        points.append(x)
        gradients.append(gradient)
        found = solver.direction(x, gradient, diagonal)
        np.testing.assert_allclose(found, directions_of_bfgs(points, gradients, diagonal), atol=1e-9)
        x = x + 0.3 * found
    # A step along which the slope falls says nothing of the curvature, and is left out.
    count = len(solver.pairs)
    solver.direction(x + 1, gradient - 1, diagonal)
    assert len(solver.pairs) == count


def grid_laplacian(n):
    V, F = meshes.grid(n, n)
    A = cotangent_laplacian(np.column_stack([V[:, :2], np.zeros(len(V))]), F).tocsr()
    order = np.argsort(kd_parts(V[:, :2], 8), kind="stable")
    return A[order][:, order].tocsr()


def test_a_cycle_takes_most_of_any_error():
    """The error after a cycle is less than four fifths of before, in the energy's norm, for the worst of many loads."""
    A = grid_laplacian(40)
    hierarchy = multigrid.Multigrid(A)
    assert len(hierarchy._levels) == 1
    rng = np.random.default_rng(0)
    x = rng.normal(size=A.shape[0])
    x -= x.mean()
    for _ in range(6):
        after = x - hierarchy.cycle(A @ x)
        after -= after.mean()
        share = np.sqrt((after @ A @ after) / (x @ A @ x))
        x = after / np.linalg.norm(after)
    assert share < 0.8


@pytest.mark.parametrize("tolerance", [1e-2, 1e-8])
def test_laplacians_are_solved_to_the_tolerance_in_its_own_scale(tolerance):
    A = grid_laplacian(40)
    rng = np.random.default_rng(1)
    b, scale = rng.normal(size=A.shape[0]), rng.uniform(0.1, 10, A.shape[0])
    solver = multigrid.LaplacianSolver()
    for factor in (1, 1.001):
        x = solver.solve(factor * A, b, scale, tolerance)
        b0 = b - b.mean()
        assert np.abs((b0 - factor * A @ x) / scale).max() <= 1.01 * tolerance * np.abs(b0 / scale).max()
        assert abs(x.mean()) < 1e-12 * np.abs(x).max()


def bumpy_parts(size=60):
    V, F = meshes.bumpy(20, 20)
    return V, F, additive_schwarz.AdditiveSchwarz(V, F, size)


def test_blocks_are_those_of_the_matrix_and_leave_no_trace():
    A = positive(80, 7)
    place = np.full(80, -1, np.int64)
    for seed in range(4):
        parts = [np.random.default_rng([seed, k]).choice(80, 20, replace=False) for k in range(seed + 1)]
        joined = additive_schwarz._Joined.of(A, parts, place)
        blocks = sp.block_diag([A.toarray()[np.ix_(d, d)] for d in parts])
        np.testing.assert_array_equal(joined.taken(A).toarray(), blocks.toarray())
        np.testing.assert_array_equal(joined.taken(3 * A).toarray(), 3 * blocks.toarray())
        assert (place == -1).all()


def test_a_solve_by_parts_is_preconditioned_by_their_sum():
    """One application is the sum of the exact solutions of the parts and of the coarse motions, by dense matrices."""
    V, F, parts = bumpy_parts()
    n = len(V)
    w = V[:, :2] @ [1, 1j]
    axes = np.tile([1, 1j], (n, 1))
    L = cotangent_laplacian(V, F).toarray()
    A = np.kron(L, np.eye(2)) + 0.1 * np.eye(2 * n)
    b = np.random.default_rng(0).normal(size=2 * n)
    seen = []

    def steps(matrix, load, precondition, *rest):
        seen.append(precondition(load))
        return np.linalg.solve(A, load)

    before, additive_schwarz.by_gradients = additive_schwarz.by_gradients, steps
    try:
        parts.solve(sp.csr_matrix(A), b, w, lambda: axes)
    finally:
        additive_schwarz.by_gradients = before
    spread = additive_schwarz.affine_motions(parts._part, parts._count, w, axes).toarray()
    # Every part has motions of its own: to shift, turn, scale and shear it.
    assert np.linalg.matrix_rank(spread) == spread.shape[1] == 6 * (parts._part.max() + 1)
    coarse = spread.T @ A @ spread
    expected = spread @ np.linalg.solve(coarse + 1e-12 * coarse.diagonal().max() * np.eye(len(coarse)), spread.T @ b)
    for d in parts._unknowns:
        expected[d] += np.linalg.solve(A[np.ix_(d, d)], b[d])
    np.testing.assert_allclose(seen[0], expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())
    # An affine map of one part alone is among the coarse motions, whatever the axes.
    part = parts._part == 1
    for motion in (np.ones(n), 1j * np.ones(n), w, 1j * w, w.conj(), 1j * w.conj()):
        moved = np.where(part, motion, 0)
        along = np.stack([moved.real, moved.imag], axis=1).ravel()
        left = along - spread @ np.linalg.lstsq(spread, along, rcond=None)[0]
        assert np.abs(left).max() < 1e-9


def test_parts_are_halves_of_halves_along_the_longest_side():
    points = np.random.default_rng(0).random((203, 2)) * [1, 3]
    part = kd_parts(points, 3)

    def halved(rows, depth):
        if not depth:
            return [rows]
        axis = np.ptp(points[rows], axis=0).argmax()
        rows = rows[np.argsort(points[rows, axis], kind="stable")]
        half = len(rows) // 2
        return [*halved(rows[:half], depth - 1), *halved(rows[half:], depth - 1)]

    for k, rows in enumerate(halved(np.arange(203), 3)):
        assert set(rows.tolist()) == set(np.flatnonzero(part == k).tolist())


def test_halves_are_eliminated_before_what_separates_them():
    """At every level: what is left of a part without its separator falls into its halves, and comes first."""
    V, F = meshes.bumpy(16, 16)
    dissection = Dissection(V)
    order = dissection.order(*halfedges(F))
    rank = np.argsort(order)
    graph = vertex_graph(F, len(V)).tocsr()
    pairs = np.array(graph.nonzero()).T
    separates = np.zeros(len(V), bool)
    for level in range(dissection.depth):
        half, before = dissection.part >> (dissection.depth - 1 - level), separates.copy()
        for whole in range(1 << level):
            low, high = half == 2 * whole, (half == 2 * whole + 1) & ~before
            across = pairs[low[pairs[:, 0]] & high[pairs[:, 1]]]
            separator = np.unique(across[:, 1])
            separates[separator] = True
            rest = (low | high) & ~before & ~np.isin(np.arange(len(V)), separator)
            if len(separator) and rest.any():
                assert rank[separator].min() > rank[rest].max()


def test_the_graph_joins_just_what_shares_a_triangle_and_every_vertex_to_itself():
    V, F = meshes.bumpy(5, 4)
    found = vertex_graph(F, len(V) + 1).toarray() > 0
    expected = np.eye(len(V) + 1) > 0
    for f in F:
        expected[np.ix_(f, f)] = True
    np.testing.assert_array_equal(found, expected)
