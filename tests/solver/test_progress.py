"""Solvers as generators: results, errors and fractions come through, also from a thread; a run has a log."""

import threading

import pytest

from omt_uv.solver.progress import EarlyEnd, Progress, RunLog, ThreadProgress, drain, on_thread, part_of, unless_ended


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
