"""What every command leaves of a .blend that holds much: all of it, to the last value, but what the command is for."""

from __future__ import annotations

import json

import bpy

import command_runs
import pytest
import scenes
import whole_file

# UVs are those of the active layer.
UVS = ("meshes/?/attributes/UVMap", "meshes/?/uv_layers/1/*")
HALVES = ("meshes/Halves/attributes/UVMap", "meshes/Halves/uv_layers/0/*")
SEAMS = ("meshes/*/edges/*/use_seam", "meshes/*/attributes/*uv_seam")
PLACES = ("meshes/*/attributes/position", "meshes/*/vertices/*/co", "meshes/*/vertices/*/normal",
          "meshes/*/vertices/*/undeformed_co", "meshes/*/polygons/*/normal", "meshes/*/polygons/*/center",
          "meshes/*/polygons/*/area", "objects/*/bound_box", "objects/*/dimensions")  # fmt: skip
BODIES = "--object A --object B"
# A new object and its mesh, and what holds them.
NEW = ("*/A_*", "collections/*/objects*", "collections/*/collection_objects*", "scenes/*/objects*", "scenes/*/objects*")
# Command, words besides, and what it may change then, as patterns of paths.
RUNS: list[tuple[str, str, tuple[str, ...]]] = [
    ("unwrap", BODIES, UVS),
    ("unwrap", f"{BODIES} --mark-seams --max-shear 1.05", (*UVS, *SEAMS)),
    ("unwrap", f"{BODIES} --uv-layer other", ("meshes/?/attributes/other", "meshes/?/uv_layers/0/*", "*/1/active")),
    ("refine", BODIES, UVS),
    ("magnify", BODIES, UVS),
    ("sphere", BODIES, UVS),
    ("queue", BODIES, UVS),
    ("stack", "--object Halves", HALVES),
    ("symmetrize", "--object Halves", HALVES),
    ("rectify", "--object Halves", HALVES),
    ("seams", f"{BODIES} --max-shear 0", SEAMS),
    ("weights", f"{BODIES} --group second", ("meshes/*/vertices/*/groups*",)),
    ("measure", BODIES, ("meshes/?/attributes/OMT*",)),
    ("partition", BODIES, ("meshes/?/attributes/.sculpt_face_set",)),
    ("flow", "--object A", PLACES),
    ("remesh", "--object A", NEW),
]


@pytest.fixture(scope="module")
def rich(package, tmp_path_factory):
    folder = whole_file.save(tmp_path_factory.mktemp("rich"))
    (folder / "handles.json").write_text(json.dumps([{"vertices": [0], "move": [0, 0, 0.1]}]))
    return folder


def opened(path):
    bpy.ops.wm.open_mainfile(filepath=str(path))
    return whole_file.told()


def words_of(name, folder):
    """A call of a command that writes no report and no picture: it takes long to compare what remeshing has made."""
    return command_runs.without(command_runs.words(name, folder), "--report", "--preview")


@pytest.mark.parametrize(("name", "more", "may"), RUNS, ids=[f"{name} {more}" for name, more, _ in RUNS])
def test_all_that_a_command_is_not_for_stays_to_the_last_value(run, rich, name, more, may):
    before = opened(rich / "in.blend")
    status, _, err = run(*words_of(name, rich), *more.split())
    assert status == 0, err
    after = opened(rich / "out.blend")
    found = whole_file.changed(before, after, may)
    assert not found, found[:40]
    assert not whole_file.idle(before, after, may)
    # Every object that was named has changed, or one has come of it.
    names = " ".join(path.split("/")[1][:1] for path in whole_file.changed(before, after))
    assert all(word[0] in names for word in more.split("--object ")[1:]), names


# What is done to every object by itself, whatever others there are.
ALONE = [run for run in RUNS if run[0] in ("weights", "seams", "partition", "sphere", "measure")]


@pytest.mark.parametrize(("name", "more"), [run[:2] for run in ALONE], ids=[run[0] for run in ALONE])
def test_an_object_gets_among_others_what_it_gets_alone(run, rich, name, more):
    found = []
    for words in (more, *(more.replace(f"--object {other}", "") for other in "AB")):
        status, _, err = run(*words_of(name, rich), *words.split())
        assert status == 0, err
        found.append(opened(rich / "out.blend"))
    both, second, first = found
    for letter, alone in (("A", first), ("B", second)):
        mine = [{path: value for path, value in told.items() if path.split("/")[1] == letter} for told in (both, alone)]
        assert len(mine[0]) > 1000
        found = whole_file.changed(*mine, ("scenes/*",))
        assert not found, (letter, found[:40])


@pytest.fixture(scope="module")
def packed(package, tmp_path_factory):
    """The same file as it is and compressed, with what commands take beside it."""
    folder = tmp_path_factory.mktemp("packed")
    obj = scenes.open_bump()
    for name, compress in (("plain", False), ("packed", True)):
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"), compress=compress, copy=True)
    (folder / "handles.json").write_text(json.dumps([{"object": obj.name, "vertices": [7], "move": [0, 0, 0.05]}]))
    return folder


@pytest.mark.parametrize("name", ["plain", "packed"])
@pytest.mark.parametrize(
    "words",
    ["seams -o @ --max-shear 0", "weights -o @ --kind mean", "measure --attributes @", "stack -o @",
     "partition -o @ --cells 3 --relax 0", "unwrap -o @ --quality draft --max-shear 0", "remesh -o @ --vertices 20",
     "flow -o @ --handles handles.json"],
    ids=lambda words: words.split()[0],
)  # fmt: skip
def test_what_was_compressed_stays_so_and_nothing_else_is(run, packed, tmp_path, words, name):
    out = tmp_path / "out.blend"
    command, *rest = ({"@": out, "handles.json": packed / "handles.json"}.get(word, word) for word in words.split())
    status, _, err = run(command, packed / f"{name}.blend", *rest)
    assert status == 0, err
    assert out.read_bytes().startswith(b"BLENDER") == (name == "plain")
