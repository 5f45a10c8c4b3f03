"""Keep the linear algebra below numpy and scipy on one thread while a solver works, and give it back as it was.

What solvers multiply is small: further threads wait for work by spinning, and take processor time for no second less.
Only the libraries that numpy and scipy bring along are limited, by their own functions (OpenBLAS,
openblas_set_num_threads); where there are none by these names, nothing is.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import scipy

# Names of OpenBLAS's functions: as scipy's builds prefix and suffix them, and as they are.
PREFIXES = ("scipy_", "")
SUFFIXES = ("64_", "", "_")
# Where wheels keep their libraries, beside the package and within it.
FOLDERS = ("../{}.libs", ".dylibs")


@dataclass(frozen=True)
class BlasLibrary:
    """A library of linear algebra: how many threads it has, and how that is changed."""

    count: Callable[[], int]
    limit: Callable[[int], None]


@cache
def libraries() -> tuple[BlasLibrary, ...]:
    """The libraries of numpy and scipy whose threads can be counted."""
    found = []
    for package in (np, scipy):
        home = Path(str(package.__file__)).parent
        for folder in FOLDERS:
            for path in sorted((home / folder.format(package.__name__)).glob("*openblas*")):
                library = _opened(path)
                found += [] if library is None else [library]
    return tuple(found)


def _opened(path: Path) -> BlasLibrary | None:
    """The functions of a library, which is loaded already; None where it has none of these names."""
    try:
        library = ctypes.CDLL(str(path))
    except OSError:
        return None
    for prefix in PREFIXES:
        for suffix in SUFFIXES:
            count = getattr(library, f"{prefix}openblas_get_num_threads{suffix}", None)
            limit = getattr(library, f"{prefix}openblas_set_num_threads{suffix}", None)
            if count is not None and limit is not None:
                count.restype, limit.argtypes, limit.restype = ctypes.c_int, [ctypes.c_int], None
                return BlasLibrary(count, limit)
    return None


class _Limit:
    """How many solvers are at work, and what the libraries had before the first of them."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.solvers = 0
        self.before: list[tuple[BlasLibrary, int]] = []

    def begin(self) -> None:
        with self.lock:
            self.solvers += 1
            if self.solvers == 1:
                self.before = [(library, library.count()) for library in libraries()]
                self._set([(library, 1) for library, count in self.before if count > 1])

    def end(self) -> None:
        with self.lock:
            self.solvers -= 1
            if self.solvers == 0:
                self._set([(library, count) for library, count in self.before if count > 1])

    @staticmethod
    def _set(counts: list[tuple[BlasLibrary, int]]) -> None:
        for library, count in counts:
            library.limit(count)


_limit = _Limit()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Context in which numpy and scipy multiply on one thread; solvers on several threads at once share it."""
    _limit.begin()
    try:
        yield
    finally:
        _limit.end()
