"""Say when memory that is free again goes back to the system: what C's allocator keeps is there for the arrays to come.

Between the stages of large meshes it is given back. Factors ask for large arrays of which they touch little, between
those that stay; the holes that they leave are never quite filled, and a mesh of a million triangles took half as much
memory again as it held (glibc, malloc_trim). Steps of small meshes keep it. They ask for as much every time, and to
give it back and have it cleared by the system took a fifth of the time of factors (glibc, mallopt).
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from functools import cache

# Vertices of a mesh of which hundreds of megabytes may be free and not given back.
MANY = 100_000
# Vertices of a mesh of which the arrays of single steps take so much: each of them finds other holes that are free, and
# all that were touched in turn take as much memory as a matrix.
VERY_MANY = 800_000
# Bytes that are kept where they are free: what a step of 10,000 vertices asks for, most of which it never touches; and
# up to which an array is taken from these, as many as the library allows.
KEPT = 1 << 28
OF_THESE = 1 << 25
# Numbers by which mallopt knows them (malloc.h).
M_TRIM_THRESHOLD = -1
M_MMAP_THRESHOLD = -3


@cache
def keep_freed() -> None:
    """Let C's allocator keep KEPT bytes that are free, in this process and from now on, where it is that of GNU."""
    set_option = getattr(ctypes.CDLL(None), "mallopt", None) if sys.platform == "linux" else None
    if set_option is not None:
        set_option(M_TRIM_THRESHOLD, KEPT)
        set_option(M_MMAP_THRESHOLD, OF_THESE)


@cache
def _trim() -> Callable[[int], int] | None:
    """The function of the C library of this process; None where it has none."""
    return getattr(ctypes.CDLL(None), "malloc_trim", None) if sys.platform == "linux" else None


def give_back_of(vertices: int) -> None:
    """Give back what is free, if it may be much: between the stages of a mesh of so many vertices."""
    if vertices > MANY:
        give_back()


def give_back_often(vertices: int) -> None:
    """Give back what is free, between the steps of a stage of a mesh of so many vertices."""
    if vertices > VERY_MANY:
        give_back()


def give_back() -> None:
    """Give back what is free; takes milliseconds for gigabytes, and touching as much again a little longer."""
    trim = _trim()
    if trim is not None:
        trim(0)
