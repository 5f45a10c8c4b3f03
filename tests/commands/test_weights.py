"""weights on the command line: what the operator writes, and only files that keep it."""

from __future__ import annotations

import bpy

import pytest
import scenes
from region_scenes import weights_of


@pytest.mark.parametrize("kind", ["saliency", "mean"])
def test_the_command_writes_what_the_operator_writes(run, tmp_path, kind):
    obj = scenes.bump(height=1.0)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    assert bpy.ops.object.omt_weights(kind=kind.upper(), weight_group="w", invert=True) == {"FINISHED"}
    expected = weights_of(obj, "w")
    arguments = ("-o", tmp_path / "out.blend", "--kind", kind, "--group", "w", "--invert")
    assert run("weights", tmp_path / "in.blend", *arguments) == (0, "", "")
    assert (weights_of(bpy.data.objects["Bump"], "w") == expected).all() and expected.any()


def test_what_cannot_be_is_refused_on_one_line(run, tmp_path):
    scenes.bump(height=0.0, name="Flat")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    cases = (
        (("-o", tmp_path / "w.ply"), "only .blend files keep vertex groups"),
        (("-o", tmp_path / "w.blend", "--group", ""), "has no name"),
        (("-o", tmp_path / "w.blend", "--kind", "mean"), "Flat: The score is the same"),
    )
    for arguments, words in cases:
        status, out, err = run("weights", tmp_path / "in.blend", *arguments)
        assert status == 1 and out == "" and words in err and len(err.splitlines()) == 1, err
