"""Give memory that is free again back to the system: C's allocator keeps it for the arrays to come.

Factors ask for large arrays of which they touch little, between those that stay; the holes that they leave are never
quite filled, and a mesh of a million triangles took half as much memory again as it held (glibc, malloc_trim).
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache


@cache
def _trim() -> Callable[[int], int] | None:
    """The function of the C library of this process; None where it has none."""
    return getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None


def give_back() -> None:
    """Give back what is free; takes milliseconds for gigabytes, and touching as much again a little longer."""
    trim = _trim()
    if trim is not None:
        trim(0)
