"""A boundary that may not cross itself: crossings, and the barrier before them."""

import numpy as np
import pytest

from omt_uv.solver.maps import boxes
from omt_uv.solver.maps.boxes import box_pairs
from omt_uv.solver.maps.contacts import crossings, crossings_on_the_way, loop_edges
from omt_uv.solver.refinement.boundary_barrier import BoundaryBarrier, make_barrier


def test_crossings_of_a_bow_tie_and_of_a_polygon():
    assert crossings(np.array([0, 1 + 1j, 1, 1j]), np.arange(4)).tolist() == [[0, 2]]
    circle = np.exp(2j * np.pi * np.arange(50) / 50)
    assert len(crossings(circle, np.arange(50))) == 0


def test_box_pairs_are_those_of_brute_force():
    rng = np.random.default_rng(0)
    low1, low2 = rng.random((60, 2)), rng.random((80, 2))
    high1, high2 = low1 + 0.1 * rng.random((60, 2)), low2 + 0.2 * rng.random((80, 2))
    i, j = box_pairs(low1, high1, low2, high2)
    meet = (low1[:, None] <= high2).all(2) & (low2 <= high1[:, None]).all(2)
    assert np.array_equal(np.column_stack([i, j]), np.argwhere(meet))


@pytest.mark.parametrize("corner", [(0, 0), (-3, 0), (0, -3), (-0.5, 0.5), (2, 2)], ids=str)
@pytest.mark.parametrize("sizes", [0.05, 2.0])
def test_a_grid_finds_them_wherever_the_others_lie(corner, sizes, monkeypatch):
    """Also where others begin below all of the first ones; and both ways round."""
    monkeypatch.setattr(boxes, "_swept", lambda *_: None)
    rng = np.random.default_rng(1)
    low1, low2 = 3 * rng.random((70, 2)), 3 * rng.random((50, 2)) + corner
    high1, high2 = low1 + sizes * rng.random((70, 2)), low2 + 0.3 * rng.random((50, 2))
    meet = (low1[:, None] <= high2).all(2) & (low2 <= high1[:, None]).all(2)
    assert meet.any() or sizes < 1
    assert np.array_equal(np.column_stack(box_pairs(low1, high1, low2, high2)), np.argwhere(meet))
    assert np.array_equal(np.column_stack(box_pairs(low2, high2, low1, high1)), np.argwhere(meet.T))


@pytest.mark.parametrize("turn", [1, np.exp(0.5j)], ids=["along", "askew"])
def test_boxes_of_a_long_strip_are_compared_with_their_neighbours_alone(turn, monkeypatch):
    rows = []
    expand = boxes.expand
    monkeypatch.setattr(boxes, "expand", lambda counts: rows.append(int(counts.sum())) or expand(counts))
    x = np.arange(20_000)
    w = np.concatenate([x, x[::-1] + 1j]) * turn
    assert not len(crossings(w, np.arange(len(w))))
    assert max(rows) < 100 * len(w)


def slot():
    """A nearly closed ring: its ends face each other across a narrow gap."""
    angle = np.linspace(0.005, 2 * np.pi - 0.005, 40)
    ring = np.concatenate([np.exp(1j * angle), 0.6 * np.exp(1j * angle[::-1])])
    return ring, np.arange(len(ring))


def test_contact_gradient_is_the_derivative_of_its_energy():
    ring, loop = slot()
    barrier = make_barrier(ring, loop, 1.0)
    assert barrier.energy(ring) > 0
    rng = np.random.default_rng(0)
    direction = rng.normal(size=len(ring)) + 1j * rng.normal(size=len(ring))
    h = 1e-8
    numeric = (barrier.energy(ring + h * direction) - barrier.energy(ring - h * direction)) / (2 * h)
    gradient, _, _ = barrier.derivatives(ring)
    assert numeric == pytest.approx((gradient.conj() * direction).real.sum(), rel=1e-4)


def test_contact_hessian_bounds_how_the_energy_bends():
    # A spike that nearly touches an edge; the second derivative counts sliding along an edge that turns.
    spike = np.array([0, 1, 1 + 0.5j, 0.4 + 0.01j, 0.5j])
    barrier = make_barrier(spike, np.arange(5), 1.0)
    _, vertices, rows = barrier.derivatives(spike)
    h = 1e-6
    for direction in np.random.default_rng(0).normal(size=(200, 5, 2)) @ [1, 1j]:
        before, here, after = (barrier.energy(spike + k * h * direction) for k in (-1, 0, 1))
        bound = ((rows * direction[vertices]).sum(1).real ** 2).sum()
        assert (before - 2 * here + after) / h**2 <= 1.001 * bound


def test_no_step_goes_through_an_edge():
    ring, loop = slot()
    barrier = make_barrier(ring, loop, 1.0)
    # Both ends move towards each other by more than the gap.
    step = np.where(ring.imag > 0, -1j, 1j) * (ring.real > 0) * (np.abs(ring.imag) < 0.5) * 0.2
    assert len(crossings(ring + step, loop)) > 0
    share = barrier.limit(ring, step)
    assert 0 < share < 1
    assert len(crossings(ring + share * step, loop)) == 0


def test_crossings_do_not_depend_on_scale_turn_and_names():
    random = np.random.default_rng(3)
    w, loop = random.normal(size=(30, 2)) @ [1, 1j], np.arange(30)
    found = crossings(w, loop)
    assert len(found)
    np.testing.assert_array_equal(crossings(1e-6 * (0.6 + 0.8j) * w + 5e-6, loop), found)
    name = random.permutation(30)
    np.testing.assert_array_equal(crossings(w[np.argsort(name)], name), found)


def test_a_loop_and_its_edges_are_the_same_boundary():
    ring, loop = slot()
    edges = np.column_stack(loop_edges(loop))
    a, b = make_barrier(ring, loop, 1.0), make_barrier(ring, edges, 1.0)
    assert a.energy(ring) == b.energy(ring)
    np.testing.assert_array_equal(a.derivatives(ring)[0], b.derivatives(ring)[0])


def test_the_barrier_does_not_feel_where_the_map_lies():
    ring, loop = slot()
    barrier = make_barrier(ring, loop, 1.0)
    gradient = barrier.derivatives(ring)[0]
    assert barrier.energy(ring * (0.6 + 0.8j) + 3) == pytest.approx(barrier.energy(ring))
    assert abs(gradient.sum()) < 1e-9 * np.abs(gradient).sum()
    assert abs((gradient.conj() * 1j * ring).real.sum()) < 1e-9 * np.abs(gradient).sum()


@pytest.mark.parametrize("vertex_reach, edge_reach", [(0.5, 0.1), (0.1, 0.5), (0.5, 0.4), (0.1, 0.1)])
def test_of_a_vertex_and_an_edge_the_smaller_reach_counts(vertex_reach, edge_reach):
    """Two triangles, 0.3 apart."""
    w = np.array([0, 1, 0.5 - 1j, 0.5 + 0.3j, 1.5 + 1.3j, -0.5 + 1.3j])
    tail, head = np.arange(6), np.array([1, 2, 0, 4, 5, 3])
    barrier = BoundaryBarrier(tail, head, np.full(6, vertex_reach), np.full(6, edge_reach), 1.0)
    reach = min(vertex_reach, edge_reach)
    assert barrier.energy(w) == pytest.approx(max(reach / 0.3 - 1, 0) ** 2)


@pytest.mark.parametrize("stacked", [False, True], ids=["swept", "in a grid"])
def test_boxes_meet_as_all_pairs_say(stacked):
    rng = np.random.default_rng(3)
    # Long boxes above one another leave a sweep nothing to tell apart.
    size = np.array([30.0, 0.01]) if stacked else np.array([0.5, 0.5])
    low1, low2 = 20 * rng.random((400, 2)), 20 * rng.random((300, 2))
    high1, high2 = low1 + size * rng.random((400, 2)), low2 + size * rng.random((300, 2))
    low2[:20], high2[:20] = low1[:20], high1[:20]
    meet = (low1[:, None] <= high2[None]).all(2) & (low2[None] <= high1[:, None]).all(2)
    i, j = box_pairs(low1, high1, low2, high2)
    np.testing.assert_array_equal(np.column_stack([i, j]), np.argwhere(meet))
    assert not len(box_pairs(low1[:0], high1[:0], low2, high2)[0])


def test_crossings_of_what_moves_are_crossings_of_all():
    w = np.exp(2j * np.pi * np.arange(60) / 60)
    loop, step = np.arange(60), np.zeros(60, complex)
    step[[10, 31]] = -1.1 * w[[10, 31]]
    found = crossings_on_the_way(w, step, loop, (0.3, 1.0, 1.9))
    everywhere = np.concatenate([crossings(w + share * step, loop) for share in (0.3, 1.0, 1.9)])
    assert len(everywhere) and {tuple(sorted(p)) for p in found.tolist()} == {tuple(p) for p in everywhere.tolist()}
    assert not len(crossings_on_the_way(w, 0 * step, loop, (1.0,)))


def slit(gap=0.0):
    """A square with a slit from its right side to its middle, whose sides are so far apart: an outline."""
    y = 0.5 * gap
    right = [1 - 0.5j - y * 1j, 1.0 - 1j * y, 0.5 - 1j * y]
    return np.array([-1 - 1j, 0 - 1j, 1 - 1j, *right, 0, 0.5 + 1j * y, 1 + 1j * y, 1 + 1j, -1 + 1j, -1])


@pytest.mark.parametrize("gap, moves", [(0.0, True), (1e-12, True), (0.02, True), (0.06, False), (0.3, False)])
def test_what_touches_is_set_apart_and_nothing_else(gap, moves):
    w = slit(gap)
    loop = np.arange(len(w))
    barrier = make_barrier(w, loop, 1.0)
    step = barrier.set_apart(w)
    assert (np.abs(step) > 0).any() == moves
    if moves:
        moved = w + step
        assert not len(crossings(moved, loop)) and np.isfinite(barrier.energy(moved))
        # Both sides go inwards, the tip of the slit and what lies off stay.
        assert (step[[4, 5]].imag < 0).all() and (step[[7, 8]].imag > 0).all()
        assert not step[[0, 1, 6, 9, 10, 11]].any() and np.abs(step).max() <= 0.1 * 0.5
    # Turned, larger and elsewhere it is the same.
    np.testing.assert_allclose(make_barrier(3j * w + 5, loop, 1.0).set_apart(3j * w + 5), 3j * step, atol=1e-12)


def test_a_smaller_reach_is_that_share_of_the_edges():
    w, loop = slot()
    near, far = make_barrier(w, loop, 1.0, 0.05), make_barrier(w, loop, 1.0)
    np.testing.assert_allclose(far.vertex_reach, 10 * near.vertex_reach)
    np.testing.assert_allclose(far.edge_reach, 10 * near.edge_reach)
    assert near.energy(w) < far.energy(w)


def test_energy_at_contact_is_infinite_without_a_word():
    w = slit()
    barrier = make_barrier(w, np.arange(len(w)), 1.0)
    with np.errstate(over="raise"):
        assert barrier.energy(w) == np.inf
