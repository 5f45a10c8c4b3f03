"""What a match writes to objects: layers of the kinds that were asked for, seams beside those there, keys, colours."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes

KINDS = ("uv", "attributes", "colours", "face_sets", "groups", "materials", "shape_keys")


@pytest.fixture
def objects(package):
    return package("blender.shapes.match_objects")


def carried(package, **more):
    """Attributes of a plane of two by two quads, with something of every kind."""
    kinds = package("pipelines.attributes")
    n, e, f = 9, 12, 4
    obj = scenes.bump(2, 2, name="Plane")
    edges = np.array([tuple(edge.vertices) for edge in obj.data.edges])
    rng = np.random.default_rng(0)
    layers = (
        kinds.Layer("Map", "CORNER", "FLOAT2", rng.random((16, 2)).astype(np.float32)),
        kinds.Layer("heat", "POINT", "FLOAT", rng.random((n, 1)).astype(np.float32)),
        kinds.Layer("Paint", "POINT", "FLOAT_COLOR", rng.random((n, 4)).astype(np.float32)),
        kinds.Layer(".sculpt_face_set", "FACE", "INT", np.arange(1, f + 1)[:, None].astype(np.int32)),
    )
    marks = kinds.Marks(edges, np.arange(e) % 3 == 0, np.zeros(e, bool), np.zeros(e))
    keys = tuple(kinds.ShapeKey(name, offsets, relative, {"value": value, "slider_max": 2.0})
                 for name, offsets, relative, value in (
                     ("Basis", np.zeros((n, 3)), 0, 0.0),
                     ("Smile", rng.random((n, 3)), 0, 0.25),
                     ("More", rng.random((n, 3)), 1, 0.5)))  # fmt: skip
    given = {
        "material_index": np.array([0, 1, 7, 1]), "smooth": np.ones(f, bool), "marks": marks, "layers": layers,
        "groups": ("LM_1", "up"), "weights": rng.random((n, 2)), "member": rng.random((n, 2)) > 0.3, "keys": keys,
    } | more  # fmt: skip
    return obj, kinds.Attributes(**given)


def values(mesh, name, key, width):
    found = np.zeros(width * len(mesh.attributes[name].data), np.float32)
    mesh.attributes[name].data.foreach_get(key, found)
    return found.reshape(-1, width)


@pytest.mark.parametrize("kinds", [(kind,) for kind in KINDS] + [KINDS, ()], ids=lambda kinds: " ".join(kinds))
def test_what_is_asked_for_is_written_and_nothing_else(package, objects, kinds):
    obj, attributes = carried(package)
    obj.data.edges[1].use_seam = True
    source = objects.Carried(None, attributes, np.eye(3), ("red", "", "blue"), ())
    before = scenes.state(obj)
    written = objects.write_onto(obj, source, attributes, set(kinds), "LM_")
    expected = {"uv": ["Map"], "attributes": ["heat"], "colours": ["Paint"], "face_sets": [".sculpt_face_set"],
                "groups": ["up"], "materials": ["materials"], "shape_keys": ["Smile", "More"]}  # fmt: skip
    assert sorted(written) == sorted(name for kind in kinds for name in expected[kind])
    mesh = obj.data
    names = {"uv": "Map", "attributes": "heat", "colours": "Paint", "face_sets": ".sculpt_face_set"}
    for kind, name in names.items():
        assert (name in mesh.attributes) == (kind in kinds)
    by_name = {layer.name: layer.values for layer in attributes.layers}
    if "uv" in kinds:
        np.testing.assert_array_equal(scenes.uv_of(obj, "Map"), by_name["Map"])
    if "attributes" in kinds:
        np.testing.assert_array_equal(values(mesh, "heat", "value", 1), by_name["heat"])
    if "colours" in kinds:
        np.testing.assert_allclose(values(mesh, "Paint", "color", 4), by_name["Paint"], atol=1e-6)
    # Those where islands end, beside those that were marked.
    seams = [edge.use_seam for edge in mesh.edges]
    assert seams == [k == 1 or ("uv" in kinds and k % 3 == 0) for k in range(len(seams))]
    if "groups" in kinds:
        group = obj.vertex_groups["up"]
        found = {v.index: g.weight for v in mesh.vertices for g in v.groups if g.group == group.index and g.weight}
        inside = np.flatnonzero(attributes.member[:, 1])
        assert set(found) == set(inside) and "LM_1" not in obj.vertex_groups
        assert [found[k] for k in inside] == pytest.approx(attributes.weights[inside, 1].tolist())
    if "materials" in kinds:
        assert [m.name if m else "" for m in mesh.materials] == ["red", "", "blue"]
        # What there is no slot for has the last one.
        assert [p.material_index for p in mesh.polygons] == [0, 1, 2, 1]
    assert (mesh.shape_keys is not None) == ("shape_keys" in kinds)
    if not kinds:
        assert scenes.state(obj) == before


def test_landmarks_are_groups_like_others_without_a_prefix(package, objects):
    obj, attributes = carried(package)
    source = objects.Carried(None, attributes, np.eye(3), (), ())
    obj.vertex_groups.new(name="first")
    obj.vertex_groups.new(name="second")
    obj.vertex_groups.active_index = 0
    assert objects.write_onto(obj, source, attributes, {"groups"}) == ["LM_1", "up"]
    assert obj.vertex_groups.active.name == "first"


@pytest.mark.parametrize("scale", [(1, 1, 1), (2, 0.5, 3)])
@pytest.mark.parametrize("there", [False, True])
def test_shape_keys_are_offsets_in_the_space_of_the_object(package, objects, scale, there):
    obj, attributes = carried(package)
    obj.scale = scale
    bpy.context.view_layer.update()
    if there:
        obj.shape_key_add(name="Basis", from_mix=False)
        obj.shape_key_add(name="Smile", from_mix=False).value = 0.9
    base = np.array([v.co[:] for v in obj.data.vertices])
    source = objects.Carried(None, attributes, np.diag(scale), (), ())
    objects.write_onto(obj, source, attributes, {"shape_keys"})
    blocks = obj.data.shape_keys.key_blocks
    assert [block.name for block in blocks] == ["Basis", "Smile", "More"]
    for block, key in zip(blocks, attributes.keys, strict=True):
        found = np.array([point.co[:] for point in block.data])
        np.testing.assert_allclose(found, base + key.offsets / scale, atol=1e-5)
    assert [block.relative_key.name for block in blocks] == ["Basis", "Basis", "Smile"]
    assert [(b.value, b.slider_max) for b in blocks[1:]] == [(0.25, 2.0), (0.5, 2.0)]
    stretched = objects.stretched_offsets(source)
    for key, old in zip(stretched.attributes.keys, attributes.keys, strict=True):
        np.testing.assert_allclose(key.offsets, old.offsets * scale)


@pytest.mark.parametrize("kinds, groups, words", [
    ({"uv"}, False, "more than 8 UV maps"), ({"groups"}, False, "locked"), ({"attributes"}, True, None),
    ({"uv"}, True, None), ({"groups"}, True, None),
])  # fmt: skip
def test_what_an_object_has_no_room_for_is_refused(package, objects, kinds, groups, words):
    obj, attributes = carried(package)
    maps = 7 if groups else 8
    for k in range(maps):
        obj.data.uv_layers.new(name=f"Map {k}")
    obj.vertex_groups.new(name="up").lock_weight = not groups
    obj.vertex_groups.new(name="other").lock_weight = True
    if words is None:
        objects.check_room(obj, attributes, kinds)
    else:
        with pytest.raises(objects.MatchError, match=words):
            objects.check_room(obj, attributes, kinds)
    # One that is there takes no room of its own.
    obj.data.uv_layers[0].name = "Map"
    objects.check_room(obj, attributes, kinds - {"groups"})


def test_a_layer_of_another_kind_keeps_its_name(package, objects):
    obj, attributes = carried(package)
    obj.data.attributes.new("heat", "FLOAT", "FACE")
    source = objects.Carried(None, attributes, np.eye(3), (), ())
    assert objects.write_onto(obj, source, attributes, {"attributes"}) == []
    assert obj.data.attributes["heat"].domain == "FACE"


def test_colours_tell_places_in_the_source_and_squares_alternate(package, objects):
    obj, _ = carried(package)
    side = 1 / objects.SQUARES
    # Points in the middles of squares along the axes, and far corners.
    place = np.array([[0.5, 0.5, 0.5], [1.5, 0.5, 0.5], [1.5, 1.5, 0.5], [1.5, 1.5, 1.5], [2.5, 0.5, 0.5],
                      [0.5, 3.5, 0.5], [0.5, 0.5, 6.5], [13.5, 13.5, 13.5], [0.5, 1.5, 2.5]]) * side  # fmt: skip
    objects._write_colour(obj.data, place)
    found = values(obj.data, objects.CHECKER, "color", 4)
    assert obj.data.attributes.active_color_name == objects.CHECKER and (found[:, 3] == 1).all()
    odd = np.floor(place / side).astype(int).sum(axis=1) % 2 == 1
    white = objects.WHITE_SHARE + (1 - objects.WHITE_SHARE) * place
    np.testing.assert_allclose(found[:, :3], np.where(odd[:, None], place, white), atol=1e-5)
    assert odd.any() and not odd.all()
    objects._write_colour(obj.data, place[::-1])
    np.testing.assert_allclose(values(obj.data, objects.CHECKER, "color", 4), found[::-1], atol=1e-6)


def test_what_has_no_faces_or_is_flat_is_refused_and_what_looks_inside_is_turned_and_said(package, objects):
    obj = scenes.cube()
    plain = objects.read_carrier(obj)
    assert plain.warnings == () and plain.materials == () and np.allclose(plain.stretch, np.eye(3))
    obj.data.materials.append(bpy.data.materials.new("red"))
    obj.data.materials.append(None)
    for polygon in obj.data.polygons[:1]:
        polygon.flip()
    obj.data.update()
    obj.scale = (1, 2, 3)
    bpy.context.view_layer.update()
    found = objects.read_carrier(obj)
    assert found.materials == ("red", "") and np.allclose(sorted(np.linalg.eigvalsh(found.stretch)), [1, 2, 3])
    assert len(found.warnings) == 1 and found.warnings[0].endswith("; turned over for the match")
    obj.scale = (1, 0, 3)
    bpy.context.view_layer.update()
    with pytest.raises(objects.MatchError, match="zero along an axis"):
        objects.read_carrier(obj)
    empty = scenes.add([(0, 0, 0)], [], "Empty")
    with pytest.raises(package("solver.errors").EmptyMeshError):
        objects.read_carrier(empty)


@pytest.mark.parametrize("value", [0.0, 0.5, 1.0])
def test_a_wrap_is_a_key_in_the_place_of_the_target(package, objects, value):
    source, target = scenes.bump(2, 2, name="Source"), scenes.bump(2, 2, name="Target")
    source.location, source.rotation_euler, source.scale = (1, 2, 3), (0.3, 0.2, 0.1), (2, 2, 2)
    target.location, target.rotation_euler, target.scale = (-4, 0, 1), (0.1, 0.9, 0.4), (3, 1, 0.5)
    bpy.context.view_layer.update()
    place = np.random.default_rng(0).random((9, 3))
    stretch = package("blender.mesh").stretch(target)
    result = type("Result", (), {"wrapped": place @ stretch.T})
    for _ in range(2):
        block = objects.write_wrap(source, target, result, "Wrapped", value)
    world = np.array(source.matrix_world)
    found = np.array([point.co[:] for point in block.data]) @ world[:3, :3].T + world[:3, 3]
    there = np.array(target.matrix_world)
    np.testing.assert_allclose(found, place @ there[:3, :3].T + there[:3, 3], atol=1e-5)
    assert block.value == pytest.approx(value) and source.active_shape_key == block
    assert [b.name for b in source.data.shape_keys.key_blocks] == ["Basis", "Wrapped"]


@pytest.mark.parametrize("there", [False, True])
def test_no_key_that_is_carried_takes_the_place_of_the_basis(package, objects, there):
    """Though it may be called as that is: the shape that others are relative to stays as it was."""
    kinds = package("pipelines.attributes")
    rng = np.random.default_rng(5)
    keys = tuple(kinds.ShapeKey(name, rng.random((9, 3)) * (k > 0), 0, {"value": 0.5})
                 for k, name in enumerate(("First", "Basis", "More")))  # fmt: skip
    obj, attributes = carried(package, keys=keys)
    if there:
        obj.shape_key_add(name="Basis", from_mix=False)
    base = np.array([v.co[:] for v in obj.data.vertices])
    objects.write_onto(obj, objects.Carried(None, attributes, np.eye(3), (), ()), attributes, {"shape_keys"})
    blocks = obj.data.shape_keys.key_blocks
    found = [np.array([point.co[:] for point in block.data]) for block in blocks]
    assert len(found) == 3
    for place, key in zip(found, keys, strict=True):
        np.testing.assert_allclose(place, base + key.offsets, atol=1e-6)
    assert all(block.relative_key == blocks[0] for block in blocks)
