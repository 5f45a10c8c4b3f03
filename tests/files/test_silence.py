"""What is printed in silence is told to whoever asks, all of it, and to nobody else, whoever keeps it back."""

import ctypes
import os

import pytest

from omt_uv.files.silence import _flush, silence

LIBRARY = ctypes.CDLL(None) if os.name == "posix" else None
by_c = pytest.mark.skipif(LIBRARY is None, reason="C's own buffer is reached by its name here")


def in_python(text):
    print(text, end="")


def past_python(text):
    os.write(1, text.encode())


def in_c(text):
    LIBRARY.printf(b"%s", text.encode())


WAYS = [in_python, past_python, pytest.param(in_c, marks=by_c)]


@pytest.mark.parametrize("raised", [False, True])
@pytest.mark.parametrize("way", WAYS)
def test_what_is_printed_before_within_and_after_is_told_where_it_was(way, raised, capfd):
    way("before")
    told = []
    with pytest.raises(KeyError) if raised else silence() as outer:
        if raised:
            with silence() as printed:
                way("within")
                told.append(printed)
                raise KeyError
        else:
            way("within")
            told.append(outer)
    way("after")
    _flush()
    found = capfd.readouterr().out
    assert "within" not in found and found.count("before") == found.count("after") == 1
    assert told[0]() == "within"


@by_c
def test_silence_within_silence_keeps_what_is_its_own(capfd):
    with silence() as outer:
        in_c("one")
        with silence() as inner:
            in_c("two")
        in_c("three")
    assert (outer(), inner()) == ("onethree", "two")
    _flush()
    assert capfd.readouterr().out == ""
