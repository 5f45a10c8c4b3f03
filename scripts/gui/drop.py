"""Drop a file on a window, at a place of the screen, as a file manager does: the protocol Xdnd, by libX11 alone.

usage: drop.py FILE X Y      source: https://www.freedesktop.org/wiki/Specifications/XDND
"""

from __future__ import annotations

import ctypes as c
import sys
import time
from pathlib import Path

VERSION = 5
# Seconds for the window to answer.
PATIENCE = 30.0
# Kinds of events.
CLIENT_MESSAGE = 33
SELECTION_REQUEST = 30
SELECTION_NOTIFY = 31
# Bits of what a property or a message holds.
BYTES = 8
LONGS = 32
# Any type of a property; what was there is replaced.
ANY = 0
REPLACE = 0


class Message(c.Structure):
    """XClientMessageEvent."""

    _fields_ = (
        ("type", c.c_int),
        ("serial", c.c_ulong),
        ("send_event", c.c_int),
        ("display", c.c_void_p),
        ("window", c.c_ulong),
        ("message_type", c.c_ulong),
        ("format", c.c_int),
        ("l", c.c_long * 5),
    )


class Request(c.Structure):
    """XSelectionRequestEvent."""

    _fields_ = (
        ("type", c.c_int),
        ("serial", c.c_ulong),
        ("send_event", c.c_int),
        ("display", c.c_void_p),
        ("owner", c.c_ulong),
        ("requestor", c.c_ulong),
        ("selection", c.c_ulong),
        ("target", c.c_ulong),
        ("property", c.c_ulong),
        ("time", c.c_ulong),
    )


class Answer(c.Structure):
    """XSelectionEvent."""

    _fields_ = (
        ("type", c.c_int),
        ("serial", c.c_ulong),
        ("send_event", c.c_int),
        ("display", c.c_void_p),
        ("requestor", c.c_ulong),
        ("selection", c.c_ulong),
        ("target", c.c_ulong),
        ("property", c.c_ulong),
        ("time", c.c_ulong),
    )


class Event(c.Union):
    """XEvent: as large as the largest."""

    _fields_ = (
        ("type", c.c_int),
        ("message", Message),
        ("request", Request),
        ("answer", Answer),
        ("pad", c.c_long * 24),
    )


class Source:
    """A window of our own that offers a file."""

    def __init__(self, path: Path):
        self.x = c.CDLL("libX11.so.6")
        for name in ("XOpenDisplay", "XInternAtom", "XDefaultRootWindow", "XCreateSimpleWindow"):
            getattr(self.x, name).restype = c.c_void_p if name == "XOpenDisplay" else c.c_ulong
        self.display = c.c_void_p(self.x.XOpenDisplay(None))
        if not self.display:
            raise OSError("there is no screen")
        self.root = c.c_ulong(self.x.XDefaultRootWindow(self.display))
        self.window = c.c_ulong(
            self.x.XCreateSimpleWindow(self.display, self.root, 0, 0, 1, 1, 0, c.c_ulong(0), c.c_ulong(0))
        )
        self.offer = path.as_uri().encode() + b"\r\n"
        self.uris = self.atom("text/uri-list")
        self.x.XSetSelectionOwner(self.display, c.c_ulong(self.atom("XdndSelection")), self.window, c.c_ulong(0))

    def atom(self, name: str) -> int:
        """The number that stands for a word."""
        return self.x.XInternAtom(self.display, name.encode(), 0)

    def target(self) -> int:
        """The last window of the screen that takes what is dropped."""
        root, parent, children, count = c.c_ulong(), c.c_ulong(), c.POINTER(c.c_ulong)(), c.c_uint()
        self.x.XQueryTree(self.display, self.root, *map(c.byref, (root, parent, children, count)))
        able = [children[k] for k in range(count.value) if self._is_aware(children[k])]
        if not able:
            raise LookupError("no window takes what is dropped")
        return able[-1]

    def _is_aware(self, window: int) -> bool:
        kind, form, size, rest, data = c.c_ulong(), c.c_int(), c.c_ulong(), c.c_ulong(), c.c_void_p()
        asked = (self.display, c.c_ulong(window), c.c_ulong(self.atom("XdndAware")), c.c_long(0), c.c_long(1), 0)
        self.x.XGetWindowProperty(*asked, c.c_ulong(ANY), *map(c.byref, (kind, form, size, rest, data)))
        return kind.value != 0

    def send(self, target: int, name: str, *values: int) -> None:
        """Tell the window a step of the protocol."""
        event = Event()
        event.message = Message(CLIENT_MESSAGE, 0, 1, self.display, target, self.atom(name), LONGS)
        event.message.l[:] = (self.window.value, *values, *(0,) * (4 - len(values)))
        self.x.XSendEvent(self.display, c.c_ulong(target), 0, c.c_long(0), c.byref(event))
        self.x.XFlush(self.display)

    def wait_for(self, name: str) -> None:
        """Give what is asked for until the window tells a step."""
        event, end = Event(), time.monotonic() + PATIENCE
        while time.monotonic() < end:
            if not self.x.XPending(self.display):
                time.sleep(0.02)
                continue
            self.x.XNextEvent(self.display, c.byref(event))
            if event.type == SELECTION_REQUEST:
                self._give(event.request)
            elif event.type == CLIENT_MESSAGE and event.message.message_type == self.atom(name):
                return
        raise TimeoutError(f"no {name} in {PATIENCE} s")

    def _give(self, asked: Request) -> None:
        """The address of the file to whoever asks for the selection."""
        place = (self.display, c.c_ulong(asked.requestor), c.c_ulong(asked.property), c.c_ulong(asked.target))
        self.x.XChangeProperty(*place, BYTES, REPLACE, self.offer, len(self.offer))
        event = Event()
        names = (asked.requestor, asked.selection, asked.target, asked.property, asked.time)
        event.answer = Answer(SELECTION_NOTIFY, 0, 1, self.display, *names)
        self.x.XSendEvent(self.display, c.c_ulong(asked.requestor), 0, c.c_long(0), c.byref(event))
        self.x.XFlush(self.display)


def main(name: str, x: str, y: str) -> None:
    """Enter, move to the place, drop, and wait until the window has taken the file."""
    source = Source(Path(name))
    target, copy = source.target(), source.atom("XdndActionCopy")
    source.send(target, "XdndEnter", VERSION << 24, source.uris)
    for _ in range(2):
        source.send(target, "XdndPosition", 0, int(x) << 16 | int(y), 0, copy)
        source.wait_for("XdndStatus")
    source.send(target, "XdndDrop", 0, 0)
    source.wait_for("XdndFinished")


if __name__ == "__main__":
    main(*sys.argv[1:4])
