"""Marks of what figures hang on, mending of meshes, and checkers in place of materials."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


def lifted(obj):
    obj.data.vertices[-1].co.z += 1e-3


def narrowed(obj):
    obj.data.vertices[0].co.x += 1e-3


def scaled(obj):
    obj.scale.z = 2
    bpy.context.view_layer.update()


def last_uv(obj):
    obj.data.uv_layers.active.uv[-1].vector[1] += 1e-3


def first_uv(obj):
    obj.data.uv_layers.active.uv[0].vector[0] += 1e-3


def turned_over(obj):
    obj.data.polygons[0].flip()


def other_layer(obj):
    obj.data.uv_layers.active = obj.data.uv_layers.new(name="other")
    last_uv(obj)


def seam(obj):
    obj.data.edges[0].use_seam = True


def moved(obj):
    obj.location = (1, 2, 3)
    bpy.context.view_layer.update()


def chosen(obj):
    obj.data.polygons[0].select = not obj.data.polygons[0].select


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("change", [lifted, narrowed, scaled, last_uv, first_uv, turned_over, other_layer])
def test_what_figures_of_uvs_hang_on_changes_their_mark(package, change, mode):
    obj, mark = scenes.bump(), package("blender.fingerprint").uv_mark
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    before = mark(obj)
    change(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    assert mark(obj) != before


@pytest.mark.parametrize("change", [seam, moved, chosen, lambda obj: None])
def test_what_they_do_not_hang_on_leaves_it(package, change):
    obj, mark = scenes.bump(), package("blender.fingerprint").uv_mark
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    before, meshes = mark(obj), len(bpy.data.meshes)
    change(obj)
    assert mark(obj) == before
    scenes.edit(obj)
    assert mark(obj) == before and len(bpy.data.meshes) == meshes
    scenes.leave_edit()
    for layer in list(obj.data.uv_layers):
        obj.data.uv_layers.remove(layer)
    assert mark(obj) != before


def flat(gap, scale=(1.0, 1.0, 1.0)):
    """Two quads side by side, a gap between the vertices that they should share, ten units wide in the world."""
    V = np.array([[0, 0, 0], [5, 0, 0], [5, 5, 0], [0, 5, 0], [5 + gap, 0, 0], [10, 0, 0], [10, 5, 0], [5 + gap, 5, 0]])
    obj = scenes.add(V / np.array(scale), [[0, 1, 2, 3], [4, 5, 6, 7]])
    obj.scale = scale
    bpy.context.view_layer.update()
    scenes.select([obj])
    return obj


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize(("scale", "gap", "joined"), [
    ((1, 1, 1), 2e-6, 2), ((1, 1, 1), 5e-5, 0), ((100, 100, 100), 2e-6, 2), ((0.01, 0.01, 0.01), 5e-5, 0),
])  # fmt: skip
def test_vertices_on_one_another_are_joined_whatever_the_scale(package, mode, scale, gap, joined):
    obj = flat(gap, scale)
    if mode == "EDIT":
        scenes.edit(obj)
    assert package("blender.clean").merge(obj) == joined
    scenes.leave_edit()
    assert len(obj.data.vertices) == 8 - joined and len(obj.data.polygons) == 2


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_lengths_of_an_object_scaled_along_one_axis_are_told_by_the_greatest_scale(package, mode):
    """Ten wide and scaled by ten: one of its own units, of which a gap of 4e-6 is too much to be joined."""
    for gap, joined in ((4e-5, 0), (4e-6, 2)):
        obj = flat(gap, (10, 1, 1))
        obj.data.vertices.foreach_set("co", (np.array([v.co[:] for v in obj.data.vertices]) * [1, 0.1, 1]).ravel())
        bpy.context.view_layer.update()
        if mode == "EDIT":
            scenes.edit(obj)
        assert package("blender.clean").merge(obj) == joined
        scenes.leave_edit()


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_faces_without_area_are_dissolved_and_turned_ones_turned(package, mode):
    clean = package("blender.clean")
    V, F = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0.5, 0, 0]], [[0, 4, 1], [0, 1, 2, 3]]
    obj = scenes.add(np.array(V, float), F)
    scenes.select([obj])
    if mode == "EDIT":
        scenes.edit(obj)
    assert clean.dissolve(obj) > 0
    scenes.leave_edit()
    assert min(p.area for p in obj.data.polygons) > 0.1
    assert clean.dissolve(obj) == 0
    cube = scenes.cube()
    for k in (1, 4):
        cube.data.polygons[k].flip()
    if mode == "EDIT":
        scenes.edit(cube)
    assert clean.turn_outside(cube) == 2
    assert clean.turn_outside(cube) == 0
    scenes.leave_edit()
    middle = np.mean([v.co[:] for v in cube.data.vertices], axis=0)
    assert all(np.dot(p.normal, np.array(p.center) - middle) > 0 for p in cube.data.polygons)


@pytest.mark.parametrize("slots", [[], ["red"], ["red", None, "blue"]])
@pytest.mark.parametrize("link", ["DATA", "OBJECT"])
def test_a_checker_is_taken_off_to_what_was_there(package, slots, link):
    checker, obj = package("blender.checker"), scenes.bump()
    for k, name in enumerate(slots):
        obj.data.materials.append(None)
        obj.material_slots[k].link = link
        obj.material_slots[k].material = bpy.data.materials.new(name) if name else None
    before = [(slot.link, slot.material) for slot in obj.material_slots]
    assert not checker.wears_one(obj) and not checker.take_off(obj)
    for size in (64, 128):
        checker.take_off(obj)
        checker.put(obj, "COLOR_GRID", size)
        assert checker.wears_one(obj) and all(checker.has_checker(slot.material) for slot in obj.material_slots)
        names = {slot.material.name for slot in obj.material_slots}
        assert names == {f"{checker.NAME} color {size}"}
        node = obj.material_slots[0].material.node_tree.nodes.active
        assert node.type == "TEX_IMAGE" and tuple(node.image.size) == (size, size)
        assert node.image.generated_type == "COLOR_GRID"
        (link_of,) = node.outputs["Color"].links
        assert link_of.to_socket.name == "Base Color" and link_of.to_node.type == "BSDF_PRINCIPLED"
        assert link_of.to_node.inputs["Roughness"].default_value == 1.0
    assert checker.take_off(obj) and not checker.wears_one(obj)
    assert [(slot.link, slot.material) for slot in obj.material_slots] == before
    checker.tidy()
    assert not [m for m in bpy.data.materials if m.name.startswith(checker.NAME)]
    assert not [m for m in bpy.data.images if m.name.startswith(checker.NAME)]


def test_a_picture_of_a_checker_stands_the_right_way_up(package):
    checker, obj = package("blender.checker"), scenes.bump()
    picture = np.zeros((4, 8, 3))
    picture[0, :, 0], picture[-1, :, 2] = 1, 1
    checker.put(obj, "letters", 8, picture)
    image = obj.material_slots[0].material.node_tree.nodes.active.image
    assert tuple(image.size) == (8, 4) and image.packed_file is not None
    pixels = np.array(image.pixels[:]).reshape(4, 8, 4)
    assert pixels[0, 3].tolist() == [0, 0, 1, 1] and pixels[-1, 3].tolist() == [1, 0, 0, 1]
    # What somebody else chose meanwhile stays.
    mine = bpy.data.materials.new("mine")
    obj.data.materials.append(mine)
    obj.material_slots[0].material = mine
    checker.take_off(obj)
    assert mine in [slot.material for slot in obj.material_slots] or not obj.material_slots


def with_faces_that_use_a_vertex_twice():
    points = np.random.default_rng(0).random((10, 3))
    return scenes.add(points, [(6, 4, 1, 4), (5, 1, 7, 9, 9), (3, 4, 1, 6), (1, 4, 6), (0, 0, 2)])


def test_faces_that_use_a_vertex_twice_are_dissolved(package):
    """Blender's own commands go round such faces for ever, and so does Edit Mode."""
    obj = with_faces_that_use_a_vertex_twice()
    assert package("blender.clean").dissolve(obj) == 3
    left = [sorted(p.vertices) for p in obj.data.polygons]
    assert left == [[1, 3, 4, 6], [1, 4, 6]] and len(obj.data.vertices) == 10
    assert package("blender.clean").dissolve(obj) == 0


@pytest.mark.parametrize("action", ["MERGE", "NORMALS"])
def test_what_would_go_round_such_faces_is_refused_and_nothing_is_mended(package, action):
    """Of two objects the second has them: the first is as it was, too, and the error names faces and what helps."""
    good = scenes.add(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.0]]), [(0, 1, 2), (3, 2, 1)])
    bad = with_faces_that_use_a_vertex_twice()
    scenes.select([good, bad])
    told = scenes.error_of(bpy.ops.uv.omt_remedy, action=action)
    assert f"{bad.name}: A face uses a vertex twice (3 faces: 0, 1, 4). Use Degenerate Dissolve." in told
    assert len(good.data.vertices) == 4 and len(good.data.polygons) == 2 and len(bad.data.polygons) == 5
