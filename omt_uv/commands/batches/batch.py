"""Run a command on every file of a folder or a list: the command batch."""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ... import __version__
from ...supervision import INTERRUPTED, PROGRAM
from ..common import CommandError, UsageError, warn_of
from ..options import gigabytes, positive

if TYPE_CHECKING:
    # Every run of every command reads this module: the database and the engine wait until there is a batch.
    from ...batch.engine import BatchResult
    from ...batch.plan import BatchPlan

NAME = "batch"
# Exit status where some files could be done, and some not.
SOME = 7
# Options of paths that are read, and may be the same for every file.
READ = ("image",)
# Options that the batch gives to each run itself.
OWN = ("report", "preview", "output", "timeout", "memory")
# What makes a command print its figures, where it writes no report.
PRINTS = {"measure": ("--json",)}


class SomeFailed(CommandError):
    """A batch that has ended, but not every file of it could be done."""

    def __init__(self, text: str, status: int) -> None:
        super().__init__(text)
        self.status = status


@dataclass(frozen=True)
class _Given:
    """What the parser of the command takes: whether it writes a result, a report, a preview, and its own parser."""

    writes: bool
    reports: bool
    previews: bool
    parser: argparse.ArgumentParser


def add(commands) -> None:
    command = commands.add_parser(
        NAME,
        help="run a command on every file of a folder or a list, each in a process of its own, and go on where it was",
        usage="%(prog)s COMMAND DIR|LIST -o OUT [options] [-- options of the command]",
    )
    command.set_defaults(run=run_batch, alone=True, told=[], commands=commands)
    command.add_argument("command", metavar="COMMAND", help="a command that works on one file")
    command.add_argument(
        "input", type=Path, metavar="DIR|LIST", help="a folder, or a text file with a path on each line"
    )
    command.add_argument("-o", "--output", type=Path, metavar="OUT", required=True, help="folder of the results")
    command.add_argument("--format", default="", metavar=".EXT", help="of the results; default: that of each file")
    command.add_argument("--jobs", type=_count, default=0, metavar="N", help="runs at a time; default: one for a core")
    command.add_argument(
        "--timeout", type=positive, default=0.0, metavar="S", help="give up a file after so many seconds"
    )
    command.add_argument("--memory", type=gigabytes, default=0.0, metavar="GB", help="most memory of one run")
    command.add_argument(
        "--total-memory", type=gigabytes, default=0.0, metavar="GB", help="of all runs at a time; default: what is free"
    )
    command.add_argument("--retry", choices=("failed",), help="try again what has failed before")
    command.add_argument(
        "--part", type=_part, default=(1, 1), metavar="K/N", help="of N parts of the files, part K alone"
    )
    command.add_argument(
        "--allow-failures", action="store_true", help="end with status 0 though some files, or all, could not be done"
    )
    command.add_argument(
        "--apart", action="store_true", help="start the program anew for every file, which takes a second or two each"
    )
    command.add_argument("--no-preview", action="store_true", help="make no pictures of the results")
    command.add_argument(
        "--scheduler", default="", metavar="ADDRESS", help="of a cluster of dask.distributed; or local, or local:N"
    )
    command.add_argument("--send", action="store_true", help="send files to the cluster, which shares no folders")


def _count(text: str) -> int:
    value = int(text)
    if value < 1:
        raise argparse.ArgumentTypeError(f"{text} is not a number of runs")
    return value


def _part(text: str) -> tuple[int, int]:
    first, _, last = text.partition("/")
    k, n = int(first), int(last)
    if not 1 <= k <= n:
        raise argparse.ArgumentTypeError(f"{text} is no part: 2/5 is the second of five")
    return k, n


def run_batch(options: argparse.Namespace) -> None:
    """Run a batch to its end.

    Raises
    ------
    UsageError : the options of the command do not pass its own parser, or name files
    BatchError : there is nothing to do, or another batch is at work
    SomeFailed : some files, or all, could not be done
    """
    from ...batch.engine import carry_out
    from ...batch.manifest import Manifest, only_one
    from ...batch.plan import MANIFEST, beside, kept, tasks_of

    plan = _plan(options)
    tasks = tasks_of(plan, options.input, options.part)
    name = MANIFEST if options.part[1] == 1 else f".part{options.part[0]}of{options.part[1]}{MANIFEST}"
    path = beside(options.output, name)
    with kept(plan.output):
        plan.output.mkdir(parents=True, exist_ok=True)
    with only_one(path), Manifest(path) as manifest:
        runner = _runner(options, plan)
        try:
            result = carry_out(plan, tasks, manifest, runner, options.retry == "failed")
        finally:
            close = getattr(runner, "close", None)
            if close is not None:
                close()
    _tell(result, plan, options.allow_failures)


def _plan(options: argparse.Namespace) -> BatchPlan:
    """What is asked, after the command's own parser has looked at its options."""
    from ...batch.plan import BatchPlan

    given = _given(options)
    rest = tuple(options.rest)
    suffix = options.format.lower()
    suffix = suffix if not suffix or suffix.startswith(".") else f".{suffix}"
    out = f"out{suffix or '.obj'}"
    words = ["in.obj", *(["-o", out] if given.writes else []), *rest]
    values = vars(given.parser.parse_args(words))
    plain = vars(given.parser.parse_args(_complete(given, words, rest)))
    for name, value in values.items():
        if isinstance(value, Path) and name not in (*READ, "input", "output"):
            raise UsageError(f"--{name.replace('_', '-')} names one file for all of the batch. Leave it out.")
        if name in OWN and name != "output" and value != plain[name]:
            raise UsageError(f"--{name} belongs before the --: the batch gives it to every run.")
    if str(values.get("output", out)) != out:
        raise UsageError("-o belongs before the --: every file gets a place in that folder.")
    return BatchPlan(
        command=options.command,
        options=(*rest, *PRINTS.get(options.command, ())),
        output=options.output,
        suffix=suffix,
        version=__version__,
        writes=given.writes,
        reports=given.reports,
        previews=given.previews and not options.no_preview,
        timeout=options.timeout,
        memory=options.memory,
    )


def _complete(given: _Given, words: list[str], rest: tuple[str, ...]) -> list[str]:
    """The words without the options that the batch gives itself, which leaves them at their defaults."""
    own = {text for action in given.parser._actions if action.dest in OWN for text in action.option_strings}
    kept, skip = list(words[: len(words) - len(rest)]), False
    for word in rest:
        if not skip and word.partition("=")[0] in own:
            skip = "=" not in word
            continue
        if not skip:
            kept.append(word)
        skip = False
    return kept


def _given(options: argparse.Namespace) -> _Given:
    """What the command takes.

    Raises
    ------
    UsageError : there is no such command, or it works on no single file
    """
    every = options.commands.choices
    single = [name for name, parser in every.items() if not parser.get_default("alone")]
    if options.command not in single:
        raise UsageError(f"{options.command} is no command for one file. These are: {', '.join(single)}.")
    parser = every[options.command]
    have = {text for action in parser._actions for text in action.option_strings}
    return _Given("--output" in have, "--report" in have, "--preview" in have, parser)


def _runner(options: argparse.Namespace, plan: BatchPlan):
    """What carries the tasks out: this machine, or a cluster."""
    start = getattr(options, "start", None) or (sys.executable, "-m", PROGRAM)
    if not options.scheduler:
        from ...batch.pool import LocalPool

        return LocalPool(plan, start, options.jobs, options.total_memory, not options.apart)
    from ...batch.cluster import Cluster

    cluster = Cluster(plan, start, options.scheduler, options.send)
    for text in cluster.warnings():
        warn_of(text)
    return cluster


def _tell(result: BatchResult, plan: BatchPlan, allowed: bool) -> None:
    """Say how many were done.

    Raises
    ------
    SomeFailed : not all of them
    """
    from ...batch.manifest import ASIDE, DONE, FAILED
    from ...batch.plan import FAILURES

    counts = result.counts
    done = counts.get(DONE, 0)
    failed = counts.get(FAILED, 0) + counts.get(ASIDE, 0)
    left = sum(counts.values()) - done - failed
    print(f"{done} of {sum(counts.values())} files done, {result.ran} of all runs now")
    where = f"Messages are in {plan.beside(FAILURES)}; --retry failed tries them again."
    if result.received:
        raise SomeFailed(f"ended by a signal, {left} files are left. The same command goes on.", INTERRUPTED)
    if failed and allowed:
        warn_of(f"{failed} of {sum(counts.values())} files could not be done. {where}")
    elif failed:
        status = SOME if done else 1
        raise SomeFailed(f"{failed} of {sum(counts.values())} files could not be done. {where}", status)
