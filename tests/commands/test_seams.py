"""seams on the command line: what the operator marks, and only files that keep it."""

from __future__ import annotations

import bpy

import pytest
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


@pytest.mark.parametrize("what", ["pins", "group"])
def test_what_cuts_avoid_they_avoid_here_and_there(run, tmp_path, what):
    """Pins of the UVs, and a group that is named: the cut that would come without them goes elsewhere, both times the
    same way."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    obj = bpy.context.object
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    assert bpy.ops.uv.omt_seams() == {"FINISHED"}
    before = seams_of(obj)
    inner = sorted({v for edge in obj.data.edges if edge.use_seam for v in edge.vertices})
    for edge in obj.data.edges:
        edge.use_seam = False
    if what == "pins":
        scenes.pin(obj, inner)
    else:
        obj.vertex_groups.new(name="free").add(inner, 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    free = "free" if what == "group" else ""
    assert bpy.ops.uv.omt_seams(keep_free=free) == {"FINISHED"}
    expected = seams_of(obj)
    met = {v for edge in obj.data.edges if edge.use_seam for v in edge.vertices} & set(inner)
    assert expected != before and len(met) < len(inner)
    given = ("--keep-free", free) if free else ()
    status, _, err = run("seams", tmp_path / "in.blend", "-o", tmp_path / "out.blend", *given)
    assert (status, err) == (0, "")
    assert seams_of(bpy.data.objects["Sphere"]) == expected


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
