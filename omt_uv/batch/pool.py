"""Runs on this machine: as many child processes at a time as cores and memory allow, the largest files first."""

from __future__ import annotations

import os
import queue
import subprocess
import threading
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Protocol

from ..supervision import GIGABYTE, MEMORY_IS_LIMITED, Errand, Outcome, watch
from .child import Record, run_task
from .plan import BatchError, BatchPlan, FileTask
from .servant import Servants

# Bytes that a run takes, measured: Blender and the solver by themselves, and more for every byte of the file.
BASE_MEMORY = 4 * 10**8
MEMORY_PER_BYTE = 40
# Share of the memory that is free which a batch takes up.
SHARE = 0.9


class Runner(Protocol):
    """What carries tasks out: a pool here, or a cluster."""

    def run(self, tasks: Sequence[FileTask]) -> Iterator[tuple[FileTask, Record | None]]:
        """Pairs of a task and None when it begins, and of a task and its Record when it has ended."""
        ...

    def stop(self) -> None:
        """End what is going on; may be called at any time, by a signal."""
        ...


class LocalPool:
    """Child processes of this one."""

    def __init__(
        self, plan: BatchPlan, start: Sequence[str], width: int = 0, room: float = 0.0, shared: bool = False
    ) -> None:
        """A pool of so many children, and of so many gigabytes for all; 0 for what this machine has.

        shared : children serve one file after the other, see `servant`
        """
        self.plan, self.start = plan, tuple(start)
        self.width = width or cores()
        self.room = room * GIGABYTE if room else SHARE * free_memory()
        if not plan.memory and MEMORY_IS_LIMITED:
            # What would drive the machine out of memory ends by itself, and no other run with it.
            self.plan = replace(plan, memory=round(self.room / GIGABYTE, 3))
        self._children: set[subprocess.Popen] = set()
        self._servants = Servants(self.start, self.plan.memory, self._begin) if shared else None
        self._lock = threading.Lock()
        self._ended: queue.SimpleQueue = queue.SimpleQueue()
        self._stopped = False

    def run(self, tasks: Sequence[FileTask]) -> Iterator[tuple[FileTask, Record | None]]:
        waiting = list(tasks)
        running: dict[str, float] = {}
        while (waiting or running) and not self._stopped:
            task = self._next(waiting, running)
            if task is not None:
                yield task, None
                running[task.name] = self.expected(task)
                threading.Thread(target=self._work, args=(task,), daemon=True).start()
                continue
            ended = self._ended.get()
            if ended is None:
                break
            task, record = ended
            del running[task.name]
            if isinstance(record, BaseException):
                raise record
            yield task, record

    def stop(self) -> None:
        self._stopped = True
        for child in list(self._children):
            child.kill()
        self._ended.put(None)

    def expected(self, task: FileTask) -> float:
        """Bytes that a run is expected to take, at most its limit."""
        most = self.plan.memory * GIGABYTE if self.plan.memory else self.room
        return min(BASE_MEMORY + MEMORY_PER_BYTE * task.size, most)

    def _next(self, waiting: list[FileTask], running: dict[str, float]) -> FileTask | None:
        """The largest file that fits beside what is running, taken from those that wait; None where none does."""
        if len(running) >= self.width:
            return None
        free = self.room - sum(running.values())
        for k, task in enumerate(waiting):
            if not running or self.expected(task) <= free:
                return waiting.pop(k)
        return None

    def _work(self, task: FileTask) -> None:
        try:
            record: Record | BaseException = run_task(self.plan, task, self.start, self._watched)
        except OSError as error:
            record = Record(status=1, seconds=0.0, message=f"{task.path}: {error}")
        except BaseException as error:  # noqa: BLE001 - raised by the thread that waits, for ever if nothing came
            record = error
        self._ended.put((task, record))

    def close(self) -> None:
        """End the children that wait for more."""
        if self._servants is not None:
            self._servants.close()

    def _watched(self, errand: Errand) -> Outcome:
        if self._servants is None:
            return watch(errand, self._begin)
        return self._servants.watch(errand)

    def _begin(self, child: subprocess.Popen) -> None:
        with self._lock:
            self._children = {c for c in self._children if c.returncode is None} | {child}
        if self._stopped:
            child.kill()


def cores() -> int:
    """Cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def free_memory() -> float:
    """Bytes of memory that programs can have now: what is free of the machine, or of the group this process is in.

    Raises
    ------
    BatchError : the system does not say
    """
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        free = next(float(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        if not hasattr(os, "sysconf"):
            raise BatchError("This system does not say how much memory is free. Give --total-memory GB.") from None
        free = float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    group = Path("/sys/fs/cgroup")
    try:
        most = float((group / "memory.max").read_text())
        return min(free, most - float((group / "memory.current").read_text()))
    except (OSError, ValueError):
        return free
