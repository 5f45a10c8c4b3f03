"""What a command warns of stands on standard error and in its report alike, each once: every command with a report."""

from __future__ import annotations

import json

import bpy

import command_runs
import pytest

MARK = "omt_uv: warning: "


@pytest.fixture(scope="module")
def folder(tmp_path_factory, package):
    """Files for all commands, and an OBJ with faces of no vertices."""
    made = tmp_path_factory.mktemp("warnings")

    def run(*arguments):
        return (package("cli").main([str(a) for a in arguments]),)

    command_runs.prepare(run, made)
    bpy.ops.wm.open_mainfile(filepath=str(made / "in.blend"))
    bpy.ops.wm.obj_export(filepath=str(made / "broken.obj"), export_materials=False)
    with open(made / "broken.obj", "a") as file:
        file.write("f 1 2 99999\nf 1 2\n")
    return made


def reporting(package):
    return sorted(
        name
        for name, command in command_runs.commands(package).items()
        if any(action.dest == "report" for action in command._actions)
    )


def test_every_warning_is_told_once_and_reported(package, run, folder):
    tried = []
    for name in reporting(package):
        (folder / "report.json").unlink(missing_ok=True)
        (folder / "out.blend").unlink(missing_ok=True)
        words = command_runs.words(name, folder, "" if name == "average" else "broken.obj")
        if name == "average":
            (folder / "shapes" / "c.obj").write_bytes((folder / "broken.obj").read_bytes())
        if name == "match":
            words = [folder / "broken.obj" if word == folder / "other.blend" else word for word in words]
        if name == "magnify":
            words = [*words[: words.index("--source")], *words[words.index("--image-output") + 2 :]]
            words = [word for word in words if word not in ("--weights", command_runs.GROUP)]
            words += ["--weights", "saliency", "--source", "mesh"]
        status, _, err = run(*words)
        if status:
            continue
        told = [line.removeprefix(MARK) for line in err.splitlines() if line.startswith(MARK)]
        reported = json.loads((folder / "report.json").read_text())["warnings"]
        assert told and sorted(told) == sorted(reported) and len(set(told)) == len(told), (name, told, reported)
        assert sum("2 of" in text and "faces were not read" in text for text in told) == 1, (name, told)
        tried.append(name)
    assert len(tried) >= 7, tried


@pytest.mark.parametrize("name", ["unwrap", "flow", "partition"])
def test_a_mesh_without_faces_is_told_and_reported(run, folder, name):
    """It is left alone beside another one."""
    bpy.ops.wm.open_mainfile(filepath=str(folder / "in.blend"))
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("bare", bpy.data.meshes.new("bare")))
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "with_bare.blend"))
    for file in ("report.json", "out.blend"):
        (folder / file).unlink(missing_ok=True)
    status, _, err = run(*command_runs.words(name, folder, "with_bare.blend"))
    assert status == 0, err
    told = [line.removeprefix(MARK) for line in err.splitlines() if line.startswith(MARK)]
    assert sorted(told) == sorted(json.loads((folder / "report.json").read_text())["warnings"])
    assert told.count("bare has no faces and is left alone") == 1


def test_a_warning_of_the_solver_is_told_once_for_each_object_in_order(package, capsys):
    class Named:
        def __init__(self, name):
            self.name = name

    given = [(0, "a"), (1, "a"), (0, "a"), (-1, "b"), (1, "c"), (-1, "b")]
    told = package("commands.common").warn([Named("One"), Named("Two")], given, ["first of all"])
    assert told == ["first of all", "One: a", "Two: a", "b", "Two: c"]
    assert capsys.readouterr().err.splitlines() == [MARK + text for text in told]
