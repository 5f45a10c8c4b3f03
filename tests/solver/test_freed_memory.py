"""Memory that is free again is the system's."""

import platform
import subprocess
import sys

import pytest

from omt_uv.solver import freed_memory
from omt_uv.solver.freed_memory import give_back


def test_all_that_is_free_is_given_back_once(monkeypatch):
    asked: list[int] = []
    monkeypatch.setattr(freed_memory, "_trim", lambda: asked.append)
    assert give_back() is None and asked == [0]


def test_what_cannot_be_given_back_is_kept(monkeypatch):
    """Other C libraries than that of GNU have no such function."""
    monkeypatch.setattr(freed_memory, "_trim", lambda: None)
    assert give_back() is None


@pytest.mark.skipif(
    sys.platform != "linux" or platform.libc_ver()[0] != "glibc", reason="what other C libraries keep is theirs"
)
def test_the_library_of_this_process_has_the_function():
    assert freed_memory._trim()(0) in (0, 1)


def test_nothing_that_is_held_changes():
    held = b"held" * 1000
    assert give_back() is None and held == b"held" * 1000


def test_what_steps_free_is_kept(monkeypatch):
    """Whoever runs a solver says so to the allocator once, and nothing of what is held changes."""
    asked: list[tuple[int, int]] = []

    class Library:
        @staticmethod
        def mallopt(what: int, value: int) -> int:
            asked.append((what, value))
            return 1

    monkeypatch.setattr(freed_memory.ctypes, "CDLL", lambda name: Library)
    monkeypatch.setattr(freed_memory.sys, "platform", "linux")
    for _ in range(2):
        freed_memory.keep_freed.__wrapped__()
    once = [(freed_memory.M_TRIM_THRESHOLD, freed_memory.KEPT), (freed_memory.M_MMAP_THRESHOLD, freed_memory.OF_THESE)]
    assert asked == 2 * once


@pytest.mark.parametrize("platform_name, library", [("win32", None), ("linux", object())])
def test_other_allocators_keep_what_they_keep(monkeypatch, platform_name, library):
    monkeypatch.setattr(freed_memory.ctypes, "CDLL", lambda name: library)
    monkeypatch.setattr(freed_memory.sys, "platform", platform_name)
    assert freed_memory.keep_freed.__wrapped__() is None


@pytest.mark.skipif(
    sys.platform != "linux" or platform.libc_ver()[0] != "glibc", reason="what other C libraries keep is theirs"
)
def test_steps_take_no_memory_anew():
    """In a process of its own: what is freed and asked for again is not cleared by the system."""
    code = (
        "import resource, numpy as np\n"
        "from omt_uv.solver.freed_memory import keep_freed\n"
        "def faults():\n"
        "    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt\n"
        "    for _ in range(20):\n"
        "        arrays = [np.ones(1 << 19) for _ in range(8)]\n"
        "        del arrays\n"
        "    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before\n"
        "keep_freed(); faults(); kept = faults()\n"
        "print(kept)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(done.stdout) < 20 * 8 * (1 << 19) * 8 / 4096 / 10
