"""A job of the queue: what it says of its state at every turn."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(("state", "progress"), [("DONE", 1.0), ("FAILED", 0.25)])
@pytest.mark.parametrize("reason", ["", "It has no faces."])
def test_a_job_waits_runs_and_ends_with_its_reason_and_without_its_work(package, state, progress, reason):
    closed = []

    def work():
        try:
            yield 0.25
        finally:
            closed.append(True)

    job = package("session.queue").Job("Box")
    assert (job.name, job.state, job.progress, job.reason, job.steps) == ("Box", "WAITING", 0.0, "", None)
    steps = job.begin(work())
    job.progress = next(steps)
    assert (job.state, job.reason) == ("RUNNING", "") and 0 <= job.seconds < 60
    job.end(state, reason)
    assert (job.state, job.progress, job.reason, job.steps, closed) == (state, progress, reason, None, [True])
