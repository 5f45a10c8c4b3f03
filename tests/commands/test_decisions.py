"""Options that do not go together are refused by what is wrong, and those that do are not; choices of meshes."""

from __future__ import annotations

import argparse
import gc
import sys
from pathlib import Path
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture
def mesh(tmp_path):
    """A mesh with UVs in a file, without overlap."""
    obj = scenes.bump(4, 4)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    return tmp_path / "in.blend"


# The words of a command beside its file, its status, and what it says.
REFUSED = {
    "a table of no regions": (["measure", "IN", "--csv"], 2, "Name these by --regions"),
    "a shape key of no strain": (["measure", "IN", "--shape-key", "Key"], 2, "goes with --beltrami"),
    "regions beside those of strain": (
        ["measure", "IN", "--beltrami", "--regions", "materials"], 2, "has regions of its own"),
    "a shape key of no compared strain": (
        ["compare", "IN", "OTHER", "--shape-key", "Key"], 2, "goes with --beltrami"),
    **{f"{words[0]} of strain": (["compare", "IN", "OTHER", "--beltrami", *words], 2, "--beltrami has not")
       for words in (["--plot", "p.png"], ["--csv"], ["--samples", "100"])},
    "a histogram that is none": (["measure", "IN", "--histogram", "h.gif"], 1, "Name a .png file"),
    "attributes elsewhere": (["measure", "IN", "--attributes", "a.obj"], 1, "only .blend files keep"),
    "a layer that is not there": (["refine", "IN", "-o", "o.blend", "--uv-layer", "none"], 1, "no UV map 'none'"),
    "a picture without its place": (
        ["magnify", "IN", "-o", "o.blend", "--weights", "w", "--source", "uv", "--image", "p.png"], 1, "needs both"),
    "a place without its picture": (
        ["magnify", "IN", "-o", "o.blend", "--weights", "w", "--source", "uv", "--image-output", "q.png"],
        1, "needs both"),
    "a picture of the mesh": (
        ["magnify", "IN", "-o", "o.blend", "--weights", "w", "--source", "mesh", "--image", "p.png", "--image-output",
         "q.png"], 1, "UVs that exist"),
    "a size of no picture": (
        ["magnify", "IN", "-o", "o.blend", "--weights", "w", "--image-size", "64"], 1, "go with --image"),
    "a detail of no picture": (
        ["magnify", "IN", "-o", "o.blend", "--weights", "w", "--detail", "d.png=0,0,1,1"], 1, "go with --image"),
    "a region twice": (["magnify", "IN", "-o", "o.blend", "--weights", "w", "--region", "a=2"], 1, "Give either"),
    "no region": (["magnify", "IN", "-o", "o.blend"], 1, "Give either"),
    "shapes of an stl": (["match", "IN", "IN", "-o", "o.stl", "--wrap"], 2, "no vertices in common"),
    "the same twice": (["match", "IN", "IN", "-o", "o.blend"], 2, "both files are one"),
    "classes of nobody": (["distances", "IN", "-o", "d.csv", "--knn", "1"], 2, "Give --labels"),
    "keys that no obj holds": (
        ["flow", "IN", "--handles", "h.json", "-o", "o.obj", "--shape-key"], 2, "has no shape keys"),
    "frames that no ply holds": (
        ["flow", "IN", "--handles", "h.json", "-o", "o.ply", "--frames", "3"], 2, "has no shape keys"),
    "a domain that is none": (["volume", "IN", "-o", "o.blend", "--domain", "none"], 1, "there is no mesh 'none'"),
    "a scene that is none": (["measure", "IN", "--scene", "none"], 1, "there is no scene 'none'. It has Scene"),
    "an object that is none": (["measure", "IN", "--object", "none"], 1, "there is no mesh 'none'. It has Bump"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_does_not_go_together_is_refused_by_what_is_wrong(run, mesh, monkeypatch, name):
    words, status, said = REFUSED[name]
    monkeypatch.chdir(mesh.parent)
    files = {"IN": str(mesh), "OTHER": str(mesh.with_name("other.blend"))}
    if "OTHER" in words:
        mesh.with_name("other.blend").write_bytes(mesh.read_bytes())
    before = {path: path.read_bytes() for path in mesh.parent.iterdir()}
    found, _, err = run(*[files.get(word, word) for word in words])
    assert found == status and said in err and len(err.strip().splitlines()) == 1, err
    assert {path: path.read_bytes() for path in mesh.parent.iterdir()} == before


@pytest.mark.parametrize("more", [[], ["--object", "Bump"], ["--scene", "Scene"]])
def test_what_does_go_together_is_not(run, mesh, more):
    assert run("measure", mesh, *more)[0] == 0
    assert run("refine", mesh, "-o", mesh.with_name("o.blend"), "--uv-layer", "UVMap", *more)[0] == 0


@pytest.mark.parametrize("count", [1, 2])
@pytest.mark.parametrize("suffix", [".blend", ".vtu"])
def test_several_insides_go_into_one_kind_of_file_alone(run, tmp_path, count, suffix):
    for k in range(count):
        scenes.cube(f"Body {k}")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    out = tmp_path / f"o{suffix}"
    status, _, err = run("volume", tmp_path / "in.blend", "-o", out, "--domain", "ball", "--tets", "50")
    assert ("meshes to map" in err) == (count == 2 and suffix == ".vtu"), err
    assert status == 1 or count == 1 or suffix == ".blend"


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize("folded", [False, True])
def test_strictness_refuses_folds_and_nothing_else(run, tmp_path, strict, folded):
    """Refined where they cannot be: two faces on one another stay so."""
    obj = scenes.add([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (3, 0, 0), (4, 0, 0), (4, 1, 0), (3, 1, 0)],
                     [(0, 1, 2, 3), (4, 5, 6, 7)])  # fmt: skip
    square = np.array([(0, 0), (0.4, 0), (0.4, 0.4), (0, 0.4)])
    scenes.set_uv(obj, np.concatenate([square, square + (0.1 if folded else 0.5)]))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    out = tmp_path / "o.blend"
    status, _, err = run("refine", tmp_path / "in.blend", "-o", out, *(["--strict"] if strict else []))
    assert out.exists() == (status == 0) == (not (strict and folded)), err
    assert ("Nothing was written, as --strict asks" in err) == (strict and folded)


@pytest.mark.parametrize("moved", ["", "moved"])
@pytest.mark.parametrize("output", [None, "o.blend", "o.obj", "o.ply"])
@pytest.mark.parametrize("texts", [(), ("one", "two")])
@pytest.mark.parametrize("strict", [False, True])
def test_what_was_not_read_is_told_in_one_line_or_refused(package, capfd, moved, output, texts, strict):
    selection, loaded = package("commands.selection"), package("files.loaded").Loaded
    options = argparse.Namespace(input=Path("in.obj"), strict=strict, told=[])
    if output:
        options.output = Path(output)
    found = loaded(texts, 0.25, moved)
    # What is kept by an offset is rounded in a file of another kind that has none.
    rounds = bool(moved) and output == "o.ply"
    if strict and (texts or rounds):
        with pytest.raises(package("commands.common").CommandError, match="Nothing was written"):
            selection._tell(options, found)
        return
    selection._tell(options, found)
    err = capfd.readouterr().err
    rounded = ["Single precision rounds coordinates by up to 0.25 in o.ply"] if rounds else []
    parts = [*texts, *rounded, *filter(None, [moved])]
    assert options.told == ([f"in.obj: {'; '.join(parts)}"] if parts else [])
    assert len(err.splitlines()) == bool(parts) and all(part in err for part in parts)


@pytest.mark.parametrize("where", ["in", "in/sub/a.obj", "else.obj"])
def test_names_of_objects_are_those_of_the_file_or_of_every_file_of_a_folder(package, where):
    options = argparse.Namespace(input=Path("in"), object=["a"], other=7)
    found = package("commands.selection").of_file(options, Path(where))
    assert found.input == Path(where) and found.other == 7 and options.input == Path("in")
    assert found.object == ([] if where == "else.obj" else ["a"])


@pytest.mark.parametrize("collects", [False, True])
@pytest.mark.parametrize("there", [False, True])
def test_garbage_is_not_looked_for_while_blender_comes_and_again_afterwards(package, monkeypatch, collects, there):
    common = package("commands.common")
    modules = dict(sys.modules) if there else {k: v for k, v in sys.modules.items() if k != "bpy"}
    monkeypatch.setattr(common, "sys", SimpleNamespace(modules=modules, stderr=sys.stderr))
    frozen, state = [], [collects]
    stand_in = SimpleNamespace(isenabled=lambda: state[0], disable=lambda: state.__setitem__(0, False),
                               enable=lambda: state.__setitem__(0, True), freeze=lambda: frozen.append(1))  # fmt: skip
    monkeypatch.setattr(common, "gc", stand_in)
    with common.without_collections():
        assert state == [collects and there]
    assert state == [collects] and bool(frozen) == (collects and not there)
    with pytest.raises(ZeroDivisionError), common.without_collections():
        raise ZeroDivisionError
    assert state == [collects] and gc.isenabled()


@pytest.mark.parametrize("write", ["mesh", "points", "materials", "seams"])
def test_a_picture_is_of_what_was_made_or_of_what_it_lies_on_with_its_cells(package, monkeypatch, write):
    partition = package("commands.shapes.partition")
    shown = []
    monkeypatch.setattr(
        partition, "write_preview", lambda _, pairs, cells=None: shown.append(([obj for obj, *_ in pairs], cells))
    )
    obj, made = scenes.bump(2, 2), scenes.bump(3, 3)
    found = [SimpleNamespace(cell="of polygons", mesh=SimpleNamespace(cell="of pieces"))]
    partition._show(SimpleNamespace(write=write), [(obj, None)], [made], found)
    assert shown == [([made], None) if write == "mesh" else ([obj], ["of polygons"])]


@pytest.mark.parametrize("start", [None, ("python", "x.py")])
@pytest.mark.parametrize("apart", [False, True])
@pytest.mark.parametrize("scheduler", ["", "local:2", "tcp://far:8786"])
def test_a_batch_runs_here_or_on_a_cluster_with_what_was_given(package, monkeypatch, capfd, scheduler, apart, start):
    batch = package("commands.batches.batch")
    monkeypatch.setattr(package("batch.pool"), "LocalPool", lambda *given: SimpleNamespace(given=given))
    monkeypatch.setattr(
        package("batch.cluster"),
        "Cluster",
        lambda *given: SimpleNamespace(given=given, warnings=lambda: ["It is far."]),
    )
    options = argparse.Namespace(scheduler=scheduler, jobs=3, total_memory=5.0, apart=apart, send=apart)
    if start:
        options.start = start
    words = start or (sys.executable, "-m", batch.PROGRAM)
    expected = ("plan", words, scheduler, apart) if scheduler else ("plan", words, 3, 5.0, not apart)
    assert batch._runner(options, "plan").given == expected
    assert ("It is far." in capfd.readouterr().err) == bool(scheduler)
