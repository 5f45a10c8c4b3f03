"""The commands match, average and measure --beltrami: files, reports, and what is refused."""

from __future__ import annotations

import json
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from match_scenes import body, pair
from sphere_shapes import random_rotation


def positions(obj):
    values = np.zeros(3 * len(obj.data.vertices), np.float32)
    obj.data.vertices.foreach_get("co", values)
    return values.reshape(-1, 3)


@pytest.fixture
def files(tmp_path):
    """Source and target in files of their own; the source's vertex of each of the target's."""
    source, target, of = pair(turned=False)
    for obj, name in ((source, "source"), (target, "target")):
        for other in (source, target):
            bpy.context.collection.objects.unlink(other)
        bpy.context.collection.objects.link(obj)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{name}.blend"), copy=True)
        bpy.context.collection.objects.link(target if obj == source else source)
    return tmp_path, of, positions(source), positions(target)


def test_transfer_between_files(run, files):
    folder, of, own, _ = files
    report = folder / "r.json"
    status, _, err = run("match", folder / "source.blend", folder / "target.blend", "-o", folder / "out.blend",
                         "--transfer", "uv,groups,materials", "--report", report)  # fmt: skip
    assert status == 0, err
    found = json.loads(report.read_text())
    assert found["flipped_area"] == 0 and found["met"] == 5 and found["fit_rms"] < 0.01
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
    obj = bpy.data.objects["Target"]
    up = np.array([sum(g.weight for g in v.groups if obj.vertex_groups[g.group].name == "up")
                   for v in obj.data.vertices])  # fmt: skip
    assert np.abs(up - np.clip(0.5 + 0.3 * own[of][:, 2], 0, 1)).max() < 0.03
    assert [slot.name for slot in obj.material_slots] == ["red", "blue"] and "Source" not in bpy.data.objects


def test_wrap_and_pairs_of_a_file(run, files):
    folder, of, own, there = files
    back = np.argsort(of)
    chosen = [int(own[:, k].argmax()) for k in range(3)] + [int(own[:, 1].argmin())]
    pairs = [[v, int(back[v])] for v in chosen[:3]] + [[chosen[3], own[chosen[3]].tolist()]]
    (folder / "pairs.json").write_text(json.dumps(pairs))
    arguments = ("match", folder / "source.blend", folder / "target.blend", "-o", folder / "out.obj", "--wrap")
    status, _, err = run(*arguments, "--landmarks", folder / "pairs.json")
    assert status == 0, err
    rows = [line.split()[1:4] for line in (folder / "out.obj").read_text().splitlines() if line.startswith("v ")]
    assert np.linalg.norm(np.array(rows, float)[of] - there, axis=1).max() < 0.05 * np.ptp(there)
    (folder / "pairs.json").write_text('[[0, 1], "x"]')
    status, _, err = run(*arguments, "--landmarks", folder / "pairs.json")
    assert status == 1 and "pair 1 is none" in err


def test_what_makes_no_sense_is_refused(run, files):
    folder, *_ = files
    out = folder / "out.blend"
    status, _, err = run("match", folder / "source.blend", folder / "source.blend", "-o", out)
    assert status == 2 and "both files are one" in err
    status, _, err = run("match", folder / "source.blend", folder / "target.blend", "-o", out, "--transfer", "hats")
    assert status == 2 and "hats is none of uv, groups" in err
    assert not out.exists()


def test_the_mean_of_a_folder(run, tmp_path):
    V, F = body(2)
    rng = np.random.default_rng(0)
    for k in range(4):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        W = (V + 0.003 * rng.normal(size=V.shape)) @ random_rotation(k).T
        if k == 2:
            W[5] *= 1.3
        scenes.add(W, F, f"Scan{k}")
        bpy.ops.wm.obj_export(filepath=str(tmp_path / f"scan{k}.obj"), forward_axis="Y", up_axis="Z",
                              export_materials=False)  # fmt: skip
    out, report = tmp_path / "mean.blend", tmp_path / "r.json"
    status, text, err = run("average", tmp_path, "-o", out, "--report", report, "--score", 1.2)
    assert status == 0, err
    rows = json.loads(report.read_text())["shapes"]
    assert [row["matched"] for row in rows] == [False] * 4
    assert max(rows, key=lambda row: row["greatest_score"])["file"].endswith("scan2.obj") and "scan2.obj" in text
    bpy.ops.wm.open_mainfile(filepath=str(out))
    score = np.zeros(len(V), np.float32)
    bpy.data.objects["scan2"].data.attributes["OMT Z-Score"].data.foreach_get("value", score)
    assert score.argmax() == 5 and "OMT Deviation" in bpy.data.objects["Mean"].data.attributes
    mean = positions(bpy.data.objects["Mean"])
    # What is told of a file is what is written of it, and all stand side by side.
    for k, row in enumerate(rows):
        obj = bpy.data.objects[f"scan{k}"]
        score, far = (
            np.array([d.value for d in obj.data.attributes[name].data]) for name in ("OMT Z-Score", "OMT Deviation")
        )
        told = [row[name] for name in ("greatest_score", "vertices_beyond", "greatest", "rms")]
        assert told == pytest.approx([score.max(), (score > 1.2).sum(), far.max(), np.sqrt((far**2).mean())], rel=1e-5)
        assert np.linalg.norm(positions(obj) - mean, axis=1) == pytest.approx(far, abs=1e-6)
        assert 0 < row["vertices_beyond"] < len(V) and f"{row['vertices_beyond']} vertices beyond 1.2" in text
        assert obj.location.x == pytest.approx((k + 1) * bpy.data.objects["scan0"].location.x)
    assert bpy.data.objects["scan0"].location.x >= np.ptp([v.co.x for v in bpy.data.objects["Mean"].data.vertices])
    status, _, err = run("average", tmp_path / "none", "-o", out)
    assert status == 1 and "no such folder" in err


def test_what_is_told_of_a_shape_that_had_to_be_matched_is_reported_with_its_name(run, files, package, monkeypatch):
    """The second of the files has other vertices, and what is found of it comes with two warnings."""
    folder, *_ = files
    remedy = package("solver.errors").MERGE

    def wrapped(job):
        yield package("solver.progress").Progress("Match", 0.0)
        return SimpleNamespace(wrapped=job.source.positions, warnings=("a hint", f"more: {remedy}"))

    monkeypatch.setattr(package("pipelines.shapes.wrap"), "wrap_surfaces", wrapped)
    out, report = folder / "out" / "mean.blend", folder / "out" / "r.json"
    out.parent.mkdir()
    status, _, err = run("average", folder, "-o", out, "--report", report)
    assert status == 0, err
    told = [line.removeprefix("omt_uv: warning: ") for line in err.splitlines() if "warning: " in line]
    assert told == json.loads(report.read_text())["warnings"]
    assert told == ["Target: a hint", f"Target: {package('remedies').advise(f'more: {remedy}')}"]


def test_strain_by_region(run, files):
    folder, *_ = files
    status, text, err = run("measure", folder / "source.blend", "--beltrami", "--json")
    assert status == 0, err
    rows = {row["name"]: row for row in json.loads(text)["Source"]}
    assert {"all", "up", "down", "material red"} <= rows.keys() and 0 < rows["all"]["mean"] < 1
    status, text, _ = run("measure", folder / "source.blend", "--beltrami", "--shape-key", "Grow")
    assert status == 0 and "all: mean strain 0.0000" in text
    status, _, err = run("measure", folder / "target.blend", "--beltrami")
    assert status == 1 and "no UV map" in err
    status, text, err = run("compare", folder / "source.blend", folder / "source.blend", "--beltrami", "--json")
    assert status == 0, err
    assert set(json.loads(text)[str(folder / "source.blend")].values()) == {0.0}
