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


@pytest.mark.parametrize("seed", range(4))
def test_uvs_have_their_digits_in_whatever_order_they_stand_and_shared_or_not(package, obj_precision, seed, tmp_path):
    """Lines of several objects, after one another or all before the faces."""
    rng = np.random.default_rng(seed)
    objects = [scenes.bump(2, 2, name="One"), scenes.bump(3, 1, name="Two")]
    uvs, numbers, corners = [], {}, []
    for obj in objects:
        uv = rng.random((len(obj.data.vertices), 2)).astype(np.float32)
        scenes.set_uv(obj, uv[[loop.vertex_index for loop in obj.data.loops]])
        for loop in obj.data.loops:
            # One line for a vertex, or for some of its corners one of their own.
            key = (obj.name, loop.vertex_index, loop.index if rng.random() < 0.3 * (seed % 2) else -1)
            numbers.setdefault(key, (len(numbers), uv[loop.vertex_index]))
            corners.append((obj, loop, key))
    order = rng.permutation(len(numbers))
    place = {key: int(np.flatnonzero(order == k)[0]) + 1 for key, (k, _) in numbers.items()}
    uvs = [value for _, value in numbers.values()]
    lines, first = [f"vt {uvs[k][0]:.6f} {uvs[k][1]:.6f}" for k in order.tolist()], 1
    for obj in objects:
        mine = {loop.index: f"{first + loop.vertex_index}/{place[key]}" for of, loop, key in corners if of is obj}
        lines += [f"o {obj.name}", *(f"v {v.co.x:.6f} {v.co.y:.6f} {v.co.z:.6f}" for v in obj.data.vertices)]
        lines += ["f " + " ".join(mine[k] for k in face.loop_indices) for face in obj.data.polygons]
        first += len(obj.data.vertices)
    (tmp_path / "out.obj").write_text("\n".join(lines))
    bpy.context.view_layer.update()
    obj_precision.restore_precision(tmp_path / "out.obj", objects)
    found = (tmp_path / "out.obj").read_text().split("\n")
    assert [line.split()[1:] for line in found if line.startswith("vt")] == [
        [f"{x:.9g}" for x in uvs[k].tolist()] for k in order.tolist()
    ]
    assert [line for line in found if line[:2] in ("f ", "o ")] == [line for line in lines if line[:2] in ("f ", "o ")]
