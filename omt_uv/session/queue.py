"""The queue of objects that are unwrapped one after the other, for the panel to draw."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .run import Watch


class Job:
    """An object of the queue: its name, state (WAITING, RUNNING, DONE or FAILED), progress in [0, 1], why it failed,
    and what there is to say of its UVs."""

    def __init__(self, name: str):
        self.name, self.state, self.progress, self.reason = name, "WAITING", 0.0, ""
        self.warnings: list[str] = []
        self.steps: Iterator | None = None
        self._watch: Watch | None = None
        self._began = 0.0

    @property
    def seconds(self) -> float:
        """How long it has been running."""
        return time.monotonic() - self._began

    def begin(self, steps: Iterator, watch: Watch | None = None) -> Iterator:
        """Its work starts now, on what is watched from now on, if anything is."""
        self.steps, self.state, self._began, self._watch = steps, "RUNNING", time.monotonic(), watch
        return steps

    def check(self, thoroughly: bool = False) -> None:
        """Raise `run.Disturbed` if the object is no longer what the work began with."""
        if self._watch is not None:
            self._watch.check(thoroughly)

    def end(self, state: str, reason: str = "") -> None:
        self.state, self.reason = state, reason
        self.progress = 1.0 if state == "DONE" else self.progress
        self.close()

    def close(self) -> None:
        """Throw away what is left of its work."""
        close = getattr(self.steps, "close", None)
        if close is not None:
            close()
        if self._watch is not None:
            self._watch.close()
        self.steps = self._watch = None
        if self.state == "RUNNING":
            self.state = "WAITING"


class Queue:
    """Jobs in their order; whether the artist stopped it, and whether it is over."""

    def __init__(self, jobs: list[Job]):
        self.jobs = jobs
        self.is_stopped = self.is_over = False

    @property
    def current(self) -> Job | None:
        """The job that runs, or the next one."""
        return next((job for job in self.jobs if job.state in {"RUNNING", "WAITING"}), None)

    @property
    def is_running(self) -> bool:
        """Whether it will go on by itself."""
        return not self.is_over and not self.is_stopped

    def close(self) -> None:
        """Throw away what is left of its work; what is done is kept."""
        for job in self.jobs:
            job.close()
        self.is_over = True


state: Queue | None = None


def stop() -> None:
    """Begin no other job; what is done is kept."""
    if state is not None:
        state.is_stopped = True


def forget() -> None:
    """Throw the queue away, also when the add-on goes."""
    global state
    if state is not None:
        state.close()
    state = None
