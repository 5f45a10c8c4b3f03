"""Every figure that a command tells is the one that a plain formula gives of what the file holds."""

from __future__ import annotations

import csv
import io
import json
import re

import bpy

import numpy as np
import pytest
import scenes
from plain_figures import areas, quantile, read, shears, two_patches
from scipy.spatial import cKDTree

TEXTURE = 512


@pytest.fixture
def measured():
    """A scene, and its figures by plain formulas: area, UV area, UV share over surface share, and shear of faces."""
    two_patches()
    P, UV, corners, material = read()
    a, b = UV[:, 1] - UV[:, 0], UV[:, 2] - UV[:, 0]
    signed = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2
    area = areas(P)
    ratio = signed / np.abs(signed).sum() / (area / area.sum())
    assert 0 < (signed <= 0).sum() < 12
    return P, UV, corners, material, area, signed, ratio, shears(P, UV)


def save(tmp_path):
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "in.blend"))
    return tmp_path / "in.blend"


def test_measure_tells_what_plain_formulas_give(run, tmp_path, measured):
    _, UV, _, _, area, _, ratio, shear = measured
    weight, good = area / area.sum(), ratio > 0
    status, out, _ = run("measure", save(tmp_path), "--json")
    told = json.loads(out)
    octaves = np.where(good, np.abs(np.log2(np.maximum(ratio, 1e-12))), 40.0)
    expected = {
        "faces": len(area),
        "charts": 2,
        "folds": (~good).sum(),
        "area_l1": np.abs(ratio - 1) @ weight,
        "area_sd": np.sqrt((ratio - 1) ** 2 @ weight),
        "area_max": octaves[good].max(),
        "angle_mean": shear[good] @ area[good] / area[good].sum(),
        "angle_p99": quantile(shear[good], area[good], 0.99),
        "seed_area": (ratio + 1 / ratio)[good].mean(),
        "seed_angle": (shear + 1 / shear)[good].mean(),
        "skipped_zero_area_faces": 0,
    }
    assert status == 0
    for name, value in expected.items():
        assert told[name] == pytest.approx(value, rel=2e-4), name
    assert told["uv_min"] == pytest.approx(UV.min((0, 1))) and told["uv_max"] == pytest.approx(UV.max((0, 1)))
    assert 0 < told["overlap"] < 0.05 and told["finite"] is True
    assert told.keys() == expected.keys() | {"overlap", "finite", "uv_min", "uv_max", "area_p99"}
    line = run("measure", tmp_path / "in.blend")[1]
    numbers = [float(x) for x in re.findall(r"-?\d+\.\d+|\d+", line)]
    keys = ("area_l1", "area_sd", None, "area_p99", "angle_mean", None, "angle_p99", "folds", "faces", "overlap",
            "charts", "seed_area", "seed_angle")  # fmt: skip
    for key, number in zip(keys, numbers, strict=True):
        value = 99 if key is None else told[key] * (100 if key in ("area_l1", "overlap") else 1)
        assert number == pytest.approx(value, abs=0.0051), key


def test_rows_of_regions_are_what_plain_formulas_give(run, tmp_path, measured):
    P, UV, corners, material, area, signed, ratio, shear = measured
    words = ["measure", save(tmp_path), "--regions", "materials", "--texture-size", TEXTURE]
    status, out, _ = run(*words, "--csv")
    rows = list(csv.DictReader(io.StringIO(out)))
    assert status == 0 and [row["name"] for row in rows] == ["all", "blue", "red"]
    texts = run(*words)[1].splitlines()[1:]
    for row, text in zip(rows, texts, strict=True):
        inside = (material == row["name"]) | (row["name"] == "all")
        w = area[inside] / area[inside].sum()
        ends = np.sort(np.concatenate([corners[inside][:, [k, (k + 1) % 3]] for k in range(3)]), axis=1)
        sides = np.concatenate([P[inside][:, [k, (k + 1) % 3]] for k in range(3)])
        _, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
        flat = UV[inside].reshape(-1, 2)
        r = np.maximum(ratio[inside], 0)
        expected = {
            "faces": inside.sum(),
            "area": area[inside].sum(),
            "surface_share": area[inside].sum() / area.sum(),
            "texture_share": np.abs(signed[inside]).sum() / np.abs(signed).sum(),
            "perimeter": np.linalg.norm(np.ptp(sides[first[count == 1]], axis=1), axis=1).sum(),
            "uv_area": np.abs(signed[inside]).sum(),
            "uv_diameter": np.linalg.norm(flat[:, None] - flat, axis=2).max(),
            "ratio_mean": w @ r,
            "ratio_sd": np.sqrt(w @ (r - w @ r) ** 2),
            "shear": w @ shear[inside],
            "texel_density": TEXTURE * np.sqrt(np.abs(signed[inside]).sum() / area[inside].sum()),
        }
        assert row.keys() == expected.keys() | {"name"}
        for name, value in expected.items():
            assert float(row[name]) == pytest.approx(value, rel=2e-4), (row["name"], name)
        numbers = [float(x) for x in re.findall(r"\d+\.\d+|\d+", text.split(": ", 1)[1])]
        order = ("faces", "area", "surface_share", "texture_share", "perimeter", "uv_diameter", "ratio_mean",
                 "ratio_sd", "shear", "texel_density")  # fmt: skip
        for name, number in zip(order, numbers, strict=True):
            assert number == pytest.approx(expected[name] * (100 if "share" in name else 1), rel=2e-3), name


def test_polygons_are_counted_and_a_subdivided_surface_is_said(run, tmp_path):
    scenes.set_uv(obj := scenes.bump(), scenes.seen_from_above(obj))
    for name in ("red", "blue"):
        obj.data.materials.append(bpy.data.materials.new(name))
    for polygon in obj.data.polygons:
        polygon.material_index = polygon.index % 3 // 2
    count, path = len(obj.data.polygons), save(tmp_path)
    assert json.loads(run("measure", path, "--json")[1])["faces"] == count
    regions = json.loads(run("measure", path, "--regions", "materials", "--json")[1])["regions"]
    assert [row["faces"] for row in regions] == [count, count // 3, count - count // 3]
    (obj,) = bpy.data.objects
    modifier = obj.modifiers.new("Subdivision", "SUBSURF")
    modifier.levels = modifier.render_levels = 1
    told = json.loads(run("measure", save(tmp_path), "--json")[1])
    assert told["on_subdivided_surface"] is True
    assert "n the subdivided surface" in run("measure", path)[1]
    # As well as those of regions, whose quads are parts of their polygons.
    regions = json.loads(run("measure", path, "--regions", "materials", "--json")[1])["regions"]
    assert [row["faces"] for row in regions] == [4 * count, 4 * (count // 3), 4 * (count - count // 3)]
    assert regions[0]["shear"] == pytest.approx(told["angle_mean"], rel=1e-6)
    (bpy.context.view_layer.objects.active,) = bpy.data.objects
    bpy.ops.object.modifier_apply(modifier="Subdivision")
    applied = json.loads(run("measure", save(tmp_path), "--regions", "materials", "--json")[1])["regions"]
    for row, other in zip(regions, applied, strict=True):
        # Blender may put vertices onto the limit surface.
        assert row == {key: pytest.approx(x, rel=0.05) if key != "name" else x for key, x in other.items()}


def test_compare_tells_what_plain_formulas_give(package, run, tmp_path, monkeypatch):
    """A patch beside itself, moved by a known way, and with one vertex lifted."""
    # A hundred thousand points take most of the time of so small a mesh.
    monkeypatch.setattr(package("solver.comparison.comparison_figures"), "POINTS", 4000)
    obj = scenes.bump(12, 12)
    path, other = save(tmp_path), tmp_path / "other.blend"
    P = np.array([v.co[:] for v in obj.data.vertices])
    diagonal = np.linalg.norm(np.ptp(P, axis=0))
    (obj,) = bpy.data.objects
    obj.location.z = 0.02
    bpy.ops.wm.save_as_mainfile(filepath=str(other))
    (row,) = json.loads(run("compare", path, other, "--json")[1])
    (obj,) = bpy.data.objects
    quads = len(obj.data.polygons)
    assert (row["vertices"], row["faces"], row["components"], row["loops"], row["euler"]) == (
        len(P),
        2 * quads,
        1,
        1,
        1,
    )
    assert row["topology_kept"] is True
    # No point is moved further, and those of the boundary, where it is flat, not less.
    assert row["boundary"] == pytest.approx(0.02 / diagonal, rel=1e-3)
    assert 0.3 * 0.02 < row["rms"] * diagonal <= row["hausdorff"] * diagonal <= 0.02 * (1 + 1e-5)
    assert row["hausdorff"] == max(row["hausdorff_a"], row["hausdorff_b"]) <= row["hausdorff_bound"]
    assert row["rms"] ** 2 == pytest.approx((row["rms_a"] ** 2 + row["rms_b"] ** 2) / 2, rel=1e-2)
    line = run("compare", path, other)[1]
    assert f"{len(P)} vertices, {2 * quads} triangles" in line and f"Hausdorff {row['hausdorff']:.5f}" in line
    table = list(csv.DictReader(io.StringIO(run("compare", path, other, "--csv")[1])))
    assert float(table[0]["rms"]) == row["rms"] and len(table) == 1
    (obj,) = bpy.data.objects
    obj.location.z = 0
    obj.data.vertices[6 * 13 + 6].co.z += 0.3
    bpy.ops.wm.save_as_mainfile(filepath=str(other))
    (row,) = json.loads(run("compare", path, other, "--json")[1])
    assert row["hausdorff"] == row["hausdorff_b"] > 0.1 / diagonal and row["gaussian_error"] > 0.5


def test_remesh_tells_the_shapes_of_the_triangles_it_writes(run, tmp_path):
    scenes.bump(12, 12)
    path = save(tmp_path)
    P = np.array([v.co[:] for v in bpy.data.objects[0].data.vertices])
    words = ["remesh", path, "-o", tmp_path / "out.blend", "--vertices", 60, "--report", tmp_path / "r.json"]
    assert run(*words)[0] == 0
    (row,) = json.loads((tmp_path / "r.json").read_text())["levels"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    (mesh,) = (obj.data for obj in bpy.data.objects if len(obj.data.vertices) == row["vertices"])
    V, F = (np.array(x) for x in ([v.co[:] for v in mesh.vertices], [p.vertices[:] for p in mesh.polygons]))
    side = np.linalg.norm(V[F] - V[np.roll(F, -1, axis=1)], axis=2)
    area = areas(V[F])
    a, b, c = side.T
    cosine = np.stack([(b * b + c * c - a * a) / (2 * b * c), (a * a + c * c - b * b) / (2 * a * c),
                       (a * a + b * b - c * c) / (2 * a * b)], axis=1)  # fmt: skip
    least = np.degrees(np.arccos(cosine)).min(axis=1)
    ends = np.unique(np.sort(np.concatenate([F, np.roll(F, -1, axis=1)]).reshape(2, -1).T, axis=1), axis=0)
    long = np.linalg.norm(V[ends[:, 0]] - V[ends[:, 1]], axis=1)
    assert (row["vertices"], row["faces"], row["euler"]) == (len(V), len(F), len(V) - len(ends) + len(F))
    assert (row["object"], row["level"], row["components"], row["loops"]) == ("Bump", 0, 1, 1)
    assert row["angle_min"] == pytest.approx(least.min(), rel=1e-3)
    assert row["angle_mean"] == pytest.approx(least.mean(), rel=1e-3)
    assert row["below_30"] == pytest.approx((least < 30).mean(), abs=1e-9)
    assert row["quality"] == pytest.approx((4 * np.sqrt(3) * area / (side**2).sum(axis=1)).mean(), rel=0.1)
    assert row["edge_cv"] == pytest.approx(long.std() / long.mean(), rel=1e-3)
    assert row["area_cv"] == pytest.approx(area.std() / area.mean(), rel=1e-3)
    far = cKDTree(P).query(V)[0].max() / np.linalg.norm(np.ptp(P, axis=0))
    assert row["hausdorff_b"] <= far and row["hausdorff"] <= row["hausdorff_bound"]


def volume(obj):
    V = np.array([v.co[:] for v in obj.data.vertices])
    obj.data.calc_loop_triangles()
    F = np.array([t.vertices[:] for t in obj.data.loop_triangles])
    return float(np.einsum("ij,ij->i", V[F[:, 0]], np.cross(V[F[:, 1]], V[F[:, 2]])).sum() / 6)


def test_flow_tells_how_much_of_the_volume_is_gone(run, tmp_path):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=12, ring_count=8)
    before = volume(bpy.context.object)
    path = save(tmp_path)
    (tmp_path / "h.json").write_text('[{"vertices": [0], "move": [0, 0, 0.2]}]')
    words = ["flow", path, "-o", tmp_path / "out.blend", "--handles", tmp_path / "h.json"]
    assert run(*words, "--report", tmp_path / "r.json")[0] == 0
    told = json.loads((tmp_path / "r.json").read_text())
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    assert abs(volume(bpy.data.objects[0]) / before - 1) == pytest.approx(told["volume_change"], abs=1e-6)
    assert told["objects"] == ["Sphere"] and told["new_intersections"] == 0 and told["steps"] >= 1
    assert abs(told["volume_change"]) < 1e-6 <= told["drift"] < 0.05 and told["missed"] < 1e-3


def test_partition_tells_how_equal_its_cells_are(run, tmp_path):
    scenes.bump(12, 12)
    words = ["partition", save(tmp_path), "-o", tmp_path / "out.blend", "--cells", 5, "--report", tmp_path / "r.json"]
    status, out, _ = run(*words)
    (row,) = json.loads((tmp_path / "r.json").read_text())["meshes"]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "out.blend"))
    mesh = bpy.data.objects[0].data
    area = np.array([p.area for p in mesh.polygons])
    sets = np.array([d.value for d in mesh.attributes[".sculpt_face_set"].data])
    found = np.bincount(sets, area)[np.unique(sets)]
    assert status == 0 and len(found) == row["cells"] == 5 and row["error"] < 1e-6
    assert row["area"] == pytest.approx(area.sum(), rel=1e-2)
    assert row["error_of_faces"] == pytest.approx(np.abs(found / found.mean() - 1).max(), rel=0.2, abs=0.01)
    assert f"5 cells, largest error of an area {row['error']:.1e}" in out
    assert row["newton_steps"] <= row["all_newton_steps"] and row["torn"] == row["empty"] == []
