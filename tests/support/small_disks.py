"""A disk that is full, for those who write."""

from __future__ import annotations

import resource
from contextlib import contextmanager


@contextmanager
def small_disk(size):
    """No file grows over so many bytes: what writes more fails, as on a full disk, if it looks."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
