"""Commands of many shapes, one piece at a time: what is refused and in which words, blocks of a matrix, classes of
neighbours, and what each word of a batch becomes."""

from __future__ import annotations

import argparse
import csv
import json
from pathlib import Path
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes

SHAPES = 9


@pytest.fixture
def index(package, tmp_path, monkeypatch):
    """An index of shapes that are points of a sphere with a curvature of their own: three classes of three."""
    signature = package("solver.signatures.signature").Signature
    make = package("pipelines.shapes.signature_index").index_of
    rng = np.random.default_rng(4)
    points = rng.standard_normal((16, 3))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    rows = {}
    for k in range(SHAPES):
        bent = np.sin((1 + k % 3) * 2 * points[:, 0]) + 0.05 * rng.standard_normal(16)
        rows[f"{k:02d}.obj"] = (f"mark {k}", signature(points, bent, 0.01))
    monkeypatch.setattr(package("pipelines.shapes.signature_index"), "BLOCK", 4)
    path = tmp_path / "shapes.npz"
    path.write_bytes(make(rows).bytes())
    return path


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        (["library", "none", "-o", "i.npz"], 1, "none: there is no such folder"),
        (["library", ".", "-o", "i.txt"], 1, "i.txt: an index is an .npz. Name one."),
        (["library", ".", "-o", "i.npz"], 1, ".: none of its 0 mesh files has a signature"),
        (["distances", "i.npz", "-o", "d.txt"], 2, "d.txt: distances are a .csv"),
        (["distances", "i.npz", "-o", "d.csv", "--picture", "p.jpg"], 2, "p.jpg: this picture is a .png"),
        (["distances", "i.npz", "-o", "d.csv", "--mds", "m.jpg"], 2, "m.jpg: this picture is a .png"),
        (["distances", "i.npz", "-o", "d.csv", "--knn", "2"], 2, "Give --labels"),
        (["distances", "i.npz", "-o", "d.csv"], 1, "i.npz: there is no such index"),
        (["block", "none.json", "-o", "b.npy"], 1, "none.json: is no block of distances"),
        (["average", "none", "-o", "m.blend"], 1, "none: there is no such folder"),
        (["average", ".", "-o", "m.obj"], 2, "m.obj: the mean and its attributes go into a .blend"),
        (["average", ".", "-o", "m.blend"], 1, "a mean needs two shapes"),
    ],
)
def test_what_cannot_be_is_refused_in_its_own_words(words, status, said, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    found, _, err = run(*words)
    assert found == status and said in err and err.count("\n") == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("batched", [False, True])
def test_a_matrix_is_put_together_of_its_blocks(batched, index, run, package, tmp_path, monkeypatch):
    """Rows and columns by name, each pair once, by a batch as without."""
    module = package("commands.shapes.distances")
    monkeypatch.setattr(module, "FEW", 0 if batched else SHAPES)
    asked = []

    def carried_out(options, plan, tasks):
        places = sorted((plan.output.parent / "asked").iterdir())
        asked.append((plan, len(list(tasks))))
        for path in places:
            plan.output.mkdir(exist_ok=True)
            words = ["block", path, "-o", (plan.output / path.name).with_suffix(".npy")]
            assert run(*words)[0] == 0
        return {path.name: {"state": "done", "message": ""} for path in places}

    monkeypatch.setattr(module, "carried_out", carried_out)
    status, out, err = run("distances", index, "-o", tmp_path / "d.csv")
    assert status == 0 and out.startswith(f"{SHAPES} shapes, {SHAPES * (SHAPES - 1) // 2} distances in "), err
    assert len(asked) == batched and (not batched or (asked[0][1], asked[0][0].command) == (6, "block"))
    with open(tmp_path / "d.csv") as file:
        names, *rows = list(csv.reader(file))
    of = package("pipelines.shapes.signature_index").read_index(index)
    assert tuple(names[1:]) == of.names == tuple(row[0] for row in rows)
    found = np.array([row[1:] for row in rows], float)
    distance = package("solver.signatures.wasserstein")
    for i, j in ((0, 1), (3, 8), (4, 7), (5, 2)):
        want = distance.distance_of(distance.prepared(of[i]), distance.prepared(of[j])).distance
        assert found[i, j] == found[j, i] == pytest.approx(want, rel=1e-5, abs=1e-9)
    assert not found.diagonal().any()


def test_blocks_that_could_not_be_done_are_counted(index, run, package, tmp_path, monkeypatch):
    module = package("commands.shapes.distances")
    monkeypatch.setattr(module, "FEW", 0)
    rows = {"a": {"state": "done", "message": ""}, "b": {"state": "failed", "message": "No room"}}
    monkeypatch.setattr(module, "carried_out", lambda *_: rows)
    status, _, err = run("distances", index, "-o", tmp_path / "d.csv")
    assert status == 1 and "1 of 6 blocks could not be done: No room" in err and not (tmp_path / "d.csv").exists()


@pytest.mark.parametrize("weight", ["0", "0.5"])
def test_blocks_have_the_weight_of_curvature_that_is_given(weight, index, run, package, tmp_path):
    asked = {"index": str(index), "block": [0, 4, 4, 6], "curvature": float(weight)}
    (tmp_path / "b.json").write_text(json.dumps(asked))
    assert run("block", tmp_path / "b.json", "-o", tmp_path / "b.npy")[0] == 0
    found = np.load(tmp_path / "b.npy")
    module = package("pipelines.shapes.signature_index")
    want = module.block_distances(module.read_index(index), (0, 4, 4, 6), float(weight))
    assert found.shape == (2, 4, 2) and np.array_equal(found, want) and (weight == "0") == (found[0].max() < 1e-6)


@pytest.mark.parametrize("owners", [False, True])
def test_neighbours_tell_classes_and_those_of_others_where_owners_are_given(
    owners, index, run, package, tmp_path, monkeypatch
):
    monkeypatch.setattr(package("commands.shapes.distances"), "FEW", SHAPES)
    rows = [f"{k:02d}.obj,{'abc'[k % 3]}" + (f",{k % 3}" if owners else "") for k in range(SHAPES)]
    (tmp_path / "l.csv").write_text("\n".join(rows))
    words = ["distances", index, "-o", tmp_path / "d.csv", "--labels", tmp_path / "l.csv"]
    status, out, err = run(*words, "--knn", 2)
    assert status == 0 and err == "" and "\n100.0 % of the classes are those of 2 neighbours\n" in out
    # Each class is one owner's: without the owner's own none is right.
    assert ("\n0.0 % are those of 2 neighbours of others\n" in out) == owners
    assert run(*words)[1].count("\n") == 1
    (tmp_path / "l.csv").write_text("\n".join(rows[:5]))
    status, _, err = run(*words, "--knn", 2)
    assert status == 1 and "has no class for 4 shapes, as 05.obj" in err
    (tmp_path / "l.csv").write_bytes(b"\xff\xfe")
    assert "is no table of names and classes" in run(*words)[2]


def classes_by_loops(away, classes, owners, count):
    """The share, in percent, of shapes whose nearest others of other owners are mostly of their class."""
    right = 0
    for k, row in enumerate(away.tolist()):
        near = [j for j in np.argsort(row, kind="stable") if j != k and (not owners[k] or owners[j] != owners[k])][
            :count
        ]
        votes = [[classes[j] for j in near].count(classes[i]) for i in near]
        # The nearest has the word where several have as many.
        told = classes[near[votes.index(max(votes))]] if near else min(classes)
        right += told == classes[k]
    return 100 * right / len(classes)


@pytest.mark.parametrize(("owners", "count"), [("aabbccdd ", 3), ("a        ", 1)])
def test_neighbours_are_those_of_others_and_what_is_nobodys_is_of_nobody(owners, count, index, run, package, tmp_path):
    module = package("pipelines.shapes.signature_index")
    read = module.read_index(index)
    upper = sum(np.pad(module.block_distances(read, (i, j, k, m))[1], ((i, SHAPES - j), (k, SHAPES - m)))
                for i, j, k, m in module.blocks_of(SHAPES))  # fmt: skip
    classes, whose = list("abcabcabd"), [owner.strip() for owner in owners]
    lines = [f"{name},{kind},{owner}" for name, kind, owner in zip(read.names, classes, whose, strict=True)]
    (tmp_path / "l.csv").write_text("\n".join(lines))
    words = ["distances", index, "-o", tmp_path / "d.csv", "--labels", tmp_path / "l.csv", "--knn", count]
    status, out, err = run(*words)
    assert (status, err) == (0, "")
    away = upper + upper.T
    every, others = (classes_by_loops(away, classes, each, count) for each in ([""] * SHAPES, whose))
    assert out.splitlines()[1:] == [
        f"{every:.1f} % of the classes are those of {count} neighbours",
        f"{others:.1f} % are those of {count} neighbours of others",
    ]


@pytest.mark.parametrize("other", [0, 7])
def test_the_last_vertex_may_be_a_marker_and_none_behind_it(other, package, tmp_path):
    module, error = package("commands.shapes.distance"), package("commands.common").CommandError
    obj = scenes.cube()
    for number in (0, 1, 7, 8, 9):
        for pair in ((number, other), (other, number)):
            options = argparse.Namespace(markers=tuple(map(str, pair)))
            if number < len(obj.data.vertices):
                assert len(module._markers(options, tmp_path, [(obj, None)])) == 1
            else:
                with pytest.raises(error, match=f"no vertex {number}. It has 8, from 0"):
                    module._markers(options, tmp_path, [(obj, None)])


@pytest.mark.parametrize("received", [0, 15])
@pytest.mark.parametrize("scheduler", ["", "local"])
def test_a_batch_of_shapes_is_carried_out_by_what_was_chosen(
    received, scheduler, package, tmp_path, monkeypatch, capfd
):
    many, plans = package("commands.shapes.many"), package("batch.plan")
    engine, pool, cluster = (package(f"batch.{name}") for name in ("engine", "pool", "cluster"))
    made, closed = [], []

    def runner(kind):
        def make(*words, **more):
            made.append((kind, words[1:], more))
            return SimpleNamespace(warnings=lambda: ["it is slow"], close=lambda: closed.append(kind))

        return make

    monkeypatch.setattr(pool, "LocalPool", runner("pool"))
    monkeypatch.setattr(cluster, "Cluster", runner("cluster"))

    def carry_out(plan, tasks, manifest, runner, retry):
        assert retry and tasks == ["a", "b"]
        return SimpleNamespace(received=received)

    monkeypatch.setattr(engine, "carry_out", carry_out)
    plan = plans.BatchPlan("library", (), tmp_path / "out", ".npz", "1", reports=False, previews=False)
    options = argparse.Namespace(jobs=-2 if scheduler else 3, scheduler=scheduler, start=("blender", "-b"))
    if received:
        with pytest.raises(many.CommandError, match="ended by a signal") as caught:
            many.carried_out(options, plan, ["a", "b"])
        assert caught.value.status == package("supervision").INTERRUPTED
    else:
        assert many.carried_out(options, plan, ["a", "b"]) == {}
    want = (
        ("cluster", (("blender", "-b"), "local"), {})
        if scheduler
        else ("pool", (("blender", "-b"), 3), {"shared": True})
    )
    assert made == [want] and closed == [want[0]]
    assert ("it is slow" in capfd.readouterr().err) == bool(scheduler)


def cube(name="Cube", scale=1.0):
    bpy.ops.mesh.primitive_cube_add()
    bpy.context.object.name = name
    bpy.context.object.scale = (scale, 1, 1)
    bpy.context.view_layer.update()
    return bpy.context.object


@pytest.mark.parametrize(("suffix", "key"), [(".blend", True), (".GLB", True), (".fbx", True), (".obj", False)])
@pytest.mark.parametrize("keyed", [False, True])
def test_a_source_takes_the_shape_as_a_key_where_there_are_keys(suffix, key, keyed, package, tmp_path):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    obj = cube(scale=2.0)
    if keyed:
        obj.shape_key_add(name="First")
    before = np.array([v.co for v in obj.data.vertices])
    wrapped = np.random.default_rng(1).random((8, 3))
    module = package("commands.shapes.match")
    module._shaped(obj, SimpleNamespace(wrapped=wrapped), tmp_path / f"a{suffix}")
    now = np.array([v.co for v in obj.data.vertices])
    if not key:
        assert now * [2, 1, 1] == pytest.approx(wrapped, abs=1e-6)
        return
    blocks = obj.data.shape_keys.key_blocks
    assert [b.name for b in blocks] == ["First" if keyed else "Basis", module.KEY] and blocks[1].value == 1
    assert np.array([p.co for p in blocks[1].data]) * [2, 1, 1] == pytest.approx(wrapped, abs=1e-6)
    assert now == pytest.approx(before) and np.array([p.co for p in blocks[0].data]) == pytest.approx(before)


def test_means_are_of_one_mesh_a_file_and_of_files_that_are_not_the_mean(run, tmp_path):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    cube("A")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "a.blend"))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "c.blend"))
    cube("B")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "b.blend"))
    status, _, err = run("average", tmp_path, "-o", tmp_path / "mean.blend")
    assert status == 1 and "b.blend: it has several meshes: A, B. Join them" in err
    (tmp_path / "b.blend").unlink()
    status, _, err = run("average", tmp_path, "-o", tmp_path / "a.blend")
    assert status == 2 and "are one file. Give the mean a name of its own" in err
    words = ["average", tmp_path, "-o", tmp_path / "mean.blend"]
    status, _, err = run(*words, "--report", tmp_path / "c.blend")
    assert status == 2 and err
    for _ in range(2):
        # The mean that is there is none of the shapes.
        status, out, err = run(*words)
        assert status == 0 and out.count("rms 0, no z-scores of two shapes") == 2, err


def test_a_batch_becomes_a_table_of_its_name(run, package, tmp_path):
    manifest, plans = package("batch.manifest"), package("batch.plan")
    with manifest.Manifest(plans.beside(tmp_path / "out", plans.MANIFEST)):
        pass
    assert run("table", tmp_path / "out", "-o", tmp_path / "t.CSV")[0] == 0
    assert (tmp_path / "t.CSV").read_text() == run("table", tmp_path / "out")[1]
    status, _, err = run("table", tmp_path / "out", "-o", tmp_path / "t.txt")
    assert status == 1 and "t.txt: a table is .csv or .parquet" in err


@pytest.mark.parametrize("command", ["batch", "library", "average"])
def test_files_of_a_folder_are_known_by_their_suffix_in_any_case(package, tmp_path, command):
    """Windows and scanners write .OBJ."""
    plan = package("batch.plan")
    for suffix in plan.READABLE:
        for name in (f"lower{suffix}", f"upper{suffix.upper()}", f"none{suffix}.txt"):
            (tmp_path / name).write_text("")
    expected = sorted(path.name for path in tmp_path.iterdir() if path.suffix != ".txt")
    if command == "batch":
        found = [path for _, path in plan._of_folder(tmp_path, tmp_path / "out")]
    elif command == "library":
        found = package("commands.shapes.library")._meshes_below(tmp_path)
    else:
        options = SimpleNamespace(input=tmp_path, output=tmp_path.parent / "mean.blend", report=None)
        found = package("commands.shapes.average")._shape_files(options)
    assert sorted(path.name for path in found) == expected


@pytest.mark.parametrize(("markers", "good"), [("0,7", True), ("7,0", True), ("8,0", False), ("0,8", False)])
def test_numbers_of_vertices_end_below_their_count(package, markers, good):
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    distance = package("commands.shapes.distance")
    options = SimpleNamespace(markers=distance.pair_of_markers(markers))
    pairs = [(obj, package("blender.mesh").read(obj))]
    if good:
        (found,) = distance._markers(options, "in.obj", pairs)
        assert found is not None
    else:
        with pytest.raises(package("commands.common").CommandError, match="there is no vertex 8"):
            distance._markers(options, "in.obj", pairs)


SUFFIXES = (".blend", ".obj", ".glb", ".gltf", ".fbx", ".ply", ".stl", ".off", "")


@pytest.mark.parametrize("what", ["face_sets", "attribute", "seams", "materials", "points", "meshes"])
def test_what_a_file_keeps_hangs_on_no_capitals_and_whoever_is_refused_is_told_what_does(package, what):
    formats = package("commands.shapes.formats")

    def told(suffix):
        try:
            formats.check_kept(Path(f"a.b/c{suffix}"), what)
        except formats.CommandError as error:
            return str(error)

    refused = [suffix for suffix in SUFFIXES if told(suffix)]
    # Blender's own files keep everything.
    assert ".blend" not in refused and (refused == []) == (what == "meshes")
    for suffix in SUFFIXES:
        for other in (suffix.upper(), suffix.capitalize(), suffix[:2] + suffix[2:].upper()):
            assert (told(other) is None) == (suffix not in refused)
        if suffix in refused:
            kept = told(suffix).partition("kept by ")[2].partition(" alone")[0].split()
            assert set(SUFFIXES) - set(refused) == set(kept) and what.split("_")[0] in told(suffix)
