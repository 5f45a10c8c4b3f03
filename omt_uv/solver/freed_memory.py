"""Give memory that is free again back to the system: C's allocator keeps it for the arrays to come.

Factors ask for large arrays of which they touch little, between those that stay; the holes that they leave are never
quite filled, and a mesh of a million triangles took half as much memory again as it held (glibc, malloc_trim).
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache

# Vertices of a mesh of which hundreds of megabytes may be free and not given back.
MANY = 100_000


@cache
def _trim() -> Callable[[int], int] | None:
    """The function of the C library of this process; None where it has none."""
    return getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None


def give_back_of(vertices: int) -> None:
    """Give back what is free, if it may be much: between the stages of a mesh of so many vertices."""
    if vertices > MANY:
        give_back()


def give_back() -> None:
    """Give back what is free; takes milliseconds for gigabytes, and touching as much again a little longer."""
    trim = _trim()
    if trim is not None:
        trim(0)
