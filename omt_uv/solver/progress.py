"""Run long solvers step by step: they are generators that yield Progress and return their result.

One code path serves a script (`drain`), a progress bar (`drain` with a callback) and a modal
operator, which steps the generator from a timer and closes it to cancel.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

from .blas_threads import one_blas_thread
from .freed_memory import keep_freed

T = TypeVar("T")


class EarlyEnd:
    """Lets a solver end with the best it has so far: whoever steps it asks, and the solver looks at every Progress."""

    def __init__(self):
        self.is_asked = False

    def ask(self) -> None:
        """End soon, with a result."""
        self.is_asked = True


@dataclass(frozen=True)
class Progress:
    """What a solver is doing and how far it is, `fraction` in [0, 1] of the named stage.

    early : ends the solver with a result that it has already, None as long as there is none
    """

    stage: str
    fraction: float
    early: EarlyEnd | None = None


class ThreadProgress(Progress):
    """Progress of a solver that works on a thread of its own: asking again at once gains nothing."""


Steps: TypeAlias = Generator[Progress, None, T]


def take_step(steps: Iterator[Progress]) -> Progress:
    """One step of a solver. Linear algebra has one thread, as in `drain`: by their number sums differ in the last bits.

    Raises StopIteration with the result at the end.
    """
    keep_freed()
    with one_blas_thread():
        return next(steps)


def drain(steps: Steps[T], callback: Callable[[Progress], None] | None = None) -> T:
    """Run a solver to its end and return its result; `callback` sees every Progress."""
    keep_freed()
    with one_blas_thread():
        while True:
            try:
                progress = next(steps)
            except StopIteration as stop:
                return stop.value
            if callback is not None:
                callback(progress)


def part_of(steps: Steps[T], start: float, width: float, stage: str | None = None) -> Steps[T]:
    """Run a solver as that part of a longer job which goes from fraction `start` to `start + width` of it; stage: what
    the job is doing meanwhile, by default what the solver says. Where the solver begins a round anew, the job waits."""
    reached = 0.0
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        reached = max(reached, progress.fraction)
        yield Progress(stage or progress.stage, min(start + width * reached, 1.0), progress.early)


def unless_ended(steps: Steps[T], early: EarlyEnd) -> Steps[T | None]:
    """Run a solver that can be done without, until it is at its end or that of the whole is asked for; then None."""
    while not early.is_asked:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        yield Progress(progress.stage, progress.fraction, early)
    steps.close()
    return None


def on_thread(steps: Steps[T], patience: float = 0.01) -> Steps[T]:
    """Run a solver on a thread of its own; what it yields, returns and raises comes out here.

    Factorisations and convex hulls take a second on large meshes, and give up the interpreter's lock meanwhile: whoever
    steps this waits for `patience` seconds at most. Closing it returns at once; the solver ends at its next Progress.
    """
    latest: list[Progress] = [Progress("", 0.0)]
    results: list[T] = []
    errors: list[BaseException] = []
    closed, done = threading.Event(), threading.Event()
    keep_freed()

    def work() -> None:
        try:
            with one_blas_thread():
                while not closed.is_set():
                    latest[0] = next(steps)
                steps.close()
        except StopIteration as stop:
            results.append(stop.value)
        # Also what is no Exception: below, whoever waits would find neither a result nor an error.
        except BaseException as error:  # noqa: BLE001, it is raised again below
            errors.append(error)
        finally:
            done.set()

    threading.Thread(target=work, name="omt_uv solver", daemon=True).start()
    try:
        while not done.wait(patience):
            yield ThreadProgress(latest[0].stage, latest[0].fraction, latest[0].early)
    finally:
        closed.set()
    if errors:
        raise errors[0]
    return results[0]


class RunLog:
    """What happened in a run of a solver: warnings, and seconds per stage."""

    def __init__(self):
        self.warnings: list[str] = []
        self.seconds: dict[str, float] = {}

    @contextmanager
    def timed(self, stage: str) -> Iterator[None]:
        """Context that adds the seconds spent in it to those of a stage, also when it ends in an error."""
        begin = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - begin
