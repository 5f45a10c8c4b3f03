"""Memory that is free again is the system's."""

import platform
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
