"""Solvers as generators: results, errors and fractions come through, also from a thread; a run has a log."""

import threading

import meshes
import numpy as np
import pytest

from omt_uv.solver.api import steps
from omt_uv.solver.comparison.comparison_figures import compare
from omt_uv.solver.editing.magnify import magnify_map
from omt_uv.solver.progress import EarlyEnd, Progress, RunLog, ThreadProgress, drain, on_thread, part_of, unless_ended
from omt_uv.solver.registration.register import register
from omt_uv.solver.sphere.dominitz_tannenbaum import flow_map
from omt_uv.solver.sphere.sphere_map import sphere_map
from omt_uv.solver.volumes.body_map import volume_map


def count_to(n):
    for k in range(n):
        yield Progress("Counting", k / n)
    return n


def test_drain_returns_the_result_and_shows_the_way():
    seen = []
    assert drain(count_to(4), seen.append) == 4
    assert [p.fraction for p in seen] == [0, 0.25, 0.5, 0.75]


def test_a_part_of_a_job():
    seen = []
    assert drain(part_of(count_to(4), 0.5, 0.2), seen.append) == 4
    assert [p.fraction for p in seen] == pytest.approx([0.5, 0.55, 0.6, 0.65])


def test_a_part_waits_where_its_solver_begins_anew():
    def rounds():
        for fraction in (0.0, 0.6, 0.2, 0.4, 0.9):
            yield Progress("Rounds", fraction)

    seen = []
    drain(part_of(rounds(), 0.5, 0.5), seen.append)
    assert [p.fraction for p in seen] == pytest.approx([0.5, 0.8, 0.8, 0.8, 0.95])


def test_what_can_be_done_without_ends_when_it_is_asked():
    """Through parts of jobs and threads, too; the solver is closed, and without being asked it goes to its end."""
    closed, early = [], EarlyEnd()

    def endless():
        try:
            while True:
                yield Progress("Here", 0.0)
        finally:
            closed.append(True)

    def whole():
        yield Progress("First", 0.0)
        return (yield from part_of(unless_ended(endless(), early), 0.5, 0.5))

    def ask(progress):
        assert (progress.early is None) == (progress.stage in ("", "First"))
        if progress.early is not None:
            progress.early.ask()

    assert drain(on_thread(whole()), ask) is None and closed == [True]
    assert drain(unless_ended(count_to(4), EarlyEnd())) == 4


def test_a_thread_gives_the_same_result():
    main = threading.get_ident()

    def where():
        yield Progress("Here", 0.0)
        return threading.get_ident()

    seen = []
    assert drain(on_thread(where()), seen.append) != main
    assert all(isinstance(p, ThreadProgress) for p in seen)
    assert drain(on_thread(count_to(100))) == 100


def test_an_error_on_a_thread_comes_out_here():
    def failing():
        yield Progress("Here", 0.0)
        raise ValueError("on purpose")

    with pytest.raises(ValueError, match="on purpose"):
        drain(on_thread(failing()))


def test_closing_a_thread_ends_its_solver():
    ended = threading.Event()

    def endless():
        try:
            while True:
                yield Progress("Here", 0.0)
        finally:
            ended.set()

    steps = on_thread(endless())
    next(steps)
    steps.close()
    assert ended.wait(5)


def test_a_log_adds_seconds_also_of_what_fails():
    log = RunLog()
    with log.timed("a"):
        pass
    first = log.seconds["a"]
    with pytest.raises(ValueError, match="b"), log.timed("a"):
        raise ValueError("b")
    assert log.seconds["a"] >= first and log.warnings == []


BALL, PATCH = meshes.icosphere(2), meshes.bumpy(8, 8)


def many_patches(count=12):
    """Patches side by side, so many that small charts are mapped together."""
    V, F = meshes.bumpy(4, 4)
    at = np.arange(count)
    return (V + 3 * at[:, None, None] * [1, 0, 0]).reshape(-1, 3), (F + len(V) * at[:, None, None]).reshape(-1, 3)


AREA = np.full(len(BALL[1]), 1.0)
FLAT = PATCH[0][:, :2]
# Solvers that have several stages, each a part of the way.
SOLVERS = {
    "unwrap": lambda: steps.unwrap(*PATCH),
    "unwrap many": lambda: steps.unwrap(*many_patches()),
    "refine": lambda: steps.refine(*PATCH, FLAT[PATCH[1]], balance=0.5),
    "remesh": lambda: steps.remesh(*PATCH, 90),
    "remesh closed": lambda: steps.remesh(*BALL, 300),
    "sphere": lambda: sphere_map(*BALL),
    "sphere by flow": lambda: sphere_map(*BALL, method="flow"),
    "flow": lambda: flow_map(*BALL, AREA + np.arange(len(AREA)) % 3),
    "match": lambda: register(PATCH, PATCH),
    "magnify": lambda: magnify_map(FLAT, PATCH[1], np.where(np.arange(len(PATCH[1])) < 30, 2.0, 1.0)),
    "volume": lambda: volume_map(*BALL, count=300),
    "volume by flow": lambda: volume_map(*BALL, method="flow", count=300),
    "compare": lambda: compare(PATCH, PATCH, 500),
}


@pytest.mark.parametrize("name", SOLVERS)
def test_a_solver_goes_on_all_the_way_and_is_at_its_end_when_it_says_so(name):
    seen = []
    drain(SOLVERS[name](), lambda p: seen.append(p.fraction))
    at = np.array(seen)
    assert at[0] < 0.1 and at.min() >= 0 and at.max() <= 1 and (np.diff(at) >= -1e-9).all()
    # At most one report comes at the end, and no stage is passed over in one step.
    assert (at >= 1).sum() <= 1 and np.diff(at, append=1.0).max() < 0.8


def test_what_a_log_tells_of_a_stage_is_the_sum_of_what_its_clock_went_on(monkeypatch):
    """Also where a stage ends in an error, or is in another one."""
    clock = iter([10.0, 12.0, 20.0, 21.0, 24.0, 30.0, 100.0, 107.0])
    monkeypatch.setattr("omt_uv.solver.progress.time.perf_counter", lambda: next(clock))
    log = RunLog()
    with log.timed("one"):
        pass
    with log.timed("outer"), log.timed("one"):
        pass
    with pytest.raises(ValueError, match="no"), log.timed("other"):
        raise ValueError("no")
    assert log.seconds == {"one": 2.0 + 3.0, "outer": 10.0, "other": 7.0}
