"""Calls of functions of all rooms but the solver once more, each with one thing in what it was given changed, as
`other_input` does of the solver: beside numbers and marks texts, bytes of files, rows of objects and sets of choices,
and what has a default is left out. Only of functions that are given neither Blender's objects nor paths."""

from __future__ import annotations

import contextlib
import inspect
from collections.abc import Callable
from enum import Enum

import numpy as np
import other_input
import scipy.sparse as sp
from recorded_calls import Call, Within, copied

import omt_uv

# Calls of each function that are kept, of different runs, and the most changes that are tried of each.
KEPT = 2
MOST = 40
# So deep objects in objects are looked into.
DEEP = 16
LARGEST = 300_000
# Seconds of a call as it was, and of a row, that are not too many.
SLOW = 0.01
LONG = 0.02
PLAIN = (bool, int, float, complex, str, bytes, np.ndarray, np.generic, Enum, type(None))
# What is taken from a call is neither a number nor anything in it, but the argument itself.
LEFT_OUT = "left out"
# What works with processes, with Blender's data and window, with dates, and with what other calls have left.
ELSEWHERE = ("supervision.", "batch.", "session.", "operators.live.", "registration.", "cli.", "panels.",
             "operators.", "blender.", "files.fbx_nodes.")  # fmt: skip


class Kept(Within):
    """As `Within`, and some calls of every function are kept to be called again."""

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        """A call that begins; the first ones of a function in a run are kept."""
        call = super().begin(name, function, args, kwargs)
        kept = self.calls.setdefault(name, [])
        first = call is not None and call.args[0] == 1 and len(kept) < KEPT and not name.startswith(ELSEWHERE)
        if first and is_plain((args, kwargs)) and _size((args, kwargs)) < LARGEST:
            with contextlib.suppress(TypeError, NotImplementedError, ValueError):
                kept.append(Call(name, function, *copied((args, kwargs))))
        return call


def is_plain(value, depth: int = 0) -> bool:
    """Whether a value holds numbers, texts, and objects of ours of such alone."""
    if isinstance(value, PLAIN) or sp.issparse(value):
        return not (isinstance(value, np.ndarray) and value.dtype == object)
    if depth > DEEP:
        return False
    if isinstance(value, (tuple, list, set, frozenset)):
        return all(is_plain(item, depth + 1) for item in value)
    if isinstance(value, dict):
        return all(is_plain(item, depth + 1) for pair in value.items() for item in pair)
    if isinstance(value, type) or not type(value).__module__.startswith(omt_uv.__name__):
        return False
    return hasattr(value, "__dict__") and is_plain(vars(value), depth + 1)


def _size(value) -> int:
    """Bytes of arrays, and of files."""
    if isinstance(value, bytes):
        return len(value)
    if isinstance(value, (tuple, list)):
        return sum(map(_size, value))
    if isinstance(value, dict):
        return sum(map(_size, value.values()))
    if isinstance(value, np.ndarray):
        return value.nbytes
    return _size(vars(value)) if hasattr(value, "__dict__") and not isinstance(value, (type, Enum)) else 0


TEXT = {"more": lambda x: f"{x}x", "less": lambda x: x[:-1], "nothing": lambda x: "", "negated": lambda x: x.swapcase()}
BYTES = {
    "less": lambda x: x[:-1],
    "half": lambda x: x[: len(x) // 2],
    "nothing": lambda x: b"",
    "spread": lambda x: x.replace(b" ", b"  "),
    "negated": lambda x: x.replace(b"1", b"-1"),
    "more": lambda x: x.replace(b"1", b"3"),
    "of windows": lambda x: x.replace(b"\n", b"\r\n"),
}
WHOLE = {"more": lambda x: x + 1, "less": lambda x: x - 1, "nothing": lambda x: 0, "negated": lambda x: -x}
ITEMS = {"fewer": lambda x: x[1:], "less": lambda x: x[:-1], "twice": lambda x: x + x, "turned": lambda x: x[::-1]}
CHOICES = {"nothing": lambda x: type(x)(), "fewer": lambda x: type(x)(sorted(x, key=repr)[1:])}
PAIRS = {"nothing": lambda x: {}, "fewer": lambda x: dict(list(x.items())[1:])}


def changes_of(value) -> dict[str, Callable]:
    """Changes of a value by their names."""
    if isinstance(value, Enum):
        return {}
    if isinstance(value, int) and not isinstance(value, bool):
        return WHOLE
    for kind, changes in ((str, TEXT), (bytes, BYTES), ((set, frozenset), CHOICES), (dict, PAIRS)):
        if isinstance(value, kind):
            return changes if value else {}
    if isinstance(value, (tuple, list)):
        return ITEMS if len(value) and not hasattr(value, "_fields") else {}
    return other_input.changes_of(value)


class FrontAsker(other_input.Asker):
    """What is changed in calls of functions of all rooms but the solver."""

    def __init__(self) -> None:
        super().__init__(changes_of, MOST, SLOW, LONG)

    def ways(self, call: Call) -> list[tuple[tuple, str]]:
        """All ways and changes that there are; arguments themselves are neither fewer nor in another order."""
        found = [(way, kind) for way, kind in super().ways(call) if len(way) > 1]
        return found + [((0, k), LEFT_OUT) for k in _with_default(call)] + [((1, k), LEFT_OUT) for k in call.kwargs]

    def given(self, call: Call, way: tuple, kind: str) -> tuple[tuple, dict]:
        """What a call is given with a change, or with none."""
        if kind != LEFT_OUT:
            return super().given(call, way, kind)
        args, kwargs = copied((call.args, call.kwargs))
        if way[0]:
            kwargs.pop(way[1])
        return (args if way[0] else args[: way[1]]), kwargs


def shaken(calls: dict[str, list[Call]], seed: int) -> dict[str, list[Call]]:
    """The same calls, in which numbers that are not whole differ in their last digits."""
    rng = np.random.default_rng(seed)
    return {name: [c._replace(args=_shaken(c.args, rng), kwargs=_shaken(c.kwargs, rng)) for c in of]
            for name, of in calls.items()}  # fmt: skip


def _shaken(value, rng):
    if isinstance(value, (np.ndarray, float)) and np.asarray(value).dtype.kind == "f":
        off = 1e-7 if np.asarray(value).dtype == np.float32 else 1e-10
        with np.errstate(all="ignore"):
            moved = np.asarray(value) * (1 + off * rng.normal(size=np.shape(value)))
        return float(moved) if isinstance(value, float) else moved.astype(value.dtype)
    if isinstance(value, (tuple, list)):
        items = [_shaken(item, rng) for item in value]
        return type(value)(*items) if hasattr(value, "_fields") else type(value)(items)
    if isinstance(value, dict):
        return {key: _shaken(item, rng) for key, item in value.items()}
    if hasattr(value, "__dict__") and not isinstance(value, (type, Enum)):
        other = copied(value)
        for key, item in vars(value).items():
            object.__setattr__(other, key, _shaken(item, rng))
        return other
    return value


def _with_default(call: Call) -> list[int]:
    """Numbers of arguments of a call, in their order, that might be left out with all that come after them."""
    try:
        parameters = list(inspect.signature(call.function).parameters.values())
    except (TypeError, ValueError):
        return []
    rows = range(min(len(call.args), len(parameters)))
    return [k for k in rows if parameters[k].default is not inspect.Parameter.empty]
