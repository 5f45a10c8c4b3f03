"""The queue of objects that are unwrapped one after the other, for the panel to draw."""

from __future__ import annotations

import time
from collections.abc import Iterator


class Job:
    """An object of the queue: its name, state (WAITING, RUNNING, DONE or FAILED), progress in [0, 1], why it failed,
    and what there is to say of its UVs."""

    def __init__(self, name: str):
        self.name, self.state, self.progress, self.reason = name, "WAITING", 0.0, ""
        self.warnings: list[str] = []
        self.steps: Iterator | None = None
        self._began = 0.0

    @property
    def seconds(self) -> float:
        """How long it has been running."""
        return time.monotonic() - self._began

    def begin(self, steps: Iterator) -> Iterator:
        """Its work starts now."""
        self.steps, self.state, self._began = steps, "RUNNING", time.monotonic()
        return steps

    def end(self, state: str, reason: str = "") -> None:
        self.state, self.reason = state, reason
        self.progress = 1.0 if state == "DONE" else self.progress
        self.close()

    def close(self) -> None:
        """Throw away what is left of its work."""
        close = getattr(self.steps, "close", None)
        if close is not None:
            close()
        self.steps = None
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


state: Queue | None = None


def stop() -> None:
    """Begin no other job; what is done is kept."""
    if state is not None:
        state.is_stopped = True
