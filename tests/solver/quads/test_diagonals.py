"""Quads are cut along the diagonals that suit them, whichever they came with."""

import numpy as np
import pytest

from omt_uv.solver.quads.diagonals import LEAST_CORNER, longer_diagonals, shorter_diagonals


def test_convex_quads_are_cut_along_the_shorter_diagonal():
    """Of parallelograms of all shapes, in all places, apart from one another."""
    rng = np.random.default_rng(5)
    corner, one, other = (rng.normal(size=(200, 3)) for _ in range(3))
    V = np.stack([corner, corner + one, corner + one + other, corner + other], axis=1).reshape(-1, 3)
    quads = np.arange(800).reshape(-1, 4)
    sine = np.linalg.norm(np.cross(one, other), axis=1) / np.linalg.norm(one, axis=1) / np.linalg.norm(other, axis=1)
    thick = sine > 0.3
    cut = shorter_diagonals(V, quads, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    assert thick.sum() > 100
    np.testing.assert_array_equal(np.sort(cut, axis=1), quads)
    mine, left = (np.linalg.norm(V[cut[:, k]] - V[cut[:, k + 2]], axis=1)[thick] for k in (0, 1))
    assert (mine <= left).all()


@pytest.mark.parametrize("seed", range(3))
def test_of_any_quads_those_are_turned_that_bulge_out_and_whose_other_diagonal_is_shorter(seed):
    """Corner by corner: flat ones, crooked ones and arrowheads, apart from one another."""
    rng = np.random.default_rng(seed)
    flat = rng.uniform(0, 1, (300, 4, 2))
    V = np.concatenate([flat, 0.1 * rng.normal(size=(300, 4, 1)) * (np.arange(300) % 2)[:, None, None]], axis=2)
    V, quads = V.reshape(-1, 3), np.arange(1200).reshape(-1, 4)
    found = longer_diagonals(V, quads, quads[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))
    seen = set()
    for q, turned in zip(quads, found, strict=True):
        a, b, c, d = p = V[q]
        own = np.cross(c - a, d - b)
        corners = [np.cross(p[(k + 1) % 4] - p[k], p[k - 1] - p[k]) @ own / (own @ own) for k in range(4)]
        if min(abs(x - LEAST_CORNER) for x in corners) < 1e-9:
            continue
        bulges = min(corners) > LEAST_CORNER
        assert turned == (bulges and np.linalg.norm(d - b) < np.linalg.norm(c - a))
        seen.add((bulges, bool(turned)))
    assert seen == {(True, True), (True, False), (False, False)}
