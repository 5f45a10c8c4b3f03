"""What every operator gives back, says with its numbers, and leaves in the file and the session, called with each
property at each value that is not its default, in files where there is something to take for something else: a table
has a few figures of all that has changed.

OMT_UV_ACCEPT=1 writes it anew, OMT_UV_ACCEPT=fewer holds no longer to cells that are others here."""

from __future__ import annotations

import os
import re
from pathlib import Path

import bpy

import cells
import every_choice
import left_behind
import operator_states
import pytest
import rich_states
import scenes
from rich_states import STATES

LEFT = Path(__file__).with_name("left.tsv")
# Where each property is tried; elsewhere operators are called once.
EVERYWHERE = ("patches", "edited", "bodies")
# What takes long is tried where there is most to see.
SOME = {"object.omt_remesh": ("patches",), "object.omt_volume": ("bodies",), "uv.omt_sphere": ("bodies",),
        "object.omt_match": ("bodies",), "object.omt_similar": ("bodies",), "uv.omt_unwrap": ("patches", "edited"),
        "uv.omt_magnify": ("patches", "edited")}  # fmt: skip
# What counts most where bodies are opened.
BESIDES = {("bodies", "uv.omt_unwrap"): ("keep_free", "max_shear", "cut_further", "mark_seams", "fill_holes"),
           ("bodies", "uv.omt_magnify"): ("balance", "use_subdivision", "further", "weight_group"),
           ("active not selected", "uv.omt_magnify"): ("attribute", "weight_group")}  # fmt: skip
LONG = {"uv.omt_unwrap", "uv.omt_refine", "uv.omt_magnify"}
# Settings that the same lines take over in whatever state.
ONCE = {"quality", "balance", "kind", "aspect", "boundary", "seams", "domain", "turn_to_fit"}


def test_every_operator_is_called(package):
    assert set(left_behind.operators(package)) == set(every_choice.BASE) | every_choice.ELSEWHERE


def said(capfd, choice) -> dict[str, str]:
    """What a call gives back and says."""
    module, verb = choice.operator.split(".")
    capfd.readouterr()
    try:
        gives = " ".join(sorted(getattr(getattr(bpy.ops, module), verb)("EXEC_DEFAULT", True, **choice.given)))
    except RuntimeError as error:
        gives = " ".join(str(error).split())
    lines = [line for line in capfd.readouterr().out.splitlines() if line.startswith(("Info", "Warn"))]
    found = {"gives": gives} | {f"says {k}": line for k, line in enumerate(lines)}
    return {key: left_behind.without_times(re.sub(r"/\S*/", "/", value)) for key, value in found.items()}


def is_tried(state: str, choice) -> bool:
    """Whether an operator is called in a state with a property."""
    states, name = SOME.get(choice.operator, EVERYWHERE), choice.words.partition("=")[0]
    if not name or state == states[0]:
        return True
    if state in states:
        return choice.operator not in LONG or name not in ONCE
    return name in BESIDES.get((state, choice.operator), ())


def rows(package, capfd, folder) -> tuple[dict, dict]:
    """Rows by state, operator and choice, and which of them are like which."""
    found, likes = {}, {}
    for state, make in STATES.items():
        rich_states.begin(make, folder)
        left_behind.forget(package)
        there, before, is_there = left_behind.told(), left_behind.session(package), True
        for operator in every_choice.BASE:
            base = f"{state}, {operator}"
            for choice in every_choice.choices(operator):
                if not is_tried(state, choice):
                    continue
                name = f"{base} {choice.words}".strip()
                if not is_there:
                    rich_states.begin(make, folder)
                left_behind.forget(package)
                words, after = said(capfd, choice), left_behind.told()
                is_there = after == there
                left = left_behind.changed(there | before, after | left_behind.session(package))
                found[name] = words | left
                likes |= {name: base} if choice.words else {}
    return found, likes


@pytest.mark.skipif(bool(os.environ.get("OMT_UV_ZIP")), reason="figures are of the sources")
@pytest.mark.skipif(bpy.app.version[:2] != (5, 0), reason="figures are of one Blender")
def test_what_is_left_is_that_of_the_table(package, capfd, monkeypatch, tmp_path):
    operator_states.with_few_samples(package, monkeypatch)
    scenes.open_empty()
    rich_states.library(tmp_path)
    found, likes = rows(package, capfd, tmp_path)
    rich_states.begin(lambda _: None, tmp_path)
    left_behind.forget(package)
    cells.hold(LEFT, found, likes)
