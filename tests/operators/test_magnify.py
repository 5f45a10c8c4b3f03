"""uv.omt_magnify, object.omt_weights and their commands: shares as asked, everything else untouched."""

from __future__ import annotations

import bpy

import bmesh
import numpy as np
import pytest
import scenes
from mathutils import Euler
from region_scenes import of_group, painted, picture_file, weights_of, with_attribute


def share(obj, areas, group="region"):
    """Share of the region in areas (f,) of the polygons."""
    weights = weights_of(obj, group)
    weight = np.array([weights[list(p.vertices)].mean() for p in obj.data.polygons])
    return weight @ np.abs(areas) / np.abs(areas).sum()


def magnify(**arguments):
    assert bpy.ops.uv.omt_magnify(**arguments) == {"FINISHED"}


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("source", ["MESH", "UV"])
def test_the_region_gets_its_share(source, mode):
    obj = painted()
    space, before = scenes.polygon_areas(obj)
    asked = 2.0 * share(obj, space if source == "MESH" else before)
    untouched = scenes.state(obj, leave_out={"UVMap"})
    if mode == "EDIT":
        scenes.edit(obj)
    magnify(factor=2.0, source=source)
    if mode == "EDIT":
        scenes.leave_edit()
    after = scenes.polygon_areas(obj)[1]
    assert share(obj, after) == pytest.approx(asked, rel=5e-3)
    assert (after * np.sign(after.sum()) > 0).all()
    assert scenes.state(obj, leave_out={"UVMap"}) == untouched
    if source == "UV":
        assert np.abs(after).sum() == pytest.approx(np.abs(before).sum(), rel=1e-3)


def test_cascades_from_uvs():
    obj = painted()
    start, before = scenes.uv_of(obj), share(obj, scenes.polygon_areas(obj)[1])
    magnify(factor=1.5, source="UV", cascade=2)
    both = scenes.uv_of(obj)
    assert share(obj, scenes.polygon_areas(obj)[1]) == pytest.approx(1.5**2 * before, rel=5e-3)
    scenes.set_uv(obj, start)
    magnify(factor=1.5, source="UV")
    magnify(factor=1.5, source="UV")
    np.testing.assert_allclose(scenes.uv_of(obj), both, atol=1e-3)


@pytest.mark.parametrize("source", ["MESH", "UV"])
@pytest.mark.parametrize("boundary", ["OWN", "DISK"])
def test_times_multiply_the_factor_without_an_exact_share(source, boundary):
    obj = painted()
    start = scenes.uv_of(obj)
    found = []
    for factor, times in ((1.5, 2), (2.25, 1)):
        scenes.set_uv(obj, start)
        magnify(factor=factor, cascade=times, exact=False, source=source, boundary=boundary)
        found.append(scenes.uv_of(obj))
    np.testing.assert_allclose(*found, atol=1e-6)


def test_other_islands_stay_to_the_bit():
    obj = painted()
    far = np.array([p.center.x for p in obj.data.polygons])
    corners = np.zeros(len(obj.data.loops), bool)
    for index in np.flatnonzero(far > np.quantile(far, 0.85)):
        corners[list(obj.data.polygons[index].loop_indices)] = True
    uv = scenes.uv_of(obj)
    uv[corners] += [3, 0]
    scenes.set_uv(obj, uv)
    magnify(factor=2.0, source="UV")
    assert scenes.uv_of(obj)[corners].tobytes() == uv[corners].tobytes()


def test_the_panel_says_the_shares(package):
    painted()
    magnify(factor=2.0)
    rows = dict(package("session.last_run").state.summary.rows)
    asked, now = (float(rows[name].split()[0]) for name in ("Region asked", "Region now"))
    assert now == pytest.approx(asked, rel=5e-3)
    assert float(rows["Region before"].split()[0]) == pytest.approx(asked / 2, rel=1e-3)
    # Against what was asked: next to plain areas it would be large.
    assert float(rows["Area error"].split()[0]) < 1


def test_a_warped_image_follows():
    painted()
    image = bpy.data.images.new("map", 64, 64, alpha=True)
    y, x = np.mgrid[0:64, 0:64] / 63
    old = np.stack([x, y, 0 * x, 1 + 0 * x], axis=2).astype(np.float32)
    image.pixels.foreach_set(old.ravel())
    magnify(factor=2.0, source="UV", image="map")
    (new,) = [i for i in bpy.data.images if i.name.startswith("map warped")]
    pixels = np.zeros(old.size, np.float32)
    new.pixels.foreach_get(pixels)
    pixels = pixels.reshape(old.shape)
    assert np.abs(pixels - old)[..., :2].max() > 0.02
    assert pixels[..., 3].min() > 0.99


@pytest.mark.parametrize("shown", [True, False])
def test_the_material_shows_the_warped_image_if_it_shall(shown):
    obj = painted()
    image = bpy.data.images.new("map", 16, 16)
    material = bpy.data.materials.new("Skin")
    material.use_nodes = True
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    # Slots without a material, materials without nodes, and other pictures are left alone.
    plain, other = bpy.data.materials.new("Plain"), material.node_tree.nodes.new("ShaderNodeTexImage")
    other.image = bpy.data.images.new("other", 4, 4)
    for slot in (material, None, plain):
        obj.data.materials.append(slot)
    magnify(factor=2.0, source="UV", image="map", use_image=shown)
    assert other.image.name == "other"
    assert node.image.name.startswith("map warped") == shown


@pytest.mark.parametrize("shift", [0.0, 0.4])
def test_uvs_that_leave_their_tile_are_told(shift, package):
    obj = painted()
    scenes.set_uv(obj, scenes.uv_of(obj) + np.float32(shift))
    magnify(factor=2.0, source="UV")
    uv = scenes.uv_of(obj)
    texts = [notice.text for notice in package("session.last_run").state.summary.notices]
    outside = uv.min() < 0 or uv.max() > 1
    assert any("beyond their tile" in text for text in texts) == outside
    assert outside or not shift


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"weight_group": "nowhere"}, "no vertex group"),
        ({"weight_group": "nothing"}, "All weights are zero"),
        ({"factor": -2.0}, "-2 times"),
        ({"factor": 0.0}, "0 times"),
        ({"factor": -2.0, "cascade": 2}, "-2 times"),
        ({"factor": -2.0, "cascade": 2, "source": "UV"}, "-2 times"),
        ({"factor": 1e30, "cascade": 16}, "inf times"),
        ({"factor": 1e-7}, "would vary"),
        ({"factor": 1e-7, "source": "UV"}, "would vary"),
        ({"factor": 1e-7, "source": "UV", "exact": False}, "would vary"),
        ({"factor": float("nan")}, "not a finite number"),
        ({"factor": 1000.0}, "leaves nothing"),
        ({"factor": 1000.0, "source": "UV"}, "leaves nothing"),
        ({"image": "no image", "source": "UV"}, "no image"),
    ],
)
def test_refusals_change_nothing(arguments, message, mode):
    obj = painted()
    obj.vertex_groups.new(name="nothing")
    obj.vertex_groups.active_index = 0
    if mode == "EDIT":
        scenes.edit(obj)
    before = scenes.state(obj)
    assert message in scenes.error_of(bpy.ops.uv.omt_magnify, **arguments)
    assert scenes.state(obj) == before


def of_faces(obj):
    w = weights_of(obj)
    return [w[list(p.vertices)].mean() for p in obj.data.polygons]


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("source", ["MESH", "UV"])
def test_attributes_of_vertices_are_as_good_as_groups(source, mode):
    obj = with_attribute(lambda obj: 4 * of_group(obj))
    start = scenes.uv_of(obj)
    magnify(factor=2.0, source=source)
    by_group = scenes.uv_of(obj)
    scenes.set_uv(obj, start)
    if mode == "EDIT":
        scenes.edit(obj)
    # Four times the weights: what goes beyond 1 is divided by the largest value.
    magnify(factor=2.0, source=source, region="ATTRIBUTE", attribute="heat")
    if mode == "EDIT":
        scenes.leave_edit()
    np.testing.assert_allclose(scenes.uv_of(obj), by_group, atol=1e-4)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("source", ["MESH", "UV"])
def test_attributes_of_faces_get_their_share(source, mode):
    obj = with_attribute(of_faces, "FACE")
    values = np.array(of_faces(obj))

    def has(areas):
        return values @ np.abs(areas) / np.abs(areas).sum()

    asked = 2.0 * has(scenes.polygon_areas(obj)[0 if source == "MESH" else 1])
    untouched = scenes.state(obj, leave_out={"UVMap"})
    if mode == "EDIT":
        scenes.edit(obj)
    magnify(factor=2.0, source=source, region="ATTRIBUTE", attribute="heat")
    if mode == "EDIT":
        scenes.leave_edit()
    assert has(scenes.polygon_areas(obj)[1]) == pytest.approx(asked, rel=5e-3)
    assert scenes.state(obj, leave_out={"UVMap"}) == untouched


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("domain", ["POINT", "FACE"])
@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda w: np.where(np.arange(len(w)) == 7, np.nan, w), "not a finite number"),
        (lambda w: np.where(np.arange(len(w)) == 7, -0.5, w), "not between 0 and 1"),
        (lambda w: 0 * w, "All weights are zero"),
    ],
)
def test_attributes_that_are_no_weights_change_nothing(change, message, domain, mode):
    of = of_group if domain == "POINT" else of_faces
    obj = with_attribute(lambda obj: change(np.array(of(obj))), domain)
    if mode == "EDIT":
        scenes.edit(obj)
    before = scenes.state(obj)
    assert message in scenes.error_of(bpy.ops.uv.omt_magnify, region="ATTRIBUTE", attribute="heat")
    assert scenes.state(obj) == before


@pytest.mark.parametrize("name", ["", "nowhere", "colour"])
def test_attributes_that_cannot_be_used_are_named(name):
    obj = with_attribute(None, "CORNER", "colour", "FLOAT_COLOR")
    before = scenes.state(obj)
    told = scenes.error_of(bpy.ops.uv.omt_magnify, region="ATTRIBUTE", attribute=name)
    assert "attribute" in told and (name or "named") in told
    assert scenes.state(obj) == before


def test_folded_uvs_are_refused_and_shown():
    obj = painted()
    uv = scenes.uv_of(obj)
    middle = len(obj.data.vertices) // 2
    moved = np.array([loop.vertex_index == middle for loop in obj.data.loops])
    uv[moved] += 0.4
    scenes.set_uv(obj, uv)
    before = scenes.state(obj)
    assert "fold" in scenes.error_of(bpy.ops.uv.omt_magnify, source="UV")
    assert scenes.state(obj) == before
    assert any(p.select for p in obj.data.polygons) and not all(p.select for p in obj.data.polygons)


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT", "WEIGHT_PAINT"])
@pytest.mark.parametrize("kind", ["SALIENCY", "GAUSSIAN", "MEAN", "SHARPNESS", "DISTANCE"])
def test_weights(kind, mode):
    obj = scenes.bump(height=1.0)
    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
    for sequence in (obj.data.polygons, obj.data.edges):
        sequence.foreach_set("select", [False] * len(sequence))
    for vertex in obj.data.vertices:
        vertex.select = vertex.index == 40
    untouched = scenes.state(obj)
    bpy.ops.object.mode_set(mode=mode)
    magnify = bpy.context.window_manager.operator_properties_last("uv.omt_magnify")
    magnify.exact = True
    assert bpy.ops.object.omt_weights(kind=kind, weight_group="w") == {"FINISHED"}
    bpy.ops.object.mode_set(mode="OBJECT")
    weights = weights_of(obj, "w")
    assert (weights.min(), weights.max()) == (0, 1)
    assert obj.vertex_groups.active.name == "w"
    after = scenes.state(obj)
    assert {k: v for k, v in after.items() if k != "groups"} == {k: v for k, v in untouched.items() if k != "groups"}
    # Magnify then asks for how much denser it gets: an exact share of what covers half the surface shears too much.
    assert not magnify.exact
    magnify.exact = True
    bpy.ops.object.omt_weights(kind=kind, weight_group="w", invert=True, show=False)
    assert not magnify.exact
    np.testing.assert_allclose(weights_of(obj, "w"), 1 - weights, atol=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"weight_group": ""}, "no name"),
        ({"low": 0.9, "high": 0.2}, "no range"),
        ({"kind": "DISTANCE"}, "No vertex is selected"),
    ],
)
def test_weights_that_cannot_be(arguments, message):
    obj = scenes.bump()
    for sequence in (obj.data.polygons, obj.data.edges, obj.data.vertices):
        sequence.foreach_set("select", [False] * len(sequence))
    before = scenes.state(obj)
    assert message in scenes.error_of(bpy.ops.object.omt_weights, **arguments)
    assert scenes.state(obj) == before


def test_locked_groups_stay():
    obj = painted()
    obj.vertex_groups["region"].lock_weight = True
    before = scenes.state(obj)
    assert "locked" in scenes.error_of(bpy.ops.object.omt_weights, weight_group="region")
    assert scenes.state(obj) == before


def test_hidden_faces_stay_and_several_objects_share():
    objects = [painted(name) for name in "AB"]
    scenes.edit(*objects)
    for obj in objects:
        edit = bmesh.from_edit_mesh(obj.data)
        edit.faces.ensure_lookup_table()
        for face in edit.faces[:8]:
            face.hide_set(True)
    before = [scenes.uv_of(obj) for obj in objects]
    for source in ("MESH", "UV"):
        magnify(factor=1.5, source=source)
        for obj, uv in zip(objects, before, strict=True):
            assert scenes.uv_of(obj)[:32].tobytes() == uv[:32].tobytes()
            assert scenes.uv_of(obj)[32:].tobytes() != uv[32:].tobytes()
    scenes.leave_edit()


def test_linked_meshes_are_refused(tmp_path):
    painted()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(tmp_path / "library.blend"), link=True) as (_, linked):
        linked.objects = ["Bump"]
    bpy.context.collection.objects.link(linked.objects[0])
    scenes.select([linked.objects[0]])
    for operator in (bpy.ops.uv.omt_magnify, bpy.ops.object.omt_weights):
        assert "linked from a library" in scenes.error_of(operator)


def test_flat_meshes_have_no_curvature_to_magnify():
    obj = scenes.bump(height=0.0)
    obj.data.transform(Euler((0.3, 0.5, 0.7)).to_matrix().to_4x4())
    before = scenes.state(obj)
    for name in ("curvature", "saliency"):
        assert "same everywhere" in scenes.error_of(bpy.ops.uv.omt_magnify, weight_group=name)
    assert scenes.state(obj) == before


@pytest.mark.parametrize(("suffix", "kind", "depth"), [(".png", "PNG", "16"), (".exr", "OPEN_EXR", "32")])
def test_packed_copies_of_deep_images_keep_their_colours(tmp_path, suffix, kind, depth):
    painted()
    picture_file(tmp_path / f"map{suffix}", kind, depth, True)
    image = bpy.data.images.load(str(tmp_path / f"map{suffix}"))
    magnify(factor=2.0, source="UV", image=image.name)
    copy = bpy.data.images[f"{image.name} warped"]
    # From what was packed, as a saved file has it.
    copy.reload()
    assert copy.pixels[:] == pytest.approx(image.pixels[:], abs=2e-3)


def test_further_regions_and_detail_over_the_region():
    obj = scenes.bump(16, 16)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    for name, columns in (("left", range(3, 7)), ("right", range(10, 14))):
        members = [17 * row + column for row in range(5, 12) for column in columns]
        obj.vertex_groups.new(name=name).add(members, 1.0, "REPLACE")
    for name, value in (("map", 0.5), ("fine", 1.0)):
        image = bpy.data.images.new(name, 32, 32)
        image.pixels[:] = (value, value, value, 1.0) * 32**2
    given = {"source": "UV", "weight_group": "left", "factor": 2.0, "further": "right=1.5", "image": "map"}
    before = np.abs(scenes.polygon_areas(obj)[1])
    assert bpy.ops.uv.omt_magnify(**given, detail="fine", image_size=64) == {"FINISHED"}
    after = np.abs(scenes.polygon_areas(obj)[1])
    whole = {"left": np.s_[3:6], "right": np.s_[10:13]}
    for name, factor in (("left", 2.0), ("right", 1.5)):
        grids = [a.reshape(16, 16)[5:11, whole[name]].sum() / a.sum() for a in (before, after)]
        assert grids[1] > (1 + 0.6 * (factor - 1)) * grids[0]
    warped = bpy.data.images["map warped"]
    bright = sum(value > 0.9 for value in warped.pixels[:][0::4]) / 64**2
    assert tuple(warped.size) == (64, 64) and bright > 0.1
    state = scenes.state(obj)
    text = scenes.error_of(bpy.ops.uv.omt_magnify, **{**given, "further": "right"})
    assert "eyes=3" in text and scenes.state(obj) == state


def test_a_detail_without_a_place_is_told_in_a_line_and_not_by_a_traceback():
    obj = scenes.bump(8, 8)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    # Single vertices: no face is in the region.
    obj.vertex_groups.new(name="few").add([20, 44], 0.2, "REPLACE")
    for name in ("map", "fine"):
        bpy.data.images.new(name, 16, 16)
    state = scenes.state(obj)
    given = {"source": "UV", "weight_group": "few", "factor": 1.5, "image": "map", "detail": "fine"}
    text = scenes.error_of(bpy.ops.uv.omt_magnify, **given)
    assert text == "Error: Detail Image: No face with UVs is in the region. Paint it, or give the box.\n"
    assert scenes.state(obj) == state
