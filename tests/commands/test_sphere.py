"""sphere on the command line: what the operator writes, images redrawn, markers, refusals."""

from __future__ import annotations

import json

import bpy

import numpy as np
import pytest
import scenes
from globe_scenes import assert_lambert, ball, corner_vertices, open_ball, panorama, positions, project, red_of


def save(obj, path):
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    return obj.name


def test_the_command_redraws_an_image_file(run, tmp_path):
    image = panorama()
    image.filepath_raw, image.file_format = str(tmp_path / "world.png"), "PNG"
    image.save()
    save(ball(), tmp_path / "in.blend")
    arguments = ("sphere", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--projection", "lambert")
    pictures = ("--image", tmp_path / "world.png", "--image-out", tmp_path / "flat.png")
    assert run(*arguments, *pictures)[0] == 0
    assert_lambert(red_of(bpy.data.images.load(str(tmp_path / "flat.png"))))
    (tmp_path / "out.blend").unlink()
    for bad, message in (
        (("--image", tmp_path / "none.png", "--image-out", tmp_path / "x.png"), "no such file"),
        (("--image", tmp_path / "world.png", "--image-out", tmp_path / "x.doc"), "unknown image format"),
        (("--image", tmp_path / "in.blend", "--image-out", tmp_path / "x.png"), "cannot be read as an image"),
        (("--image", tmp_path / "world.png"), "go together"),
    ):
        status, _, err = run(*arguments, *bad)
        assert status == 1 and message in err
    assert not (tmp_path / "out.blend").exists()


@pytest.mark.parametrize("projection", ["equirect", "lambert", "octahedral"])
def test_the_command_writes_what_the_operator_writes(run, tmp_path, projection):
    obj = ball()
    save(obj, tmp_path / "in.blend")
    project(projection=projection.upper())
    expected = scenes.uv_of(obj)
    report = tmp_path / "report.json"
    arguments = ("-o", tmp_path / "out.blend", "--projection", projection, "--report", report)
    assert run("sphere", tmp_path / "in.blend", *arguments)[0] == 0
    assert (scenes.uv_of(bpy.data.objects["Ball"]) == expected).all()
    told = json.loads(report.read_text())
    assert told["projection"] == projection and told["charts"][0]["faces"] == 320
    assert told["charts"][0]["area_l1_sphere"] < 0.05


def test_the_command_takes_markers_and_refuses_what_is_open(run, tmp_path):
    obj = ball()
    obj.vertex_groups.new(name="pole").add([5], 1.0, "REPLACE")
    save(obj, tmp_path / "in.blend")
    assert run("sphere", tmp_path / "in.blend", "-o", tmp_path / "out.blend", "--pole", "pole")[0] == 0
    obj = bpy.data.objects["Ball"]
    assert np.allclose(scenes.uv_of(obj)[corner_vertices(obj) == 5, 1], 1, atol=1e-6)
    status, _, err = run("sphere", tmp_path / "in.blend", "-o", tmp_path / "x.blend", "--meridian", "pole")
    assert status == 1 and "needs one of the pole" in err
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    save(open_ball(), tmp_path / "open.blend")
    status, _, err = run("sphere", tmp_path / "open.blend", "-o", tmp_path / "no.blend")
    assert status == 1 and "not closed" in err and "Open: " in err
    assert not (tmp_path / "no.blend").exists()


def test_a_painted_part_gets_more_of_the_texture(run, tmp_path):
    obj = ball()
    V = positions(obj)
    top = np.flatnonzero(V[:, 2] > 0.6)
    obj.vertex_groups.new(name="face").add(top.tolist(), 1.0, "REPLACE")
    save(obj, tmp_path / "in.blend")
    project()
    space, _ = scenes.areas(obj)
    whole = np.isin(corner_vertices(obj).reshape(-1, 3), top).all(axis=1)
    plain = space[whole].sum() / space.sum()
    project(weight_group="face", weight_factor=4.0)
    _, uv = scenes.areas(obj)
    share = uv[whole].sum() / uv.sum()
    rest = ~np.isin(corner_vertices(obj).reshape(-1, 3), top).any(axis=1)
    density = (uv[whole].sum() / space[whole].sum()) / (uv[rest].sum() / space[rest].sum())
    assert share > 1.5 * plain and density == pytest.approx(4, rel=0.1)
    expected = scenes.uv_of(obj)
    arguments = ("-o", tmp_path / "out.blend", "--projection", "lambert", "--weights", "face", "--weight-factor", "4")
    assert run("sphere", tmp_path / "in.blend", *arguments)[0] == 0
    assert (scenes.uv_of(bpy.data.objects["Ball"]) == expected).all()
    for bad, expected, message in (
        (("--weights", "none"), 1, "no vertex group"),
        (("--weights", "face", "--weight-factor", "-1"), 2, "not greater than 0"),
    ):
        status, _, err = run("sphere", tmp_path / "in.blend", "-o", tmp_path / "x.blend", *bad)
        assert status == expected and message in err
