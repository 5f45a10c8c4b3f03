"""What holds for every command, by reflection over the parser: no command can be added that does not keep to it."""

from __future__ import annotations

import argparse
import importlib.util
import json

import bpy

import pytest
import scenes

READ_ONLY = ("measure", "compare", "remesh")
MORE = {"magnify": ["--weights", "region", "--factor", "2"], "remesh": ["--vertices", "40"],
        "weights": ["--kind", "gaussian"], "partition": ["--cells", "4", "--relax", "0"]}  # fmt: skip
# Commands on bodies, whose reports have no charts: tests of their own look at these.
BODIES = ("flow", "volume", "partition")
# Commands on two files or a folder: tests/commands/shapes has theirs.
SHAPES = ("match", "average", "distance", "signature", "library", "similar")
# Of islands that have an image or are grids, which those of a ball are not: tests/commands/arranging has theirs.
SHAPED = ("symmetrize", "rectify")
# Commands that draw: tests/commands/pictures has theirs.
PICTURES = ("test-texture", "diagram")


def names(package):
    (every,) = (a for a in package("cli").parser()._actions if isinstance(a, argparse._SubParsersAction))
    # A batch works on folders, and has the tests of its own room.
    alone = [name for name, command in every.choices.items() if command.get_default("alone")]
    # The extension does not bring what fills a body with tetrahedra: without it the command ends before it reads.
    alone += [] if importlib.util.find_spec("tetgen") else ["volume"]
    return [name for name in every.choices if name not in (*alone, *SHAPES, *SHAPED, *PICTURES)]


def arguments(name, folder, target="out.blend"):
    """Words of a command on in.blend."""
    nothing: dict = {"measure": [], "compare": [folder / "in.blend"]}
    output = nothing.get(name, ["-o", folder / target])
    output += ["--quality", "draft"] if name in ("unwrap", "queue", "refine", "magnify", "sphere") else []
    if name == "volume":
        output += ["--tets", "200"]
    if name == "flow":
        (folder / "h.json").write_text('[{"vertices": [0], "move": [0, 0, 0.1]}]')
        output += ["--handles", folder / "h.json"]
    return [name, folder / "in.blend", *output, *MORE.get(name, [])]


def ball(name="Ball", x=0.0):
    """A closed mesh with a UV map and a vertex group: every command has something to work on."""
    bpy.ops.mesh.primitive_uv_sphere_add(segments=8, ring_count=6, location=(x, 0, 0))
    obj = bpy.context.object
    obj.name = obj.data.name = name
    for vertex in obj.data.vertices:
        # Not the same all around, or nothing would stand out.
        vertex.co.z *= 1 + 0.3 * vertex.co.x
    obj.vertex_groups.new(name="region").add(list(range(8)), 1.0, "REPLACE")
    return obj


def save(path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def library(folder, override):
    """in.blend with a mesh of its own, and one linked from another file, or a library override of that."""
    ball("Far", 4.0)
    save(folder / "library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    ball("Near")
    with bpy.data.libraries.load(str(folder / "library.blend"), link=True) as (_, data):
        data.objects = ["Far"]
    obj = data.objects[0]
    bpy.context.scene.collection.objects.link(obj)
    if override:
        obj = obj.override_create(remap_local_usages=True)
        obj.data.override_create(remap_local_usages=True)
    save(folder / "in.blend")


@pytest.mark.parametrize("override", [False, True], ids=["linked", "override"])
def test_linked_meshes_are_refused_by_name_or_left_out_by_every_command_that_writes(package, run, tmp_path, override):
    library(tmp_path, override)
    for name in names(package):
        status, _, err = run(*arguments(name, tmp_path))
        if name in READ_ONLY:
            assert status == 0, (name, err)
        else:
            assert status == 1 and err.splitlines()[-1].startswith("omt_uv: error: Far is "), (name, err)
            assert not (tmp_path / "out.blend").exists()
        (tmp_path / "out.blend").unlink(missing_ok=True)
        if override:
            continue
        status, _, err = run(*arguments(name, tmp_path), "--skip-linked")
        assert status == 0 and "Far is " in err and "is left out" in err, (name, err)
        (tmp_path / "out.blend").unlink(missing_ok=True)
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--object", "Near")[0] == 0
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "x.blend", "--object", "Far", "--skip-linked")[0] == 1


def test_every_report_has_all_of_its_keys(package, run, tmp_path):
    ball("A"), ball("B", 3.0)
    save(tmp_path / "in.blend")
    common = {"version", "input", "output", "quality", "balance", "charts", "gate", "warnings"}
    own = {"unwrap": {"boundary", "map", "packing"}, "refine": {"keep_boundary"}, "sphere": {"projection", "method"},
           "magnify": {"weights", "factor", "exact", "source", "cascade", "share"}}  # fmt: skip
    (every,) = (a for a in package("cli").parser()._actions if isinstance(a, argparse._SubParsersAction))
    reporting = [n for n, c in every.choices.items() if any("--report" in a.option_strings for a in c._actions)]
    # That of remesh has levels instead of charts.
    reporting = [n for n in reporting if n not in (*BODIES, *SHAPES, "remesh")]
    assert set(reporting) == own.keys()
    for name in reporting:
        words = [*arguments(name, tmp_path), *(["--source", "uv"] if name == "magnify" else [])]
        status, _, err = run(*words, "--report", tmp_path / "r.json")
        assert status == 0, (name, err)
        report = json.loads((tmp_path / "r.json").read_text())
        assert report.keys() == common | own[name], name
        assert {chart["object"] for chart in report["charts"]} == {"A", "B"}
        assert report["gate"].keys() == {"faces", "folds", "overlap"}
        told = [line.removeprefix("omt_uv: warning: ") for line in err.splitlines()]
        assert told == report["warnings"], name


def test_overlap_is_told_in_report_and_error_stream_and_strict_writes_nothing(run, tmp_path):
    """Islands on one another were there before the run, and are not its doing, but nobody wants them unsaid."""
    scenes.bump()
    save(tmp_path / "in.blend")
    first = ["unwrap", tmp_path / "in.blend", "-o", tmp_path / "one.blend", "--quality", "draft"]
    assert run(*first, "--strict") == (0, "", "")
    (obj,) = bpy.data.objects
    other = obj.copy()
    other.data = obj.data.copy()
    bpy.context.scene.collection.objects.link(other)
    save(tmp_path / "two.blend")
    words = ["refine", tmp_path / "two.blend", "-o", tmp_path / "out.blend"]
    status, _, err = run(*words, "--report", tmp_path / "r.json")
    assert status == 0 and "of the UV area is under several faces, as before" in err
    assert json.loads((tmp_path / "r.json").read_text())["gate"]["overlap"] > 0.9
    (tmp_path / "out.blend").unlink()
    status, _, err = run(*words, "--strict")
    assert status == 1 and len(err.splitlines()) == 1 and "under several faces" in err
    assert not (tmp_path / "out.blend").exists()


def test_islands_that_shall_lie_on_one_another_pass(run, tmp_path):
    ball("A"), ball("B", 3.0)
    save(tmp_path / "in.blend")
    assert run("unwrap", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--no-pack", "--strict")[0] == 0
    assert run("sphere", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--strict")[0] == 0


@pytest.mark.parametrize("target", [".obj", ".ply", ".stl", ".glb", ".fbx"])
def test_meshes_of_other_scenes_go_to_every_format(package, run, tmp_path, target):
    ball("A")
    other = bpy.data.scenes.new("Other")
    obj = ball("B", 3.0)
    bpy.context.scene.collection.objects.unlink(obj)
    other.collection.objects.link(obj)
    save(tmp_path / "in.blend")
    status, _, err = run("unwrap", tmp_path / "in.blend", "-o", tmp_path / f"out{target}", "--quality", "draft")
    assert status == 0, err
    found = package("files.meshes").load(tmp_path / f"out{target}")
    assert sum(len(obj.data.polygons) for obj in found) >= 2 * 8 * 6


def test_uvs_that_a_new_mesh_carries_pass_the_gate(run, tmp_path):
    """Those that lay on one another before still do, and that is said."""
    obj = scenes.bump()
    obj.data.uv_layers.new(name="UVMap")
    middle = sum(v.co.x for v in obj.data.vertices) / len(obj.data.vertices)
    for loop in obj.data.loops:
        x, y, _ = obj.data.vertices[loop.vertex_index].co
        obj.data.uv_layers.active.uv[loop.index].vector = (abs(x - middle), y)
    save(tmp_path / "in.blend")
    words = ["remesh", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--vertices", "300"]
    status, _, err = run(*words)
    assert status == 0 and "of the UV area is under several faces, as before" in err
    (tmp_path / "out.blend").unlink()
    assert run(*words, "--strict")[0] == 1 and not (tmp_path / "out.blend").exists()
    plain = [*words, "--no-attributes", "--strict"]
    assert run(*plain)[0] == 0
