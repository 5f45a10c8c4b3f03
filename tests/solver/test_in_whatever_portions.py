"""What is done in portions, so that memory is enough, is the same in whatever portions it is done."""

from __future__ import annotations

import functools
import inspect

import numpy as np
import pytest
import recorded_calls
import solver_runs
from recorded_calls import copied, leaves

from omt_uv.solver.progress import drain

# Names of how much is done at once; what is less is no portion.
PORTIONS = ("CHUNK", "AT_ONCE", "MOST_AT_ONCE", "FEW_AT_ONCE", "BLOCK")
LEAST = 100
# What it is made, which is no whole part of most.
PORTION = 97
# What gives the portions themselves, or how many there are.
PARTED = {"_parts", "within", "_looked_at", "_chunks", "some_at_once"}
# Runs that take little time and come to most portions.
RUNS = ("unwrapped", "unwrapped_into_shapes", "magnified", "spheres", "in_contact", "moved_by_flows", "insides",
        "upright", "read_off", "cages")  # fmt: skip
# Calls of every function that are made again.
MOST = 3


def portions() -> dict[str, tuple]:
    """Modules and names of portions, by what they are called here."""
    return {
        f"{module.__name__.removeprefix('omt_uv.solver.')}.{name}": (module, name)
        for module in recorded_calls.modules()
        for name in PORTIONS
        if type(getattr(module, name, None)) is int and getattr(module, name) >= LEAST and _is_own(module, name)
    }


def _is_own(module, name: str) -> bool:
    return f"\n{name} = " in inspect.getsource(module)


@functools.cache
def calls() -> dict[str, list[recorded_calls.Call]]:
    """Calls of the functions of modules that work in portions."""
    kept = recorded_calls.Record(MOST)
    modules = list({module.__name__: module for module, _ in portions().values()}.values())
    with recorded_calls.watching(kept, modules, private=True):
        for run in RUNS:
            kept.next_run()
            solver_runs.RUNS[run]()
    return kept.calls


def outcome(call: recorded_calls.Call) -> list[np.ndarray]:
    """All that comes of a call, also in what it was given."""
    args, kwargs = copied((call.args, call.kwargs))
    found = call.function(*args, **kwargs)
    return list(leaves([drain(found) if inspect.isgenerator(found) else found, args, kwargs]))


def of_module(module) -> list[recorded_calls.Call]:
    """Calls of the functions of a module, but those that give portions."""
    made = [call for some in calls().values() for call in some if call.function.__module__ == module.__name__]
    return [call for call in made if call.function.__name__ not in PARTED]


def test_most_portions_are_come_to():
    assert sum(bool(of_module(module)) for module, _ in portions().values()) >= 12


@pytest.mark.parametrize("where", sorted(portions()))
def test_what_is_found_is_the_same_in_whatever_portions(where, monkeypatch):
    module, name = portions()[where]
    own = of_module(module)
    whole = [outcome(call) for call in own]
    monkeypatch.setattr(module, name, PORTION)
    for call, expected in zip(own, whole, strict=True):
        found = outcome(call)
        assert len(found) == len(expected), call.name
        for one, other in zip(found, expected, strict=True):
            assert one.shape == other.shape and one.dtype == other.dtype, call.name
            if one.dtype.kind in "fc":
                size = np.abs(other[np.isfinite(other)]).max(initial=1e-300)
                np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * size, err_msg=call.name)
            else:
                np.testing.assert_array_equal(one, other, err_msg=call.name)
