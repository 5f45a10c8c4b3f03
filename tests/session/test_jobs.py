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


@pytest.mark.parametrize("worked", [True, False])
def test_a_job_that_is_stopped_waits_again(package, worked):
    """Its work is thrown away, and what has ended stays as it ended."""
    job = package("session.queue").Job("Box")
    job.begin(iter(()) if worked else (x for x in (0.5,)))
    job.close()
    assert (job.state, job.steps) == ("WAITING", None)
    job.begin(iter(()))
    job.end("DONE")
    job.close()
    assert (job.state, job.progress) == ("DONE", 1.0)


def test_a_job_that_is_thrown_away_waits_again_and_one_that_has_ended_does_not(package):
    """Its generator is closed, and what was reached of it is still drawn."""
    closed = []

    def steps():
        try:
            yield
        finally:
            closed.append(True)

    queue = package("session.queue")
    jobs = [queue.Job(name) for name in ("thrown", "done", "failed")]
    everything = queue.Queue(jobs)
    for job in jobs:
        next(job.begin(steps()))
        job.progress = 0.5
        assert job.state == "RUNNING"
    jobs[0].close()
    jobs[1].end("DONE")
    jobs[2].end("FAILED", "no")
    assert [(j.state, j.progress, j.reason) for j in jobs] == [("WAITING", 0.5, ""), ("DONE", 1.0, ""),
                                                              ("FAILED", 0.5, "no")]  # fmt: skip
    assert len(closed) == 3 and everything.current is jobs[0]
