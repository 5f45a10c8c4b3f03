"""What every function of the solver finds, private ones, too, on meshes of more kinds and sizes than `solver_runs` has.

As `test_what_holds_of_every_function`, whose table has public functions on small meshes alone: `found_wider.tsv` has
three figures of what each function finds in its first calls of every run of `wider_runs`, `seldom_runs` and
`rare_runs`, and of private ones in those of `solver_runs`. So a bound or a weight within a function, and a branch that
is taken from a size on, is seen by what it changes. `came.tsv` has what comes of the first calls of each with one thing
in what it was given changed, as `other_input` does, so that what no run comes to is seen as well. OMT_UV_ACCEPT=1
writes the tables anew, without what the last digits of the input decide; OMT_UV_ACCEPT=fewer leaves out what does not
hold here, to be called once with every OPENBLAS_CORETYPE.
"""

from __future__ import annotations

import functools
import os
import types
import warnings
from dataclasses import replace
from pathlib import Path

import meshes
import numpy as np
import other_input
import pytest
import rare_runs
import recorded_calls
import seldom_runs
import solver_runs
import wider_runs

from omt_uv import solver

FOUND = Path(__file__).with_name("found_wider.tsv")
# What comes of calls with one thing in what they were given changed.
CAME = Path(__file__).with_name("came.tsv")
ACCEPT = os.environ.get("OMT_UV_ACCEPT", "")
# Calls of each function in a run whose figures are kept.
MOST = 6
# Runs of `solver_runs` that take longest, and find by private functions what public ones tell.
LEFT_OUT = ("compared", "new_meshes")
# What stands behind names of private functions in runs of `solver_runs`.
SMALL = " on small meshes"
# What stands behind names in runs of `seldom_runs`.
SELDOM = " seldom"
# What stands behind names of runs of `rare_runs`.
RARE = " rarely"
# Least share of the functions of the solver that are to be seen.
MOST_OF_ALL = 0.85


def told():
    """The record of all runs: figures of what functions give, by their names, and calls of them."""
    # What other tests have made is made again, and seen.
    recorded_calls.forget([solver_runs])
    record = other_input.Asked(MOST)
    everything = [*recorded_calls.modules(), solver]
    watched = recorded_calls.watching(record, everything, private=True, callers=(seldom_runs, rare_runs), held=True)
    with watched, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for name, run in wider_runs.RUNS.items():
            record.next_run(wider_runs.MARKS.get(name, ""))
            run()
        for name, run in seldom_runs.RUNS.items():
            record.next_run(SELDOM + " of symmetric meshes" * (name in seldom_runs.SYMMETRIC))
            run()
        for name, run in rare_runs.RUNS.items():
            record.next_run(RARE + " of symmetric meshes" * (name in rare_runs.SYMMETRIC))
            run()
        for name, run in solver_runs.RUNS.items():
            if name not in LEFT_OUT:
                record.next_run(SMALL + " of symmetric meshes" * (name in ("with_symmetry", "bodies_cut_open")))
                run()
    recorded_calls.forget([solver_runs])
    return record


def _shaken(seed, value):
    """A mesh (positions first), or a surface, whose positions differ in the tenth digit, by where they are alone."""
    if hasattr(value, "positions"):
        return replace(value, positions=_moved(seed, value.positions))
    if isinstance(value, tuple):
        return (_shaken(seed, value[0]), *value[1:])
    return _moved(seed, value)


def _moved(seed, V):
    V = np.asarray(V, float)
    with np.errstate(all="ignore"):
        return V * (1 + 1e-10 * np.sin(7 * V.sum(axis=1, keepdims=True) + seed))


def _shaking(seed, function):
    return lambda *given, **more: _shaken(seed, function(*given, **more))


def shaken(seed, monkeypatch):
    """The record of the same runs on meshes that differ in the tenth digit."""
    with monkeypatch.context() as patch:
        for module, names in (
            (wider_runs, ("bent", "curved", "wavy_quads", "wavy_mixed", "with_limbs", "broken_mesh")),
            (seldom_runs, ("bent",)),
            (rare_runs, ("bent", "curved", "patch", "wavy_quads", "wavy_mixed", "with_limbs", "ridge")),
            (solver_runs, ("patch", "body")),
        ):
            for name in names:
                patch.setattr(module, name, _shaking(seed, getattr(module, name)))
        names = ("two_bumps", "torus", "polar", "icosphere", "bumpy", "comb", "annulus")
        others = {name: _shaking(seed, getattr(meshes, name)) for name in names}
        for module in (wider_runs, rare_runs):
            patch.setattr(module, "meshes", types.SimpleNamespace(**{**vars(meshes), **others}))
        return told()


@functools.cache
def record():
    return told()


def rows():
    return record().figures


@functools.cache
def others():
    """Records of the same runs on meshes that differ in the tenth digit, three times."""
    with pytest.MonkeyPatch.context() as patch:
        return [shaken(seed, patch) for seed in (1, 2, 3)]


def test_nearly_all_functions_are_seen():
    names = {name for module in recorded_calls.modules() for name, *_ in recorded_calls._public(module, private=True)}
    seen = {name.partition(" ")[0] for name in rows()}
    missing = sorted(names - seen)
    assert len(missing) < (1 - MOST_OF_ALL) * len(names), (len(names), missing)


def test_what_is_found_on_wider_inputs_is_that_of_the_table():
    # Public functions on small meshes have a table of their own.
    here = {name: row for name, row in rows().items() if SMALL not in name or "._" in name}
    if ACCEPT == "1":
        lines = recorded_calls.lines_of(here, [other.figures for other in others()])
        FOUND.write_text("".join(f"{line}\n" for line in lines))
    recorded_calls.hold(FOUND, here)


def test_what_comes_of_other_input_is_that_of_the_table():
    calls = record().calls
    if ACCEPT == "1":
        here = other_input.quick_rows(calls)
        near = [other_input.rows_for(list(here), other.calls) for other in others()]
        CAME.write_text("".join(f"{line}\n" for line in recorded_calls.lines_of(here, near)))
    recorded_calls.hold(CAME, other_input.rows_for(CAME.read_text().splitlines(), calls))
