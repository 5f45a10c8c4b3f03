"""Children that serve one file after the other, so that the program starts once for many.

A run has its time, and the process its memory, as a child of one file has them; what exceeds either, crashes, or ends
in any way but well or by an error that was told, ends the process with it, and the next file gets a new one. So does
what leaves much memory in use, and everybody after a while. Tasks are lines of JSON on the child's standard input.
"""

from __future__ import annotations

import json
import subprocess
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path

from ..supervision import FAILURE, STREAMS, Errand, Outcome, begun, end_of, tidy, watch

# The word that starts a servant, with its limit of memory after it.
SERVE = "serve"
# Files that one process serves, and bytes that it may have in use between two of them.
MOST_RUNS = 50
MOST_AT_REST = 10**9
# A larger file has a process of its own.
LARGEST = 20 * 10**6


class Servant:
    """A child that waits for tasks."""

    def __init__(self, start: Sequence[str], memory: float) -> None:
        """Start one; `memory` in gigabytes, 0 for no limit."""
        self._stack = ExitStack()
        errand = Errand([*start, SERVE, f"{memory:g}"], "")
        self.child, self.folder = self._stack.enter_context(begun(errand, captured=True, answers=True))
        self.start = tuple(start)
        self.runs = 0
        self.usable = True

    def watch(self, errand: Errand) -> Outcome:
        """Run an errand to its end; see `supervision.watch`."""
        self.runs += 1
        out, err = (self.folder / f"{self.runs}_{name}" for name in STREAMS)
        words = [str(word) for word in errand.words[len(self.start) :]]
        late = threading.Event()
        timer = threading.Timer(errand.timeout or threading.TIMEOUT_MAX, self._end_late, (late,))
        timer.daemon = True
        begin = time.monotonic()
        if errand.timeout:
            timer.start()
        try:
            answer = self._asked({"words": words, "out": str(out), "err": str(err)})
        finally:
            timer.cancel()
        seconds = time.monotonic() - begin
        if answer is None:
            self.usable = False
            self.child.wait()
            status, text = end_of(errand, self.child.returncode, late.is_set())
            tidy(errand, self.child)
            return Outcome(status, text, _text(out), _text(err) or _text(self.folder / STREAMS[1]), seconds, None, None)
        self.usable = answer["status"] in (0, FAILURE) and answer["at_rest"] <= MOST_AT_REST and self.runs < MOST_RUNS
        outcome = Outcome(answer["status"], "", _text(out), _text(err), seconds, answer["processor"], answer["memory"])
        for path in (out, err):
            path.unlink(missing_ok=True)
        return outcome

    def _asked(self, task: dict) -> dict | None:
        """The answer to a task; None where the child is gone."""
        assert self.child.stdin is not None and self.child.stdout is not None
        try:
            self.child.stdin.write(json.dumps(task).encode() + b"\n")
            self.child.stdin.flush()
            line = self.child.stdout.readline()
        except OSError:
            return None
        return json.loads(line) if line.endswith(b"\n") else None

    def _end_late(self, late: threading.Event) -> None:
        late.set()
        self.child.kill()

    def close(self) -> None:
        """End it; its folder goes."""
        self.child.kill()
        self.child.wait()
        assert self.child.stdout is not None
        self.child.stdout.close()
        self._stack.close()


class Servants:
    """As many servants as there are runs at a time."""

    def __init__(self, start: Sequence[str], memory: float, begin: Callable[[subprocess.Popen], None]) -> None:
        """`begin` is handed every child, so that it can be ended."""
        self.start, self.memory, self.begin = tuple(start), memory, begin
        self._idle: list[Servant] = []
        self._lock = threading.Lock()

    def watch(self, errand: Errand) -> Outcome:
        """Run an errand by a servant, on any thread; that of a large file by a child of its own."""
        with suppress(OSError):
            if Path(errand.about).stat().st_size > LARGEST:
                return watch(errand, self.begin)
        with self._lock:
            servant = self._idle.pop() if self._idle else None
        servant = servant or Servant(self.start, self.memory)
        self.begin(servant.child)
        outcome = servant.watch(errand)
        if servant.usable:
            with self._lock:
                self._idle.append(servant)
        else:
            servant.close()
        return outcome

    def close(self) -> None:
        """End those that wait."""
        with self._lock:
            idle, self._idle = self._idle, []
        for servant in idle:
            servant.close()


def _text(path: Path) -> str:
    with suppress(OSError):
        return path.read_text(errors="replace")
    return ""
