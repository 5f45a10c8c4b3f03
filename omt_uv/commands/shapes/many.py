"""Do many small things by the engine of batches: on several cores or machines, and on from where it was stopped."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from contextlib import closing
from typing import TYPE_CHECKING

from ...supervision import INTERRUPTED, PROGRAM
from ..common import CommandError, warn_of

if TYPE_CHECKING:
    from ...batch.plan import BatchPlan, FileTask


def add_jobs(command: argparse.ArgumentParser) -> None:
    command.add_argument("--jobs", type=int, default=0, metavar="N", help="by a batch, N runs at a time")
    command.add_argument(
        "--scheduler", default="", metavar="ADDRESS", help="by a batch on a cluster of dask.distributed; or local"
    )


def carried_out(options: argparse.Namespace, plan: BatchPlan, tasks: Sequence[FileTask]) -> dict[str, dict]:
    """Rows of the manifest of a batch, by name, after it has run; failures are tried again.

    Raises
    ------
    CommandError : a signal has ended it
    """
    from ...batch.cluster import Cluster
    from ...batch.engine import carry_out
    from ...batch.manifest import Manifest, only_one
    from ...batch.plan import MANIFEST
    from ...batch.pool import LocalPool, Runner

    start = getattr(options, "start", None) or (sys.executable, "-m", PROGRAM)
    plan.output.mkdir(parents=True, exist_ok=True)
    path = plan.beside(MANIFEST)
    with only_one(path), Manifest(path) as manifest:
        runner: Runner
        if options.scheduler:
            runner = Cluster(plan, start, options.scheduler)
            for text in runner.warnings():
                warn_of(text)
        else:
            runner = LocalPool(plan, start, max(options.jobs, 0), shared=True)
        with closing(runner):
            result = carry_out(plan, tasks, manifest, runner, retry=True)
        if result.received:
            raise _Stopped("ended by a signal. The same command goes on.")
        return {row["name"]: row for row in manifest.rows()}


class _Stopped(CommandError):
    """Ended by a signal."""

    status = INTERRUPTED
