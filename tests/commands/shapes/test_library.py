"""distance, library and similar: a body finds itself, what cannot be compared is named, an index is added to."""

from __future__ import annotations

import csv
import json

import bpy

import numpy as np


def body(path, scale):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
    for vertex in bpy.context.object.data.vertices:
        vertex.co.x *= scale * (1.5 if vertex.co.x > 0 else 1)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def test_a_folder_is_indexed_once_and_searched(run, tmp_path):
    (tmp_path / "all").mkdir()
    body(tmp_path / "all" / "round.blend", 1)
    body(tmp_path / "all" / "long.blend", 3)
    # What is no mesh is nobody's business, and each picture comes without the other.
    (tmp_path / "all" / "notes.txt").write_text("v 0 0 0")
    words = ["library", tmp_path / "all", "-o", tmp_path / "index.npz"]
    status, out, err = run(*words)
    assert status == 0 and out.startswith("2 new, 2 in ") and err == ""
    for kind in ("--mds", "--picture"):
        made = tmp_path / f"{kind}.png"
        assert run("distances", tmp_path / "index.npz", "-o", tmp_path / "d.csv", kind, made)[0] == 0
        assert made.stat().st_size > 1000
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_torus_add()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "all" / "ring.blend"))
    status, out, err = run(*words)
    assert status == 0 and out.startswith("0 new, 2 in ") and "ring.blend" in err and "handle" in err
    body(tmp_path / "query.blend", 2.8)
    status, out, _ = run("similar", tmp_path / "query.blend", "--index", tmp_path / "index.npz", "--top", 2)
    assert status == 0 and [json.loads(line)["name"] for line in out.splitlines()] == ["long.blend", "round.blend"]
    status, out, _ = run("distance", tmp_path / "query.blend", tmp_path / "all" / "long.blend", "--json")
    assert status == 0 and json.loads(out)["raw"] < 0.3
    assert "no such index" in run("similar", tmp_path / "query.blend", "--index", tmp_path / "none.npz")[2]


def test_a_folder_goes_into_an_index_and_a_matrix_by_a_batch_as_it_does_without(package, run, tmp_path):
    """The same signatures, the same distances; done again is only what changed; the class of the nearest is told."""
    (tmp_path / "all").mkdir()
    for name, scale in (("round", 1), ("rounder", 1.05), ("long", 3), ("longer", 3.2)):
        body(tmp_path / "all" / f"{name}.blend", scale)
    status, out, err = run("distances", tmp_path / "all", "-o", tmp_path / "d.csv", "--points", 100)
    assert status == 0 and "6 distances" in out, err
    with open(tmp_path / "d.csv") as file:
        names, *rows = list(csv.reader(file))
    assert names[1:] == [row[0] for row in rows] == ["long.blend", "longer.blend", "round.blend", "rounder.blend"]
    found = np.array([row[1:] for row in rows], float)
    assert np.array_equal(found, found.T) and not found.diagonal().any() and found[0, 2] > 2 * found[0, 1]
    words = ["library", tmp_path / "all", "-o", tmp_path / "index.npz", "--points", 100]
    assert run(*words)[1].startswith("4 new, 4 in ")
    read = package("pipelines.shapes.signature_index").read_index
    assert np.allclose(read(tmp_path / "index.npz").packed, read(tmp_path / "d.index.npz").packed, atol=1e-5)
    assert run(*words, "--jobs", 1)[1].startswith("0 new, 4 in ")
    (tmp_path / "labels.csv").write_text("".join(f"{name},{name[:4]}\n" for name in names[1:]))
    more = ["--labels", tmp_path / "labels.csv", "--knn", 1, "--jobs", 1, "--mds", tmp_path / "m.png"]
    words = ["distances", tmp_path / "index.npz", "-o", tmp_path / "e.csv", "--picture", tmp_path / "e.png", *more]
    status, out, err = run(*words)
    assert status == 0 and "100.0 % of the classes are those of 1 neighbours" in out, err
    again = np.genfromtxt(tmp_path / "e.csv", delimiter=",", skip_header=1)[:, 1:]
    assert np.allclose(again, found, atol=1e-3)
    assert (tmp_path / "e.png").stat().st_size > 1000 and (tmp_path / "m.png").stat().st_size > 1000
    blocks = tmp_path / "e.blocks" / "found" / "0_4_0_4.npy"
    before = blocks.stat().st_mtime_ns
    assert run(*words)[0] == 0 and blocks.stat().st_mtime_ns == before
    (tmp_path / "labels.csv").write_text("long.blend,long\n")
    assert "no class for 3 shapes" in run(*words)[2]


def test_markers_compare_faces_as_they_lie(run, tmp_path):
    """By groups or by numbers; an index with markers asks for them, and whose a face is can be left out."""
    (tmp_path / "faces").mkdir()
    for name, bump in (("anna_flat", 0), ("anna_deep", 2), ("bert_flat", 0.1), ("bert_deep", 2.1)):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        bpy.ops.mesh.primitive_grid_add(x_subdivisions=12, y_subdivisions=12)
        own = bpy.context.object
        for vertex in own.data.vertices:
            x, y, _ = vertex.co
            vertex.co.z = 0.4 * bump * np.exp(-8 * ((x - 0.4) ** 2 + y**2))
        for group, row in (("P", 84), ("Q", 90)):
            own.vertex_groups.new(name=group).add([row], 1.0, "REPLACE")
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "faces" / f"{name}.blend"))
    one, other = tmp_path / "faces" / "anna_flat.blend", tmp_path / "faces" / "bert_deep.blend"
    told = [
        json.loads(run("distance", one, other, "--points", 100, "--markers", words, "--json")[1])
        for words in ("P,Q", "84,90")
    ]
    assert told[0]["raw"] == told[1]["raw"] > 0.1
    assert "no vertex group 'X'" in run("distance", one, other, "--markers", "X,Q")[2]
    # A number among names is a name.
    for words, name in (("84,Q", "84"), ("P,86", "86")):
        status, _, err = run("distance", one, other, "--markers", words)
        assert status == 1 and f"no vertex group '{name}'" in err and len(err.splitlines()) == 1, err
    assert "no vertex 999" in run("distance", one, other, "--markers", "84,999")[2]
    around = run("distance", one, other, "--points", 100, "--markers", "84,86", "--json")[1]
    assert json.loads(around)["raw"] > 0.05 and json.loads(around)["raw"] != told[0]["raw"]
    assert "lies on the boundary" in run("distance", one, other, "--markers", "90,84")[2]
    assert run("distance", one, other, "--markers", "P")[0] == 2
    (tmp_path / "labels.csv").write_text(
        "".join(f"{who}_{kind}.blend,{kind},{who}\n" for who in ("anna", "bert") for kind in ("flat", "deep"))
    )
    words = ["distances", tmp_path / "faces", "-o", tmp_path / "d.csv", "--markers", "P,Q", "--points", 100]
    status, out, err = run(*words, "--labels", tmp_path / "labels.csv", "--knn", 1)
    assert status == 0 and "100.0 % are those of 1 neighbours of others" in out, err
    assert "markers" in run("similar", one, "--index", tmp_path / "d.index.npz")[2]
    status, out, _ = run("similar", other, "--index", tmp_path / "d.index.npz", "--markers", "P,Q", "--top", 2)
    assert status == 0 and [json.loads(line)["name"] for line in out.splitlines()] == [
        "bert_deep.blend",
        "anna_deep.blend",
    ]
    assert "without" not in run("library", tmp_path / "faces", "-o", tmp_path / "d.index.npz")[1]
    assert "with markers" in run("library", tmp_path / "faces", "-o", tmp_path / "d.index.npz")[2]
