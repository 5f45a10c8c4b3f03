"""How far a batch is: rate, time left and failures, on a terminal alone."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

# Of a file, in bytes: what a run takes however small it is.
BASE_SIZE = 100_000


@contextmanager
def shown(count: int, work: float) -> Iterator[Callable[[float, bool], None]]:
    """What to call after each run with its share of the work and whether it failed.

    count : files; work : the sum of `work_of` over them. By rich where it is installed, in one line of text elsewhere,
    and not at all where the error stream is no terminal.
    """
    if not sys.stderr.isatty() or not count:
        yield lambda _work, _failed: None
        return
    try:
        from rich.console import Console
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
    except ModuleNotFoundError:
        yield from _plain(count, work)
        return
    columns = (TextColumn("{task.fields[text]}"), BarColumn(), TextColumn("{task.percentage:>3.0f} %"),
               TimeRemainingColumn())  # fmt: skip
    state = Progressed(count, work)
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task("", total=work, text=state.text())

        def step(part: float, failed: bool) -> None:
            state.add(part, failed)
            progress.update(bar, advance=part, text=state.text())

        yield step


def _plain(count: int, work: float) -> Iterator[Callable[[float, bool], None]]:
    """A line of text that is written again and again."""
    state = Progressed(count, work)

    def step(part: float, failed: bool) -> None:
        state.add(part, failed)
        sys.stderr.write(f"\r\033[K{state.text()}, {state.left_text()}")
        sys.stderr.flush()

    try:
        yield step
    finally:
        sys.stderr.write("\r\033[K")


class Progressed:
    """Counts of files, and what follows from them."""

    def __init__(self, count: int, work: float, clock: Callable[[], float] = time.monotonic) -> None:
        self.count, self.work, self._clock = count, work, clock
        self.done, self.failed, self.part = 0, 0, 0.0
        self._start = clock()

    def add(self, part: float, failed: bool) -> None:
        self.done += 1
        self.failed += failed
        self.part += part

    def seconds_left(self) -> float:
        """Seconds that the rest takes if it takes as long for its size as what is done."""
        return (self._clock() - self._start) * (self.work - self.part) / self.part if self.part else 0.0

    def left_text(self) -> str:
        minutes, seconds = divmod(round(self.seconds_left()), 60)
        return f"{minutes // 60}:{minutes % 60:02}:{seconds:02} left"

    def text(self) -> str:
        passed = max(self._clock() - self._start, 1e-9)
        failed = f", {self.failed} failed" if self.failed else ""
        return f"{self.done} of {self.count}{failed}, {60 * self.done / passed:.1f} a minute"


def work_of(size: int) -> float:
    """How much work a file of so many bytes is."""
    return size + BASE_SIZE
