"""Green's functions of plates: those of slivers are told apart from nothing, though double precision does not."""

import numpy as np
from scipy.sparse import csr_matrix

from omt_uv.solver.seams.predicted_scale import Held, _inverse


def test_a_plate_that_rounding_makes_singular_has_an_answer():
    rows = np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 2.0]])
    rows[1, 1] = np.nextafter(1.0, 0.0)
    green = _inverse(csr_matrix(rows), np.array([0, 1, 3]), 4)
    assert np.isfinite(green).all() and (green == green.T).all()
    assert abs(green[3, 3] - 0.5) < 1e-8
    assert not green[2].any()


def test_what_is_held_one_after_another_is_held_at_once():
    """To the digits that rounding leaves, where what holds it against rounding is what it was before any."""
    rng = np.random.default_rng(0)
    root = rng.normal(size=(30, 30))
    held = Held.of(root @ root.T, rng.normal(size=30))
    first, then = np.arange(3, 9), np.arange(12, 20)
    once = held.at(np.concatenate([first, then]))
    after = held.at(first).at(then, held.own(then))
    np.testing.assert_allclose(after.value, once.value, atol=1e-10)
    np.testing.assert_allclose(after.own(np.arange(30)), once.own(np.arange(30)), atol=1e-9)
    assert np.abs(once.value[np.concatenate([first, then])]).max() < 1e-4


def test_what_rounding_leaves_between_vertices_that_are_held_already_holds_nothing():
    """As of a closed surface, whose Green's function is large and the same nearly everywhere."""
    rng = np.random.default_rng(1)
    root = rng.normal(size=(12, 12))
    root[6:] = root[:6] + 1e-9 * root[6:]
    held = Held.of(1e4 + root @ root.T, rng.normal(size=12))
    first, again = held.at(np.arange(6)), np.arange(4, 12)
    block = first.between(again, np.full(8, 1e-9))
    assert np.linalg.eigvalsh(block)[0] < 0
    after = first.at(again, np.full(8, 1e-9))
    assert len(after.rows) < 6 + 8
    assert np.abs(after.value).max() < 1e-6 * np.abs(held.value).max()
    assert np.abs(after.own(np.arange(12))).max() < 1e-6
