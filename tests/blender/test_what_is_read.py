"""What is read of modifiers, shape keys and groups: levels of the render, shapes as they stand, and whole faces."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


@pytest.mark.parametrize("in_render, in_view, levels", [(True, True, 3), (True, False, 3), (False, True, 1)])
def test_levels_are_those_of_the_render_where_there_is_one(package, in_render, in_view, levels):
    obj = scenes.cube()
    modifier = obj.modifiers.new("Smooth", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 3
    modifier.show_render, modifier.show_viewport = in_render, in_view
    of = package("blender.subdivision").modifier_of
    assert of(obj, obj.data).levels == levels
    modifier.show_render = modifier.show_viewport = False
    assert of(obj, obj.data) is None
    other = obj.modifiers.new("Next", "SUBSURF")
    other.levels = other.render_levels = 2
    assert of(obj, obj.data).levels == 2


@pytest.mark.parametrize("levels", [(1, 1), (2, 3), (3, 1)])
def test_a_level_that_is_applied_is_missing_in_render_and_view(package, levels):
    obj = scenes.bump(3, 2)
    modifier = obj.modifiers.new("Smooth", "SUBSURF")
    modifier.levels, modifier.render_levels = levels
    faces = len(obj.data.polygons)
    assert package("blender.subdivision").apply_level(obj) == 1
    assert len(obj.data.polygons) == 4 * faces and list(obj.modifiers) == [modifier]
    assert (modifier.levels, modifier.render_levels) == tuple(n - 1 for n in levels)


@pytest.mark.parametrize("scale", [(1, 1, 1), (3, 1, 0.5), (-1, 2, 1)], ids=str)
def test_a_shape_key_that_is_the_mesh_is_no_strain_and_one_that_is_larger_none_either(package, scale):
    obj = scenes.bump()
    obj.scale = scale
    obj.shape_key_add(name="Basis"), obj.shape_key_add(name="Same"), obj.shape_key_add(name="Larger")
    for point in obj.data.shape_keys.key_blocks["Larger"].data:
        point.co = 2 * point.co
    bpy.context.view_layer.update()
    reading = package("blender.mesh").read(obj)
    for name in ("Same", "Larger"):
        (row,) = package("blender.shapes.strain").strain_rows(obj, reading, name)
        assert row.name == "all" and row.greatest < 1e-4


def test_faces_belong_to_a_region_with_half_of_the_weight_of_their_corners(package):
    obj = scenes.bump(3, 1)
    # Corners of the faces: 0 1 5 4, 1 2 6 5, 2 3 7 6.
    obj.vertex_groups.new(name="half").add([0, 1], 1.0, "REPLACE")
    faint = obj.vertex_groups.new(name="faint")
    faint.add([2, 3, 6, 7], 0.49, "REPLACE")
    obj.vertex_groups.new(name="strong").add([2, 3, 6, 7], 0.5, "REPLACE")
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    pairs = [(obj, package("blender.mesh").read(obj))]
    labels = package("blender.measuring.region_labels")
    found = {name: masks[0].tolist() for name, masks in labels.regions_of(pairs, labels.GROUPS)}
    assert found == {"half": [True, False, False], "strong": [False, False, True]}
    faint.add([2, 3, 6, 7], 0.51, "REPLACE")
    found = {name: masks[0].tolist() for name, masks in labels.regions_of(pairs, labels.GROUPS)}
    assert found["faint"] == [False, False, True]


def test_faces_of_empty_slots_are_a_region_of_their_own_and_those_of_every_material_too(package):
    labels = package("blender.measuring.region_labels")
    pairs = []
    for names in (["Red", None, "Blue"], [None, "Red"], []):
        obj = scenes.bump(3, 1)
        for name in names:
            found = bpy.data.materials.get(name) or bpy.data.materials.new(name) if name else None
            obj.data.materials.append(found)
        for polygon in obj.data.polygons:
            polygon.material_index = min(polygon.index, max(len(names) - 1, 0))
        pairs.append((obj, package("blender.mesh").read(obj)))
    found = {name: [mask.tolist() for mask in masks] for name, masks in labels.regions_of(pairs, labels.MATERIALS)}
    yes, no = True, False
    assert found == {
        "Red": [[yes, no, no], [no, yes, yes], [no, no, no]],
        "Blue": [[no, no, yes], [no, no, no], [no, no, no]],
        "no material": [[no, yes, no], [yes, no, no], [yes, yes, yes]],
    }
    # Where nothing has a material, there are no regions.
    with pytest.raises(package("errors").UserError, match="no material to tell regions by"):
        labels.regions_of(pairs[2:], labels.MATERIALS)


def test_options_that_an_operator_does_not_have_are_left_out(package):
    known = package("blender.versions").known_options
    assert known(bpy.ops.mesh.primitive_cube_add, size=2.0, facets=9) == {"size": 2.0}
    assert known(bpy.ops.mesh.primitive_cube_add) == {}


@pytest.mark.parametrize("slots", [0, 1, 2, 3])
def test_an_index_beyond_the_slots_is_that_of_the_last_as_blender_draws_it(package, slots):
    labels, obj = package("blender.measuring.region_labels"), scenes.bump(5, 1)
    for k in range(slots):
        obj.data.materials.append(bpy.data.materials.new(f"Slot {k}"))
    other = scenes.bump(2, 1)
    other.data.materials.append(bpy.data.materials.new("Other"))
    obj.data.polygons.foreach_set("material_index", np.arange(5, dtype=np.int32))
    pairs = [(each, package("blender.mesh").read(each)) for each in (obj, other)]
    found = {name: masks[0].tolist() for name, masks in labels.regions_of(pairs, labels.MATERIALS) if name != "Other"}
    at = np.minimum(np.arange(5), max(slots - 1, 0))
    names = [f"Slot {k}" for k in range(slots)] or ["no material"]
    assert found == {name: (at == k).tolist() for k, name in enumerate(names)}
