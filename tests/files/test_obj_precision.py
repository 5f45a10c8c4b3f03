"""Numbers of OBJ lines are written with more digits where they agree with what is there, and are left alone else."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


@pytest.fixture
def obj_precision(package):
    return package("files.obj_precision")


@pytest.mark.parametrize(
    ("line", "row", "new"),
    [
        ("v 0.333333 2.000000 1.000000", [1 / 3, 2, 1], "v 0.333333333 2 1"),
        ("v 0.333333 2.000000 1.000000 0.5 0.25", [1 / 3, 2, 1], "v 0.333333333 2 1 0.5 0.25"),
        # A millionth off, to the last bit, and a little more.
        ("vt 0.000001 0.500000", [0, 0.5], "vt 0 0.5"),
        ("vt 0.0000011 0.500000", [0, 0.5], None),
        ("vt 1000.001000 0.500000", [1000, 0.5], "vt 1000 0.5"),
        ("vt 1000.001100 0.500000", [1000, 0.5], None),
        ("vt -999.999000 0.500000", [-1000, 0.5], "vt -1000 0.5"),
        ("vt 0.500000 0.600000", [0.5, 0.5], None),
    ],
)
def test_numbers_that_agree_have_all_their_digits(obj_precision, line, row, new):
    lines = ["# text", line]
    obj_precision._replace(lines, [1], np.array([row], float))
    assert lines == ["# text", new or line]
    obj_precision._replace(lines, [1, 0], np.array([row], float))
    assert lines == ["# text", new or line]


@pytest.mark.parametrize("change", ["moved", "turned", "stretched", "sheared"])
def test_a_small_body_has_its_digits_however_it_stands(package, tmp_path, change):
    """Six decimals would be three digits of it; what stands in the file is what the mesh has in the world."""
    from mathutils import Euler

    objects = [scenes.bump(3, 2, name="One"), scenes.bump(4, 2, name="Another with spaces")]
    for obj in objects:
        for vertex in obj.data.vertices:
            vertex.co *= 1e-3
        obj.location = (1e-3, 2e-3, -3e-3)
        if change != "moved":
            obj.rotation_euler = Euler((0.3, -0.7, 1.9))
        if change == "stretched":
            obj.scale = (1, 2, 0.5)
        if change == "sheared":
            obj.parent = bpy.data.objects.new("Parent", None)
            bpy.context.scene.collection.objects.link(obj.parent)
            obj.parent.scale = (1, 2, 0.5)
    bpy.context.view_layer.update()
    package("files.export").export(tmp_path / "out.obj", ".obj", objects, False)
    lines = [line.split() for line in (tmp_path / "out.obj").read_text().splitlines()]
    found = np.array([line[1:4] for line in lines if line[:1] == ["v"]], float)
    world = [np.array([v.co[:] for v in obj.data.vertices]) @ np.array(obj.matrix_world)[:3, :3].T
             + np.array(obj.matrix_world)[:3, 3] for obj in objects]  # fmt: skip
    np.testing.assert_allclose(found, np.concatenate(world), rtol=0, atol=3e-9)
