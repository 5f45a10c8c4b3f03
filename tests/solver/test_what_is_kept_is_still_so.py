"""What was found once and is kept is what would be found now, whenever it is asked for again.

Nothing that it was found from may have changed meanwhile, and nobody who was given it may have written into it.
"""

from __future__ import annotations

import functools

import pytest
import recorded_calls
import solver_runs
from recorded_calls import same

# What tells of the machine alone.
OF_THE_MACHINE = ("blas_threads", "freed_memory")
# Of a search: begun empty, and filled by it.
FILLED = {f"ShearSearch.{name}" for name in ("memory", "models", "rehearsals", "borders", "thinned")}
# Runs that ask for what is kept, and take little time.
RUNS = ("unwrapped", "bodies_cut_open", "magnified", "new_meshes", "in_contact", "moved_by_flows", "matched")


class KeptProperty:
    """In the place of a `cached_property`: finds it anew each time that the count of times is a power of two."""

    def __init__(self, kept: functools.cached_property):
        self.find, self.name, self.stale, self.asked = kept.func, kept.attrname, [], 0

    def __get__(self, owner, kind=None):
        if owner is None:
            return self
        values, times = vars(owner), f"times of {self.name}"
        values[times] = values.get(times, 0) + 1
        if self.name not in values:
            values[self.name] = self.find(owner)
        elif values[times].bit_count() == 1:
            self.asked += 1
            if not same(values[self.name], self.find(owner)):
                self.stale.append(type(owner).__name__)
        return values[self.name]

    def __set__(self, owner, value):
        vars(owner)[self.name] = value


def of_modules():
    """Classes and functions of the solver, each with the module that it belongs to."""
    for module in recorded_calls.modules():
        for name, value in list(vars(module).items()):
            if getattr(value, "__module__", "").rpartition(".")[2] not in OF_THE_MACHINE:
                yield module, name, value


@pytest.fixture
def watched(monkeypatch):
    """All that is kept, by its name."""
    found = {}
    for module, _, value in of_modules():
        if isinstance(value, type) and value.__module__ == module.__name__:
            for name, member in list(vars(value).items()):
                if isinstance(member, functools.cached_property) and f"{value.__qualname__}.{name}" not in FILLED:
                    found[f"{value.__qualname__}.{name}"] = kept = KeptProperty(member)
                    monkeypatch.setattr(value, name, kept)
    wrapped = {}
    for module, name, value in of_modules():
        if isinstance(value, functools._lru_cache_wrapper):
            if value not in wrapped:
                wrapped[value] = found[name] = kept_function(value)
            monkeypatch.setattr(module, name, wrapped[value])
    return found


def kept_function(function):
    """The same function, of which every result that is kept is compared with a fresh one."""

    @functools.wraps(function.__wrapped__)
    def compared(*args, **kwargs):
        hits = function.cache_info().hits
        value = function(*args, **kwargs)
        if function.cache_info().hits > hits:
            compared.asked += 1
            if compared.asked.bit_count() == 1 and not same(value, function.__wrapped__(*args, **kwargs)):
                compared.stale.append(args)
        return value

    compared.stale, compared.asked = [], 0
    return compared


@pytest.mark.parametrize("run", RUNS)
def test_what_is_kept_is_what_would_be_found_now(watched, run):
    solver_runs.RUNS[run]()
    assert {name: kept.stale for name, kept in watched.items() if kept.stale} == {}
    assert sum(kept.asked for kept in watched.values()) > 10
