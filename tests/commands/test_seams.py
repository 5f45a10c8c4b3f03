"""seams on the command line: what the operator marks, and only files that keep it."""

from __future__ import annotations

import bpy

import scenes


def seams_of(obj):
    return [edge.use_seam for edge in obj.data.edges]


def test_the_command_marks_what_the_operator_marks(run, tmp_path):
    obj = scenes.cube()
    for edge in obj.data.edges:
        edge.use_seam = False
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    assert bpy.ops.uv.omt_seams() == {"FINISHED"}
    expected = seams_of(obj)
    status, out, err = run("seams", tmp_path / "in.blend", "-o", tmp_path / "out.blend")
    assert (status, err) == (0, "")
    assert seams_of(bpy.data.objects["Cube"]) == expected
    assert out.startswith(f"Cube: {sum(expected)} edges of seam, ")


def test_files_that_lose_seams_and_groups_that_are_not_there_are_refused(run, tmp_path):
    scenes.cube()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    cases = (
        (("-o", tmp_path / "out.obj"), "only .blend files keep seams"),
        (("-o", tmp_path / "out.blend", "--keep-free", "nose"), "no vertex group 'nose'"),
    )
    for arguments, words in cases:
        status, out, err = run("seams", tmp_path / "in.blend", *arguments)
        assert status == 1 and out == "" and words in err and len(err.splitlines()) == 1
    assert {path.name for path in tmp_path.iterdir()} == {"in.blend"}
