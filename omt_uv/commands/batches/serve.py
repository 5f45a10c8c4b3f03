"""Run one command after the other in one process, as its parent asks: the child of `batch.servant`."""

from __future__ import annotations

import json
import os
import queue
import sys
import time
from collections.abc import Callable, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from ...batch.servant import SERVE
from ...supervision import begin_child

NAME = SERVE
STATUS = Path("/proc/self/status")
# What makes Linux forget the most memory that a process has had.
FORGET = Path("/proc/self/clear_refs")


def serve(gigabytes: float, carry: Callable[[Sequence[str]], int]) -> int:
    """Answer every line of the standard input, until it ends, which ends this process.

    carry : runs the words of a command, and returns its status
    """
    heard: queue.SimpleQueue = queue.SimpleQueue()
    begin_child(gigabytes, heard.put)
    # What commands print must not be taken for an answer.
    answers = os.dup(1)
    with _printing_to(os.devnull, os.devnull):
        rest = b""
        while True:
            rest += heard.get()
            while b"\n" in rest:
                line, _, rest = rest.partition(b"\n")
                os.write(answers, json.dumps(_answered(json.loads(line), carry)).encode() + b"\n")


def _answered(task: dict, carry: Callable[[Sequence[str]], int]) -> dict:
    """Run a task: its status, seconds of processors, and bytes of memory at most and afterwards."""
    with suppress(OSError):
        FORGET.write_text("5")
    begin = time.process_time()
    with _printing_to(task["out"], task["err"]):
        status = carry(task["words"])
    memory = _memory()
    return {
        "status": status,
        "processor": time.process_time() - begin,
        "memory": memory.get("VmHWM"),
        "at_rest": memory.get("VmRSS", 0),
    }


@contextmanager
def _printing_to(out: str, err: str):
    """Let what this process prints, from Python and from C, go to two files."""
    sys.stdout.flush()
    sys.stderr.flush()
    kept = [os.dup(number) for number in (1, 2)]
    for number, path in ((1, out), (2, err)):
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        os.dup2(file, number)
        os.close(file)
    try:
        yield
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        for number, before in zip((1, 2), kept, strict=True):
            os.dup2(before, number)
            os.close(before)


def _memory() -> dict[str, int]:
    """Bytes that this process has, and has had at most, where the system says so."""
    with suppress(OSError):
        rows = [line.split() for line in STATUS.read_text().splitlines()]
        return {row[0].rstrip(":"): int(row[1]) * 1024 for row in rows if len(row) == 3 and row[2] == "kB"}
    return {}
