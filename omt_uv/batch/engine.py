"""Carry out what is due of a batch, and keep what came of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..supervision import ended_by_signals
from .bar import shown, work_of
from .child import Record
from .manifest import Manifest
from .plan import FAILURES, BatchPlan, FileTask, kept, shell_text
from .pool import Runner


@dataclass(frozen=True)
class BatchResult:
    """How a batch has ended: counts of states of all files, runs of this time, and the signal that ended it, or 0."""

    counts: dict[str, int]
    ran: int
    received: int


def carry_out(
    plan: BatchPlan, tasks: Sequence[FileTask], manifest: Manifest, runner: Runner, retry: bool = False
) -> BatchResult:
    """Run what is due of the tasks; the manifest is kept up at every begin and end.

    retry : what has failed is due again, too
    """
    manifest.describe(plan)
    due = manifest.due(plan, tasks, retry)
    ran = 0
    with ended_by_signals(runner.stop) as received, shown(len(due), sum(work_of(t.size) for t in due)) as step:
        for task, record in runner.run(due):
            if record is None:
                manifest.begin(task)
                continue
            if received:
                # What was ended by us has not failed: it stays in flight, and is due the next time.
                break
            manifest.end(plan, task, record)
            keep_failure(plan, task, record)
            step(work_of(task.size), record.status != 0)
            ran += 1
    return BatchResult(manifest.counts(), ran, received[0] if received else 0)


def keep_failure(plan: BatchPlan, task: FileTask, record: Record) -> None:
    """Keep a failure's command line and message beside the results, and remove that of a file that works now."""
    path = plan.beside(FAILURES) / f"{task.name}.txt"
    with kept(path):
        if record.status == 0:
            path.unlink(missing_ok=True)
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        text = f"{shell_text(record.words)}\n\nstatus {record.status}\n{record.message}\n"
        path.write_text(text, errors="replace")
