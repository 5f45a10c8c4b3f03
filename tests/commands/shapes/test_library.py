"""distance, library and similar: a body finds itself, what cannot be compared is named, an index is added to."""

from __future__ import annotations

import json

import bpy


def body(path, scale):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    for vertex in bpy.context.object.data.vertices:
        vertex.co.x *= scale * (1.5 if vertex.co.x > 0 else 1)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def test_a_folder_is_indexed_once_and_searched(run, tmp_path):
    (tmp_path / "all").mkdir()
    body(tmp_path / "all" / "round.blend", 1)
    body(tmp_path / "all" / "long.blend", 3)
    words = ["library", tmp_path / "all", "-o", tmp_path / "index.npz"]
    status, out, _ = run(*words)
    assert status == 0 and out.startswith("2 new, 2 in ")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_torus_add()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "all" / "ring.blend"))
    status, out, err = run(*words)
    assert status == 0 and out.startswith("0 new, 2 in ") and "ring.blend" in err and "handle" in err
    body(tmp_path / "query.blend", 2.8)
    status, out, _ = run("similar", tmp_path / "query.blend", "--index", tmp_path / "index.npz", "--top", 2)
    assert status == 0 and [json.loads(line)["name"] for line in out.splitlines()] == ["long.blend", "round.blend"]
    status, out, _ = run("distance", tmp_path / "query.blend", tmp_path / "all" / "long.blend", "--json")
    assert status == 0 and json.loads(out)["raw"] < 0.3
    assert "no such index" in run("similar", tmp_path / "query.blend", "--index", tmp_path / "none.npz")[2]
