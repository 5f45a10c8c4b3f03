"""Run a command in a child process, so that a crash, a hang or too little memory ends as one line and a status.

The parent imports no Blender. It hands signals on as an end of the child, keeps to a limit of time, and removes what a
child that was ended left behind. The child has a folder of its own for temporary files, a limit of memory, and ends
when its parent is gone.
"""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from .temporary import own_folder, remove_of

PROGRAM = "omt_uv"

# Exit statuses; 0 is success, and 128 + n the end by signal n.
FAILURE = 1
USAGE = 2
CRASH = 3
TIMEOUT = 4
MEMORY = 5
DEFECT = 6
INTERRUPTED = 128 + signal.SIGINT
# Whoever read what is printed has gone, as `head` does: 128 + the number of SIGPIPE, which Python keeps from us.
UNREAD = 128 + 13
OWN = {0, FAILURE, USAGE, MEMORY, DEFECT, INTERRUPTED, UNREAD}

GIGABYTE = 10**9
# Says to a process that it is the child, and which folder for temporary files the parent has made for it.
MARK = "OMT_UV_CHILD"
# Where what a watched child prints is kept.
STREAMS = ("printed.txt", "errors.txt")
MEMORY_IS_LIMITED = sys.platform.startswith("linux")
# What a user or a system ends a program with; Windows knows the first two alone.
SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


@dataclass(frozen=True)
class Errand:
    """What a child does: the words that start it, and what is said about it.

    about : the file it works on; folders : where it may leave temporary files; timeout : seconds, 0 for no end;
    memory : whether it has a limit, see `begin_child`
    """

    words: Sequence[str]
    about: str
    folders: Sequence[Path] = ()
    timeout: float = 0.0
    memory: bool = False


def temporary_prefix() -> str:
    """How the names of temporary files of this process begin, wherever they lie."""
    return f".omt_uv_{os.getpid()}_"


def is_child() -> bool:
    return MARK in os.environ


def begin_child(gigabytes: float, heard: Callable[[bytes], object] | None = None) -> None:
    """Take up the life of a child: no more than so much memory, 0 for all there is, and an end with the parent.

    heard : is handed what the parent writes, on a thread of its own; most children are told nothing
    """
    folder = os.environ.pop(MARK, "")
    if gigabytes and MEMORY_IS_LIMITED:
        import resource

        # What is written to: the address space counts libraries and reserves of threads as well.
        resource.setrlimit(resource.RLIMIT_DATA, (int(gigabytes * GIGABYTE),) * 2)
    threading.Thread(target=_end_with_parent, args=(Path(folder), os.getppid(), heard), daemon=True).start()


def _end_with_parent(folder: Path, parent: int, heard: Callable[[bytes], object] | None) -> None:
    """Wait for the end of the standard input, which the parent holds open."""
    # Not sys.stdin, whose lock would be held while the interpreter shuts down.
    while data := os.read(0, 1 << 16):
        if heard is not None:
            heard(data)
    remove_of(folder, parent)
    os._exit(CRASH)


def leave(status: int) -> None:
    """End this process with a status.

    As a Python module, Blender may crash while the interpreter shuts down (4.2 does after a glTF export), and the
    status would be that of the crash. Its temporary files lie in a folder that the parent removes. Without it, too, the
    system takes back what numpy and the solver hold sooner than Python does.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError as error:
            # What is left of it would be written, and fail, once more.
            with open(os.devnull, "wb") as nowhere:
                os.dup2(nowhere.fileno(), stream.fileno())
            status = status or lost(error)
    if not {"bpy", "numpy"}.isdisjoint(sys.modules):
        os._exit(status)
    sys.exit(status)


def lost(error: OSError) -> int:
    """The status where something could not be printed; says so, unless its reader has gone."""
    if isinstance(error, BrokenPipeError):
        return UNREAD
    tell(f"what is printed cannot be written: {error.strerror}")
    return FAILURE


def open_streams() -> None:
    """Open what our caller has closed of standard input, output and errors, to nowhere.

    The next file would take its number, and what anybody prints would go into that file.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            handle = os.open(os.devnull, os.O_RDWR)
            if handle != number:
                os.dup2(handle, number)
                os.close(handle)
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "w" if number else "r", closefd=False))  # noqa: SIM115 - as Python's own


def supervise(errand: Errand) -> int:
    """Run the child to its end and say what ended it unless it did so itself; returns the exit status."""
    with begun(errand) as (child, _):
        with ended_by_signals(child.kill) as received:
            late = False
            try:
                child.wait(errand.timeout or None)
            except subprocess.TimeoutExpired:
                late = True
                child.kill()
                child.wait()
        if received:
            status, text = 128 + received[0], f"stopped by {signal.Signals(received[0]).name}"
        else:
            status, text = end_of(errand, child.returncode, late)
        if text:
            tidy(errand, child)
            tell(f"{errand.about}: {text}")
        return status


@dataclass(frozen=True)
class Outcome:
    """How a child that was watched has ended.

    status, text : its exit status, and what ended it unless it said so itself; out, err : what it has printed
    seconds : by the clock; processor : seconds of processors; memory : bytes at most; both None where none can tell
    """

    status: int
    text: str
    out: str
    err: str
    seconds: float
    processor: float | None
    memory: int | None


def watch(errand: Errand, begin: Callable[[subprocess.Popen], None]) -> Outcome:
    """Run the child to its end without a word, on any thread; `begin` is handed the child, so that it can be ended."""
    with begun(errand, captured=True) as (child, folder):
        begin(child)
        late = threading.Event()
        timer = threading.Timer(errand.timeout or threading.TIMEOUT_MAX, _end_late, (child, late))
        timer.daemon = True
        start = time.monotonic()
        if errand.timeout:
            timer.start()
        try:
            processor, memory = _wait(child)
        finally:
            timer.cancel()
        seconds = time.monotonic() - start
        status, text = end_of(errand, child.returncode, late.is_set())
        if text:
            tidy(errand, child)
        out, err = ((folder / name).read_text(errors="replace") for name in STREAMS)
    return Outcome(status, text, out, err, seconds, processor, memory)


@contextmanager
def begun(errand: Errand, captured: bool = False, answers: bool = False) -> Iterator[tuple[subprocess.Popen, Path]]:
    """The child of an errand, and the folder for its temporary files, which goes at the end of the block.

    captured : what it prints goes to files there; answers : what it prints on the standard output is read by us
    """
    with own_folder() as folder, ExitStack() as stack:
        places = dict.fromkeys(("TMPDIR", "TEMP", "TMP"), str(folder))
        out, err = (stack.enter_context(open(folder / n, "wb")) if captured else None for n in STREAMS)
        child = subprocess.Popen(
            errand.words,
            env={**os.environ, **places, MARK: str(folder)},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE if answers else out,
            stderr=err,
            # Ctrl-C in a terminal is for the parent alone, which ends the child at once.
            start_new_session=True,
        )
        try:
            yield child, folder
        finally:
            assert child.stdin is not None
            # It may have gone, with words to it still unread.
            with suppress(OSError):
                child.stdin.close()


def _end_late(child: subprocess.Popen, late: threading.Event) -> None:
    """End a child that takes too long."""
    late.set()
    child.kill()


def _wait(child: subprocess.Popen) -> tuple[float | None, int | None]:
    """Wait for a child; seconds of processors and bytes that it alone has used, where the system says so."""
    if not hasattr(os, "wait4"):
        child.wait()
        return None, None
    try:
        _, ended, usage = os.wait4(child.pid, 0)
    except ChildProcessError:
        # It had ended by itself when somebody was about to end it, who has taken its status.
        child.wait()
        return None, None
    child.returncode = os.waitstatus_to_exitcode(ended)
    unit = 1 if sys.platform == "darwin" else 1024
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss * unit


def end_of(errand: Errand, returned: int, late: bool) -> tuple[int, str]:
    """Exit status, and words for an end that the child has not told itself."""
    if late:
        return TIMEOUT, f"not done within {errand.timeout:g} s"
    return (returned, "") if returned in OWN else _crash(returned, errand.memory)


@contextmanager
def ended_by_signals(end: Callable[[], None]) -> Iterator[list[int]]:
    """Signals that are received call `end`; the value lists them. Threads other than the first get none."""
    received: list[int] = []
    if threading.current_thread() is not threading.main_thread():
        yield received
        return

    def stop(number: int, _frame) -> None:
        received.append(number)
        end()

    before = {number: signal.signal(number, stop) for number in SIGNALS}
    try:
        yield received
    finally:
        for number, handler in before.items():
            # None is a handler that Python did not install, as Blender's own, and cannot put back.
            signal.signal(number, signal.SIG_DFL if handler is None else handler)


def _crash(returned: int, memory: bool) -> tuple[int, str]:
    """Exit status and words for a child that ended itself neither by a status of ours nor by us."""
    if os.name == "posix" and returned == -signal.SIGKILL:
        return MEMORY, "killed from outside, as a rule because the system is out of memory"
    what = f"status {returned}" if returned > 0 else signal.Signals(-returned).name
    more = ", or lacked the memory that it may have" if memory else ""
    return CRASH, f"Blender crashed on it ({what}); the file may be damaged{more}"


def tidy(errand: Errand, child: subprocess.Popen) -> None:
    """Remove what a child that was ended has left in the folders that it writes to."""
    for folder in errand.folders:
        # By the number of the child: other runs may be writing to the same folder.
        for rest in folder.glob(f".omt_uv_{child.pid}_*"):
            if rest.is_dir() and not rest.is_symlink():
                shutil.rmtree(rest, ignore_errors=True)
            else:
                rest.unlink(missing_ok=True)


def tell(text: str) -> None:
    """Say an error on one line."""
    print(f"{PROGRAM}: error: {' '.join(text.split())}", file=sys.stderr, flush=True)
