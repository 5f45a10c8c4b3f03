"""Silence Blender while it loads, reads and writes: a command that is piped into another must not talk."""

from __future__ import annotations

import ctypes
import io
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout


@contextmanager
def silence() -> Iterator[Callable[[], str]]:
    """Keep what Blender prints, from Python and from C, off the terminal; the value returns what was printed."""
    python = io.StringIO()
    with tempfile.TemporaryFile() as sink, redirect_stdout(python), redirect_stderr(python):
        printed = ""
        saved = [os.dup(1), os.dup(2)]
        _flush()
        try:
            os.dup2(sink.fileno(), 1)
            os.dup2(sink.fileno(), 2)
            yield lambda: printed + python.getvalue()
        finally:
            _flush()
            for number, copy in zip((1, 2), saved, strict=True):
                os.dup2(copy, number)
                os.close(copy)
            sink.seek(0)
            printed = sink.read().decode(errors="replace")


def _flush() -> None:
    """Empty the buffers of Python and of C, where Blender's own messages wait."""
    for stream in (sys.__stdout__, sys.__stderr__):
        if stream is not None:
            stream.flush()
    ctypes.CDLL("ucrtbase" if os.name == "nt" else None).fflush(None)
