"""Factors solve what they were made from, in every order, and say so when they cannot."""

import meshes
import numpy as np
import pytest
import scipy.sparse as sp

from omt_uv.solver.errors import PrecisionError
from omt_uv.solver.linalg import sparse
from omt_uv.solver.linalg.sparse import (
    Factor,
    FillOrder,
    conjugate_gradients,
    fill,
    minimum_degree,
    solve_conjugate_gradients,
    solve_general,
    solve_spd,
)
from omt_uv.solver.mesh.geometry import cotangent_laplacian


def system():
    V, F = meshes.random_disk()
    A = cotangent_laplacian(V, F) + 0.1 * sp.identity(len(V))
    return A, np.random.default_rng(0).normal(size=(len(V), 2))


@pytest.mark.parametrize("order", [None, "mmd", "colamd", "natural", "permutation"])
def test_every_order_solves(order):
    A, b = system()
    factor = Factor(A, minimum_degree(A) if order == "permutation" else order)
    assert np.allclose(A @ factor.solve(b), b)
    assert np.allclose(A @ factor.solve(b[:, 0]), b[:, 0])


def test_minimum_degree_is_a_permutation_with_less_fill_than_none():
    A, _ = system()
    order = minimum_degree(A)
    assert np.array_equal(np.sort(order), np.arange(A.shape[0]))
    assert Factor(A, order)._lu.nnz < Factor(A, "natural")._lu.nnz


@pytest.mark.parametrize("many", [False, True])
def test_an_order_is_found_anew_once_vertices_far_from_each_other_meet(many, monkeypatch):
    V, F = meshes.head(24)
    # Of many unknowns it is found before factors fill.
    monkeypatch.setattr(sparse, "MANY", 2 * len(V) + (0 if many else 1))
    order = minimum_degree(cotangent_laplacian(V, F))
    mesh = sp.kron(cotangent_laplacian(V, F)[order][:, order] + 0.1 * sp.identity(len(V)), np.ones((2, 2)), "csc")
    plain = mesh + sp.identity(2 * len(V))
    far = np.random.default_rng(0).integers(len(V), size=(60, 2))
    forms = sp.csr_matrix((np.tile([1.0, -1.0], 60), (np.repeat(np.arange(60), 2), 2 * far.ravel())), (60, 2 * len(V)))
    with_contacts, b = plain + forms.T @ forms, np.arange(2.0 * len(V))
    orders = FillOrder()
    entries = []
    for matrix in (plain, plain, with_contacts, with_contacts, with_contacts):
        factor = orders.factor(matrix)
        np.testing.assert_allclose(matrix @ factor.solve(b), b, atol=1e-6)
        entries.append(factor.entries)
    assert entries[0] == entries[1] and entries[4] == entries[3]
    assert entries[2] == entries[3] if many else entries[2] > max(1.2 * entries[0], entries[3])


def test_an_order_is_found_anew_however_slowly_factors_fill():
    V, F = meshes.head(24)
    order = minimum_degree(cotangent_laplacian(V, F))
    matrix = sp.kron(cotangent_laplacian(V, F)[order][:, order] + 0.1 * sp.identity(len(V)), np.ones((2, 2)), "csc")
    matrix = (matrix + sp.identity(2 * len(V))).tocsc()
    rng, orders, entries = np.random.default_rng(0), FillOrder(), []
    while orders.order is not None and isinstance(orders.order, str) and len(entries) < 200:
        entries.append(orders.factor(matrix).entries)
        form = sp.csr_matrix(([1.0, -1.0], ([0, 0], 2 * rng.integers(len(V), size=2))), (1, 2 * len(V)))
        matrix = (matrix + form.T @ form).tocsc()
    # Each has hardly more than the one before, and the last much more than the first.
    assert len(entries) > 3 and max(np.divide(entries[1:], entries[:-1])) < sparse.FILLED
    assert entries[-1] > sparse.FILLED * entries[0] >= entries[-2]


def test_fill_is_that_of_the_order_given():
    n = 12
    path = sp.diags([np.ones(n - 1), np.ones(n), np.ones(n - 1)], [-1, 0, 1])
    assert fill(path) == 2 * n - 1
    star = sp.lil_matrix(sp.identity(n))
    star[0] = star[:, 0] = 1
    assert fill(star) == n * (n + 1) // 2
    assert fill(star[::-1][:, ::-1]) == 2 * n - 1


def test_unsymmetric_dominant_systems():
    A, b = system()
    B = A + sp.diags(np.full(A.shape[0] - 1, 0.05), 1)
    assert np.allclose(B @ solve_general(B, b), b)
    assert np.allclose(A @ solve_spd(A, b), b)


def test_a_singular_matrix_is_named():
    with pytest.raises(PrecisionError, match="A linear system is singular in double"):
        solve_spd(sp.csc_matrix((3, 3)), np.ones(3))
    with pytest.raises(PrecisionError, match="A linear system is singular in double"):
        solve_spd(sp.diags([1.0, np.nan, 1.0]), np.ones(3))


@pytest.mark.parametrize("tolerance", [1e-3, 1e-10])
def test_conjugate_gradients_leave_no_more_than_their_tolerance(tolerance):
    A, b = system()
    b = b[:, 0]
    x = solve_conjugate_gradients(A, b, tolerance, 2000)
    left = np.linalg.norm(A @ x - b) / np.linalg.norm(b)
    assert left <= tolerance * (1 + 1e-6) and left > tolerance * 1e-3
    assert not solve_conjugate_gradients(A, 0 * b).any()
    # The error falls in the norm of A from one iteration to the next.
    exact = solve_spd(A, b)
    some = [solve_conjugate_gradients(A, b, 1e-300, k) - exact for k in range(6)]
    energies = [e @ (A @ e) for e in some]
    assert (np.diff(energies) < 0).all()
    # Preconditioned by its inverse, one iteration is enough.
    inverse = sp.csr_matrix(np.linalg.inv(A.toarray()))
    np.testing.assert_allclose(conjugate_gradients(lambda y: A @ y, b, inverse, 1e-12, 1), exact, rtol=1e-6, atol=1e-9)


def test_single_precision_solves_to_its_own_digits():
    A, b = system()
    exact = Factor(A).solve(b)
    found = Factor(A, single=True).solve(b)
    assert found.dtype == float
    error = np.abs(found - exact).max() / np.abs(exact).max()
    assert 1e-9 < error < 1e-3
