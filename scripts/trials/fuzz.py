"""Unwrap as many meshes of all kinds as one likes, in processes of their own, judged by another program.

usage: fuzz.py LOG [--first 0] [--count 20000] [--seconds 240] [--memory 4] [--kind NAME] [--vertices N] [--together 50]

The cases are those of `tests/pipelines/test_wide_fuzz.py`. LOG gets a line of each: its number, kind, what
became of it, folds, overlap, processor seconds. Called again, it goes on where it was. Whatever broke a promise is told
at the end, and is exit 1. Thousands of small cases take a third of the time with --vertices 200, which leaves larger
ones out. A process runs some cases one after the other; one that dies takes none with it but the case it was at.
"""

from __future__ import annotations

import argparse
import contextlib
import mmap
import os
import resource
import signal
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "support"), str(ROOT / "tests" / "pipelines")]
os.environ.setdefault("OMP_NUM_THREADS", "1")
# What became of a case that broke a promise; the traceback is in LOG.err.
BROKEN = ("BROKEN", "LATE", "CRASH")


def run_case(seed: int, judge, log: Path) -> None:
    """Append the line of a case."""
    from test_wide_fuzz import outcome
    from wide_meshes import wide_case

    begin = time.process_time()
    try:
        found = outcome(judge, seed)
    except Exception:  # noqa: BLE001 - whatever it is, it is what this looks for
        found = (wide_case(seed)[0], "BROKEN", 0, 0.0)
        with open(f"{log}.err", "a") as errors:
            print(f"== {seed}", *wide_case(seed)[3:], traceback.format_exc(), file=errors)
    write(log, seed, *found, round(time.process_time() - begin, 2))


def write(log: Path, *words) -> None:
    """Append a line."""
    with open(log, "a") as file:
        print(*words, file=file)


def in_child(seeds: list[int], judge, args) -> list[int]:
    """Run cases in a process of their own, until one ends it: a line for that one, and the cases that are left."""
    reached = mmap.mmap(-1, 8)
    child = os.fork()
    if not child:
        resource.setrlimit(resource.RLIMIT_DATA, (int(args.memory * 1e9),) * 2)
        for k, seed in enumerate(seeds):
            reached[:8] = k.to_bytes(8, "little")
            used = int(time.process_time()) + 1
            resource.setrlimit(resource.RLIMIT_CPU, (used + args.seconds, resource.RLIM_INFINITY))
            run_case(seed, judge, args.log)
        os._exit(0)
    status, k = os.waitpid(child, 0)[1], int.from_bytes(reached[:8], "little")
    if not os.WIFSIGNALED(status):
        return []
    late = os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL)
    write(args.log, seeds[k], "?", "LATE" if late else "CRASH", 0, 0.0, args.seconds if late else os.WTERMSIG(status))
    return seeds[k + 1 :]


def cases(args) -> Iterator[int]:
    """The cases asked for that the log has not yet."""
    from wide_meshes import KINDS, wide_case

    names, done = [kind.__name__ for kind in KINDS], {int(row[0]) for row in rows(args.log)}
    for seed in range(args.first, args.first + args.count):
        kind = "broken" if seed % 3 else names[seed // 3 % len(names)]
        if seed in done or args.kind not in (None, kind):
            continue
        if args.vertices is None or len(wide_case(seed)[1].positions) <= args.vertices:
            yield seed


def rows(log: Path) -> list[list[str]]:
    """The words of every line of a log; none where there is no log."""
    return [line.split() for line in log.read_text().splitlines()] if log.exists() else []


def summary(found: list[list[str]]) -> tuple[str, bool]:
    """What became of the cases, by kind, and whether a promise was broken."""
    kinds = sorted({row[1] for row in found})
    lines = [f"{len(found)} cases, {sum(float(row[5]) for row in found):.0f} s"]
    for kind in kinds:
        mine = [row for row in found if row[1] == kind]
        said = ", ".join(f"{count} {what}" for what, count in Counter(row[2] for row in mine).most_common())
        lines.append(f"{kind:10} {len(mine):6}  {said}")
    folds = [row[0] for row in found if int(row[3])]
    lines.append(f"told of folds: {len(folds)} ({' '.join(folds[:40])})")
    broken = [row for row in found if row[2] in BROKEN]
    lines += [f"{what}: {' '.join(row[0] for row in broken if row[2] == what)}" for what in BROKEN]
    return "\n".join(lines), bool(broken)


def main() -> int:
    """Run what the log has not yet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("log", type=Path)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=20_000)
    parser.add_argument("--seconds", type=int, default=240, help="of processor time, the most that a case may take")
    parser.add_argument("--memory", type=float, default=4.0, help="gigabytes, the most that a case may ask for")
    parser.add_argument("--kind", help="cases of this kind alone")
    parser.add_argument("--vertices", type=int, help="the most that a case may have")
    parser.add_argument("--together", type=int, default=50, help="cases in one process")
    args = parser.parse_args()
    import test_wide_fuzz

    if not test_wide_fuzz.JUDGE.exists():
        parser.error("OMT_UV_JUDGE names no judge")
    judge = test_wide_fuzz.load_judge()
    warnings.simplefilter("ignore", RuntimeWarning)
    # What a process imports on its way, all later ones have.
    with contextlib.suppress(Exception):
        test_wide_fuzz.outcome(judge, 1)
    asked = cases(args)
    while left := list(islice(asked, args.together)):
        while left:
            left = in_child(left, judge, args)
    text, broken = summary(rows(args.log))
    print(text)
    return int(broken)


if __name__ == "__main__":
    sys.exit(main())
