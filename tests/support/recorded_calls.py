"""What public functions are called with: the first calls of each in a run, so that each may be called again alone."""

from __future__ import annotations

import argparse
import copy
import dataclasses
import functools
import importlib
import inspect
import itertools
import math
import os
import pkgutil
import re
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

import omt_uv
from omt_uv import solver

LARGEST = 400_000
SAMPLED = 20_000
# What is larger stands for infinite.
HUGE = 1e100
# How truth values, whole and complex numbers count beside others, so that one in place of another shows.
KINDS = {"b": 0.11, "i": 0.07, "u": 0.17, "c": 0.05}
# So far objects in objects are looked into.
DEEP = 5
# What most values are.
PLAIN = {float, int, bool, np.ndarray}
# What Blender calls by itself, and counts the arguments of.
CALLED_BY_BLENDER = {"cancel", "check", "description", "draw", "execute", "invoke", "modal", "poll", "draw_header",
                     "draw_header_preset"}  # fmt: skip
# Numbers in texts, and paths, which differ from machine to machine.
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")
PATH = re.compile(r"\S*/\S*")
# Where a line of a source stands, which any change above it moves.
LINE = re.compile(r"(?<=/ line )\d+")
# The size of a file, which for a .blend differs from run to run, and when it was written, in nanoseconds.
WRITTEN = re.compile(r"\b\d+ \d{19}\b")


class Call(NamedTuple):
    """A call as it was before the function had run: its arguments are copies."""

    name: str
    function: Callable
    args: tuple
    kwargs: dict


def copied(value):
    """A copy in which nothing is shared with what was there."""
    return copy.deepcopy(value)


def leaves(value, depth: int = 0) -> Iterator[np.ndarray]:
    """Arrays and numbers in a value, in the order of its fields; what a class keeps for itself is left out."""
    if isinstance(value, (bool, int, float, complex, np.ndarray, np.generic)):
        yield np.asarray(value)
    elif sp.issparse(value):
        whole = value.tocoo()
        whole.sum_duplicates()
        yield from (whole.row, whole.col, whole.data)
    elif isinstance(value, (tuple, list)) and depth < 6:
        yield np.asarray(len(value))
        for item in value:
            yield from leaves(item, depth + 1)
    elif isinstance(value, dict) and depth < 6:
        for item in value.values():
            yield from leaves(item, depth + 1)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type) and depth < 6:
        for field in dataclasses.fields(value):
            if not field.name.startswith("_") and field.name != "seconds":
                yield from leaves(getattr(value, field.name), depth + 1)


def told_leaves(value, depth: int = 0, errors: bool = False) -> Iterator[np.ndarray]:
    """Leaves as above of what is told as well: the letters of texts without paths, and the numbers in them;
    those of errors, too, if asked for."""
    if type(value) in PLAIN:
        yield np.asarray(value)
        return
    if isinstance(value, Enum):
        value = value.value
    if errors and isinstance(value, BaseException):
        # What others say differs from version to version.
        own = type(value).__module__.startswith(omt_uv.__name__) and value.__cause__ is None
        value = f"{type(value).__name__}: {value if own else ''}"
    elif isinstance(value, argparse.Namespace):
        value = vars(value)
    if value is None or isinstance(value, Path):
        yield np.asarray(-1.0)
    elif isinstance(value, str):
        text = WRITTEN.sub("#", LINE.sub("#", PATH.sub("/", value)))
        yield np.frombuffer(NUMBER.sub("#", text).encode(), np.uint8).astype(float)
        yield np.array([float(word) for word in NUMBER.findall(text)])
    elif isinstance(value, (bytes, bytearray)):
        yield np.frombuffer(value, np.uint8).astype(float)
    elif isinstance(value, (tuple, list, set, frozenset)) and depth < 6:
        yield np.asarray(len(value))
        for item in sorted(value, key=repr) if isinstance(value, (set, frozenset)) else value:
            yield from told_leaves(item, depth + 1, errors)
    elif isinstance(value, dict) and depth < 6:
        for key, item in value.items():
            if key != "seconds":
                yield from told_leaves([key, item], depth + 1, errors)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type) and depth < 6:
        for field in dataclasses.fields(value):
            if not field.name.startswith("_") and field.name != "seconds":
                yield from told_leaves(getattr(value, field.name), depth + 1, errors)
    else:
        yield from leaves(value, depth)


def opened(value, depth: int = 0):
    """A value in which objects, and what dataclasses keep for themselves, stand as all that they hold; None if there
    is neither."""
    if isinstance(value, (tuple, list, dict)) and depth < DEEP:
        items = value.values() if isinstance(value, dict) else value
        inside = [opened(item, depth + 1) for item in items]
        return inside if any(item is not None for item in inside) else None
    if isinstance(value, (type, Enum)) or not type(value).__module__.startswith(omt_uv.__name__) or depth == DEEP:
        return None
    all_held = getattr(value, "__dict__", {}).items()
    if dataclasses.is_dataclass(value):
        own = {key: item for key, item in all_held if key.startswith("_")}
        further = opened([item for key, item in all_held if not key.startswith("_")], depth + 1)
        return [own, further] if own or further else None
    return {key: [item, opened(item, depth + 1)] for key, item in all_held if key != "seconds"}


def figures(found) -> np.ndarray:
    """Two figures of arrays: of their sizes, shapes and kinds of numbers, and of where in them what lies."""
    size = place = 0.0
    for k, leaf in enumerate(found):
        # Most are single numbers.
        single = not leaf.ndim and leaf.dtype.kind in "fiub"
        count, total, along = (_single if single else _several)(leaf, 0.61 * k)
        own = 1 + 0.5 * math.sin(k)
        size += own * (math.log(total) if total > 1e-12 else 0.0) + 0.01 * count + _kind(leaf)
        place += own * along / total if total > 1e-12 else 0.0
    return np.array([size, place])


def _single(leaf: np.ndarray, turn: float) -> tuple[int, float, float]:
    """As `_several` of a single number."""
    value = float(leaf)
    value = 7.0 if math.isnan(value) else value if abs(value) < HUGE else math.copysign(9.0, value)
    return 1, abs(value), math.cos(0.3 + turn) * value


def _several(leaf: np.ndarray, turn: float) -> tuple[int, float, float]:
    """How many numbers stand for an array, the sum of their sizes, and that of the numbers by where they stand."""
    x = _fewer(leaf)
    if x.dtype.kind == "c":
        x = np.concatenate([x.real, x.imag])
    # Faster than `sum`, and most arrays are short.
    total = float(np.add.reduce(np.abs(x)))
    if not total < HUGE:
        x = np.nan_to_num(x, nan=7.0, posinf=9.0, neginf=-9.0)
        # What stands for infinite would leave nothing of all else.
        x = np.where(np.abs(x) < HUGE, x, 9.0 * np.sign(x))
        total = float(np.add.reduce(np.abs(x)))
    even, odd = (_waves()[:, : len(x)] @ x).tolist()
    return len(x), total, math.cos(turn) * even - math.sin(turn) * odd


@functools.cache
def _waves() -> np.ndarray:
    """Cosine and sine by which numbers count where they stand."""
    angle = 0.3 + 1.7 * np.arange(2 * SAMPLED)
    return np.stack([np.cos(angle), np.sin(angle)])


def _fewer(leaf: np.ndarray) -> np.ndarray:
    """The numbers of an array in a row; of many, as of a picture, sums of some each."""
    flat = leaf.ravel()
    if flat.dtype.char not in "dD" or not flat.dtype.isnative:
        flat = flat.astype(complex if flat.dtype.kind == "c" else float)
    many = 1 + flat.size // SAMPLED
    if many == 1:
        return flat
    # To look for what is no number takes a fifth of the time of putting others there.
    finite = flat if np.isfinite(flat).all() else np.nan_to_num(flat)
    with np.errstate(over="ignore"):
        return np.add.reduceat(finite, np.arange(0, flat.size, many))


def _kind(leaf: np.ndarray) -> float:
    """A figure of the kind of numbers that an array holds, and of its shape: 0 for a row of numbers of full length."""
    kind = KINDS.get(leaf.dtype.kind, 0.23 * (leaf.dtype.char == "f" and leaf.dtype.isnative))
    return kind + sum(0.03 * axis * n for axis, n in enumerate(leaf.shape)) if leaf.ndim > 1 else kind


def same(a, b) -> bool:
    """Whether two values hold the same numbers, bit for bit."""
    left, right = list(leaves(a)), list(leaves(b))
    return len(left) == len(right) and all(
        x.dtype == y.dtype and x.shape == y.shape and x.tobytes() == y.tobytes() if x.dtype != object else True
        for x, y in zip(left, right, strict=True)
    )


def modules() -> list:
    """All modules of the solver, imported."""
    names = [m.name for m in pkgutil.walk_packages(solver.__path__, solver.__name__ + ".")]
    return [importlib.import_module(name) for name in sorted(names)]


def front_modules() -> list:
    """All modules of the package but those of the solver, imported."""
    names = [m.name for m in pkgutil.walk_packages(omt_uv.__path__, omt_uv.__name__ + ".")]
    return [
        importlib.import_module(name)
        for name in sorted(names)
        if not f"{name}.".startswith(f"{solver.__name__}.") and not name.endswith("__main__")
    ]


def _public(module, private: bool = False) -> Iterator[tuple[str, Any, str, Callable]]:
    """Names, owners, attributes and functions of a module: public functions, and public methods of its classes;
    private ones, too, if asked for, but for those that Python calls by itself."""
    short = module.__name__.removeprefix(solver.__name__ + ".").removeprefix(omt_uv.__name__ + ".")
    for name, value in sorted(vars(module).items()):
        if getattr(value, "__module__", "") != module.__name__ or (name.startswith("_") and not private):
            continue
        if inspect.isfunction(value):
            yield f"{short}.{name}", None, name, value
        elif inspect.isclass(value):
            for method, found in sorted(vars(value).items()):
                if method in CALLED_BY_BLENDER:
                    continue
                told = not method.startswith("__") if private else not method.startswith("_")
                if inspect.isfunction(found) and (told or method == "__call__"):
                    yield f"{short}.{name}.{method}", value, method, found


def _held(module) -> Iterator[tuple[str, type, str, Any, Callable, Callable]]:
    """Of what classes of a module compute when it is asked for, of their functions that need no object, and of how
    their objects begin: names, owners, attributes, what stands there, functions, and what makes such of a function."""
    short = module.__name__.removeprefix(solver.__name__ + ".").removeprefix(omt_uv.__name__ + ".")
    for name, owner in sorted(vars(module).items()):
        if not inspect.isclass(owner) or owner.__module__ != module.__name__:
            continue
        for attribute, found in sorted(vars(owner).items()):
            if isinstance(found, property) and found.fget is not None:
                function, made = found.fget, found.getter
            elif isinstance(found, functools.cached_property):
                function, made = found.func, functools.partial(_cached_again, owner, attribute)
            elif isinstance(found, (staticmethod, classmethod)):
                function, made = found.__func__, type(found)
            elif attribute in ("__init__", "__post_init__") and inspect.isfunction(found):
                function, made = found, _as_it_is
            else:
                continue
            if getattr(function, "__code__", None) and function.__code__.co_filename == module.__file__:
                yield f"{short}.{name}.{attribute}", owner, attribute, found, function, made


def _cached_again(owner: type, attribute: str, function: Callable) -> functools.cached_property:
    made = functools.cached_property(function)
    made.__set_name__(owner, attribute)
    return made


def _as_it_is(function: Callable) -> Callable:
    return function


class Record:
    """The first call of every function in each run, in which calls arguments were changed, and figures of all."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.calls: dict[str, list[Call]] = {}
        self.changed: dict[str, Callable] = {}
        self.told: dict[str, np.ndarray] = {}
        self._in_this_run: set[str] = set()

    def next_run(self) -> None:
        """From here on every function may be kept once more."""
        self._in_this_run = set()

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        """A call that begins; None if it is not kept, and then nothing is heard of it."""
        if name in self._in_this_run or len(self.calls.get(name, ())) >= self.most:
            return None
        self._in_this_run.add(name)
        if sum(leaf.nbytes for leaf in leaves((args, kwargs))) > LARGEST:
            return None
        try:
            call = Call(name, function, *copied((args, kwargs)))
        except (TypeError, NotImplementedError, ValueError):
            return None
        self.calls.setdefault(name, []).append(call)
        return call

    def end(self, call: Call | None, args: tuple, kwargs: dict, result, is_method: bool) -> None:
        """Keep whether a call changed its arguments; a method may change what it belongs to, and nothing else."""
        if call is not None and not same((call.args[is_method:], call.kwargs), (args[is_method:], kwargs)):
            self.changed[call.name] = call.function

    def way(self, call: Call | None, value, k: int) -> None:
        """What a call tells before its end, and why it breaks off, is not kept."""


# So many calls of a function in a run are looked into for what objects hold then.
OPENED = 2
# What stands behind names of what is left in objects.
KEPT = " kept"


class Told(Record):
    """Figures of what comes of the first calls of every function in each run, and how many there are; of what objects
    hold then as well, if they are to be opened."""

    errors = False

    def __init__(self, most: int, open: bool = False) -> None:
        super().__init__(most)
        self.open = open
        self.figures: dict[str, np.ndarray] = {}
        self._calls: dict[str, int] = {}
        self._mark = ""

    def next_run(self, mark: str = "") -> None:
        """From here on calls are counted anew, and figures are those of a function with this mark behind its name."""
        self._calls, self._mark = {}, mark

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        """A call that begins; None if it is not counted."""
        k = self._calls[name] = self._calls.get(name, 0) + 1
        return Call(name, function, (k,), {}) if k <= self.most else None

    def end(self, call: Call | None, args: tuple, kwargs: dict, result, is_method: bool) -> None:
        """Add the figures of what came of a call."""
        if call is not None and not inspect.isgenerator(result):
            left = [result, args] if result is None or is_method else [result]
            self.add(call.name + self._mark, [result, args] if result is None else result, call.args[0])
            kept = opened(left) if self.open and call.args[0] <= OPENED else None
            if kept is not None:
                self.add(call.name + self._mark + KEPT, kept, call.args[0])

    def add(self, name: str, value, k: int = 1) -> None:
        """Add the figures of a value to those of a name."""
        found = figures(told_leaves(value, errors=self.errors))
        own = np.array([1.0, *found]) * (1 + 0.1 * (k - 1))
        self.figures[name] = self.figures.get(name, np.zeros(3)) + own


# What stands behind names of what is given, and of what is told before the end.
GIVEN = " given"
ON_THE_WAY = " on the way"
# So much of the way is counted.
STEPS = 60


class Within(Told):
    """As `Told`, and what every function is given, what it tells on the way, and why it refuses."""

    errors = True

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        """A call that begins: what it is given is counted; None if nothing is."""
        call = super().begin(name, function, args, kwargs)
        if call is not None:
            self.add(name + self._mark + GIVEN, [args, kwargs], call.args[0])
        return call

    def way(self, call: Call | None, value, k: int) -> None:
        """Add the figures of what a call tells before its end, or of the error by which it ends."""
        if call is not None and k <= STEPS:
            self.add(call.name + self._mark + ON_THE_WAY, value, call.args[0] + k)


# How exact figures are told to be, at best and at worst.
EXACT = 1e-6
LOOSE = 1e-2


def apart(one: np.ndarray, other: np.ndarray) -> float:
    """How far two triples of figures are apart, relative to what is larger than one."""
    return float((np.abs(one - other) / np.maximum(1, np.abs(other))).max())


def lines_of(rows: dict[str, np.ndarray], others: list[dict[str, np.ndarray]]) -> Iterator[str]:
    """Lines of a table of figures, each with how exact it is: ten times as much as others, of nearly the same input,
    are off; without those that the last bits of the input decide."""
    for name, row in sorted(rows.items()):
        off = max((apart(other[name], row) if name in other else np.inf for other in others), default=0.0)
        exact = max(EXACT, 10.0 ** np.ceil(np.log10(max(10 * off, 1e-12))))
        if exact <= LOOSE:
            yield "\t".join([name, f"{exact:.0e}", *(f"{x:.7g}" if x % 1 else f"{x:.0f}" for x in row)])


def unlike(lines: list[str], rows: dict[str, np.ndarray]) -> Iterator[str]:
    """Those lines of a table of figures that are not those of rows."""
    for line in lines:
        name, exact, *values = line.split("\t")
        if name not in rows or apart(rows[name], np.array(values, float)) > float(exact) + EXACT:
            yield line


def hold(table: Path, rows: dict[str, np.ndarray]) -> None:
    """Rows are those of a table; with OMT_UV_ACCEPT=fewer those that are not are left out of it."""
    lines = table.read_text().splitlines()
    other = list(unlike(lines, rows))
    if os.environ.get("OMT_UV_ACCEPT") == "fewer":
        table.write_text("".join(f"{line}\n" for line in lines if line not in other))
        return
    now = [f"{line} is now {rows.get(line.split(chr(9))[0])}" for line in other]
    assert not other, "\n".join([*now, "OMT_UV_ACCEPT=1 accepts this"])


def _listened(record: Record, call: Call | None, steps: Generator) -> Generator:
    """The same steps, of which a record hears."""
    resume = functools.partial(next, steps)
    for k in itertools.count():
        try:
            step = resume()
        except StopIteration as stop:
            return stop.value
        except Exception as error:
            record.way(call, error, k)
            raise
        record.way(call, step, k)
        try:
            resume = functools.partial(steps.send, (yield step))
        except GeneratorExit:
            steps.close()
            raise
        except BaseException as error:  # noqa: BLE001, whatever comes goes on to them
            resume = functools.partial(steps.throw, error)


def _watched(record: Record, name: str, function: Callable, is_method: bool) -> Callable:
    if inspect.isgeneratorfunction(function):

        @functools.wraps(function)
        def steps(*args, **kwargs):
            call = record.begin(name, function, args, kwargs)
            if call is None:
                return (yield from function(*args, **kwargs))
            found = yield from _listened(record, call, function(*args, **kwargs))
            record.end(call, args, kwargs, found, is_method)
            return found

        return steps

    @functools.wraps(function)
    def plain(*args, **kwargs):
        call = record.begin(name, function, args, kwargs)
        if call is None:
            return function(*args, **kwargs)
        try:
            found = function(*args, **kwargs)
        except Exception as error:
            record.way(call, error, 0)
            raise
        record.end(call, args, kwargs, found, is_method)
        return found

    return plain


def forget(everything: list) -> None:
    """Empty the caches of modules: what other tests have called is called again."""
    for module in everything:
        for value in vars(module).values():
            if hasattr(value, "cache_clear"):
                value.cache_clear()


@contextmanager
def recorded(most: int = 1) -> Iterator[Record]:
    """A context in which the first calls of every public function and method of the solver are kept."""
    record = Record(most)
    with watching(record, [*modules(), solver]):
        yield record


@contextmanager
def watching(
    record: Record, everything: list, private: bool = False, callers: tuple = (), held: bool = False
) -> Iterator[None]:
    """A context in which a record hears of all calls of public functions and methods of modules, or of private ones,
    too, or of what classes compute when asked, by each other and by other modules, `callers`."""
    before, watched = [], {}
    forget(everything)
    for module in everything:
        for name, owner, attribute, function in _public(module, private):
            if owner is None:
                watched[function] = _watched(record, name, function, False)
            else:
                before.append((owner, attribute, function))
                setattr(owner, attribute, _watched(record, name, function, True))
        for name, owner, attribute, there, function, made in _held(module) if held else ():
            before.append((owner, attribute, there))
            setattr(owner, attribute, made(_watched(record, name, function, not isinstance(there, staticmethod))))
    for module in [*everything, *callers]:
        for attribute, value in list(vars(module).items()):
            if _is_one_of(value, watched):
                before.append((module, attribute, value))
                setattr(module, attribute, watched[value])
    tables = [value for module in everything * private for value in vars(module).values() if type(value) is dict]
    kept = [(table, key, value) for table in tables for key, value in table.items() if _is_one_of(value, watched)]
    for table, key, value in kept:
        table[key] = watched[value]
    try:
        yield
    finally:
        for owner, attribute, value in before:
            setattr(owner, attribute, value)
        for table, key, value in kept:
            table[key] = value


def _is_one_of(value, watched: dict) -> bool:
    return inspect.isfunction(value) and value in watched


def names_of(module) -> list[str]:
    """Names of the public functions and methods of a module."""
    return [name for name, *_ in _public(module)]
