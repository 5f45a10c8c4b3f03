"""What somebody sees at every step of what he does in a window, and what there is in the file and the session then:
a table has a few figures of all that has changed since.

OMT_UV_ACCEPT=1 writes it anew, OMT_UV_ACCEPT=fewer holds no longer to cells that are others here."""

from __future__ import annotations

import os
import re
from pathlib import Path

import bpy

import cells
import left_behind
import operator_states
import pytest
import rich_states
import scenes
import window_stories
import windows
from window_stories import STORIES

GOES_ON = Path(__file__).with_name("goes_on.tsv")
# What a report tells of the machine.
MACHINE = re.compile(r"OMT UV [\d.]+ / .*? / mode")


def rows(package, folder) -> tuple[dict, dict]:
    """Rows by story and step, each like the one before it."""
    found, likes = {}, {}
    for name, (state, steps) in STORIES.items():
        rich_states.begin(rich_states.STATES[state], folder)
        left_behind.forget(package)
        before = left_behind.told() | left_behind.session(package)
        stage, last = window_stories.Stage(package), ""
        for k, step in enumerate(steps(stage)):
            after = left_behind.told() | left_behind.session(package)
            row = stage.told() | left_behind.changed(before, after)
            here = f"{name} {k}: {step}"
            found[here] = {key: MACHINE.sub("mode", left_behind.without_times(value)) for key, value in row.items()}
            likes |= {here: last} if last else {}
            last = here
    return found, likes


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="figures are of the sources")
@pytest.mark.skipif(bpy.app.version[:2] != (5, 0), reason="figures are of one Blender")
def test_what_goes_on_is_that_of_the_table(package, monkeypatch, tmp_path):
    operator_states.with_few_samples(package, monkeypatch)
    windows.in_front(monkeypatch, package)
    windows.in_single_steps(monkeypatch, package)
    # What is shown on the way does not hang on the clock.
    monkeypatch.setattr(package("operators.base"), "SHOW_EVERY", -1.0)
    scenes.open_empty()
    rich_states.library(tmp_path)
    found, likes = rows(package, tmp_path)
    rich_states.begin(lambda _: None, tmp_path)
    left_behind.forget(package)
    cells.hold(GOES_ON, found, likes)
