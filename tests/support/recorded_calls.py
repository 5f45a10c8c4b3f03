"""What public functions are called with: the first calls of each in a run, so that each may be called again alone."""

from __future__ import annotations

import copy
import dataclasses
import functools
import importlib
import inspect
import pkgutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

import numpy as np
import scipy.sparse as sp

from omt_uv import solver

LARGEST = 400_000


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


def _public(module) -> Iterator[tuple[str, Any, str, Callable]]:
    """Names, owners, attributes and functions of a module: public functions, and public methods of its classes."""
    short = module.__name__.removeprefix(solver.__name__ + ".")
    for name, value in sorted(vars(module).items()):
        if getattr(value, "__module__", "") != module.__name__ or name.startswith("_"):
            continue
        if inspect.isfunction(value):
            yield f"{short}.{name}", None, name, value
        elif inspect.isclass(value):
            for method, found in sorted(vars(value).items()):
                if inspect.isfunction(found) and (not method.startswith("_") or method == "__call__"):
                    yield f"{short}.{name}.{method}", value, method, found


class Record:
    """The first call of every function in each run, what came of it, and in which calls arguments were changed."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.calls: dict[str, list[Call]] = {}
        self.found: dict[str, list[list[np.ndarray]]] = {}
        self.changed: dict[str, Callable] = {}
        self._in_this_run: set[str] = set()

    def next_run(self) -> None:
        """From here on every function may be kept once more."""
        self._in_this_run = set()

    def begin(self, name: str, function: Callable, args: tuple, kwargs: dict) -> Call | None:
        """A call that begins; None if it is not kept."""
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
        """Keep what came of a call; a method may change what it belongs to, and nothing else."""
        if call is None:
            return
        is_changed = not same((call.args[is_method:], call.kwargs), (args[is_method:], kwargs))
        if is_changed:
            self.changed[call.name] = call.function
        if not inspect.isgenerator(result):
            told = [result, args] if is_changed or result is None else [result]
            self.found.setdefault(call.name, []).append([np.array(leaf) for leaf in leaves(told)])


def _watched(record: Record, name: str, function: Callable, is_method: bool) -> Callable:
    if inspect.isgeneratorfunction(function):

        @functools.wraps(function)
        def steps(*args, **kwargs):
            call = record.begin(name, function, args, kwargs)
            found = yield from function(*args, **kwargs)
            record.end(call, args, kwargs, found, is_method)
            return found

        return steps

    @functools.wraps(function)
    def plain(*args, **kwargs):
        call = record.begin(name, function, args, kwargs)
        found = function(*args, **kwargs)
        record.end(call, args, kwargs, found, is_method)
        return found

    return plain


def forget() -> None:
    """Empty the caches of the solver: what other tests have called is called again."""
    for module in modules():
        for value in vars(module).values():
            if hasattr(value, "cache_clear"):
                value.cache_clear()


@contextmanager
def recorded(most: int = 1) -> Iterator[Record]:
    """A context in which the first calls of every public function and method of the solver are kept."""
    record, everything, before = Record(most), modules(), []
    watched = {}
    forget()
    for module in everything:
        for name, owner, attribute, function in _public(module):
            if owner is None:
                watched[function] = _watched(record, name, function, False)
            else:
                before.append((owner, attribute, function))
                setattr(owner, attribute, _watched(record, name, function, True))
    for module in [*everything, solver]:
        for attribute, value in list(vars(module).items()):
            if inspect.isfunction(value) and value in watched:
                before.append((module, attribute, value))
                setattr(module, attribute, watched[value])
    try:
        yield record
    finally:
        for owner, attribute, value in before:
            setattr(owner, attribute, value)


def names_of(module) -> list[str]:
    """Names of the public functions and methods of a module."""
    return [name for name, *_ in _public(module)]
