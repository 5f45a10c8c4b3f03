"""Figures of flows, volumes, globes and cells are those that plain numpy has of the files that were written."""

from __future__ import annotations

import json
import re

import bpy

import command_runs
import numpy as np
import operator_runs
import pytest

TETS = ["--tets", "200"]


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    made = tmp_path_factory.mktemp("bodies")
    operator_runs.bodies(operator_runs.some_uvs())
    bpy.ops.wm.save_as_mainfile(filepath=str(made / "in.blend"))
    return made


def told(run, folder, name, *words):
    status, _, err = run(name, folder / "in.blend", *words, "--report", folder / "r.json")
    assert status == 0, err
    return json.loads((folder / "r.json").read_text())


def points_of(obj):
    return np.array([obj.matrix_world @ v.co for v in obj.data.vertices])


def faces_of(obj):
    return np.array([face.vertices[:] for face in obj.data.polygons])


def volume_of(V, T):
    a, b, c, d = (V[T[:, k]] for k in range(4))
    return np.einsum("ij,ij->i", b - a, np.cross(c - a, d - a)) / 6


def values(obj, name, key, width=1):
    found = np.zeros(len(obj.data.attributes[name].data) * width, np.float32)
    obj.data.attributes[name].data.foreach_get(key, found)
    return found.reshape(-1, width)


def test_a_volume_is_the_same_in_every_format_and_its_figures_are_those_of_its_tetrahedra(run, folder):
    pytest.importorskip("tetgen")
    one = ["--object", "B", *TETS]
    (row,) = told(run, folder, "volume", "-o", folder / "out.npz", *one)["volumes"]
    data = dict(np.load(folder / "out.npz"))
    here, there = volume_of(data["points"], data["tets"]), volume_of(data["positions"], data["tets"])
    shares, grown = here / here.sum(), there / there.sum()
    np.testing.assert_allclose(data["dilation"], np.log2(grown / shares), atol=1e-9)
    around = [np.bincount(data["tets"].ravel(), np.repeat(x / 4, 4)) for x in (shares, grown)]
    assert row["object"] == "B" and row["domain"] == "ball"
    assert (row["points"], row["tetrahedra"]) == (len(data["points"]), len(data["tets"]))
    assert row["inverted"] == (there <= 0).sum()
    assert row["share_error"] == pytest.approx(np.abs(grown - shares).sum(), rel=1e-6)
    assert row["vertex_share_error"] == pytest.approx(np.abs(around[1] - around[0]).sum(), rel=1e-6)
    bins = np.floor((data["dilation"] + 2) / 0.1).astype(int)
    assert row["log2_dilation_histogram"] == np.bincount(bins[(bins >= 0) & (bins < 40)], minlength=40).tolist()
    told(run, folder, "volume", "-o", folder / "out.vtu", *one)
    arrays = dict(re.findall(r'Name="([^"]+)"[^>]*>\s*([^<]*)<', (folder / "out.vtu").read_text()))
    found = {name: np.array(text.split(), float) for name, text in arrays.items()}
    for name, key in (("Points", "points"), ("connectivity", "tets"), ("OMT Ball", "positions"),
                      ("OMT Dilation", "dilation")):  # fmt: skip
        np.testing.assert_allclose(found[name], data[key].ravel(), err_msg=name)
    assert found["offsets"].tolist() == list(range(4, 4 * len(data["tets"]) + 1, 4)) and set(found["types"]) == {10}
    told(run, folder, "volume", "-o", folder / "out.blend", *one)
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
    obj = bpy.data.objects["B Tetrahedra"]
    np.testing.assert_allclose(points_of(obj), data["points"], atol=1e-5)
    np.testing.assert_allclose(values(obj, "OMT Ball", "vector", 3), data["positions"], atol=1e-6)
    of = {}
    for tet, value in zip(data["tets"].tolist(), data["dilation"].tolist(), strict=True):
        for left_out in range(4):
            of.setdefault(frozenset(np.delete(tet, left_out).tolist()), []).append(value)
    mine = [frozenset(face) for face in faces_of(obj).tolist()]
    assert len(mine) == len(of) and set(mine) == of.keys()
    # A face has the value of a tetrahedron that it is of.
    for face, value in zip(mine, values(obj, "OMT Dilation", "value")[:, 0], strict=True):
        assert min(abs(value - other) for other in of[face]) < 1e-5


def test_cells_are_those_of_the_faces_that_were_written(run, folder):
    rows = told(run, folder, "partition", "-o", folder / "out.blend", "--cells", 5, "--write", "attribute")["meshes"]
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
    assert [row["object"] for row in rows] == ["A", "B"]
    for row in rows:
        obj = bpy.data.objects[row["object"]]
        V, F = points_of(obj), faces_of(obj)
        area = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2
        cell = np.array([item.value for item in obj.data.attributes["OMT Cell"].data])
        mass = np.bincount(cell - cell.min(), area)
        assert len(mass) == row["cells"] == 5
        assert row["area"] == pytest.approx(area.sum(), rel=1e-5)
        assert row["error_of_faces"] == pytest.approx(np.abs(mass / area.sum() * 5 - 1).max(), rel=1e-3)


def test_what_flows_has_the_volumes_that_are_told_each_body_its_own(run, folder):
    handles = [{"vertices": [3], "move": [0.1, 0.2, 0.05]}]
    (folder / "h.json").write_text(json.dumps(handles))
    figures = told(run, folder, "flow", "-o", folder / "out.blend", "--handles", folder / "h.json", "--object", "B")
    found = []
    for name in ("in", "out"):
        bpy.ops.wm.open_mainfile(filepath=str(folder / f"{name}.blend"))
        found.append({obj.name: (points_of(obj), faces_of(obj)) for obj in bpy.data.objects})
    before, after = found
    np.testing.assert_array_equal(before["A"][0], after["A"][0])
    (V, F), (W, _) = before["B"], after["B"]
    sizes = [np.einsum("ij,ij->i", X[F[:, 0]], np.cross(X[F[:, 1]], X[F[:, 2]])).sum() for X in (V, W)]
    assert figures["objects"] == ["B"]
    assert abs(sizes[1] / sizes[0] - 1) == pytest.approx(figures["volume_change"], abs=1e-6)
    np.testing.assert_allclose(W[3] - V[3], [0.1, 0.2, 0.05], atol=1e-3)


def test_globes_have_the_areas_that_are_told(run, folder):
    rows = told(run, folder, "sphere", "-o", folder / "out.blend", "--projection", "lambert")["charts"]
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
    assert [row["object"] for row in rows] == ["A", "B"]
    for row in rows:
        obj = bpy.data.objects[row["object"]]
        V, F = points_of(obj), faces_of(obj)
        assert (row["vertices"], row["faces"], row["holes"]) == (len(V), len(F), 0)
        area = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1)
        uv = np.array([item.vector[:] for item in obj.data.uv_layers.active.uv], float).reshape(-1, 3, 2)
        a, b = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
        flat = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
        error = np.abs(flat / flat.sum() - area / area.sum()).sum()
        assert row["area_l1"] == pytest.approx(error, rel=2e-2, abs=2e-3)


def test_a_surface_matched_with_itself_gets_all_that_it_has_and_its_figures_are_none(run, tmp_path):
    command_runs.body("in", seed=4)
    obj = bpy.context.object
    for face in obj.data.polygons:
        face.material_index = face.index % 2
    for name in ("one", "two"):
        obj.data.materials.append(bpy.data.materials.new(name))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    obj = bpy.data.objects["in"]
    weights = [sum(g.weight for g in v.groups) for v in obj.data.vertices]
    positions = points_of(obj)
    obj.vertex_groups.clear()
    obj.data.uv_layers.remove(obj.data.uv_layers.active)
    for face in obj.data.polygons:
        face.material_index = 0
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "bare.blend"))
    words = ["match", tmp_path / "in.blend", tmp_path / "bare.blend", "-o", tmp_path / "out.blend"]
    status, _, err = run(*words, "--report", tmp_path / "r.json")
    assert status == 0, err
    row = json.loads((tmp_path / "r.json").read_text())
    assert row["flipped_area"] == 0 and row["met"] == len(row["landmarks"]) == 0
    assert max(row["stretch_99"]) == pytest.approx(1, abs=1e-2) and row["fit_rms"] < 1e-2
    assert row["area_distortion"]["mean"] == pytest.approx(1, abs=1e-2)
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    obj = bpy.data.objects["in"]
    np.testing.assert_allclose(points_of(obj), positions, atol=1e-6)
    found = [sum(g.weight for g in v.groups) for v in obj.data.vertices]
    np.testing.assert_allclose(found, weights, atol=2e-2)
    assert [face.material_index for face in obj.data.polygons] == [k % 2 for k in range(len(obj.data.polygons))]
    assert len(obj.data.uv_layers) == 1


ROWS = {"partition": ("meshes", ["--cells", "4", "--relax", "0"]), "sphere": ("charts", ["--quality", "draft"]),
        "volume": ("volumes", TETS), "remesh": ("levels", ["--vertices", "40", "--levels", "2"])}  # fmt: skip


@pytest.mark.parametrize("name", ROWS)
def test_each_of_several_objects_has_the_row_that_it_has_alone(package, run, folder, monkeypatch, name):
    if name == "volume":
        pytest.importorskip("tetgen")
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 500)
    key, words = ROWS[name]
    both, *single = (told(run, folder, name, "-o", folder / "out.blend", *words, *chosen)[key]
                     for chosen in ([], ["--object", "A"], ["--object", "B"]))  # fmt: skip
    alone = [row for rows in single for row in rows]
    assert [row["object"] for row in both] == [row["object"] for row in alone]
    assert len({json.dumps(row) for row in both}) == len(both) >= 2
    assert both == alone


def test_what_writers_of_every_level_say_is_told_once(package, monkeypatch, tmp_path):
    remesh, saving = package("commands.remesh"), package("files.saving")
    said = {"x_LOD0.obj": ["a", "b"], "x_LOD1.obj": ["b"], "x_LOD2.obj": ["c", "a"]}
    objects = [[f"{name}{k}" for k in range(3)] for name in "AB"]
    for name in (name for names in objects for name in names):
        bpy.data.objects.new(name, bpy.data.meshes.new(name))
    written = {}

    def save(path, made, *_):
        written[path.name] = [obj.name for obj in made]
        return said[path.name]

    monkeypatch.setattr(saving, "save", save)
    assert remesh._save(tmp_path / "x.obj", objects, tmp_path / "in.obj") == ["a", "b", "c"]
    assert written == {f"x_LOD{k}.obj": [f"A{k}", f"B{k}"] for k in range(3)}


def test_slots_without_a_material_are_regions_by_their_number(run, folder, tmp_path):
    bpy.ops.wm.open_mainfile(filepath=str(folder / "in.blend"))
    mesh = bpy.data.objects["A"].data
    for material in (bpy.data.materials.new("one"), None, None):
        mesh.materials.append(material)
    for face in mesh.polygons:
        face.material_index = face.index % 3
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    status, out, err = run("measure", tmp_path / "in.blend", "--object", "A", "--beltrami", "--json")
    assert status == 0, err
    rows = {row["name"]: row["share"] for row in json.loads(out)["A"]}
    slots = [f"material {name}" for name in ("one", "1", "2")]
    assert {"all", *slots} <= rows.keys() and sum(rows[name] for name in slots) == pytest.approx(1)
