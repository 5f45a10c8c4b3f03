"""What every function and dataclass takes where nothing is given: a table keeps it, so that it changes on purpose."""

from __future__ import annotations

import dataclasses
import importlib
import inspect
from pathlib import Path

from kept import check, modules, plain

TABLE = Path(__file__).with_name("defaults.tsv")


def words(default):
    """A default as the table has it; of an object the name of its class, whose fields have lines of their own."""
    return plain(default) if isinstance(default, (bool, int, float, str, tuple, type(None))) else type(default).__name__


def says_something(default):
    nothing = (inspect.Parameter.empty, dataclasses.MISSING, None)
    return not any(default is value for value in nothing) and not (isinstance(default, (str, tuple)) and not default)


def functions(name, value):
    """Pairs of name and function of a function or a class, its methods then."""
    if inspect.isfunction(value):
        yield name, value
    elif inspect.isclass(value):
        for method, found in vars(value).items():
            function = getattr(found, "__func__", found)
            if inspect.isfunction(function) and not (dataclasses.is_dataclass(value) and method.startswith("__")):
                yield f"{name}.{method}", function


def rows(module, name, value):
    """A line of each field and of each parameter that need not be given."""
    if dataclasses.is_dataclass(value) and inspect.isclass(value):
        for field in dataclasses.fields(value):
            if field.name in vars(value).get("__annotations__", {}) and says_something(field.default):
                yield "\t".join([module, name, field.name, words(field.default)])
    for own, function in functions(name, value):
        for parameter in inspect.signature(function).parameters.values():
            if says_something(parameter.default):
                yield "\t".join([module, own, parameter.name, words(parameter.default)])


def test_what_is_taken_where_nothing_is_given_is_that_of_the_table():
    lines = []
    for module in modules():
        for name, value in sorted(vars(importlib.import_module(module)).items()):
            if getattr(value, "__module__", "") == module:
                lines += rows(module, name, value)
    assert len(lines) > 400
    check(TABLE, lines)
