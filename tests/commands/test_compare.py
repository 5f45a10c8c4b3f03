"""The command compare, and the report of remesh, which has the same figures."""

from __future__ import annotations

import argparse
import csv
import io
import json
from pathlib import Path

import bpy

import meshes
import pytest
import scenes


@pytest.fixture
def bump(package, tmp_path, monkeypatch):
    # A hundred thousand points take most of the time of so small a mesh.
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 4000)
    V, F = meshes.bumpy(12, 12)
    lines = [f"v {x} {y} {z}" for x, y, z in V.tolist()] + [f"f {a} {b} {c}" for a, b, c in (F + 1).tolist()]
    (tmp_path / "in.obj").write_text("\n".join(lines) + "\n")
    return tmp_path


def test_levels_of_detail_have_rows_and_a_plot(run, bump):
    words = ["remesh", bump / "in.obj", "-o", bump / "out.obj", "--vertices", "120", "--levels", "2"]
    status, _, err = run(*words, "--report", bump / "r.json", "--preview", bump / "p.png")
    assert status == 0, err
    levels = json.loads((bump / "r.json").read_text())["levels"]
    assert [(row["level"], row["vertices"]) for row in levels] == [(0, 120), (1, 60)]
    assert levels[0]["hausdorff"] < levels[1]["hausdorff"] < 0.1 and levels[0]["topology_kept"]
    others = [bump / "out_LOD0.obj", bump / "out_LOD1.obj"]
    status, out, err = run("compare", bump / "in.obj", *others, "--csv", "--plot", bump / "plot.png")
    rows = list(csv.DictReader(io.StringIO(out)))
    assert (status, err) == (0, "")
    # What was written has single precision.
    for row, level in zip(rows, levels, strict=True):
        assert float(row["rms"]) == pytest.approx(level["rms"], rel=1e-3)
    for name in ("p.png", "plot.png"):
        assert (bump / name).read_bytes().startswith(b"\x89PNG")
    status, out, _ = run("compare", bump / "in.obj", bump / "in.obj")
    assert status == 0 and "Hausdorff 0.00000" in out and "topology kept" in out


def test_what_cannot_be_compared_or_drawn_is_one_line(run, bump):
    for words in (["none.obj"], ["in.obj", "--plot", bump / "p.jpg"], ["in.obj", "--plot", bump / "none" / "p.png"]):
        status, out, err = run("compare", bump / "in.obj", bump / words[0], *words[1:])
        assert (status, out) == (1, "") and len(err.splitlines()) == 1


@pytest.mark.parametrize("count", [1, 2, 4])
def test_all_objects_of_a_file_are_compared_together(package, monkeypatch, count):
    """Vertices and triangles of each come behind those of the ones before."""
    command, parts = package("commands.compare"), []
    for k in range(count):
        V, F = meshes.bumpy(2 + k, 3)
        parts.append((V + [3.0 * k, 0, 0], F))
    monkeypatch.setattr(command, "read_file", lambda options: [(None, part) for part in parts])
    monkeypatch.setattr(package("blender.measuring.distances"), "placed_mesh", lambda obj, part: part)
    options = argparse.Namespace(input=Path("in.blend"), object=[])
    positions, triangles = command._mesh(options, options.input)
    expected = [V[triangle].tolist() for V, F in parts for triangle in F]
    assert positions[triangles].tolist() == expected and len(positions) == sum(len(V) for V, _ in parts)


@pytest.mark.parametrize("more", [[], ["--beltrami"]], ids=str)
def test_objects_that_are_named_are_those_of_the_first_file(run, tmp_path, monkeypatch, package, more):
    """As everywhere where several files are read: of the others all are meant."""
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 500)
    for file, names in (("in", "AZ"), ("other", "B")):
        scenes.open_empty()
        for k, name in enumerate(names):
            obj = scenes.bump(3, 2, name=name, offset=5.0 * k)
            scenes.set_uv(obj, 0.2 * scenes.seen_from_above(obj))
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{file}.blend"))
    words = ["compare", tmp_path / "in.blend", tmp_path / "other.blend", "--json", *more]
    status, out, err = run(*words, "--object", "A")
    assert (status, err) == (0, "")
    found = json.loads(out)
    if more:
        assert set(found[str(tmp_path / "other.blend")].values()) == {0.0}
    else:
        assert [row["hausdorff"] for row in found] == [pytest.approx(0, abs=1e-6)]
    status, _, err = run(*words, "--object", "B")
    assert status == 1 and "in.blend: there is no mesh 'B'. It has A, Z." in err
