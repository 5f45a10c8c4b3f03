"""Calls of functions once more, each with one thing in what it was given changed: numbers that are larger, of the other
sign or all alike, rows in another order, marks turned over. What no run comes to by itself is seen by what comes of it.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import inspect
import io
import os
import pickle
import random
import select
import signal
import warnings
import zlib
from collections.abc import Callable, Iterator
from enum import Enum
from typing import NoReturn

import numpy as np
import recorded_calls
import scipy.sparse as sp
from recorded_calls import Call, Told, copied, figures, told_leaves

import omt_uv

# Calls of each function that are kept, of different runs, and the most changes that are tried of each.
KEPT = 2
MOST = 30
# Tetrahedra are made by a library that leaves files where it fails.
LEAVES_FILES = "volumes.meshing."
# Changes of order make indices that lead to places where nobody wrote: what comes of them is not the same each time.
UNSOUND = {"rolled", "reversed", "repeated"}
# What stands between the name of a function and that of a change.
CAME = " came "
# Arguments with more bytes are let be.
LARGEST = 60_000
# So far changes go into what objects hold, and so many items of a row of them are changed.
DEEP = 2
ITEMS = 2


class Asked(Told):
    """As `Told`, of the solver, and some calls of every function are kept to be called again."""

    def __init__(self, most: int) -> None:
        super().__init__(most, open=True)

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        """A call that begins; the first ones of a function in a run are kept."""
        call = super().begin(name, function, args, kwargs)
        if call is None or call.args[0] != 1:
            return call
        kept = self.calls.setdefault(name, [])
        if len(kept) < KEPT and not name.startswith(LEAVES_FILES) and _size((args, kwargs)) < LARGEST:
            # What cannot be copied, as a factorisation, is not asked for.
            with contextlib.suppress(TypeError, NotImplementedError, ValueError):
                kept.append(Call(name, function, *copied((args, kwargs))))
        return call


def _size(value) -> int:
    return sum(leaf.nbytes for leaf in recorded_calls.leaves(value))


def _is_ours(value) -> bool:
    return type(value).__module__.startswith(omt_uv.__name__) and not isinstance(value, (type, Enum))


def _inside(value) -> list[tuple[object, object]]:
    """Places in a value, and what stands there."""
    if isinstance(value, (tuple, list)):
        return list(enumerate(value[:ITEMS] if isinstance(value, list) else value))
    if isinstance(value, dict):
        return list(value.items())
    return list(vars(value).items()) if _is_ours(value) and hasattr(value, "__dict__") else []


def places(value, depth: int = 0) -> Iterator[tuple[tuple, str]]:
    """Ways to numbers in a value, each with the name of a change that may be made there."""
    for kind in _changes(value):
        # How many there are of something, within an object, goes to functions in C that trust it.
        if not depth or _changes(value) is not WHOLE:
            yield (), kind
    if depth <= DEEP:
        for place, item in _inside(value):
            for way, kind in places(item, depth + (depth > 0 or not isinstance(value, (tuple, dict)))):
                yield (place, *way), kind


def changed(value, way: tuple, kind: str):
    """A value with what stands at the end of a way changed; what is on the way is changed in place where it can be."""
    if not way:
        return _changes(value)[kind](value)
    place, *rest = way
    if isinstance(value, tuple):
        items = list(value)
        items[place] = changed(items[place], tuple(rest), kind)
        return type(value)(*items) if hasattr(value, "_fields") else tuple(items)
    if isinstance(value, (list, dict)):
        value[place] = changed(value[place], tuple(rest), kind)
    else:
        object.__setattr__(value, place, changed(vars(value)[place], tuple(rest), kind))
    return value


def _waves(a):
    return a * (1 + 0.3 * np.sin(1.0 + np.arange(a.size)).reshape(a.shape))


def _alike(a):
    """Rounded so that many are the same."""
    size = np.abs(a[np.isfinite(a)]).max(initial=0.0) or 1.0
    return np.round(3 * a / size) * (size / 3)


def _thinned(a):
    fewer = a.copy()
    fewer.reshape(-1)[::3] = 0
    return fewer


def _repeated(a):
    """Every second row as the one before."""
    other = a.copy()
    other[1::2] = other[: len(other) - 1 : 2]
    return other


def _rolled(a):
    return np.roll(a, 1, axis=0)


NUMBER = {
    "more": lambda x: 1.7 * x + 0.01,
    "less": lambda x: 0.3 * x,
    "negated": lambda x: -x,
    "nothing": lambda x: 0.0,
}
WHOLE = {"more": lambda x: x + 1}
MARK = {"negated": lambda x: not x}
FLOATS = {"waves": _waves, "alike": _alike, "thinned": _thinned, "negated": np.negative, "rolled": _rolled}
ROWS = {"rolled": _rolled, "reversed": lambda a: a[::-1].copy(), "repeated": _repeated}
ORDERS = {"rolled": _rolled, "reversed": lambda a: a[::-1].copy()}
MARKS = {"negated": np.logical_not, "rolled": _rolled, "thinned": _thinned}
POINTS = {"waves": _waves, "negated": np.conj, "rolled": _rolled}
MATRIX = {"waves": lambda a: a._with_data(_waves(a.data)) if hasattr(a, "_with_data") else a}


def _changes(value) -> dict[str, Callable]:
    """Changes of a value by their names."""
    if isinstance(value, (bool, np.bool_)):
        return MARK
    if isinstance(value, (int, np.integer)) and not isinstance(value, Enum):
        return WHOLE
    if isinstance(value, (float, np.floating)):
        return NUMBER
    if sp.issparse(value) and value.dtype.kind == "f":
        return MATRIX
    if isinstance(value, np.ndarray) and value.ndim and value.size:
        # Where rows of something begin, and which row is which, goes to functions in C that trust it.
        if value.ndim == 1 and value.dtype.kind == "i":
            return {} if (np.diff(value) >= 0).all() else ORDERS
        return {"f": FLOATS, "i": ROWS, "b": MARKS, "c": POINTS}.get(value.dtype.kind, {})
    return {}


def asked(call: Call) -> list[tuple[tuple, str]]:
    """Ways and changes that are tried of a call."""
    found = list(places((call.args, call.kwargs)))
    if len(found) > MOST:
        found = random.Random(zlib.crc32(call.name.encode())).sample(found, MOST)
    return found


def outcome(call: Call, way: tuple = (), kind: str = "") -> np.ndarray:
    """Figures (2,) of what comes of a call with a change, or with none."""
    args, kwargs = copied((call.args, call.kwargs))
    if kind:
        args, kwargs = changed((args, kwargs), way, kind)
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = call.function(*args, **kwargs)
            if inspect.isgenerator(result):
                result = _last(result)
    except Exception as error:  # noqa: BLE001, which one it is counts
        return figures(told_leaves(error, errors=True))
    left = [result, args] if result is None else result
    return figures(told_leaves(left)) + 0.1 * figures(told_leaves(recorded_calls.opened([left])))


def _last(steps):
    while True:
        try:
            next(steps)
        except StopIteration as stop:
            return stop.value


def rows_of(name: str, calls: list[Call], kinds: set[str] | None = None) -> dict[str, np.ndarray]:
    """Figures of all that comes of the calls of a function with changes, by its name and that of the change; of some
    changes alone, if they are given."""
    rows: dict[str, np.ndarray] = {}
    for k, call in enumerate(calls):
        for way, kind in asked(call):
            if kinds is None or kind in kinds:
                key = f"{name}{CAME}{kind}"
                count = rows[key][0] if key in rows else 0.0
                own = np.array([1.0, *(outcome(call, way, kind) * (1 + 0.1 * count + 0.05 * k))])
                rows[key] = rows.get(key, np.zeros(3)) + own
    return rows


def kinds_in(lines: list[str]) -> dict[str, set[str]]:
    """Changes that lines of a table have, by names of functions."""
    kinds: dict[str, set[str]] = {}
    for line in lines:
        name, came, kind = line.partition("\t")[0].partition(CAME)
        if came:
            kinds.setdefault(name, set()).add(kind)
    return kinds


def rows_for(lines: list[str], calls: dict[str, list[Call]]) -> dict[str, np.ndarray]:
    """Rows of functions and changes that lines of a table have."""
    kinds = kinds_in(lines)
    return _in_other_processes(sorted(kinds), lambda name: rows_of(name, calls.get(name, []), kinds[name]), PATIENT)


def quick_rows(calls: dict[str, list[Call]]) -> dict[str, np.ndarray]:
    """Rows of all calls that are kept but for those that take long, break off Python itself or never end."""
    return _in_other_processes(sorted(calls), lambda name: _quick_rows(name, calls[name]), HUNG)


# What takes longer is not asked for while a table is written: seconds of a call as it was, and of a row.
SLOW = 0.01
LONG = 0.015
# Seconds after which a function never ends: while a table is written, and where those are known that do.
HUNG = 2.5
PATIENT = 120.0
# Functions that are asked for in a process before the next one begins.
BATCH = 60


def _quick_rows(name: str, calls: list[Call]) -> dict[str, np.ndarray]:
    """Rows of a function that do not take long."""
    rows: dict[str, np.ndarray] = {}
    begin = os.times().user
    for call in calls:
        outcome(call)
    if os.times().user - begin < SLOW * len(calls):
        for kind in sorted({kind for call in calls for _, kind in asked(call)} - UNSOUND):
            begin = os.times().user
            found = rows_of(name, calls, {kind})
            if os.times().user - begin < LONG:
                rows |= found
    return rows


def _in_other_processes(names: list[str], rows: Callable[[str], dict], seconds: float) -> dict[str, np.ndarray]:
    """Rows of names, found where nothing is lost if Python itself breaks off, as C may with numbers it trusts."""
    found: dict[str, np.ndarray] = {}
    while names:
        reading, writing = os.pipe()
        child = os.fork()
        if not child:
            _tell(names[:BATCH], rows, writing)
        os.close(writing)
        told = b""
        while select.select([reading], [], [], seconds)[0]:
            more = os.read(reading, 1 << 16)
            if not more:
                break
            told += more
        os.close(reading)
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        stream, count = io.BytesIO(told), 0
        while stream.tell() < len(told):
            found |= pickle.load(stream)
            count += 1
        # The next one is the one that did not come back.
        names = names[count + (count < BATCH) :]
    return found


def _tell(names: list[str], rows: Callable[[str], dict], writing: int) -> NoReturn:
    """Write the rows of names, in a process of its own, which ends here."""
    gc.disable()
    faulthandler.disable()
    # Places where nobody wrote hold the same each time.
    np.empty, np.empty_like = np.zeros, np.zeros_like
    try:
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        for name in names:
            os.write(writing, pickle.dumps(rows(name)))
    finally:
        os._exit(0)
