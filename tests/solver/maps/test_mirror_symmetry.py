"""Vertices that follow their mirror images: symmetric maps stay what they are, slopes and forms are carried exactly."""

from __future__ import annotations

import numpy as np
import pytest

from omt_uv.solver.maps.mirror_symmetry import mirror_symmetry, without_symmetry

# Six vertices: two pairs, and two on the axis.
ONE = np.array([[1, 0, 3, 2, 4, 5]])
# A square and its centre, in two mirrors across one another.
TWO = np.array([[1, 0, 3, 2, 4], [3, 2, 1, 0, 4]])


@pytest.fixture(params=[(ONE, 1.0), (ONE, np.exp(0.7j)), (TWO, 1.0), (TWO, np.exp(-1.1j))], ids=str)
def symmetry(request):
    return mirror_symmetry(*request.param)


def some(n, seed=0):
    rng = np.random.default_rng(seed)
    return rng.normal(size=n) + 1j * rng.normal(size=n)


def test_a_spread_map_is_its_own_image(symmetry):
    w = symmetry.spread(some(symmetry.images.shape[1]))
    np.testing.assert_allclose(w[symmetry.images[0]], symmetry.phase * w.conj(), atol=1e-14)
    if len(symmetry.images) == 2:
        np.testing.assert_allclose(w[symmetry.images[1]], -symmetry.phase * w.conj(), atol=1e-14)
    np.testing.assert_allclose(symmetry.spread(w), w, atol=1e-14)


def test_the_average_of_a_symmetric_map_is_itself(symmetry):
    w = symmetry.spread(some(symmetry.images.shape[1]))
    np.testing.assert_allclose(symmetry.averaged(w), w, atol=1e-14)


def test_slopes_are_those_of_the_representatives(symmetry):
    n = symmetry.images.shape[1]
    slope, change = some(n, 1), some(n, 2)
    own = np.where(symmetry.follows, 0, change)
    # Of a move of the representatives that keeps them on their axes.
    own = np.where(symmetry.follows, 0, symmetry.spread(own))
    whole = (slope.conj() * symmetry.spread(own)).real.sum()
    assert (symmetry.folded(slope).conj() * own).real.sum() == pytest.approx(whole)


def test_forms_are_carried(symmetry):
    n = symmetry.images.shape[1]
    vertices, rows = np.array([[0, 1, 2], [3, 4, 1]]), some(6, 3).reshape(2, 3)
    own = np.where(symmetry.follows, 0, symmetry.spread(some(n, 4)))
    at, carried = symmetry.carried(vertices, rows)
    before = (rows * symmetry.spread(own)[vertices]).real.sum(axis=1)
    np.testing.assert_allclose((carried * own[at]).real.sum(axis=1), before, atol=1e-13)


def test_parts_and_restrictions():
    whole = without_symmetry(9).with_part(mirror_symmetry(ONE), np.arange(3, 9))
    assert not whole.follows[:3].any()
    place = np.full(9, -1)
    place[3:] = np.arange(6)
    np.testing.assert_array_equal(
        whole.restricted(np.arange(3, 9), place).representative, mirror_symmetry(ONE).representative
    )


@pytest.mark.parametrize("fixed", [[], [0], [4], [1, 4], range(4)], ids=str)
def test_unknowns_are_all_symmetric_changes_that_leave_fixed_vertices(symmetry, fixed):
    n = symmetry.images.shape[1]
    held = np.isin(np.arange(n), fixed)
    found = symmetry.unknowns(held).toarray()
    changes = (found[0::2] + 1j * found[1::2]).T
    for change in changes:
        np.testing.assert_allclose(change[symmetry.images[0]], symmetry.phase * change.conj(), atol=1e-14)
        np.testing.assert_allclose(symmetry.spread(change), change, atol=1e-14)
        assert not change[held].any()
    # None is missing, and none there twice: as many as there are such changes at all.
    units = np.concatenate([np.eye(n), 1j * np.eye(n)])
    spread = np.array([symmetry.spread(u) - u for u in units])
    stay = [np.where(held, x, 0) for x in (units.real, units.imag)]
    conditions = np.concatenate([spread.real, spread.imag, *stay], axis=1)
    rank = np.linalg.matrix_rank(found) if found.size else 0
    assert found.shape[1] == rank == 2 * n - np.linalg.matrix_rank(conditions)


@pytest.mark.parametrize("phase", [1.0, -1.0, 1j])
def test_representatives_are_on_one_side_of_any_axis(phase):
    """An axis may be given as a real number, negative too."""
    w = mirror_symmetry(ONE, phase).spread(some(6))
    side = (w * np.sqrt(np.conj(complex(phase)))).imag
    found = mirror_symmetry(ONE, phase, w)
    assert (side[~found.follows] > -1e-12).all()
