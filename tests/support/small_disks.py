"""A disk that is full, for those who write."""

from __future__ import annotations

import resource
import sys
from contextlib import contextmanager


@contextmanager
def small_disk(size):
    """No file grows over so many bytes: what writes more fails, as on a full disk, if it looks."""
    before, quiet = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    # Python does not look: half of what it compiles would be kept for the next process, which breaks off there.
    sys.dont_write_bytecode = True
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = quiet
