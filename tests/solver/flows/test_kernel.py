"""The field: free of divergence wherever it is measured, and what is asked of it where it is asked."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.errors import HandleError
from omt_uv.solver.flows.kernel import conditions, interpolated_field, kernel_matrix


def random_field(dimension, count=8, walls=5, seed=0):
    rng = np.random.default_rng(seed)
    given = conditions(rng.uniform(-1, 1, (count, dimension)), *(rng.normal(size=(2, walls, dimension))))
    values = rng.normal(size=len(given.directions))
    return given, values, interpolated_field(given, values, 4.0)


@pytest.mark.parametrize("dimension", [2, 3])
def test_every_condition_is_met(dimension):
    given, values, field = random_field(dimension)
    found = np.einsum("rd,rd->r", field(given.points)[given.place], given.directions)
    np.testing.assert_allclose(found, values, atol=1e-8)


def divergence(field, points, step):
    """By central differences: it is nothing but error."""
    axes = np.eye(points.shape[1])
    return sum((field(points + step * a) - field(points - step * a)) @ a for a in axes) / (2 * step)


@pytest.mark.parametrize("dimension", [2, 3])
def test_nothing_diverges_anywhere(dimension):
    *_, field = random_field(dimension)
    points = np.random.default_rng(1).uniform(-2, 2, (500, dimension))
    assert np.abs(divergence(field, points, 1e-4)).max() < 1e-5 * np.abs(field(points)).max() / 1e-1


def test_the_fast_sum_is_the_kernel():
    """Against the closed form, term by term."""
    rng = np.random.default_rng(2)
    given, _, field = random_field(3, walls=0)
    x = rng.normal(size=3)
    total = np.zeros(3)
    for centre, c in zip(field.centres, field.coefficients, strict=True):
        d = x - centre
        psi = np.exp(-4.0 * d @ d)
        total += psi * (2 * c + 8.0 * (d * (d @ c) - (d @ d) * c))
    np.testing.assert_allclose(field(x[None])[0], total, atol=1e-9 * np.abs(field.coefficients).max())
    matrix = kernel_matrix(given, 4.0)
    np.testing.assert_allclose(matrix, matrix.T, atol=1e-14)
    assert np.linalg.eigvalsh(matrix).min() > 0


def test_contradictions_are_refused():
    points = np.array([[0.0, 0, 0], [1e-9, 0, 0]])
    given = conditions(points, np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(HandleError, match="too close"):
        interpolated_field(given, np.array([1.0, 0, 0, -1, 0, 0]), 4.0)


@pytest.mark.parametrize("speed", [1e-12, 1e-6, 1e6, 1e12])
@pytest.mark.parametrize("near", [0.0, 0.1])
def test_fields_are_linear_in_what_is_asked_whatever_the_unit_of_speed(speed, near):
    """What cannot be is refused however slow it is, and what can be is found however fast."""
    given, values, _ = random_field(3)
    plain, fast = (interpolated_field(given, each, 4.0, near) for each in (values, speed * values))
    points = np.random.default_rng(3).uniform(-1, 1, (50, 3))
    np.testing.assert_allclose(fast(points) / speed, plain(points), atol=1e-6 * np.abs(plain(points)).max())
    # Nearly as exact as that of the unit itself, in the worst of the directions.
    twice = conditions(np.array([[0.0, 0, 0], [1e-9, 0, 0]]), np.zeros((0, 3)), np.zeros((0, 3)))
    with pytest.raises(HandleError, match="too close"):
        interpolated_field(twice, speed * np.array([1.0, 0, 0, -1, 0, 0]), 4.0, near)
