"""What is printed in silence is told to whoever asks, all of it, and to nobody else, whoever keeps it back."""

import ctypes
import os
import sys

import pytest

from omt_uv.files.silence import _flush, silence

LIBRARY = ctypes.CDLL(None) if os.name == "posix" else None
if LIBRARY is not None:
    LIBRARY.fdopen.restype = ctypes.c_void_p
    # What is printed here waits in a buffer of its own, whatever this process does with its output.
    BUFFER = ctypes.c_void_p(LIBRARY.fdopen(1, b"w"))
    LIBRARY.setvbuf(BUFFER, None, 0, ctypes.c_size_t(4096))
by_c = pytest.mark.skipif(LIBRARY is None, reason="C's own buffer is reached by its name here")


def in_python(text):
    sys.stdout.write(text)


def past_python(text):
    os.write(1, text.encode())


def in_c(text):
    LIBRARY.fputs(text.encode(), BUFFER)


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
