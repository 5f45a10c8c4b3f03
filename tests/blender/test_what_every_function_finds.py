"""What every function of `omt_uv/blender` that asks for objects alone gives, refuses and changes, of two objects in
many states: edited, mirrored and scaled unevenly, with keys, smooth, bare, without faces; a table has a few figures of
each.

OMT_UV_ACCEPT=1 writes it anew, OMT_UV_ACCEPT=fewer leaves out rows that do not hold here."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import object_calls
import operator_states
import pytest
import recorded_calls
import scenes

FOUND = Path(__file__).with_name("found.tsv")
ACCEPT = os.environ.get("OMT_UV_ACCEPT", "")


def rows():
    """Figures of all calls, by function, state, and what is chosen."""
    found = {}
    scenes.open_empty()
    for state, make in object_calls.STATES.items():
        before = None
        for name, function, asked in object_calls.functions():
            for chosen in object_calls.choices(asked):
                if before is None:
                    operator_states.begin(make)
                    before = object_calls.left()
                figures = object_calls.outcome(function, asked, chosen)
                left = object_calls.left()
                words = " ".join(map(str, chosen.values()))
                changed = 0.0 if left == before else 1 + left / 2**32
                found[f"{name} {state} {words}".strip()] = np.array([1.0, figures[0] + changed, figures[1]])
                before = left if left == before else None
    operator_states.begin(lambda: None)
    return found


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="figures are of the sources")
def test_what_is_found_of_objects_in_all_states_is_that_of_the_table(package):
    here = rows()
    assert len({name.partition(" ")[0] for name in here}) > 80
    if ACCEPT == "1":
        FOUND.write_text("".join(f"{line}\n" for line in recorded_calls.lines_of(here, [rows()])))
    recorded_calls.hold(FOUND, here)
