"""Which ways commands of shapes take: what is due, what a batch carries out, what is told, with figures in advance."""

from __future__ import annotations

import json
import os
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest


@pytest.fixture
def distances(package):
    return package("commands.shapes.distances")


@pytest.fixture
def library(package):
    return package("commands.shapes.library")


NAMES = ("a/one.obj", "b/two.obj", "three.obj")
FOUND = np.array([[[0, 1, 2.5], [1, 0, 3], [2.5, 3, 0]], [[0, 1.5, 2.75], [1.5, 0, 3.5], [2.75, 3.5, 0]]])


class Index:
    names = NAMES
    marks = ("1", "2", "3")
    marked = False

    def __len__(self):
        return 3

    def bytes(self):
        return b"index"


def asked(tmp_path, **more):
    given = {"input": tmp_path / "in.npz", "output": tmp_path / "out.csv", "picture": None, "mds": None, "knn": 0,
             "labels": None, "jobs": 0, "scheduler": None, "curvature": None}  # fmt: skip
    return SimpleNamespace(**(given | more))


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({"output": "out.txt"}, "distances are a .csv"),
        ({"picture": "p.jpg"}, "p.jpg: this picture is a .png"),
        ({"mds": "m.csv"}, "m.csv: this picture is a .png"),
        ({"knn": 3}, "Give --labels"),
    ],
)
def test_what_cannot_be_written_or_told_is_refused_before_anything_is_read(distances, package, tmp_path, more, words):
    more = {k: v if k == "knn" else tmp_path / v for k, v in more.items()}
    with pytest.raises(package("commands.common").UsageError, match=words):
        distances.run(asked(tmp_path, **more))


@pytest.mark.parametrize("owners", [False, True])
@pytest.mark.parametrize("knn", [0, 1])
def test_distances_are_a_table_and_classes_those_of_neighbours(
    distances, package, tmp_path, monkeypatch, capsys, owners, knn
):
    index_module = package("pipelines.shapes.signature_index")
    read = []
    monkeypatch.setattr(index_module, "read_index", lambda path: read.append(path) or Index())
    monkeypatch.setattr(distances, "_matrix", lambda options, index: FOUND)
    drawn = []
    monkeypatch.setattr(distances, "_draw", lambda *given: drawn.append(given))
    labels = tmp_path / "labels.csv"
    people = ["ann", "ann", "bob"] if owners else ["", "", ""]
    labels.write_text("".join(f"{n},{c},{p}\n" for n, c, p in zip(NAMES, "xxy", people, strict=True)))
    distances.run(asked(tmp_path, knn=knn, labels=labels))
    rows = [line.split(",") for line in (tmp_path / "out.csv").read_text().splitlines()]
    assert rows[0] == ["", *NAMES] and rows[3] == ["three.obj", "2.5", "3", "0"] and len(rows) == 4
    assert read == [tmp_path / "in.npz"] and drawn[0][2:] == (NAMES, ["x", "x", "y"])
    said = capsys.readouterr().out.splitlines()
    assert said[0].startswith("3 shapes, 3 distances in ")
    if knn:
        # Of the first two each is nearest to the other, the first to the third; of others the first has the third.
        assert said[1] == "66.7 % of the classes are those of 1 neighbours"
        assert said[2:] == (["0.0 % are those of 1 neighbours of others"] if owners else [])
    else:
        assert len(said) == 1


def test_neighbours_are_those_by_distances_from_which_no_floor_was_taken_off(
    distances, package, tmp_path, monkeypatch, capsys
):
    """Below it all shapes are alike, and the first ones would be everybody's neighbours."""
    raw = np.array([[0, 9.0, 1], [9, 0, 2], [1, 2, 0]])
    monkeypatch.setattr(package("pipelines.shapes.signature_index"), "read_index", lambda path: Index())
    monkeypatch.setattr(distances, "_matrix", lambda options, index: np.stack([np.zeros((3, 3)), raw]))
    monkeypatch.setattr(distances, "_draw", lambda *given: None)
    labels = tmp_path / "labels.csv"
    labels.write_text("".join(f"{n},{c}\n" for n, c in zip(NAMES, "xyx", strict=True)))
    distances.run(asked(tmp_path, knn=1, labels=labels))
    assert capsys.readouterr().out.splitlines()[1].startswith("66.7 % of the classes")


@pytest.mark.parametrize(("count", "jobs", "scheduler"), [(3, 0, None), (3, 2, None), (3, 0, "tcp"), (9, 0, None)])
def test_few_distances_are_found_here_and_many_by_a_batch(
    distances, package, tmp_path, monkeypatch, count, jobs, scheduler
):
    module = package("pipelines.shapes.signature_index")
    calls = []
    blocks = [(0, 2, 0, 2), (0, 2, 2, 3), (2, 3, 2, 3)]
    parts = [np.array([[[0, 1.0], [0, 0]]] * 2), np.array([[[2.0], [3]]] * 2), np.zeros((2, 1, 1))]
    monkeypatch.setattr(distances, "FEW", 3 if count == 3 else 2)
    monkeypatch.setattr(module, "blocks_of", lambda n: blocks)
    monkeypatch.setattr(
        module, "block_distances", lambda index, block, curvature: calls.append(curvature) or parts[blocks.index(block)]
    )
    monkeypatch.setattr(
        distances, "_by_batch", lambda options, index, blocks, curvature: calls.append("batch") or parts
    )
    found = distances._matrix(asked(tmp_path, jobs=jobs, scheduler=scheduler, curvature=None if jobs else 0.5), Index())
    assert found[0].tolist() == [[0, 1, 2], [1, 0, 3], [2, 3, 0]] and found[1].tolist() == found[0].tolist()
    assert calls == (["batch"] if jobs or scheduler or count == 9 else [0.5] * 3)


@pytest.mark.parametrize("fails", [False, True])
def test_blocks_are_asked_for_by_what_they_hold(distances, package, tmp_path, monkeypatch, fails):
    blocks = [(0, 2, 0, 2), (0, 2, 2, 3)]
    plans = []

    def carried_out(options, plan, tasks):
        plans.append((plan, tasks))
        plan.output.mkdir(parents=True)
        for k, block in enumerate(blocks):
            np.save(plan.output / ("_".join(map(str, block)) + ".npy"), np.full(2, k))
        state = "failed" if fails else "done"
        return {"a": {"state": "done", "message": "fine"}, "b": {"state": state, "message": "no room"}}

    monkeypatch.setattr(distances, "carried_out", carried_out)
    monkeypatch.setattr(package("batch.plan"), "tasks_of", lambda plan, path: path.read_text())
    options = asked(tmp_path)
    if fails:
        with pytest.raises(package("commands.common").CommandError, match="1 of 2 blocks could not be done: no room"):
            distances._by_batch(options, Index(), blocks, 0.25)
        return
    parts = distances._by_batch(options, Index(), blocks, 0.25)
    assert [p.tolist() for p in parts] == [[0, 0], [1, 1]]
    ((plan, tasks),) = plans
    folder = options.output.with_suffix(distances.BLOCKS)
    assert tasks == "asked/0_2_0_2.json\nasked/0_2_2_3.json\n" and plan.suffix == ".npy"
    assert not plan.reports and not plan.previews and plan.output == folder / "found"
    asked_for = json.loads((folder / "asked" / "0_2_2_3.json").read_text())
    assert asked_for["block"] == [0, 2, 2, 3] and asked_for["curvature"] == 0.25
    assert Path(asked_for["index"]).read_bytes() == b"index"


def test_blocks_of_another_index_are_other_blocks(distances, package, tmp_path, monkeypatch):
    """A batch goes on with what it has of the same words: these name what the index holds."""
    words, other = [], type("Other", (), {"bytes": lambda self: b"another index"})()

    def carried_out(options, plan, tasks):
        (plan.output).mkdir(parents=True, exist_ok=True)
        np.save(plan.output / "0_1_0_1.npy", np.zeros(1))
        words.append((tmp_path / f"out{distances.BLOCKS}" / "asked" / "0_1_0_1.json").read_text())
        return {"a": {"state": "done", "message": "fine"}}

    monkeypatch.setattr(distances, "carried_out", carried_out)
    monkeypatch.setattr(package("batch.plan"), "tasks_of", lambda plan, path: path.read_text())
    for index in (Index(), other, Index()):
        distances._by_batch(asked(tmp_path), index, [(0, 1, 0, 1)], 0.25)
    assert words[0] == words[2] != words[1]
    held = [Path(json.loads(text)["index"]).read_bytes() for text in words]
    assert held == [b"index", b"another index", b"index"]


@pytest.mark.parametrize(
    "text", ["{", "[]", '{"index": "a", "block": 1}', '{"index": 3, "block": [], "curvature": "x"}']
)
def test_what_is_no_block_is_refused(distances, package, tmp_path, text):
    path = tmp_path / "block.json"
    path.write_text(text)
    with pytest.raises(package("commands.common").CommandError, match="is no block of distances"):
        distances.run_block(SimpleNamespace(input=path, output=tmp_path / "out.npy"))


# ---- libraries -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("jobs", [0, 2])
@pytest.mark.parametrize("known", [[], ["one.obj"], ["one.obj", "two.obj"]])
@pytest.mark.parametrize("bad", [[], ["two.obj"], ["one.obj", "two.obj"]])
@pytest.mark.parametrize("since", ["as it was", "longer", "newer"])
def test_only_what_is_new_in_a_folder_or_has_changed_gets_a_signature(
    library, package, tmp_path, monkeypatch, capsys, jobs, known, bad, since
):
    folder, module = tmp_path / "meshes", package("pipelines.shapes.signature_index")
    folder.mkdir()
    for name in ("one.obj", "two.obj", "notes.txt"):
        (folder / name).write_text("v 0 0 0\n")
    common = package("commands.common")
    output = tmp_path / "index.npz"

    class Held(Index):
        def __init__(self, names):
            self.names, self.marks = tuple(names), tuple(library._mark(folder / n, None) for n in names)

        def __len__(self):
            return len(self.names)

        def bytes(self):
            return ",".join(sorted(self.names)).encode()

    old = Held(known) if known else None
    if old:
        output.write_bytes(old.bytes())
    monkeypatch.setattr(module, "read_index", lambda path: old)
    monkeypatch.setattr(
        module,
        "index_of",
        lambda new, old=None: Held(dict.fromkeys([*(old.names if old else ()), *new])) if new or old else None,
    )
    changed = known[:1] if since != "as it was" else []
    for name in changed:
        if since == "longer":
            (folder / name).write_text("v 0 0 0\nv 1 0 0\n")
        else:
            os.utime(folder / name, ns=(0, (folder / name).stat().st_mtime_ns + 1000))
    tried, told = [], []

    def signature(options, path):
        tried.append(path.name)
        if path.name in bad:
            raise common.CommandError("no signature")
        return "signature"

    monkeypatch.setattr(library, "signature_of_file", signature)
    monkeypatch.setattr(library, "_by_batch", lambda options, due: {n: "s" for n in sorted(due) if n not in bad})
    monkeypatch.setattr(library, "warn_of", told.append)
    options = SimpleNamespace(
        input=folder, output=output, markers=None, jobs=jobs, scheduler=None, report=None, points=100, object=[],
        scene="", skip_linked=False, strict=False, timeout=0.0, memory=0.0,
    )  # fmt: skip
    due = [n for n in ("one.obj", "two.obj") if n not in known or n in changed]
    new = [n for n in due if n not in bad]
    if not new and not known:
        with pytest.raises(common.CommandError, match="none of its 2 mesh files"):
            library.run(options)
        return
    library.run(options)
    assert tried == ([] if jobs else due) and len(told) == (0 if jobs else len(set(due) & set(bad)))
    every = sorted({*known, *new})
    assert output.read_bytes().decode() == ",".join(every)
    assert capsys.readouterr().out.startswith(f"{len(new)} new, {len(every)} in ")


@pytest.mark.parametrize("begin", ["", "{path}: ", "{path.name}: "])
def test_a_file_without_a_signature_is_named_once(library, tmp_path, monkeypatch, begin):
    """Reasons begin with the file, with its name, or with neither."""
    told = []
    monkeypatch.setattr(library, "warn_of", told.append)
    reason = begin.format(path=tmp_path / "in" / "a.obj") + "It is open"
    library._tell(SimpleNamespace(input=tmp_path), "in/a.obj", reason)
    assert told == ["in/a.obj: It is open"]


def test_a_batch_of_signatures_is_asked_with_what_was_asked(library, package, tmp_path, monkeypatch):
    plans, told = [], []

    def carried_out(options, plan, tasks):
        plans.append(plan)
        return {"a.obj": {"state": "done", "message": ""}, "b.obj": {"state": "done", "message": ""},
                "c.obj": {"state": "failed", "message": "open"}}  # fmt: skip

    monkeypatch.setattr(library, "carried_out", carried_out)
    monkeypatch.setattr(package("batch.plan"), "tasks_of", lambda plan, path: "tasks")
    monkeypatch.setattr(library, "read_signature", lambda path: path.name)
    monkeypatch.setattr(library, "warn_of", told.append)
    options = SimpleNamespace(
        input=tmp_path, output=tmp_path / "index.npz", markers=("A", "B"), points=77, object=["x", "-y"], scene="s",
        skip_linked=True, strict=True,
    )  # fmt: skip
    assert library._by_batch(options, {"a.obj", "c.obj"}) == {"a.obj": "a.npz"} and told == ["c.obj: open"]
    words = [
        "--points",
        "77",
        "--markers",
        "A,B",
        "--object=x",
        "--object=-y",
        "--scene=s",
        "--skip-linked",
        "--strict",
    ]
    assert list(plans[0].options) == words and plans[0].suffix == ".npz" and not plans[0].reports
    plain = SimpleNamespace(
        **(vars(options) | {"markers": None, "object": [], "scene": "", "skip_linked": False, "strict": False})
    )
    library._by_batch(plain, set())
    assert list(plans[1].options) == ["--points", "77"]
