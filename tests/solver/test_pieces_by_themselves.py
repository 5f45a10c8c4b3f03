"""Pieces of solvers that few results tell of, by plain formulas: what waits, what is shared, what comes first."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace

import meshes
import numpy as np
import pytest
from bodies import icosphere
from sphere_shapes import blob, random_rotation

from omt_uv.solver import errors
from omt_uv.solver.arranging import congruence
from omt_uv.solver.contact import barrier
from omt_uv.solver.contact.new_crossings import NewCrossings
from omt_uv.solver.contact.self_intersections import FaceCrossings
from omt_uv.solver.flows import flow_map
from omt_uv.solver.flows.handles import FlowHandle, joined
from omt_uv.solver.mesh.closest_point import ClosestPoint, ClosestPointTracker
from omt_uv.solver.mesh.geometry import vertex_normals
from omt_uv.solver.mesh.topology import halfedges
from omt_uv.solver.progress import drain
from omt_uv.solver.registration import suggestions
from omt_uv.solver.remeshing.fitting import local_trials
from omt_uv.solver.seams.cut_tree import Cut
from omt_uv.solver.signatures import wasserstein
from omt_uv.solver.signatures.marked import marked_signature
from omt_uv.solver.signatures.signature import signature
from omt_uv.solver.sphere import multilevel
from omt_uv.solver.volumes.registration import OUTERMOST, registered


@pytest.mark.parametrize("share, words", [(0.005, "less than 1 %"), (0.01, "1 %"), (0.126, "13 %"), (1.0, "100 %")])
def test_shares_in_words(share, words):
    assert errors.percent(share) == words


def test_every_error_says_what_to_do_in_a_sentence_without_its_end():
    classes = [c for c in vars(errors).values() if isinstance(c, type) and issubclass(c, errors.MeshError)]
    for cls in classes:
        if cls is errors.MeshError:
            continue
        assert cls.remedy[0].isupper() and cls.remedy[-1].isalnum(), cls
        # What is a kind of another thing says it in other words.
        for base in cls.__bases__:
            assert cls.remedy != base.remedy, cls
        own = cls("It is so", "Do this", "face", [3, 1])
        assert own.remedy == "Do this" and str(own) == "It is so (2 faces: 3, 1). Do this."
        assert str(cls("It is so")) == f"It is so. {cls.remedy}."


@pytest.mark.parametrize("count", [1, 3, 4, 7])
@pytest.mark.parametrize("walls", [False, True])
def test_all_that_is_reached_is_carried_block_by_block_and_the_rest_stays(monkeypatch, count, walls):
    monkeypatch.setattr(flow_map, "BLOCK", 3)
    monkeypatch.setattr(flow_map, "carried", lambda block, steps: block + sum(steps))
    rng = np.random.default_rng(0)
    everything, reached = rng.random((9, 3)), np.sort(rng.choice(9, count, replace=False))
    domain = SimpleNamespace(held=lambda block: np.minimum(block, 2.5)) if walls else None
    seen, plan = [], [[1.0], [0.5, 0.25], []]
    steps = flow_map._carry_all(everything, plan, domain, reached)
    found = drain(steps, lambda p: seen.append(p.fraction))
    assert seen == pytest.approx([min(3 * (k + 1) / count, 1.0) for k in range(-(-count // 3))])
    still = np.setdiff1d(np.arange(9), reached)
    expected = everything[reached]
    for move, result in zip((1.0, 0.75, 0.0), found, strict=True):
        expected = np.minimum(expected + move, 2.5) if walls else expected + move
        np.testing.assert_allclose(result[reached], expected)
        assert (result[still] == everything[still]).all()


def test_handles_at_one_place_are_told_by_their_names_or_their_numbers():
    at = np.zeros((1, 3))
    handles = (FlowHandle(at, at + 1, name="hand"), FlowHandle(at + 5, at + 6), FlowHandle(at, at + 2))
    with pytest.raises(errors.HandleError, match="different ones: hand and number 2"):
        joined(handles, 0.1)
    # Those that go the same way count once, the first of them.
    start, end, owner = joined((handles[0], handles[1], FlowHandle(at, at + 1, name="other")), 0.1)
    assert owner.tolist() == [0, 1] and np.array_equal(end - start, np.ones((2, 3)))


def pushed(shift=0.0):
    """Two balls of which one is to go through a third of the other, which gives way."""
    V, F = icosphere(1)
    V = np.concatenate([V, V + [np.ptp(V[:, 0]) + 0.1, 0.03, 0.02]]) + [0, shift, 0]
    goal = V + np.where(np.arange(len(V)) < len(V) // 2, 0.6, 0.0)[:, None] * [1, 0.1, 0]
    return V, np.concatenate([F, F + len(V) // 2]), goal


def test_what_is_far_apart_is_brought_as_if_it_were_alone():
    V, F, goal = pushed()
    W, G, other = pushed(9.0)
    free = np.arange(len(V)) % 7 > 0
    alone = barrier.brought(V, goal, NewCrossings(V, FaceCrossings(F)), free)
    both, faces = np.concatenate([V, W]), np.concatenate([F, G + len(V)])
    # The second one is where it shall be.
    together = barrier.brought(
        both, np.concatenate([goal, W]), NewCrossings(both, FaceCrossings(faces)), np.tile(free, 2)
    )
    np.testing.assert_allclose(together[len(V) :], W, atol=1e-9)
    twice = barrier.brought(
        both, np.concatenate([goal, other]), NewCrossings(both, FaceCrossings(faces)), np.tile(free, 2)
    )
    np.testing.assert_allclose(twice[len(V) :] - [0, 9.0, 0], twice[: len(V)], atol=1e-7)
    for found in (together, twice):
        np.testing.assert_allclose(found[: len(V)], alone, atol=5e-3)


def test_no_energy_rises_and_nothing_meets_in_a_step_of_the_barrier():
    V, F, goal = pushed()
    crossings = NewCrossings(V, FaceCrossings(F))
    tail, head = halfedges(F)
    edge = float(np.linalg.norm(V[tail] - V[head], axis=1).mean())
    problem = barrier._Problem(goal, np.ones(len(V)) / edge**2, crossings, edge)
    at, near, falls = V, problem.near(V), []
    for _ in range(8):
        group = near.groups(len(V))
        before = problem.energies(at, near, group)
        after, there, gone = problem.searched(at, near)
        assert not len(problem.meeting(after)) and np.abs(after - at).max() <= 0.5 * edge * (1 + 1e-9)
        left = problem.energies(after, there, group)
        # What stays may come close to what moves.
        goes = np.unique(group[np.abs(after - at).max(axis=1) > 0])
        assert len(goes) and (left[goes] <= before[goes] * (1 + 1e-9)).all()
        assert gone == pytest.approx(1 - left.sum() / before.sum(), abs=1e-9)
        falls.append(gone)
        at, near = after, there
    assert falls[0] > 0.2 and all(gone >= -1e-9 for gone in falls)
    # The energy is that of the formula, pair by pair.
    total = 0.5 * problem.mass @ ((at - goal) ** 2).sum(axis=1)
    total += sum(-1e-3 * (s - 1) ** 2 * np.log(s) for s in near.share)
    assert problem.energies(at, near, near.groups(len(V))).sum() == pytest.approx(total)


@pytest.mark.parametrize("ends", [None, 1, 5])
def test_copies_move_with_what_was_varied_held_first_and_freely_then(ends):
    held, fixed, seen = np.array([1]), np.array([2]), []

    class Trial:
        def flip(self):
            seen.append("flip")

        def step(self, rms, stays, keep_centroids):
            seen.append((rms, stays is held, stays is fixed, keep_centroids))
            return len(seen) - 1 != ends

    trial = Trial()
    batch = SimpleNamespace(mesh=lambda: trial, held=held, fixed=fixed)
    assert local_trials.TrialBatch.run(batch, 0.25) is trial
    first, then = (0.25, True, False, True), (0.25, False, True, False)
    every = [first] * 1 + [then] * 2
    assert seen == ["flip", *every[:ends]]


@pytest.mark.parametrize("shift", [0.0, 0.2])
def test_landmarks_of_bodies_are_turned_first_and_then_led(shift):
    rng = np.random.default_rng(4)
    points = rng.normal(size=(60, 3))
    points *= 0.8 * rng.random((60, 1)) ** (1 / 3) / np.linalg.norm(points, axis=1, keepdims=True)
    turn = random_rotation(rng) if callable(random_rotation) else np.eye(3)
    marks = np.array([[0.5, 0, 0], [0, 0.6, 0], [0, 0, 0.7], [-0.4, -0.3, 0.1]])
    goals = marks @ turn.T
    goals[0] += shift * np.array([0.0, 0.6, 0.8])
    found = drain(registered(points, marks, goals))
    np.testing.assert_allclose(found.rotation @ found.rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(found.rotation) == pytest.approx(1)
    before = np.linalg.norm(marks @ found.rotation.T - goals, axis=1).mean()
    assert found.before == pytest.approx(before, abs=1e-12) and found.after <= found.before + 1e-12
    if shift:
        assert found.after < 1e-3 and found.before > 0.02
        assert np.linalg.norm(found.positions, axis=1).max() < 1
    else:
        np.testing.assert_allclose(found.rotation, turn, atol=1e-9)
        np.testing.assert_allclose(found.positions, points @ turn.T, atol=1e-9)
        assert found.after == found.before < 1e-9
    for few in (marks[:2], marks[:3]):
        with pytest.raises(errors.HandleError, match="three landmarks"):
            drain(registered(points, few, goals[:2] if len(few) == 2 else goals))


def test_landmarks_at_the_wall_are_pulled_in_and_no_others():
    from omt_uv.solver.volumes.registration import _inner

    points = np.array([[0.0, 0, 0], [0.5, 0, 0], [0, OUTERMOST, 0], [0, 0, -1.0], [3.0, 4.0, 0]])
    found = _inner(points)
    np.testing.assert_array_equal(found[:3], points[:3])
    np.testing.assert_allclose(found[3:], OUTERMOST * np.array([[0, 0, -1.0], [0.6, 0.8, 0]]))


@pytest.mark.parametrize("most", [0, 30, 10**6])
def test_a_sphere_is_reached_from_whatever_level(monkeypatch, most):
    monkeypatch.setattr(multilevel, "MOST_RETRIED", most)
    V, F = blob(2, seed=2)
    seen = []
    found, steps = drain(multilevel.multilevel_start(V, F, np.ones(len(F))), lambda p: seen.append(p.fraction))
    assert np.linalg.norm(found, axis=1) == pytest.approx(np.ones(len(V)))
    a, b, c = (found[F[:, k]] for k in range(3))
    assert (np.einsum("ij,ij->i", a, np.cross(b, c)) > 0).all() and steps >= 0
    assert all(0 <= x <= 1 for x in seen)


@pytest.mark.parametrize("every", [1, 2, 3])
@pytest.mark.parametrize("far", [0.0, 1.5])
@pytest.mark.parametrize("start", [False, True])
def test_when_closest_points_are_searched_for_and_when_they_are_walked_to(monkeypatch, every, far, start):
    V, F = blob(1)
    real, did = ClosestPoint(V, F, 0.3), []
    points, normals = 1.1 * V, vertex_normals(V, F)

    class Index:
        def __call__(self, *given):
            did.append("search")
            return real(*given)

        def walk(self, *given):
            did.append("walk")
            return real.walk(*given)

        def closer(self, *given):
            did.append("closer")
            return real.closer(*given)

    tracker = ClosestPointTracker(every, far, np.zeros(len(V), np.int64) if start else None)
    for _ in range(7):
        found = tracker(Index(), points, normals)
        assert (tracker.faces == found.faces).all()
    expected, calls = [], int(start)
    for k in range(7):
        again = calls % every == 0
        expected += ["search"] if (k == 0 and not start) or (again and not far) else ["walk", *["closer"] * again]
        calls += 1
    assert did == expected


def test_peaks_are_the_strongest_places_above_all_beside_them_and_not_near_one_another():
    V, F = blob(3)
    rng = np.random.default_rng(0)
    value = rng.random(len(V)) * (rng.random(len(V)) > 0.2)
    found = suggestions._peaks(value, V, F)
    beside = [set() for _ in V]
    for a, b, c in F.tolist():
        beside[a] |= {b, c}
        beside[b] |= {a, c}
        beside[c] |= {a, b}
    tops = [v for v in range(len(V)) if value[v] > 0 and all(value[v] >= value[w] for w in beside[v])]
    expected: list[int] = []
    for v in sorted(tops, key=lambda v: -value[v]):
        if len(expected) < 40 and all(np.linalg.norm(V[v] - V[w]) > 0.05 for w in expected):
            expected.append(v)
    assert found.tolist() == expected and len(expected) > 3


def library():
    """Signatures of bodies that grow ever less like the first one, on the sphere, and on the disk by markers."""
    shapes = []
    for k in range(5):
        V, F = blob(2, seed=1)
        shapes.append((V * [1 + 0.12 * k, 1.0, 1 - 0.06 * k], F))
    V, F = shapes[0]
    ends = int(V[:, 0].argmax()), int(V[:, 0].argmin())
    plain = [drain(signature(*shape, 60)) for shape in shapes]
    marked = [drain(marked_signature(*shape, *ends, 60)) for shape in shapes]
    return {"plain": plain, "marked": marked}


@pytest.mark.parametrize("kind", ["plain", "marked"])
def test_the_nearest_of_a_library_are_those_that_are_nearest_one_by_one(kind):
    every = library()[kind]
    for k, mine in enumerate(every):
        distances = [
            wasserstein.distance_of(wasserstein.prepared(mine), wasserstein.prepared(other)).raw for other in every
        ]
        listed = wasserstein.nearest(mine, every, 3)
        assert [found.raw for _, found in listed] == pytest.approx(
            [distances[row] for row, _ in listed], rel=0.25, abs=1e-3
        )
        assert [found.raw for _, found in listed] == pytest.approx(sorted(distances)[:3], rel=0.25, abs=1e-3)
        assert listed[0][0] == k


def test_a_cut_of_half_the_spread_may_be_a_fifth_longer():
    def cut(cost, spread):
        return Cut(np.arange(1), np.arange(1), spread, cost)

    for bound in (0.5, 3.0):
        even = cut(1.0, bound).score(bound)
        assert even == pytest.approx(1.0) and cut(2.0, bound).score(bound) == pytest.approx(2.0)
        assert cut(1.15, bound / 2).score(bound) < even < cut(1.35, bound / 2).score(bound)
        # What is far below the bound is worth no more.
        assert cut(1.0, 0.0).score(bound) == cut(1.0, bound / 2).score(bound) < cut(1.0, bound).score(bound)
        scores = [cut(1.0, x).score(bound) for x in np.linspace(bound / 2, 3 * bound, 9)]
        assert all(a < b for a, b in pairwise(scores))


@pytest.mark.parametrize("seed", range(4))
def test_what_is_congruent_is_found_with_the_vertex_of_each_and_what_is_not_is_none(seed):
    rng = np.random.default_rng(seed)
    V, F = meshes.random_disk(40, seed)
    turn, new = random_rotation(rng), rng.permutation(len(V))
    for mirror in (False, True):
        W = np.empty_like(V)
        W[new] = (V * [-1 if mirror else 1, 1, 1]) @ turn.T + rng.normal(size=3)
        G = new[F][:, ::-1] if mirror else new[F]
        found = congruence.matching(V, F, W, G)
        assert found.vertices.tolist() == new.tolist() and found.mirrored == mirror
        assert congruence.matching(V, F, W * 1.01, G) is None
        moved = W.copy()
        moved[new[7]] += 0.01
        assert congruence.matching(V, F, moved, G) is None
        # Two at one place are not one each.
        merged = W.copy()
        merged[new[7]] = merged[new[8]]
        assert congruence.matching(V, F, merged, G) is None
        # Vertices alone do not do: faces have to go to faces.
        assert congruence.matching(V, F, W, rng.permutation(len(V))[G]) is None
    double = np.concatenate([V, V[:3]])
    other = np.concatenate([V, V[4:7]])
    assert congruence._checked(double, congruence.cKDTree(double), F, F, 1e-9) is None
    assert congruence._checked(other, congruence.cKDTree(np.concatenate([V, V[:3]])), F, F, 1e-9) is None
    assert congruence._checked(V, congruence.cKDTree(V), F, F, 1e-9).tolist() == list(range(len(V)))
