"""Names of what only some of several meshes have: a UV map or a shape key to work on has to be there, or the mesh that
lacks it is told; a group that marks something need not be on all, but on one."""

from __future__ import annotations

import json

import bpy

import command_runs
import numpy as np
import pytest
import scenes
from command_runs import contents

NAMES = ("First", "Second", "Third")
LACKING = [(0,), (1, 2), (0, 1, 2)]
# What has to be on every mesh, and what is told of one that lacks it.
ON_ALL = {
    "refine -o @out --quality draft --uv-layer own": "has no UV map 'own'",
    "stack -o @out --uv-layer own": "has no UV map 'own'",
    "symmetrize -o @out --uv-layer own": "has no UV map 'own'",
    "rectify -o @out --uv-layer own": "has no UV map 'own'",
    "magnify -o @out --quality draft --weights region --factor 1.5 --source uv --uv-layer own": "no UV map 'own'",
    "measure --beltrami --shape-key own": "no shape key 'own'",
    "remesh -o @out --vertices 40 --density own": "no vertex group 'own'",
}
# What has to be on one mesh.
ON_ONE = [
    "unwrap -o @out --quality draft --max-shear 0 --keep-free own",
    "seams -o @out --max-shear 0 --keep-free own",
    "sphere -o @out --quality draft --weights own",
    "sphere -o @out --quality draft --pole own",
    "flow -o @out --handles @handles --keep own",
]
# What is made where it is not there.
MADE = ["unwrap -o @out --quality draft --max-shear 0 --uv-layer own", "sphere -o @out --quality draft --uv-layer own",
        "magnify -o @out --quality draft --weights region --factor 1.5 --source mesh --uv-layer own"]  # fmt: skip


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    """A file for each of `LACKING`."""
    made = tmp_path_factory.mktemp("lacking")
    for lacking in LACKING:
        # What moves is a mesh that has nothing that stays.
        handle = {"object": NAMES[lacking[0]], "vertices": [40], "move": [0, 0, 0.05]}
        (made / f"{''.join(map(str, lacking))}.json").write_text(json.dumps([handle]))
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        for k, name in enumerate(NAMES):
            obj = command_runs.body(name, at=4.0 * k, seed=k + 1)
            if k not in lacking:
                obj.data.uv_layers.new(name="own")
                obj.vertex_groups.new(name="own").add([0, 1, 2, 3], 0.8, "REPLACE")
                obj.shape_key_add(name="Basis")
                obj.shape_key_add(name="own").data[0].co.x += 0.1
        bpy.ops.wm.save_as_mainfile(filepath=str(made / f"{''.join(map(str, lacking))}.blend"))
    return made


def called(run, folder, tmp_path, words, lacking):
    file = folder / f"{''.join(map(str, lacking))}.blend"
    files = {"@out": tmp_path / "out.blend", "@handles": file.with_suffix(".json")}
    name, *rest = (files.get(word, word) for word in words.split())
    status, _, err = run(name, file, *rest)
    return status, err


@pytest.mark.parametrize("words", ON_ALL)
@pytest.mark.parametrize("lacking", LACKING, ids=str)
def test_a_mesh_that_lacks_what_is_worked_on_is_named_and_nothing_is_written(run, folder, tmp_path, words, lacking):
    status, err = called(run, folder, tmp_path, words, lacking)
    assert status == 1 and len(err.splitlines()) == 1 and ON_ALL[words] in err and not contents(tmp_path), err
    assert [name for name in NAMES if name in err] == [NAMES[lacking[0]]]


@pytest.mark.parametrize("words", ON_ONE)
@pytest.mark.parametrize("lacking", LACKING, ids=str)
def test_a_group_has_to_be_on_one_mesh(run, folder, tmp_path, words, lacking):
    status, err = called(run, folder, tmp_path, words, lacking)
    if len(lacking) < len(NAMES):
        assert status == 0 and "error" not in err, err
    else:
        assert status == 1 and "no vertex group 'own'" in err and all(name in err for name in NAMES), err
        assert not contents(tmp_path)


@pytest.mark.parametrize("words", MADE)
def test_a_uv_map_that_is_not_there_is_made(run, folder, tmp_path, words):
    status, err = called(run, folder, tmp_path, words, (1, 2))
    assert status == 0, err
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    for name in NAMES:
        layers = bpy.data.objects[name].data.uv_layers
        assert layers.keys() == ["UVMap", "own"] and layers.active.name == "own"
        assert np.abs(scenes.uv_of(bpy.data.objects[name])).max() > 0.1


def test_globes_of_meshes_without_the_region_are_those_without_weights(run, folder, tmp_path):
    """Every one has the whole texture to itself."""
    found = {}
    for words in ("--weights own", ""):
        assert called(run, folder, tmp_path, f"sphere -o @out --quality draft {words}", (0,))[0] == 0
        bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
        found[words] = [scenes.uv_of(bpy.data.objects[name]) for name in NAMES]
    with_weights, without = found.values()
    np.testing.assert_array_equal(with_weights[0], without[0])
    assert all(np.abs(a - b).max() > 1e-3 for a, b in zip(with_weights[1:], without[1:], strict=True))
