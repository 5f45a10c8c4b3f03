"""Which copies of a random search are taken, with copies whose distances and shapes are written in advance."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from omt_uv.solver.remeshing.fitting import random_search


@pytest.fixture
def searched(monkeypatch):
    """What a search of one patch takes: of each round the copy whose move stays, and whether it was better."""

    def run(rounds, target=1.0):
        monkeypatch.setattr(random_search, "ROUNDS", len(rounds))
        monkeypatch.setattr(random_search, "COPIES", len(rounds[0]["norm"]))
        monkeypatch.setattr(random_search, "COPIES_TOGETHER", 1)
        copies, at, placed, put = len(rounds[0]["norm"]), [-1], [], []

        class Patches:
            vertices = np.array([3, 5, 6])
            triangles = np.array([[0, 1, 2]])
            of_face = np.array([0])
            of_vertex = np.array([0, 0, 0])

            def __len__(self):
                return 1

        class Trial:
            triangles = np.arange(3 * copies).reshape(-1, 3)
            twin = None
            points = None

            def place(self, points):
                at[0] += 1
                self.points = points
                placed.append(points.reshape(copies, 3, 3).copy())

            def pairs(self):
                return "pairs"

        class Batch:
            owner = np.arange(copies)
            patches = Patches()

            def __init__(self, state, peaks, count):
                assert count == copies

            def mesh(self):
                return Trial()

        now = lambda name: np.array(rounds[at[0]][name], float)  # noqa: E731
        monkeypatch.setattr(random_search, "TrialBatch", Batch)
        monkeypatch.setattr(random_search, "find_peaks", lambda *_: None)
        monkeypatch.setattr(random_search, "patch_shapes", lambda *_: None)
        monkeypatch.setattr(random_search, "_fixed_in", lambda *_: np.array([True, False, False]))
        monkeypatch.setattr(
            random_search, "least_angles", lambda points, triangles: np.array([0.5]) if at[0] < 0 else now("angle")
        )
        monkeypatch.setattr(random_search, "MIN_ANGLE", 0.4)
        moves = np.arange(copies)[:, None, None] * np.ones((1, 3, 3))
        monkeypatch.setattr(random_search, "_moves", lambda *_: moves)
        monkeypatch.setattr(random_search, "distance_norms", lambda *_: now("norm"))
        monkeypatch.setattr(random_search, "smallness", lambda *_: now("bad"))
        monkeypatch.setattr(random_search, "acceptable", lambda *_: now("ok").astype(bool).reshape(copies, 1).copy())
        monkeypatch.setattr(
            random_search, "put_best_back", lambda batch, trial, after, pairs, best: put.append(best.tolist())
        )
        state = SimpleNamespace(points=np.zeros((9, 3)))
        better = random_search.search_randomly(state, None, Patches(), target, None)
        return better.tolist(), put[0], placed

    return run


def plain(*norm, bad=0.0, ok=True, angle=0.45):
    n = len(norm)
    spread = lambda x: list(x) if isinstance(x, tuple) else [x] * n  # noqa: E731
    return {"norm": norm, "bad": spread(bad), "ok": spread(ok), "angle": spread(angle)}


def test_the_best_copy_is_taken_where_it_is_better_than_what_there_was(searched):
    assert searched([plain(5.0, 4.0, 3.0)])[:2] == ([True], [2])
    assert searched([plain(5.0, 5.0, 6.0)])[:2] == ([False], [-1])
    gain = 0.002
    assert searched([plain(5.0, 5.0 * (1 - 0.9 * gain), 9.0)])[0] == [False]
    assert searched([plain(5.0, 5.0 * (1 - 1.1 * gain), 9.0)])[0] == [True]


def test_copies_that_are_not_acceptable_or_too_narrow_are_not_taken(searched):
    assert searched([plain(5.0, 4.0, 3.0, ok=(True, True, False))])[1] == [1]
    assert searched([plain(5.0, 4.0, 3.0, angle=(0.45, 0.41, 0.39))])[1] == [1]
    assert searched([plain(5.0, 4.0, 3.0, ok=(True, False, False))])[:2] == ([False], [-1])
    # What there was may be as it is.
    assert searched([plain(5.0, 4.0, 6.0, ok=(False, True, True))])[1] == [1]


def test_below_the_target_shapes_alone_count(searched):
    assert searched([plain(0.9, 0.2, 0.9, bad=(1.0, 1.0, 0.5))])[1] == [2]
    assert searched([plain(0.9, 0.2, 0.9)])[0] == [False]
    assert searched([plain(5.0, 4.0, 4.0, bad=(0.0, 0.0, 0.1))], target=2.0)[1] == [1]


def test_rounds_go_on_from_what_was_taken_and_what_is_fixed_stays(searched):
    better, best, placed = searched([plain(5.0, 4.0, 3.0), plain(3.0, 3.0, 3.5)])
    assert (better, best) == ([True], [0])
    # The second copy had moved by 2, but for its fixed vertex.
    assert placed[1][0].tolist() == [[0, 0, 0], [2, 2, 2], [2, 2, 2]]
    assert placed[1][1].tolist() == [[0, 0, 0], [3, 3, 3], [3, 3, 3]] and (placed[0][:, 0] == 0).all()


def test_moves_are_in_the_frame_of_the_middle_and_none_in_the_first_copy():
    points = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [5, 5, 0], [5, 5.5, 0], [4, 5, 0.0]])

    class Patches:
        triangles = np.array([[0, 1, 2], [3, 4, 5]])
        middle = np.array([0, 1])
        of_vertex = np.array([0, 0, 0, 1, 1, 1])

        def __len__(self):
            return 2

    found = random_search._moves(points, Patches(), 2000, np.random.default_rng(1))
    assert found.shape == (2000, 6, 3) and not found[0].any()
    moved = np.abs(found[1:]).max(axis=2) > 0
    assert moved.mean() == pytest.approx(0.6, abs=0.02)
    size = found[1:][moved].std(axis=0)
    # Steps along the first side and across it are as long as each other, on the mean; upwards they are shorter.
    first = found[1:, :3][moved[:, :3]]
    assert first[:, 0].std() == pytest.approx(first[:, 1].std(), rel=0.1)
    assert first[:, 2].std() == pytest.approx(0.5 * first[:, 0].std(), rel=0.1)
    second = found[1:, 3:][moved[:, 3:]]
    assert second[:, 0].std() == pytest.approx(first[:, 0].std() / 4, rel=0.15) and size.shape == (3,)


def test_outer_rings_fixed_vertices_and_the_boundary_stay():
    triangles = np.array([[0, 1, 2], [2, 1, 3]])
    twin = np.array([-1, 3, -1, 1, -1, -1])
    state = SimpleNamespace(points=np.zeros((6, 3)), triangles=triangles, twin=twin)
    batch = SimpleNamespace(
        patches=SimpleNamespace(vertices=np.array([4, 1, 5])), fixed=np.array([False, False, True, True])
    )
    found = random_search._fixed_in(state, batch)
    assert found.tolist() == [False, True, True]
