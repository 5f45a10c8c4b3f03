"""A file whose name ends in capitals, as other systems write them, is the file that it is with small letters: the same
is read, said, warned of and written."""

from __future__ import annotations

import bpy

import pytest
import scenes
from sphere_shapes import blob

FORMATS = (".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx", ".blend")


def made(folder, suffix):
    """A file of a patch with a lamp beside it: its path."""
    obj = scenes.bump(4, 3)
    scenes.set_uv(obj, 0.3 * scenes.seen_from_above(obj))
    bpy.context.collection.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA")))
    path, ops = folder / f"in{suffix}", bpy.ops
    if suffix in (".glb", ".gltf"):
        scenes.export_gltf(path, export_format="GLB" if suffix == ".glb" else "GLTF_SEPARATE")
    else:
        {".obj": ops.wm.obj_export, ".ply": ops.wm.ply_export, ".stl": ops.wm.stl_export, ".fbx": ops.export_scene.fbx,
         ".blend": ops.wm.save_as_mainfile}[suffix](filepath=str(path))  # fmt: skip
    return path


@pytest.mark.parametrize("command", ["unwrap", "measure"])
@pytest.mark.parametrize("suffix", FORMATS)
def test_capitals_at_the_end_of_a_name_are_all_one(package, run, tmp_path, monkeypatch, suffix, command):
    monkeypatch.setattr(package("files.saving"), "_lost_kinds", lambda source, path: ["Some kinds are lost"])
    path = made(tmp_path, suffix)
    found = []
    for ending in (suffix, suffix.upper()):
        begin = path.rename(tmp_path / f"in{ending}")
        out = tmp_path / f"out{ending}"
        words = {"unwrap": ["--quality", "draft", "-o", out], "measure": []}
        status, printed, told = run(command, begin, *words[command])
        scenes.open_empty()
        written = [len(o.data.polygons) for o in package("files.meshes").load(out)] if out.exists() else []
        found.append((status, printed.replace(ending, suffix), told.replace(ending, suffix), written))
        begin.rename(path)
    assert found[0] == found[1]
    # What is lost of an .fbx is told of what is written by Blender's exporter into another one.
    assert ("Some kinds are lost" in found[0][2]) == (suffix == ".fbx" and command == "unwrap")


# Commands, and the files that they write besides, which are each of one kind.
OTHERS = {
    "signature": (["--points", "60"], {"-o": ".npz"}),
    "library": (["--points", "60"], {"-o": ".npz"}),
    "diagram": (["--size", "32"], {"-o": ".png"}),
    "measure": ([], {"--preview": ".png", "--attributes": ".blend"}),
}


@pytest.mark.parametrize("command", OTHERS)
def test_capitals_at_the_end_of_what_is_written_besides_are_all_one(package, run, tmp_path, command):
    words, written = OTHERS[command]
    (tmp_path / "shapes").mkdir()
    V, F = blob(1, seed=1)
    obj = scenes.add(V, F)
    scenes.set_uv(obj, 0.4 * scenes.seen_from_above(obj))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "shapes" / "in.blend"))
    begin = tmp_path / "shapes" if command == "library" else tmp_path / "shapes" / "in.blend"
    found = []
    for change in (str.lower, str.upper):
        files = {option: tmp_path / f"{option.strip('-')}{change(suffix)}" for option, suffix in written.items()}
        status, printed, told = run(command, begin, *words, *(word for pair in files.items() for word in pair))
        for path in files.values():
            assert path.is_file(), told
            printed = printed.replace(str(path), path.stem)
        found.append((status, printed, told))
    assert found[0] == found[1] and found[0][0] == 0
