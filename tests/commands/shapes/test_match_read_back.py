"""Figures of a match are those that plain numpy has of the shape that was written and of what it was matched with."""

from __future__ import annotations

import json
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from sphere_shapes import blob


def body(name, seed, corners, subdivisions=2):
    """A body, and its vertices at the ends of the axes, as landmarks of one order on each body."""
    V, F = blob(subdivisions, seed=seed)
    V = V * [1.0, 1.3, 0.8]
    obj = scenes.add(V, F, name)
    for k in range(corners):
        axis, sign = k // 2, 1 - 2 * (k % 2)
        group = obj.vertex_groups.new(name=f"LM_{k}")
        group.add([int((sign * V[:, axis]).argmax())], 1.0, "REPLACE")
    return obj


def vertex_areas(V, F):
    area = np.linalg.norm(np.cross(V[F[:, 1]] - V[F[:, 0]], V[F[:, 2]] - V[F[:, 0]]), axis=1) / 2
    return np.bincount(F.ravel(), np.repeat(area / 3, 3), len(V)), area


def stretches(V, W, F):
    """Singular values (m,2) of the maps of triangles, the greater first."""
    found = []
    for (a, b, c), (p, q, r) in zip(V[F], W[F], strict=True):
        frames = []
        for one, two in ((b - a, c - a), (q - p, r - p)):
            x = one / np.linalg.norm(one)
            y = two - x * (two @ x)
            y /= np.linalg.norm(y)
            frames.append(np.array([[one @ x, two @ x], [one @ y, two @ y]]))
        found.append(np.linalg.svd(frames[1] @ np.linalg.inv(frames[0]), compute_uv=False))
    return np.array(found)


def distances(points, V, F):
    """Distances (k,) of points from a surface, by all of its triangles."""
    best = np.full(len(points), np.inf)
    for a, b, c in V[F]:
        u, v = b - a, c - a
        gram = np.array([[u @ u, u @ v], [u @ v, v @ v]])
        s, t = np.linalg.solve(gram, np.stack([(points - a) @ u, (points - a) @ v]))
        inside = (s >= 0) & (t >= 0) & (s + t <= 1)
        near = [np.where(inside, np.linalg.norm(points - (a + s[:, None] * u + t[:, None] * v), axis=1), np.inf)]
        for p, q in ((a, b), (b, c), (c, a)):
            along = np.clip((points - p) @ (q - p) / ((q - p) @ (q - p)), 0, 1)
            near.append(np.linalg.norm(points - (p + along[:, None] * (q - p)), axis=1))
        best = np.minimum(best, np.min(near, axis=0))
    return best


def _landmarks(obj):
    """Their vertices by name."""
    names = {group.index: group.name for group in obj.vertex_groups}
    return {names[g.group]: v.index for v in obj.data.vertices for g in v.groups}


@pytest.fixture(scope="module")
def matched(package, tmp_path_factory):
    """The report, basis and new shape of the source, its triangles, vertices and triangles of the target, landmarks."""
    folder = tmp_path_factory.mktemp("match")
    for name, seed in (("one", 1), ("two", 2)):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        body(name, seed, 6)
        bpy.ops.wm.save_as_mainfile(filepath=str(folder / f"{name}.blend"))
    target = np.array([v.co[:] for v in bpy.data.objects["two"].data.vertices])
    faces = np.array([p.vertices[:] for p in bpy.data.objects["two"].data.polygons])
    landmarks = _landmarks(bpy.data.objects["two"])
    words = ["match", folder / "one.blend", folder / "two.blend", "--wrap", "-o", folder / "out.blend",
             "--report", folder / "r.json"]  # fmt: skip
    assert package("cli").main([str(word) for word in words]) == 0
    bpy.ops.wm.open_mainfile(filepath=str(folder / "out.blend"))
    mesh = bpy.data.objects["one"].data
    V, W = (np.array([v.co[:] for v in mesh.shape_keys.key_blocks[k].data]) for k in (0, -1))
    F = np.array([p.vertices[:] for p in mesh.polygons])
    own = _landmarks(bpy.data.objects["one"])
    return json.loads((folder / "r.json").read_text()), V, W, F, (target, faces), (own, landmarks)


def test_the_shape_lies_on_the_target_and_how_far_from_it_its_faces_are_is_told(matched):
    report, _, W, F, (target, faces), _ = matched
    assert distances(W, target, faces).max() < 1e-4
    area = vertex_areas(W, F)[1]
    away = distances(W[F].mean(axis=1), target, faces)
    expected = np.sqrt(area @ away**2 / area.sum()) / np.linalg.norm(np.ptp(target, axis=0))
    assert report["fit_rms"] == pytest.approx(expected, rel=2e-2)


def test_areas_and_stretches_are_those_of_the_new_shape(matched):
    report, V, W, F, (target, faces), _ = matched
    assert report["intersections"] == 0
    before, after = (vertex_areas(X, F)[0] for X in (V, W))
    share, other = before / before.sum(), after / after.sum()
    ratio = np.maximum(share / other, other / share)
    assert report["area_distortion"]["mean"] == pytest.approx(share @ ratio, rel=1e-3)
    histogram = report["area_distortion"]["histogram"]
    assert sum(histogram) == pytest.approx(share[ratio <= 5].sum() if max(ratio) > 5 else 1, abs=1e-2)
    found = stretches(V, W, F) / np.sqrt(vertex_areas(target, faces)[0].sum() / before.sum())
    assert report["stretch_99"] == pytest.approx(np.percentile(found, 99, axis=0), rel=1e-2)
    assert report["flipped_area"] == 0


def test_landmarks_are_told_by_name_with_how_far_they_are_from_their_partners(matched):
    report, _, W, _, (target, _), (own, partner) = matched
    assert report["landmarks"].keys() == own.keys() == partner.keys() and report["met"] == len(own) == 6
    size = np.linalg.norm(np.ptp(target, axis=0))
    for name, value in report["landmarks"].items():
        away = np.linalg.norm(W[own[name]] - target[partner[name]])
        assert value == pytest.approx(away / size, abs=1e-4), name


@pytest.mark.parametrize("across", [0, 1, 4])
def test_faces_that_reach_across_a_seam_are_told_of(package, run, tmp_path, monkeypatch, across):
    for name in ("in", "to"):
        scenes.open_empty()
        V, F = blob(1, seed=1)
        scenes.add(V * [1.0, 1.3, 0.8], F, name)
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{name}.blend"))
    # A surface that is matched with itself gets what it has.
    found = SimpleNamespace(report=dict)
    module = package("commands.shapes.match")
    monkeypatch.setattr(module, "_match", lambda _, source, target: (found, (source[1].attributes, across), ["one"]))
    words = ["match", tmp_path / "in.blend", tmp_path / "to.blend", "-o", tmp_path / "out.blend"]
    status, _, err = run(*words, "--report", tmp_path / "r.json")
    assert status == 0, err
    first, *told = json.loads((tmp_path / "r.json").read_text())["warnings"]
    who = {0: [], 1: ["A face reaches across a seam"], 4: ["4 faces reach across a seam"]}[across]
    assert first == "one" and [text.partition(";")[0] for text in told] == who and all(text in err for text in told)


@pytest.mark.parametrize("how", ["transfer", "wrap", "operator"])
def test_faces_that_are_turned_over_for_a_match_are_those_of_the_object_that_is_named(run, capfd, tmp_path, how):
    names = ("Source", "Target")
    for k, name in enumerate(names):
        scenes.open_empty() if how != "operator" else None
        obj = body(name, k, 4, 1)
        for face in range(2 + k):
            obj.data.polygons[face].flip()
        obj.data.update()
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / f"{name}.blend"))
    if how == "operator":
        scenes.select([bpy.data.objects[name] for name in names])
        capfd.readouterr()
        mode = {"mode": "CHECKER", "landmark_prefix": "LM_", "use_polish": False}
        assert bpy.ops.object.omt_match(**mode) == {"FINISHED"}
        lines = capfd.readouterr().out.splitlines()
    else:
        words = [
            tmp_path / "Source.blend",
            tmp_path / "Target.blend",
            "-o",
            tmp_path / "out.blend",
            "--landmarks",
            "LM_",
        ]
        status, _, err = run("match", *words, *(["--wrap"] if how == "wrap" else []))
        assert status == 0, err
        lines = err.splitlines()
    told = [line.partition("arning: ")[2] for line in lines if "turned over for the match" in line]
    assert len(told) == 2
    for k, text in enumerate(told):
        assert text.startswith(f"{names[k]}: {2 + k} faces look to another side"), told
