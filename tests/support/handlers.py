"""Handlers of exceptions as the sources have them, each run by itself: which exceptions it takes, and what it does.

A `try` is cut out of its function and its body replaced by what the handler is there for. Names of exceptions are those
of the module; all else that the handler uses is a `Name`, which writes down what is done with it. So a handler says
what it does without what stands around it, and nothing is touched that it would write or end.
"""

from __future__ import annotations

import ast
import builtins
import functools
import importlib
import inspect
from collections.abc import Iterator
from typing import Any, NamedTuple

from kept import ROOT, modules
from sources import tree_of

# Names of builtins that do the same with a `Name` as with what it stands for.
SAME = {"str", "repr", "tuple", "list", "dict", "getattr", "True", "False", "None", "zip"}


class Handler(NamedTuple):
    """A handler: its module, the function around it, its place among those of the function, and its `try`."""

    module: str
    function: str
    place: int
    node: ast.ExceptHandler
    around: ast.Try


@functools.cache
def handlers() -> tuple[Handler, ...]:
    """All handlers of the package, by module and function."""
    return tuple(_found())


def _found() -> Iterator[Handler]:
    for module in modules():
        tree = tree_of(ROOT / f"{module.replace('.', '/')}.py")
        counts: dict[str, int] = {}
        for function, around in _tries(tree, ""):
            for node in around.handlers:
                counts[function] = counts.get(function, 0) + 1
                yield Handler(module, function, counts[function], node, around)


def _tries(node: ast.AST, function: str) -> Iterator[tuple[str, ast.Try]]:
    # Statements stand in these alone.
    held = (getattr(node, name, ()) for name in ("body", "cases", "handlers", "orelse", "finalbody"))
    for child in (each for inner in held if isinstance(inner, list) for each in inner):
        name = function
        if isinstance(child, ast.FunctionDef | ast.ClassDef):
            name = f"{function}.{child.name}".strip(".")
        if isinstance(child, ast.Try):
            yield name, child
        yield from _tries(child, name)


# ---- which exceptions it takes ----------------------------------------------------------------------------------


def named(node: ast.expr | None, module: str) -> tuple[type[BaseException], ...] | str:
    """The exceptions that stand behind `except`; the name where a function is given them."""
    if node is None:
        return (BaseException,)
    try:
        found = eval(compile(ast.Expression(node), module, "eval"), vars(importlib.import_module(module)))
    except NameError:
        return ast.unparse(node)
    return found if isinstance(found, tuple) else (found,)


def kind_of(kind: type) -> str:
    """An exception as a table has it: of the package with its module, of others with their first name."""
    own = kind.__module__.partition("omt_uv.")[2]
    first = kind.__module__.partition(".")[0].strip("_")
    return kind.__name__ if first == "builtins" else f"{own or first}.{kind.__name__}"


def taken(handler: Handler) -> str:
    """The widest exceptions for which a handler runs."""
    own = named(handler.node.type, handler.module)
    if isinstance(own, str):
        return own
    return " ".join(sorted(kind_of(k) for k in own if not any(k is not w and issubclass(k, w) for w in own)))


def in_vain(handler: Handler) -> list[str]:
    """Exceptions that a handler names, but are some of another of its own, or taken by one that is asked before."""
    own = named(handler.node.type, handler.module)
    if isinstance(own, str):
        return []
    before = [named(other.type, handler.module) for other in handler.around.handlers]
    before = before[: handler.around.handlers.index(handler.node)]
    wider = [k for kinds in before if not isinstance(kinds, str) for k in kinds]
    return [kind_of(k) for k in own if any(k is not w and issubclass(k, w) for w in own) or issubclass(k, tuple(wider))]


# ---- what it does then ------------------------------------------------------------------------------------------


class Told(Exception):
    """What a handler raises, in its words."""


class Name:
    """Stands for whatever a handler uses, and says what is done with it; whatever is asked of it holds, or does not."""

    def __init__(self, said: str, log: list[str], holds: bool) -> None:
        self.__dict__.update(_said=said, _log=log, _holds=holds)

    def _then(self, more: str) -> Name:
        return Name(f"{self._said}{more}", self._log, self._holds)

    def __getattr__(self, name):
        if name.startswith("__") and name != "__name__":
            raise AttributeError(name)
        return self._then(f".{name}")

    def __setattr__(self, name, value):
        self._log.append(f"{self._said}.{name} = {value!r}")

    def __setitem__(self, key, value):
        self._log.append(f"{self._said}[{key!r}] = {value!r}")

    def __getitem__(self, key):
        return self._then(f"[{key!r}]")

    def __call__(self, *given, **named):
        return self._then(f"({', '.join([*map(repr, given), *(f'{k}={v!r}' for k, v in named.items())])})")

    def __enter__(self):
        return self._then(" within it")

    def __exit__(self, *_):
        return False

    def __iter__(self):
        return iter([self._then("[each]")])

    def __bool__(self):
        self._log.append(f"{self._said} is {self._holds}")
        return self._holds

    def __contains__(self, key):
        self._log.append(f"{key!r} in {self._said} is {self._holds}")
        return self._holds

    def __format__(self, spec):
        return f"<{self._said}:{spec}>" if spec else f"<{self._said}>"

    def __repr__(self):
        return f"<{self._said}>"

    __str__ = __repr__
    __hash__ = object.__hash__

    def __len__(self):
        return 1

    def __neg__(self):
        return Name(f"-{self._said}", self._log, self._holds)


def _with_another(sign):
    def before(self, other):
        return Name(f"({self._said} {sign} {other!r})", self._log, self._holds)

    def behind(self, other):
        return Name(f"({other!r} {sign} {self._said})", self._log, self._holds)

    return before, behind


for _word, _sign in {"add": "+", "sub": "-", "mul": "*", "truediv": "/", "or": "|", "and": "&", "matmul": "@"}.items():
    for _name, _function in zip((f"__{_word}__", f"__r{_word}__"), _with_another(_sign), strict=True):
        setattr(Name, _name, _function)
for _word, _sign in {"lt": "<", "le": "<=", "gt": ">", "ge": ">=", "eq": "==", "ne": "!="}.items():
    setattr(Name, f"__{_word}__", _with_another(_sign)[0])


class Cause(Exception):
    """What happens, with whatever a handler asks of it."""

    def __init__(self, log: list[str], holds: bool) -> None:
        self.__dict__["_name"] = Name("cause", log, holds)

    def __getattr__(self, name):
        return getattr(self.__dict__["_name"], name)

    def __repr__(self):
        return "<cause>"

    __str__ = __repr__


class _Telling(ast.NodeTransformer):
    """What is raised is told with all that it is given, and names are taken apart and put together as asked for."""

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        self.generic_visit(node)
        if node.exc is None:
            return node
        kind, given, named = "", [node.exc], []
        if isinstance(node.exc, ast.Call):
            kind, given, named = ast.unparse(node.exc.func), node.exc.args, node.exc.keywords
        cause = [ast.keyword("cause", node.cause)] if node.cause else []
        return ast.Raise(_call("_told", ast.Constant(kind), *given, named=[*named, *cause]), None)

    def visit_Expr(self, node: ast.Expr) -> ast.AST:
        self.generic_visit(node)
        return node if isinstance(node.value, ast.Yield | ast.YieldFrom) else ast.Expr(_call("_done", node.value))

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if (
            isinstance(node.func, ast.Attribute)
            and node.func.attr == "join"
            and isinstance(node.func.value, ast.Constant)
        ):
            return _call("_joined", node.func.value, *node.args)
        return node

    def visit_YieldFrom(self, node: ast.YieldFrom) -> ast.AST:
        self.generic_visit(node)
        return ast.YieldFrom(_call("_steps", node.value))

    def visit_Assign(self, node: ast.Assign) -> ast.AST:
        self.generic_visit(node)
        if isinstance(node.targets[0], ast.Tuple) and not isinstance(node.value, ast.Tuple):
            node.value = _call("_part", node.value, ast.Constant(_shape(node.targets[0])))
        return node

    def _in_parts(self, node):
        self.generic_visit(node)
        if isinstance(node.target, ast.Tuple):
            node.iter = _call("_parts", node.iter, ast.Constant(_shape(node.target)))
        return node

    visit_For = visit_comprehension = _in_parts


def _call(name: str, *given: ast.expr, named=()) -> ast.Call:
    return ast.Call(ast.Name(name, ast.Load()), list(given), list(named))


def _told(kind, /, *given, **named):
    return Told(f"raises {kind}({', '.join([*map(repr, given), *(f'{k}={v!r}' for k, v in named.items())])})")


def _joined(between, texts):
    return between.join(map(str, texts))


def _steps(name):
    yield name
    return name


def _shape(target: ast.expr):
    return tuple(map(_shape, target.elts)) if isinstance(target, ast.Tuple) else None


def _parts(names, shape):
    return [_part(name, shape) for name in names]


def _part(name, shape):
    return name if shape is None else [_part(name[k], inner) for k, inner in enumerate(shape)]


AROUND = """
def way():
    for turn_ in (0, 1):
        if turn_:
            return "goes on with the next"
        try:
            raise _cause
        except BaseException:
            pass
        return dict(locals())
    return "breaks off"
"""
HELPERS = {"_told": _told, "_joined": _joined, "_steps": _steps, "_part": _part, "_parts": _parts}


def does(handler: Handler, holds: bool) -> str:
    """What a handler does when what it is there for happens, and whatever it asks then holds or does not."""
    way = ast.parse(AROUND)
    (cut_out,) = (node for node in ast.walk(way) if isinstance(node, ast.Try))
    # Unparsed: what is changed here is none of what other tests read.
    (copied,) = (n for n in ast.walk(ast.parse(f"try: pass\n{ast.unparse(handler.node)}")) if isinstance(n, ast.Try))
    body = [_Telling().visit(node) for node in copied.handlers[0].body]
    cut_out.handlers[0].name, cut_out.handlers[0].body = handler.node.name, body
    log: list[str] = []
    space: dict[str, Any] = {**HELPERS, "_done": lambda found: log.append(str(found)), "_cause": Cause(log, holds)}
    names = [n for node in body for n in ast.walk(node) if isinstance(n, ast.Name)]
    stored = sorted({n.id for n in names if isinstance(n.ctx, ast.Store)} - {handler.node.name})
    for name in {n.id for n in names} - {*space, *SAME, handler.node.name}:
        space[name] = _meant(name, handler, log, holds)
    (function,) = way.body
    assert isinstance(function, ast.FunctionDef)
    function.args.args = [ast.arg(name) for name in stored]
    exec(compile(ast.fix_missing_locations(way), handler.module, "exec"), space)
    given = {name: space[name] for name in stored}
    end = _end(space["way"], given, log, handler.node.name)
    return "; ".join([*log, end])


def _meant(name: str, handler: Handler, log: list[str], holds: bool):
    """What a name stands for: an exception, or a `Name`."""
    found = vars(importlib.import_module(handler.module)).get(name, getattr(builtins, name, None))
    if inspect.isclass(found) and issubclass(found, BaseException):
        return found
    return Name(name, log, holds)


def _end(way, given: dict, log: list[str], caught: str | None) -> str:
    """How a handler ends, after what it has told: `log` grows while it is run."""
    try:
        found = way(**given)
        if inspect.isgenerator(found):
            found = _drained(found, log)
    except Told as told:
        return str(told)
    except Cause:
        return "raises it again"
    if isinstance(found, dict) and "turn_" in found:
        kept = {k: v for k, v in found.items() if k not in ("turn_", caught) and v is not given.get(k)}
        return ", ".join(["goes on", *(f"{k} = {v!r}" for k, v in kept.items())])
    return (
        found if isinstance(found, str) and found in ("goes on with the next", "breaks off") else f"returns {found!r}"
    )


def _drained(steps, log: list[str]):
    while True:
        try:
            log.append(f"yields {next(steps)!r}")
        except StopIteration as stop:
            return stop.value
