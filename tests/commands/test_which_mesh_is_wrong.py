"""Of several meshes of a file the one that is wrong is named, by every command, wherever it stands: what lacks UVs that
are needed, and what has a coordinate that is no number, by its own number; and nothing is written."""

from __future__ import annotations

import json
import re

import bpy

import command_runs
import numpy as np
import pytest
import scenes
from command_runs import contents

NAMES = ("First", "Second", "Third")
# Commands that need UVs.
OF_UVS = {
    "refine": "-o @out --quality draft",
    "magnify": "-o @out --quality draft --weights region --factor 1.5 --source uv",
    "measure": "--json",
    "measure strain": "--json --beltrami",
    "stack": "-o @out",
    "symmetrize": "-o @out",
    "rectify": "-o @out",
    "test-texture area": "-o @picture --kind area --size 32",
    "test-texture normals": "-o @picture --kind normals --size 32",
}
EVERY = OF_UVS | {
    "unwrap": "-o @out --quality draft",
    "sphere": "-o @out --quality draft",
    "seams": "-o @out",
    "weights": "-o @out --kind gaussian",
    "remesh": "-o @out --vertices 40",
    "partition": "-o @out --cells 3 --relax 0",
    "volume": "-o @out --tets 100",
    "flow": "-o @out --handles @handles",
}
# It looks at UVs, and lights faces by what normals there are.
WITHOUT = {"test-texture normals"}


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    """Files of three meshes, of which some are wrong, called by what is wrong with which."""
    made = tmp_path_factory.mktemp("wrong")
    every = [("bare", names) for names in ([0], [1], [1, 2])] + [("nan", [k]) for k in range(3)]
    for kind, wrong in [*every, ("flat", [1]), ("loose", [1]), ("strange", [1])]:
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        for k, name in enumerate(NAMES):
            obj = command_runs.body(name, at=4.0 * k, seed=k + 1)
            if k in wrong and kind == "bare":
                obj.data.uv_layers.remove(obj.data.uv_layers.active)
            if k in wrong and kind == "nan":
                obj.data.vertices[5].co.y = float("nan")
            if k in wrong and kind == "flat":
                obj.data.vertices.foreach_set("co", np.ravel([(v.co.x, 0, 0) for v in obj.data.vertices]))
            if k in wrong and kind == "loose":
                mesh = bpy.data.meshes.new("Loose")
                mesh.from_pydata([v.co[:] for v in obj.data.vertices], [], [])
                obj.data = mesh
            if k in wrong and kind == "strange":
                uv = scenes.uv_of(obj)
                uv[4] = np.nan
                scenes.set_uv(obj, uv)
        bpy.ops.wm.save_as_mainfile(filepath=str(made / f"{kind}{''.join(map(str, wrong))}.blend"))
    (made / "handles.json").write_text(json.dumps([{"object": "First", "vertices": [0], "move": [0, 0, 0.1]}]))
    return made


def refused(run, folder, name, file):
    """What is told of the meshes of a file, without its name."""
    files = {"@out": "out.blend", "@picture": "out.png", "@handles": "handles.json"}
    words = [folder / files[word] if word in files else word for word in EVERY[name].split()]
    before = contents(folder)
    status, out, err = run(name.split()[0], folder / file, *words)
    assert (status, out) == (1, "") and len(err.splitlines()) == 1, err
    assert contents(folder) == before
    return err.replace(str(folder / file), "")


@pytest.mark.parametrize("name", OF_UVS)
@pytest.mark.parametrize("wrong", [[0], [1], [1, 2]], ids=str)
def test_meshes_without_uvs_are_named_and_nothing_is_written(run, folder, name, wrong):
    message = refused(run, folder, name, f"bare{''.join(map(str, wrong))}.blend")
    named = {k for k, word in enumerate(NAMES) if word in message}
    # One that is wrong is enough, where they are looked at in turn; none is named that is not.
    assert named == set(wrong) or not name.startswith("test-texture")
    assert named and named <= set(wrong) and re.search("no UV", message) and "nwrap" in message, message


@pytest.mark.parametrize("name", sorted(EVERY.keys() - WITHOUT))
@pytest.mark.parametrize("wrong", [0, 1, 2])
def test_a_mesh_with_a_coordinate_that_is_none_is_named_with_its_own_number(run, folder, name, wrong):
    if name == "volume":
        pytest.importorskip("tetgen")
    message = refused(run, folder, name, f"nan{wrong}.blend")
    assert [word for word in NAMES if word in message] == [NAMES[wrong]], message
    assert "(1 vertex: 5)" in message


@pytest.mark.parametrize("name", EVERY)
@pytest.mark.parametrize("file", ["flat1", "loose1", "strange1"])
def test_nothing_that_is_wrong_with_a_mesh_is_a_defect_of_the_program(run, folder, tmp_path, name, file):
    """It is done, or refused in one line, whatever the figures are then."""
    if name == "volume":
        pytest.importorskip("tetgen")
    files = {"@out": tmp_path / "out.blend", "@picture": tmp_path / "out.png", "@handles": folder / "handles.json"}
    words = [files.get(word, word) for word in EVERY[name].split()]
    status, _, err = run(name.split()[0], folder / f"{file}.blend", *words)
    assert status in (0, 1) and "defect" not in err and "Traceback" not in err, err


@pytest.mark.parametrize("others", [0, 1, 2])
def test_a_mesh_without_faces_is_left_alone_beside_others_and_that_is_said(run, tmp_path, others):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for k in range(others):
        command_runs.body(NAMES[k], at=4.0 * k)
    scenes.add([(0, 0, 0), (1, 0, 0)], [], "Bare")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    status, out, err = run("measure", tmp_path / "in.blend")
    assert status == (0 if others else 1) and ("Area error" in out) == bool(others)
    told = [line for line in err.splitlines() if "no faces" in line]
    assert len(told) == 1 and ("Bare has no faces and is left alone" in told[0]) == bool(others), err
