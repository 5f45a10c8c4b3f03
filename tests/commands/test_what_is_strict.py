"""--strict refuses what is wrong, and of what is well takes nothing away: commands end as without it, say the same, and
write the same files."""

from __future__ import annotations

import re
import shutil

import bpy

import command_runs
import pytest
import scenes
from command_runs import contents

# Commands that have something of their own to refuse, and one of each kind that has not.
QUICK = ("diagram", "queue", "seams", "test-texture", "weights")


@pytest.fixture(scope="module")
def sound(package, tmp_path_factory):
    """A folder with a body whose UVs neither fold nor lie on one another."""
    folder = tmp_path_factory.mktemp("sound")
    scenes.open_bump()
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "in.blend"))
    return folder


def told(text, folder):
    """Lines without places and times."""
    return [re.sub(r"\d+(\.\d+)? s\b", "# s", line) for line in text.replace(str(folder), "").splitlines()]


@pytest.mark.parametrize("name", QUICK)
def test_what_is_well_is_done_as_without(package, run, sound, tmp_path, name):
    assert "--strict" in command_runs.commands(package)[name]._option_string_actions
    found = []
    for more in ([], ["--strict"]):
        folder = tmp_path / f"at{len(more)}"
        shutil.copytree(sound, folder)
        status, out, err = run(*command_runs.words(name, folder), *more)
        found.append((status, told(out, folder), told(err, folder), set(contents(folder))))
    assert found[0][0] == 0 and found[0] == found[1]
