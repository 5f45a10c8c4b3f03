"""A word that an option has a meaning for means that, however meshes are called; and where the mesh that an option
names is the only one, nothing is left to work on, which is said, whatever is written."""

from __future__ import annotations

import json

import bpy

import pytest
import scenes
from bodies import icosphere

NAMES = ("Body", "ball", "cube")
# What each command is called with, but for its files; {name} is that of the mesh.
WORDS = {
    "flow": ("--handles", "{folder}/h.json", "--inside", "ball"),
    "volume": ("--tets", "100", "--domain", "ball"),
    "volume in a cube": ("--tets", "100", "--domain", "cube"),
}
# What names the mesh itself.
GOALS = {
    "flow": ("--handles", "{folder}/h.json", "--inside", "Body"),
    "volume": ("--tets", "100", "--domain", "Body"),
}


def file_of(folder, *names):
    """A file of bodies of these names beside one another, of which flows move the first by its topmost vertex."""
    scenes.open_empty()
    V, F = icosphere(1)
    for k, name in enumerate(names):
        obj = scenes.add(V * [1.0, 1.2, 0.9] + [3.0 * k, 0, 0], F, name)
        obj.vertex_groups.new(name=f"tip {k}").add([int(V[:, 2].argmax())], 1.0, "REPLACE")
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "in.blend"))
    (folder / "h.json").write_text(json.dumps([{"group": "tip 0", "move": [0, 0, 0.2]}]))
    return folder / "in.blend"


def vertices(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    found = [obj for obj in bpy.data.objects if obj.type == "MESH"]
    return sorted([round(x, 6) for x in (obj.matrix_world @ v.co)] for obj in found for v in obj.data.vertices)


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("command", WORDS)
def test_what_a_mesh_is_called_changes_nothing_for_a_word(run, tmp_path, command, count):
    found = []
    for name in NAMES:
        path = file_of(tmp_path, name, *["Other"][: count - 1])
        words = [word.format(folder=tmp_path) for word in WORDS[command]]
        status, _, err = run(command.split()[0], path, "-o", tmp_path / "out.blend", *words)
        assert status == 0, err
        found.append(vertices(tmp_path / "out.blend"))
        assert found[-1] != vertices(path), "nothing was done"
    assert all(one == found[0] for one in found)


@pytest.mark.parametrize(
    ("command", "suffix"),
    [("flow", ".blend"), ("flow", ".obj"), ("volume", ".blend"), ("volume", ".npz"), ("volume", ".vtu")],
)
def test_the_only_mesh_is_not_its_own_goal(run, tmp_path, command, suffix):
    path = file_of(tmp_path, "Body")
    before = path.read_bytes()
    words = [word.format(folder=tmp_path) for word in GOALS[command]]
    status, out, err = run(command, path, "-o", tmp_path / f"out{suffix}", *words)
    assert (status, out) == (1, "") and "Body is there, and nothing that could" in err, err
    assert not (tmp_path / f"out{suffix}").exists() and path.read_bytes() == before
