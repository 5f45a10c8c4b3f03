"""Laws of functions of meshes, from one call of each: how what comes of it goes with a mesh that is told otherwise.

Meshes are found among the arguments, and within objects that are given, by what stands there: places of vertices, and
triangles of these. Each law is told in a word for every array that comes of the call; what holds no law has none.
"""

from __future__ import annotations

import contextlib
import dataclasses
import inspect
import signal
import warnings
from collections.abc import Callable, Iterator
from typing import NoReturn

import numpy as np
import recorded_calls
from recorded_calls import Call, leaves

from omt_uv.solver.errors import MeshError
from omt_uv.solver.progress import drain

# Seconds of a call whose laws are asked for.
QUICK = 0.004
# Seconds after which a change to it is not asked for.
LONG = 0.1
# Fields and parameters that are places of vertices, in space or in the plane.
PLACES = {"positions", "vertices", "points", "V", "uv", "w", "sites", "sphere", "space", "reference", "p", "x"}
TURN = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
SMALL = 2.0**-30
LARGE = 2.0**30


def outcome(call: Call, change: Callable | None = None) -> list[np.ndarray] | str:
    """Arrays that a call returns, or leaves in what it was given; the name of the error by which it refuses."""
    args, kwargs = recorded_calls.copied((call.args, call.kwargs))
    if change is not None:
        args, kwargs = change(args, kwargs)
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore")
            result = inspect.unwrap(call.function)(*args, **kwargs)
            result = drain(result) if inspect.isgenerator(result) else result
    except MeshError as error:
        return type(error).__name__
    except Late:
        raise
    except Exception:  # noqa: BLE001, what was told wrongly breaks off anywhere, and there is no law
        return ""
    return [np.array(leaf) for leaf in leaves([result, args] if result is None else [result])]


def close(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two arrays are of one kind and shape, and hold the same up to rounding."""
    if a.shape != b.shape or a.dtype.kind != b.dtype.kind:
        return False
    if a.dtype.kind not in "fc":
        return np.array_equal(a, b)
    size = max(np.abs(b[np.isfinite(b)]).max(initial=0.0), 1e-300)
    return bool(np.allclose(a, b, rtol=1e-6, atol=1e-8 * size, equal_nan=True))


# ---- ways to tell a mesh ----------------------------------------------------------------------------------------


def _named(call: Call) -> Iterator[tuple[str, object]]:
    names = list(inspect.signature(inspect.unwrap(call.function)).parameters)
    for k, value in enumerate(call.args):
        yield names[k] if k < len(names) else "", value
    yield from call.kwargs.items()


def is_places(name: str, value) -> bool:
    """Whether a value is places of vertices, by its name and what it holds."""
    there = isinstance(value, np.ndarray) and value.dtype.kind in "fc" and len(value) > 3
    flat = there and value.ndim == 1 and value.dtype.kind == "c"
    return there and name in PLACES and (flat or (value.ndim == 2 and value.shape[1] in (2, 3)))


def sizes(call: Call) -> tuple[int, int] | None:
    """How many vertices and triangles the mesh has that a call is given as arrays; None if it has none, or if what
    counts by vertices and by triangles would not be told apart."""
    given = dict(_named(call))
    n = next((len(v) for k, v in given.items() if is_places(k, v)), 0)
    faces = next((v for k, v in given.items() if k in ("triangles", "F", "faces") and _is_triangles(v, n)), None)
    if faces is None or len({n, len(faces), 3 * len(faces)}) < 3:
        return None
    return n, len(faces)


def _is_triangles(value, n: int) -> bool:
    there = isinstance(value, np.ndarray) and value.dtype.kind == "i" and value.ndim == 2 and value.shape[1] == 3
    return there and len(value) > 0 and value.min() >= 0 and value.max() < n


def _each(change: Callable) -> Callable:
    """A change of every argument by itself."""
    return lambda args, kwargs: (tuple(map(change, args)), {k: change(v) for k, v in kwargs.items()})


def moved(call: Call, move: Callable) -> Callable:
    """A change of all that are places in space, also within objects."""
    names = [name for name, _ in _named(call)]

    def within(name: str, value):
        if is_places(name, value):
            return move(value)
        if dataclasses.is_dataclass(value) and not isinstance(value, type):
            for field in dataclasses.fields(value):
                item = getattr(value, field.name, None)
                other = within(field.name, item)
                if other is not item:
                    object.__setattr__(value, field.name, other)
        return value

    def change(args, kwargs):
        own = tuple(within(name, a) for name, a in zip(names, args, strict=False))
        return own, {k: within(k, v) for k, v in kwargs.items()}

    return change


def unused(n: int) -> Callable:
    """A change to a mesh with one vertex more, in the middle, that no triangle has."""

    def longer(a):
        if not isinstance(a, np.ndarray) or not a.ndim or len(a) != n:
            return a
        return np.concatenate([a, a.mean(axis=0, keepdims=True) if a.dtype.kind in "fc" else a[:1]])

    return _each(longer)


def twice(n: int, m: int) -> Callable:
    """A change to two of the mesh, one beside the other."""

    def both(a):
        if _is_triangles(a, n) and len(a) == m:
            return np.concatenate([a, a + n])
        return np.concatenate([a, a]) if isinstance(a, np.ndarray) and a.ndim and len(a) in (n, m, 3 * m) else a

    return _each(both)


def renumbered(n: int, m: int, order: np.ndarray) -> Callable:
    """A change to the same mesh with vertex order[k] as its vertex k."""
    number = np.argsort(order)

    def other(a):
        if _is_triangles(a, n) and len(a) == m:
            return number[a]
        return a[order] if isinstance(a, np.ndarray) and a.ndim and len(a) == n else a

    return _each(other)


def turned_over(n: int, m: int, mirror: bool) -> Callable:
    """A change to triangles that go the other way round, or to the mirror image."""

    def other(a):
        if not isinstance(a, np.ndarray) or not a.ndim:
            return a
        if _is_triangles(a, n) and len(a) == m:
            return a[:, ::-1].copy()
        if mirror and a.dtype.kind == "f" and a.ndim == 2 and len(a) == n and a.shape[1] in (2, 3):
            return a * ([-1.0, 1.0] + [1.0] * (a.shape[1] - 2))
        return a

    return _each(other)


# ---- what comes of it -------------------------------------------------------------------------------------------


def words(before: list, after, kinds: dict[str, Callable]) -> str | None:
    """The word of every array that comes of a call: the first of `kinds` that gives it from what it was."""
    if isinstance(after, str):
        return f"refused {after}" if after else None
    if len(after) != len(before):
        return None
    found = []
    for a, b in zip(before, after, strict=True):
        with np.errstate(all="ignore"):
            found.append(next((word for word, kind in kinds.items() if close(b, kind(a))), None))
    return None if None in found else " ".join(dict.fromkeys(found)) if found else None


def _same(a):
    return a


def _powers(factor: float) -> dict[str, Callable]:
    with_size = {k: (lambda a, k=k: a * factor**k if a.dtype.kind in "fc" else a) for k in (1, 2, -1, -2, 3, -3, 4, -4)}
    return {"0": _same} | {str(k): change for k, change in with_size.items()}


def _rows(a, n, order):
    return a[order] if a.ndim and len(a) == n else a


def _number(a, order):
    number = np.argsort(order)
    whole = a.dtype.kind == "i" and a.size and a.min() >= 0 and a.max() < len(order)
    return number[a] if whole else a


def _stacked(a, step):
    return np.concatenate([a, a + step]) if a.ndim and a.dtype.kind != "b" else np.concatenate([a, a]) if a.ndim else a


class Late(Exception):
    """A call takes too long with what was changed."""


def _late(*_) -> NoReturn:
    raise Late


@contextlib.contextmanager
def in_time(seconds: float) -> Iterator[None]:
    """A block that is broken off after so many seconds."""
    signal.signal(signal.SIGALRM, _late)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


def is_quick(call: Call) -> bool:
    """Whether the laws of a call are asked for."""
    try:
        with in_time(QUICK):
            outcome(call)
    except Late:
        return False
    return True


def all_that_hold(call: Call) -> dict[str, str]:
    """Words of the laws that hold for a call, without those that take long to be asked for."""
    found = {}
    for name in ways(call):
        try:
            with in_time(LONG):
                word = held(call, name)
        except Late:
            continue
        if word is not None:
            found[name] = word
    return found


def held(call: Call, name: str) -> str | None:
    """The word of a law that holds for a call, None if it does not."""
    before, way = outcome(call), ways(call).get(name)
    if way is None or isinstance(before, str) or not before:
        return None
    change, kinds, *fewer = way
    if recorded_calls.same(change(*recorded_calls.copied((call.args, call.kwargs))), (call.args, call.kwargs)):
        return None
    after = outcome(call, change)
    if fewer and not isinstance(after, str):
        after = [fewer[0](b) for b in after]
    return words(before, after, kinds)


def ways(call: Call) -> dict[str, tuple]:
    """Changes of what a call is given, by the names of the laws, and what may come of each array."""
    found: dict[str, tuple] = {}
    for name, factor in (("tiny", SMALL), ("huge", LARGE)):
        found[name] = moved(call, lambda a, f=factor: a * f), _powers(factor)
    for name, move in (
        ("turned", lambda a: a @ TURN.T if _in_space(a) else a),
        ("moved", lambda a: a + [0.5, -1.25, 2.0] if _in_space(a) else a),
    ):
        found[name] = moved(call, move), {"still": _same, "with it": move}
    return found if sizes(call) is None else found | _of_arrays(*sizes(call))


def _in_space(a) -> bool:
    return a.ndim == 2 and a.shape[1] == 3


def _of_arrays(n: int, m: int) -> dict[str, tuple]:
    """Ways to tell a mesh of n vertices and m triangles."""
    found: dict[str, tuple] = {}
    found["a loose vertex"] = unused(n), {"same": _same}, lambda b: b[:n] if b.ndim and len(b) == n + 1 else b
    twofold = {"same": _same, "both": lambda a: _stacked(a, 0), "both, n": lambda a: _stacked(a, n),
               "both, m": lambda a: _stacked(a, m), "sum": lambda a: 2 * a if a.dtype.kind != "b" else a,
               "both, 3m": lambda a: _stacked(a, 3 * m)}  # fmt: skip
    found["two of it"] = twice(n, m), twofold
    order = np.random.default_rng(n).permutation(n)
    by_order = {"same": _same, "rows": lambda a: _rows(a, n, order), "numbers": lambda a: _number(a, order),
                "rows of numbers": lambda a: _number(_rows(a, n, order), order)}  # fmt: skip
    found["vertices in another order"] = renumbered(n, m, order), by_order
    over = {"same": _same, "other sign": lambda a: -a if a.dtype.kind != "b" else a,
            "other way round": lambda a: a[:, ::-1] if a.ndim == 2 else a,
            "mirrored": lambda a: a * [-1, 1] if a.ndim == 2 and a.shape[1] == 2 and a.dtype.kind == "f" else a,
            "mirrored in space": lambda a: a * [-1, 1, 1] if _in_space(a) and a.dtype.kind == "f" else a}  # fmt: skip
    for name, mirror in (("turned over", False), ("mirrored", True)):
        found[name] = turned_over(n, m, mirror), over
    return found
