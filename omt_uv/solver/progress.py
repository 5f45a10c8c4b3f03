"""Long solvers are generators: they yield Progress and return their result.

One code path serves a script (`drain`), a progress bar (`drain` with a callback) and a modal
operator, which steps the generator from a timer and closes it to cancel.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TypeAlias, TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Progress:
    """What a solver is doing and how far it is, `fraction` in [0, 1] of the named stage."""

    stage: str
    fraction: float


Steps: TypeAlias = Generator[Progress, None, T]


def drain(steps: Steps[T], callback: Callable[[Progress], None] | None = None) -> T:
    """Run a solver to its end and return its result; `callback` sees every Progress."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        if callback is not None:
            callback(progress)


def part_of(steps: Steps[T], start: float, width: float) -> Steps[T]:
    """Run a solver as that part of a longer job which goes from fraction `start` to `start + width` of it."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        yield Progress(progress.stage, min(start + width * progress.fraction, 1.0))
