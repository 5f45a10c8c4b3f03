"""What nobody named is told in one line with its place, or raised whole where Python is in its development mode."""

from __future__ import annotations

import argparse
import errno
import sys
from types import SimpleNamespace

import pytest


def fail(error):
    def run(_options):
        raise error

    return argparse.Namespace(run=run, input="in.obj")


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (ZeroDivisionError("by nothing"), "DEFECT", "a defect of this program, please report it: ZeroDivisionError in"),
        (OSError(errno.EBADMSG, "odd"), "DEFECT", "please report it: OSError in"),
        (OSError(errno.ENOSPC, "No space left", "out.obj"), "FAILURE", "out.obj: No space left. Look for space"),
        (OSError(errno.ENOSPC, "No space left"), "FAILURE", "what is written or printed: No space left. Look"),
        (MemoryError("much"), "MEMORY", "in.obj: not enough memory. much"),
        (KeyboardInterrupt(), "INTERRUPTED", "in.obj: stopped by SIGINT"),
    ],
)
def test_what_goes_wrong_is_one_line_and_a_status(error, status, said, package, capfd):
    cli, supervision = package("cli"), package("supervision")
    capfd.readouterr()
    assert cli.carry_out(fail(error)) == getattr(supervision, status)
    out, err = capfd.readouterr()
    assert out == "" and err.count("\n") == 1 and said in err
    if status == "DEFECT":
        assert "test_defects.py:" in err


@pytest.mark.parametrize("error", [ZeroDivisionError("by nothing"), OSError(errno.EBADMSG, "odd")])
def test_defects_are_raised_in_development_mode(error, package, monkeypatch):
    flags = {name: getattr(sys.flags, name) for name in dir(sys.flags) if not name.startswith(("_", "n_"))}
    cli = package("cli")
    monkeypatch.setattr(cli, "sys", SimpleNamespace(flags=SimpleNamespace(**flags | {"dev_mode": True}), argv=sys.argv))
    with pytest.raises(type(error)):
        cli.carry_out(fail(error))
