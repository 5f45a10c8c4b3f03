"""L-BFGS: descent always, and Newton's step where the Hessian is a multiple of the identity."""

import numpy as np
import pytest

from omt_uv.solver.linalg.lbfgs import LBFGS, MEMORY


def quadratic(n, seed=0):
    """A positive definite matrix (3n,3n), and the gradient of its form about a minimum (n,3)."""
    rng = np.random.default_rng(seed)
    q = np.linalg.qr(rng.normal(size=(3 * n, 3 * n)))[0]
    A = q @ np.diag(np.geomspace(1, 50, 3 * n)) @ q.T
    x0 = rng.normal(size=(n, 3))
    return x0, lambda x: (A @ (x - x0).ravel()).reshape(-1, 3)


def test_the_first_direction_is_that_of_the_diagonal():
    gradient, diagonal = np.random.default_rng(0).normal(size=(5, 3)), np.arange(1.0, 6)[:, None]
    np.testing.assert_array_equal(LBFGS().direction(np.zeros((5, 3)), gradient, diagonal), -diagonal * gradient)


def test_directions_descend_and_end_at_the_minimum():
    x0, gradient = quadratic(4)
    x, descent = np.zeros_like(x0), LBFGS()
    for _ in range(200):
        g = gradient(x)
        if np.linalg.norm(g) < 1e-10:
            break
        step = descent.direction(x, g, np.full((len(x), 1), 0.02))
        assert (step * g).sum() < 0
        # Exact along the line, as the gradient is linear.
        x = x - (step * g).sum() / (step * (gradient(x + step) - g)).sum() * step
    np.testing.assert_allclose(x, x0, atol=1e-9)
    assert len(descent.pairs) <= MEMORY


def test_a_step_with_the_right_scale_is_newtons():
    """One pair tells the scale of a Hessian that is a multiple of the identity along it."""
    x0 = np.random.default_rng(0).normal(size=(6, 3))
    descent, x = LBFGS(), np.zeros_like(x0)
    x = x + descent.direction(x, 7 * (x - x0), np.full((6, 1), 0.01))
    x = x + descent.direction(x, 7 * (x - x0), np.full((6, 1), 0.01))
    np.testing.assert_allclose(x, x0, atol=1e-12)


def test_reset_forgets():
    x0, gradient = quadratic(3)
    descent, diagonal = LBFGS(), np.full((3, 1), 0.02)
    x = np.zeros_like(x0)
    for _ in range(3):
        x = x + descent.direction(x, gradient(x), diagonal)
    descent.reset()
    np.testing.assert_array_equal(descent.direction(x, gradient(x), diagonal), -diagonal * gradient(x))


@pytest.mark.parametrize("length, energy", [(1e-9, 1.0), (1e9, 1.0), (1.0, 1e-12), (1.0, 1e12), (1e-9, 1e-9)])
def test_units_of_length_and_energy_do_not_matter(length, energy):
    """Steps are lengths, gradients energies over lengths, and the diagonal squared lengths over energies."""
    x0, gradient = quadratic(4)
    plain, scaled = LBFGS(), LBFGS()
    x, diagonal = np.zeros_like(x0), np.full((4, 1), 0.02)
    for _ in range(6):
        g = gradient(x)
        step = plain.direction(x, g, diagonal)
        other = scaled.direction(length * x, energy / length * g, length**2 / energy * diagonal)
        np.testing.assert_allclose(other / length, step, atol=1e-9 * np.abs(step).max())
        x = x + 0.5 * step
    assert len(plain.pairs) == len(scaled.pairs) == 5


def test_a_step_that_led_nowhere_changes_nothing():
    """What has no length says nothing of the Hessian."""
    x0, gradient = quadratic(3)
    diagonal, descent = np.full((3, 1), 0.02), LBFGS()
    x = np.zeros_like(x0)
    first = descent.direction(x, gradient(x), diagonal)
    np.testing.assert_array_equal(descent.direction(x, gradient(x), diagonal), first)
    assert not descent.pairs
    # Nor does one along which the gradient falls: the Hessian would not be positive.
    descent.direction(x + 1, gradient(x) - 1, diagonal)
    assert not descent.pairs


def test_whoever_asks_may_write_to_what_was_handed_in():
    """Steps are differences of what was there then: arrays that are used again say the same as new ones."""
    x0, gradient = quadratic(4)
    kept, fresh, diagonal = LBFGS(), LBFGS(), np.full((4, 1), 0.02)
    x, g = np.zeros_like(x0), np.empty_like(x0)
    for _ in range(6):
        g[:] = gradient(x)
        expected = fresh.direction(x.copy(), g.copy(), diagonal.copy())
        step = kept.direction(x, g, diagonal)
        np.testing.assert_array_equal(step, expected)
        x += 0.5 * step
        step[:] = np.nan
    assert len(kept.pairs) == len(fresh.pairs) == 5 and (diagonal == 0.02).all()
