"""The add-on in a real window: clicks and keys as an artist's, assertions on what became of the mesh.

`make gui` runs these and keeps the screenshots in build/gui; `make test` leaves them out, as they take minutes.
"""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
OUT = ROOT / "build" / "gui"
# Seconds from the key to the end of the run: without a graphics card, drawing alone may take most of one.
PATIENCE = 3.0
# On a busy machine a click may come before the panel does, and Debian's Blender, older than what we support, may crash.
# Every try that failed is told when the last one fails.
TRIES = 3


def load():
    spec = importlib.util.spec_from_file_location("gui_run", ROOT / "scripts" / "gui" / "run.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def play():
    if not os.environ.get("OMT_UV_GUI"):
        pytest.skip("make gui runs these")
    run = load()
    if reason := run.missing():
        pytest.skip(reason)
    told = {}

    def once(name):
        story = ROOT / "scripts" / "gui" / "stories" / f"{name}.py"
        if name not in told:
            errors: list[str] = []
            while "error" in (found := run.play(story, OUT / name)) and len(errors) < TRIES - 1:
                errors.append(found["error"])
            told[name] = found | {"tries": errors}
        assert "error" not in told[name], "\n\nanother try:\n".join([*told[name]["tries"], told[name]["error"]])
        return told[name]

    return once


def good(figures, area_error=0.01):
    return figures["folds"] == 0 and figures["overlap"] < 1e-4 and figures["area_l1"] < area_error


def test_three_clicks_to_an_unwrap(play):
    facts = play("tour")
    assert facts["clicks to an unwrap"] <= 3
    assert good(facts["unwrapped"])


def test_colours_come_and_go(play):
    facts = play("tour")
    for name in ("area colours", "shear colours"):
        assert facts[name] == [["OMT UV Distortion"], "VERTEX"]
    assert facts["colours off"] == [[], "MATERIAL"]
    facts = play("uv_editor")
    assert facts["uv_area"] == facts["uv_shear"] == ["OMT UV Distortion"]


def test_escape_ends_a_run_and_changes_nothing(play):
    facts = play("escape")
    assert facts["cancelled after"] < PATIENCE
    assert facts["layers after cancel"] == 0


def test_the_uv_editor_does_the_same(play):
    assert good(play("uv_editor")["unwrapped in the UV editor"])


def test_uvs_follow_the_slider_while_it_is_dragged(play):
    facts = play("uv_editor")
    seen = facts["while dragging"]
    assert seen == sorted(seen) and len(set(seen)) >= 3
    assert facts["after dragging"]["folds"] == 0
    assert facts["after dragging"]["area_l1"] > 2 * facts["unwrapped in the UV editor"]["area_l1"]


def test_the_sections_work(play):
    facts = play("sections")
    (_, *magnified), (_, *sphere), (_, *remeshed) = (facts[name] for name in ("magnified", "sphere", "remeshed"))
    asked, now = (float(dict(magnified)[f"Region {name}"].split()[0]) for name in ("asked", "now"))
    assert abs(now / asked - 1) < 5e-3
    for rows in (magnified, sphere):
        assert dict(rows)["Folded faces"] == "0"
        assert float(dict(rows)["Area error"].split()[0]) < 1
    assert dict(remeshed)["Vertices"] == "5000"
    assert {"Head", "Head_remesh"} <= set(facts["objects"])


def test_pictures_were_taken(play):
    for story, least in (("tour", 4), ("escape", 2), ("uv_editor", 4), ("sections", 3)):
        play(story)
        assert len(list((OUT / story).glob("*.png"))) >= least
