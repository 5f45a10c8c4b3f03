"""Cuts that are made shorter, and islands that start where they lie: which changes are kept, with costs written in
advance."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import meshes
import numpy as np
import pytest

from omt_uv.solver.editing import refine_island
from omt_uv.solver.editing.refine_island import island_start
from omt_uv.solver.errors import FoldedUVError
from omt_uv.solver.mesh.topology import boundary_edges
from omt_uv.solver.seams import improvement


@dataclass(frozen=True)
class Cut:
    """A cut whose spread and cost follow from its steps."""

    steps: np.ndarray
    spread: float = 0.0
    cost: float = 0.0

    def score(self, bound):
        return self.cost


def task(bound=1.0, cost=None, spread=None, size=12):
    cost = np.ones(size) if cost is None else np.asarray(cost, float)
    graph = SimpleNamespace(cost=cost, is_open=lambda steps: True)
    return SimpleNamespace(bound=bound, graph=graph, spread_of=spread or (lambda steps: 0.0))


@pytest.fixture
def written(monkeypatch):
    """Cuts along steps, with leaves and stretches as given."""

    def along(task, steps):
        steps = np.unique(steps)
        return Cut(steps, task.spread_of(steps.tolist()), float(task.graph.cost[steps].sum()))

    def use(leaves=None, stretches=None, losses=None):
        monkeypatch.setattr(improvement, "cut_along", along)
        if leaves is not None:
            monkeypatch.setattr(
                improvement,
                "leaves",
                lambda graph, steps: [np.array(x) for x in leaves if set(x) <= set(steps.tolist())],
            )
        if stretches is not None:
            monkeypatch.setattr(improvement, "stretches", lambda graph, steps: [np.array(x) for x in stretches])
        if losses is not None:
            monkeypatch.setattr(
                improvement.Removal,
                "of",
                staticmethod(
                    lambda task, cut: SimpleNamespace(losses=lambda leaf: np.array(losses[tuple(leaf.tolist())], float))
                ),
            )

    use.along = along
    return use


def test_ends_of_leaves_are_taken_off_that_lose_least_while_there_is_room(written):
    leaves = [(0, 1, 2, 3), (4, 5)]
    losses = {(0, 1, 2, 3): [0.1, 0.2, 0.6, 2.0], (4, 5): [0.3, 0.4]}
    written(leaves, losses=losses)

    def spread(steps):
        return 0.5 if {0, 1} <= set(steps) else 0.9

    given = task(1.0, spread=spread)
    cut = written.along(given, np.arange(7))
    # Half of the first leaf loses 0.1 for each step, the whole other one 0.2; after that there is room for 0.1.
    found = improvement.trimmed(given, cut)
    assert found.steps.tolist() == [2, 3, 4, 5, 6]
    # Without room it stays.
    assert improvement.trimmed(task(0.5, spread=spread), cut) is cut


def test_of_even_losses_the_first_is_taken_and_costs_count(written):
    written([(0, 1), (2, 3)], losses={(0, 1): [0.2, 0.4], (2, 3): [0.2, 0.4]})
    given = task(1.0, cost=[1, 1, 4, 4, 1], spread=lambda steps: 0.55 if len(steps) == 5 else 0.99)
    # What costs four times as much loses a quarter for it.
    assert improvement.trimmed(given, written.along(given, np.arange(5))).steps.tolist() == [0, 1, 4]


@pytest.mark.parametrize(
    ("path", "cost", "is_open", "taken"),
    [
        ([8, 9], 1.9, True, True),
        ([8, 9], 1.9, False, False),
        ([8, 9], 2.0, True, False),
        (None, 1.0, True, False),
        ([0, 1], 1.0, True, False),
    ],
)
def test_stretches_are_replaced_by_cheaper_ones_that_keep_the_surface_whole(
    path, cost, is_open, taken, written, monkeypatch
):
    written(stretches=[[0, 1], [2, 3]])
    given = task(cost=[1, 1, 1, 1, 1, 1, 1, 1, cost / 2, cost / 2])
    given.graph.is_open = lambda steps: is_open
    given.graph.steps_of = np.array
    monkeypatch.setattr(improvement, "_bridge", lambda task, stretch, rest: path if stretch[0] == 0 else None)
    cut = written.along(given, np.arange(4))
    found = improvement.rerouted(given, cut)
    assert found.steps.tolist() == ([2, 3, 8, 9] if taken else [0, 1, 2, 3])
    # What is no longer in the cut has no other way.
    assert improvement.rerouted(given, written.along(given, np.array([0, 2, 3]))).steps.tolist() == [0, 2, 3]


@pytest.mark.parametrize(("share", "taken"), [(1.1, True), (0.9, False)])
def test_what_is_better_is_so_by_a_thousandth(share, taken, written, monkeypatch):
    written(stretches=[[0, 1]])
    less = 1000 * (1 - share * 1e-3)
    given = task(cost=[500, 500, 0, 0, 0, 0, 0, 0, less, 0])
    given.graph.steps_of = np.array
    monkeypatch.setattr(improvement, "_bridge", lambda *_: [8])
    assert improvement.rerouted(given, written.along(given, np.array([0, 1]))).steps.tolist() == (
        [8] if taken else [0, 1]
    )


@pytest.mark.parametrize("in_vain", [0, 1, 2, 3])
def test_the_leaf_that_is_worth_least_is_taken_back_first_then_some_at_random(in_vain, written):
    leaves = [np.array(x) for x in ((0, 1), (2,), (3, 4))]
    losses = {(0, 1): [0.1, 0.9], (2,): [0.2], (3, 4): [0.1, 0.3]}
    written([leaf.tolist() for leaf in leaves], losses=losses)
    given = task(cost=[1, 1, 1, 2, 2, 1])
    cut = written.along(given, np.arange(6))
    found, order = improvement._leaves_by_worth(given, cut)
    # 0.9 for 2, 0.2 for 1, 0.3 for 4.
    assert [tuple(found[k].tolist()) for k in order] == [(3, 4), (2,), (0, 1)]
    gone = improvement._taken_back(found, order, in_vain, np.random.default_rng(0))
    if in_vain < 3:
        assert [leaf.tolist() for leaf in gone] == [found[order[in_vain]].tolist()]
    else:
        chosen = np.random.default_rng(0).random(3) < 0.4
        random = [leaf.tolist() for leaf, c in zip(leaves, chosen, strict=True) if c]
        assert [leaf.tolist() for leaf in gone] == (random or [[3, 4]])


@pytest.mark.parametrize(
    "outcomes",
    [
        [(0.9, 5.0, True), (0.9, 5.0, False), (0.9, 4.0, True)],
        [(1.1, 1.0, False), (0.9, 9.0, True)],
        [(0.9, 9.999, False)],
    ],
)
def test_trials_are_kept_where_they_are_better_within_the_bound(outcomes, written, monkeypatch):
    asked, rest = [], list(outcomes)

    def taken(found, order, in_vain, rng):
        asked.append(in_vain)
        return [np.array([len(asked)])]

    def grow(task, base, most):
        assert most == 12
        return base

    def trimmed(task, grown):
        spread, cost, _ = rest.pop(0)
        return Cut(np.arange(12), spread, cost)

    written([[0]], losses={(0,): [0.1]})
    monkeypatch.setattr(improvement, "_taken_back", taken)
    monkeypatch.setattr(improvement, "grow", grow)
    monkeypatch.setattr(improvement, "rerouted", lambda task, cut: cut)
    monkeypatch.setattr(improvement, "trimmed", trimmed)
    first = Cut(np.arange(12), 0.95, 10.0)
    found = list(improvement.improved(task(1.0), first, len(outcomes)))
    best, vain, want = first, 0, []
    for (spread, cost, better), one in zip(outcomes, found, strict=True):
        want.append(vain)
        assert (one.cost == cost and one.spread == spread) if better else one is best
        best, vain = (one, 0) if better else (best, vain + 1)
    assert asked == want
    # A cut that is beyond the bound already may be as far beyond.
    rest[:] = [(1.4, 5.0, True)]
    assert next(improvement.improved(task(1.0), Cut(np.arange(12), 1.5, 10.0), 1)).cost == 5.0
    monkeypatch.setattr(improvement, "leaves", lambda graph, steps: [])
    assert list(improvement.improved(task(1.0), first, 4)) == []


def test_what_the_same_leaves_or_the_same_growth_come_to_is_found_once(written, monkeypatch):
    taken, counts = [[1], [1], [2], [1, 2]], {"grow": 0, "trimmed": 0}
    written([[0]], losses={(0,): [0.1]})

    def grow(task, base, most):
        counts["grow"] += 1
        # Without one as without the other.
        return Cut(np.setdiff1d(base.steps, [1, 2]))

    def trimmed(task, grown):
        counts["trimmed"] += 1
        return Cut(grown.steps, 0.9, 20.0)

    monkeypatch.setattr(improvement, "_taken_back", lambda *_: [np.array(taken.pop(0))])
    monkeypatch.setattr(improvement, "grow", grow)
    monkeypatch.setattr(improvement, "rerouted", lambda task, cut: cut)
    monkeypatch.setattr(improvement, "trimmed", trimmed)
    found = list(improvement.improved(task(1.0), Cut(np.arange(12), 0.95, 10.0), 4))
    assert [one.cost for one in found] == [10.0] * 4 and counts == {"grow": 3, "trimmed": 1}


# ---- islands ------------------------------------------------------------------------------------------------


V, F = meshes.grid(3, 3)
GIVEN = 2 * V[:, :2] @ [1, 1j]


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("apart", [True, False])
@pytest.mark.parametrize("straight", [True, False])
def test_islands_start_where_they_lie_or_straightened(straight, apart, fixed, monkeypatch):
    monkeypatch.setattr(refine_island, "_parted", lambda w, triangles, boundary: w + 1 if apart else None)
    monkeypatch.setattr(refine_island, "_straightened", lambda *_: V[:, :2] + 9 if straight else None)
    boundary = boundary_edges(F)
    start, told = island_start(V, F, GIVEN, boundary, fixed)
    # The map has an area of 4, and is to have 1.
    if fixed:
        assert np.array_equal(start, GIVEN) and told == ()
    elif apart:
        assert start == pytest.approx((GIVEN + 1) / 2) and told == ()
    elif straight:
        assert start == pytest.approx(V[:, :2] @ [1, 1j] + 9 + 9j) and told == (refine_island.STRAIGHTENED,)
    else:
        assert start == pytest.approx(GIVEN / 2) and told == ()
    folded = GIVEN.copy()
    folded[5] = -3 - 3j
    if straight:
        assert island_start(V, F, folded, boundary, fixed)[1] == (refine_island.STRAIGHTENED,)
        return
    with pytest.raises(FoldedUVError) as caught:
        island_start(V, F, folded, boundary, fixed)
    uv = np.column_stack([folded.real, folded.imag])
    a, b, c = (uv[F[:, k]] for k in range(3))
    area = (b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0]
    assert caught.value.elements.tolist() == np.flatnonzero(area <= 0).tolist() and len(caught.value.elements)


@pytest.mark.parametrize("tries", [0, 1, 2, 99])
def test_boundaries_are_drawn_in_little_by_little_until_they_are_apart(tries, monkeypatch):
    tried = []

    def meets(drawn, boundary):
        tried.append(drawn.copy())
        return len(tried) <= tries

    monkeypatch.setattr(refine_island, "meets_itself", meets)
    found = refine_island._parted(GIVEN, F, boundary_edges(F))
    # A tenth of the way at most.
    shares = (0, 0.01, 0.03, 0.1)
    count = min(tries + 1, len(shares))
    assert len(tried) == count and (found is None) == (tries == 99)
    beside = [sorted({int(u) for t in F if v in t for u in t} - {v}) for v in range(16)]
    # Neighbours count once for each face they share, as halfedges do.
    for drawn, share in zip(tried, shares, strict=False):
        moved = {v for v in range(16) if drawn[v] != GIVEN[v]}
        assert moved <= set(boundary_edges(F)[:, 0].tolist())
        for v in range(16):
            if v in (5, 6, 9, 10):
                assert drawn[v] == GIVEN[v]
            else:
                around = [GIVEN[u] for t in F.tolist() if v in t for u in t if u != v]
                assert drawn[v] == pytest.approx(GIVEN[v] + share * (np.mean(around) - GIVEN[v])) and beside[v]


def test_outlines_have_the_area_to_their_left():
    assert refine_island.signed_area_of(np.array([[0, 0], [2, 0], [2, 1], [0, 1.0]])) == 2.0
    assert refine_island.signed_area_of(np.array([[0, 0], [0, 3], [3, 0.0]])) == -4.5


@pytest.mark.parametrize(
    ("mesh", "straight"),
    [(lambda: meshes.grid(3, 3), True), (lambda: meshes.annulus(8, 2), True), (meshes.cube, False)],
)
def test_disks_and_rings_are_straightened_to_an_area_of_one(mesh, straight):
    vertices, triangles = mesh()
    uv = vertices[:, :2] * [1.0, 0.9] if straight else vertices[:, :2]
    found = refine_island._straightened(vertices, triangles, uv)
    assert (found is not None) == straight
    if straight:
        from omt_uv.solver.mesh.geometry import signed_areas

        assert signed_areas(found, triangles).sum() == pytest.approx(1) and (signed_areas(found, triangles) > 0).all()
