"""Measure processor time: once, the median, or the least of several runs; and the peak of memory."""

from __future__ import annotations

import resource
import time
from pathlib import Path


def timed(work):
    """The result of `work()` and its processor seconds."""
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def median_of(runs, work):
    """The result of the run with the median time, and that time."""
    results = sorted((timed(work) for _ in range(runs)), key=lambda pair: pair[1])
    return results[(runs - 1) // 2]


def fastest_of(runs, work):
    """The result of the first run, and the least time of all."""
    result, seconds = timed(work)
    return result, min([seconds, *(timed(work)[1] for _ in range(runs - 1))])


def peak_mib() -> int:
    """Peak memory of this process so far, in MiB."""
    status = Path("/proc/self/status")
    if status.exists():
        # What the system counts for a process begins with the peak of the one that started it.
        (line,) = (line for line in status.read_text().splitlines() if line.startswith("VmHWM"))
        return int(line.split()[1]) // 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
