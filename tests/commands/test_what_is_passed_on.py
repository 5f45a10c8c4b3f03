"""What the command line hands on to the process that does the work, and what a terminal is shown meanwhile."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

WORDS = ["unwrap", "in.obj", "-o", "there/out.obj"]


@pytest.fixture
def errand(package, monkeypatch):
    """The errand that words become, without anybody who goes on it."""
    supervision = package("cli").supervision
    monkeypatch.setattr(supervision, "is_child", lambda: False)

    def made(*words):
        found = []
        monkeypatch.setattr(supervision, "supervise", lambda one: found.append(one) or 7)
        assert package("cli").program([*WORDS, *words], ["python", "-m", "omt_uv", *WORDS, *words]) == 7
        return found[0]

    return made


def test_limits_and_folders_are_those_of_the_words(errand):
    plain = errand()
    assert (plain.timeout, plain.memory, plain.about) == (0, False, "in.obj")
    assert set(plain.folders) == {Path.cwd(), Path.cwd() / "there"}
    assert list(plain.words) == ["python", "-m", "omt_uv", *WORDS]
    assert errand("--timeout", "7.5").timeout == 7.5 and not errand("--timeout", "7.5").memory
    if sys.platform == "linux":
        assert errand("--memory", "2").memory and errand("--memory", "2").timeout == 0
    assert Path.cwd() / "far" in errand("--report", "far/r.json").folders


def test_a_child_that_cannot_be_started_is_a_line(package, monkeypatch, capsys):
    supervision = package("cli").supervision
    monkeypatch.setattr(supervision, "is_child", lambda: False)

    def none(_):
        raise OSError(12, "Cannot allocate memory")

    monkeypatch.setattr(supervision, "supervise", none)
    assert package("cli").program(WORDS, ["python", *WORDS]) == supervision.FAILURE
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "in.obj: no child process can be started" in told


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize("stream", [Terminal, io.StringIO])
def test_a_terminal_sees_how_far_it_is_and_then_nothing_of_it(package, monkeypatch, capsys, stream):
    from omt_uv.solver.progress import Progress

    def steps():
        yield Progress("Half", 0.5)
        return "done"

    monkeypatch.setattr(sys, "stderr", stream())
    assert package("commands.common").drain_shown(steps()) == "done"
    told = sys.stderr.getvalue()
    assert told == ("\r\033[K 50 % Half\r\033[K" if stream is Terminal else "")
    assert capsys.readouterr().out == ""
