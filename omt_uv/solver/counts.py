"""Refuse counts that no machine has memory for, before any is asked for."""

from __future__ import annotations

import math
import os

from .errors import CountError

# What a point, face, quad, tetrahedron, sample or shell takes at least while it is made.
BYTES_PER_ELEMENT = 100
# What a vertex of a new mesh takes at least while it is made: 13 kB between 10,000 and 40,000 vertices.
BYTES_PER_VERTEX = 10_000
# Numbers of a pixel of a picture, at least.
CHANNELS = 3
BYTES_OF_NUMBER = 8
# Beyond so many levels there is no telling them apart: no machine has memory for a quarter of them.
MOST_LEVELS = 32


def real(count: float) -> float:
    """A count as a float: integers of Python have no limit, and too large ones become infinite, as floats do.

    >>> real(3), real(10**400), real(-(10**400))
    (3.0, inf, -inf)
    """
    try:
        return float(count)
    except OverflowError:
        return math.inf if count > 0 else -math.inf


def check_memory(count: float, each: float, what: str, advice: str = "Ask for fewer") -> None:
    """Raise CountError where `count` things of at least `each` bytes are more than the memory of this machine.

    what : the things, with braces for their count, as the subject of a sentence in the singular; advice : what to do

    >>> check_memory(10, 100, "A mesh of about {} vertices")
    """
    if not hasattr(os, "sysconf"):
        return
    there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    count = real(count)
    # What is no number is not below either.
    if not count <= there / each:
        raise CountError(
            f"{what.format(f'{count:.3g}')} takes more memory to make than the {there / 1e9:.3g} GB of this machine",
            advice,
        )


def check_vertices(count: float) -> None:
    """Raise CountError for a new mesh of so many vertices that this machine has no memory for it."""
    check_memory(count, BYTES_PER_VERTEX, "A mesh of about {} vertices", "Ask for fewer, or for longer edges")


def check_pixels(width: int, height: int) -> None:
    """Raise CountError for so many pixels across and down that this machine has no memory for them."""
    check_memory(
        real(width) * real(height), CHANNELS * BYTES_OF_NUMBER, "A picture of {} pixels", "Ask for a smaller one"
    )


def quadrupled(levels: int) -> float:
    """How many there are of one that becomes four so many times; beyond `MOST_LEVELS`, as many as after those.

    >>> quadrupled(2), quadrupled(10**9) == quadrupled(MOST_LEVELS)
    (16.0, True)
    """
    return 4.0 ** min(levels, MOST_LEVELS)
