"""object.omt_match: transfer, wrap, morph and checker where the truth is known; landmarks, undo, and bad input."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes
from match_scenes import choose, corners_of, pair
from meshes import torus


def match(**settings):
    assert bpy.ops.object.omt_match(**settings) == {"FINISHED"}


def positions(obj, key=""):
    data = obj.data.shape_keys.key_blocks[key].data if key else obj.data.vertices
    values = np.zeros(3 * len(data), np.float32)
    data.foreach_get("co", values)
    return values.reshape(-1, 3)


def weights(obj, name):
    index = obj.vertex_groups[name].index
    return np.array([sum(g.weight for g in v.groups if g.group == index) for v in obj.data.vertices])


def test_everything_arrives_on_the_other_mesh(package):
    source, target, of = pair()
    before, shape = scenes.state(source), positions(target)
    # A lock of what gets nothing is no hindrance, and landmarks stay where they were picked.
    target.vertex_groups.new(name="of no concern").lock_weight = True
    picked = [weights(target, f"LM_{k}") for k in range(5)]
    match()
    assert scenes.state(source) == before and (positions(target) == shape).all()
    np.testing.assert_array_equal([weights(target, f"LM_{k}") for k in range(5)], picked)
    own = positions(source)[of]
    up, down = weights(target, "up"), weights(target, "down")
    assert np.abs(up - weights(source, "up")[of]).max() < 0.03 and np.abs(up + down - 1).max() < 1e-5
    colour = np.zeros(4 * len(of), np.float32)
    target.data.attributes["paint"].data.foreach_get("color", colour)
    assert np.abs(colour.reshape(-1, 4)[:, :3] - (own * 0.2 + 0.5)).max() < 0.03
    assert np.abs(positions(target, "Grow") - 1.2 * shape).max() < 0.05
    assert target.data.shape_keys.key_blocks.keys() == ["Basis", "Grow"]
    corner = np.array([loop.vertex_index for loop in target.data.loops])
    side = np.array([target.data.materials[p.material_index].name == "blue" for p in target.data.polygons])
    there = own[corner]
    count = [p.loop_total for p in target.data.polygons]
    sign = np.where(np.repeat(side, count), 1, -1)[:, None]
    expected = there[:, 1:] * 0.1 * sign * [1, -1] + np.where(sign > 0, 0.25, 0.75)
    off = np.abs(scenes.uv_of(target) - expected).max(axis=1)
    assert np.quantile(off, 0.97) < 0.01
    # No face is torn across the seam: all corners of a face are on one island.
    island = np.split(scenes.uv_of(target)[:, 0] > 0.5, np.cumsum(count)[:-1])
    assert all(part.all() or not part.any() for part in island)
    sets = np.zeros(len(target.data.polygons), np.int32)
    target.data.attributes[".sculpt_face_set"].data.foreach_get("value", sets)
    assert set(sets) == {1, 2}
    rows = dict(package("session.last_run").state.summary.rows)
    assert rows["Landmarks met"] == "5 of 5" and rows["Flipped"] == "0 %"


def test_a_group_of_no_vertex_arrives_as_one():
    source, target, _ = pair()
    source.vertex_groups.new(name="empty")
    taken = target.vertex_groups.new(name="emptied")
    taken.add([0, 1, 2], 0.5, "REPLACE")
    source.vertex_groups.new(name="emptied")
    match()
    assert not weights(target, "empty").any() and not weights(target, "emptied").any()
    assert weights(target, "up").any()


def test_only_what_is_chosen_is_transferred():
    source, target, _ = pair()
    match(transfer={"GROUPS"})
    assert "up" in target.vertex_groups and not target.data.uv_layers and not target.data.materials
    assert target.data.shape_keys is None and source.data.shape_keys is not None


def test_wrap_puts_the_source_where_the_target_is():
    source, target, of = pair()
    match(mode="WRAP")
    world = np.array(target.matrix_world)
    expected = positions(target) @ world[:3, :3].T + world[:3, 3]
    wrapped = positions(source, "OMT Match")[of] @ np.array(source.matrix_world)[:3, :3].T
    assert np.linalg.norm(wrapped - expected, axis=1).max() < 0.05 * np.ptp(expected, axis=0).max()
    assert source.data.shape_keys.key_blocks["OMT Match"].value == 1
    choose(source, target)
    match(mode="MORPH", factor=0.25)
    assert source.data.shape_keys.key_blocks["OMT Match"].value == pytest.approx(0.25)


def test_the_checker_is_the_same_where_surfaces_correspond():
    source, target, of = pair()
    match(mode="CHECKER")
    colours = []
    for obj in (source, target):
        values = np.zeros(4 * len(obj.data.vertices), np.float32)
        obj.data.attributes["OMT Match"].data.foreach_get("color", values)
        colours.append(values.reshape(-1, 4))
    apart = np.abs(colours[1] - colours[0][of]).max(axis=1)
    assert np.mean(apart < 0.05) > 0.9 and source.data.attributes.active_color_name == "OMT Match"


def test_undo_takes_everything_back():
    source, target, _ = pair()
    bpy.context.preferences.edit.use_global_undo = True
    bpy.ops.ed.undo_push(message="before")
    before = scenes.state(target)
    match(mode="TRANSFER", transfer={"UV", "GROUPS"})
    bpy.ops.ed.undo_push(message="after")
    bpy.ops.ed.undo()
    assert scenes.state(bpy.data.objects["Target"]) == before


def unchanged(text, source, target, **settings):
    before = [scenes.state(obj) for obj in (source, target)]
    assert text in scenes.error_of(bpy.ops.object.omt_match, **settings)
    assert [scenes.state(obj) for obj in (source, target)] == before


def test_landmarks_on_one_side_or_twice_are_named():
    source, target, _ = pair()
    target.vertex_groups.remove(target.vertex_groups["LM_3"])
    unchanged("Landmarks LM_3 are on Source alone", source, target)
    source.vertex_groups.remove(source.vertex_groups["LM_3"])
    target.vertex_groups["LM_4"].name = "LM_0x"
    unchanged("LM_4 are on Source alone", source, target)


def test_topology_and_handedness_are_named():
    source, target, _ = pair()
    # The ends of an axis exchanged.
    first, second = target.vertex_groups["LM_0"], target.vertex_groups["LM_1"]
    first.name, second.name = "x", "LM_0"
    first.name = "LM_1"
    unchanged("mirror image", source, target)
    hole = scenes.bump()
    choose(source, hole)
    source.vertex_groups.clear()
    unchanged("is closed, and the other surface is not", source, hole, domain="DISK")


def test_two_meshes_are_needed_and_a_linked_or_locked_target_is_refused():
    source, target, _ = pair()
    scenes.select([source])
    unchanged("Select two mesh objects", source, target)
    choose(source, target)
    target.vertex_groups.new(name="up").lock_weight = True
    unchanged("'up' is locked", source, target)
    unchanged("no name", source, target, mode="WRAP", shape_key="")


@pytest.mark.parametrize("linked", ["Source", "Target"])
@pytest.mark.parametrize("mode, written", [("TRANSFER", {"Target"}), ("CHECKER", {"Source", "Target"}),
                                           ("WRAP", {"Source"}), ("MORPH", {"Source"})])  # fmt: skip
def test_what_is_written_has_to_be_local_and_what_is_read_has_not(package, monkeypatch, mode, written, linked):
    source, target, _ = pair()
    mesh, objects = package("blender.mesh"), package("blender.shapes.match_objects")

    def check_local(obj):
        if obj.name == linked:
            raise mesh.TargetError(f"{obj.name} is linked.")

    def match_job(*_):
        raise mesh.TargetError("It went on.")

    monkeypatch.setattr(mesh, "check_local", check_local)
    monkeypatch.setattr(objects, "match_job", match_job)
    said = scenes.error_of(bpy.ops.object.omt_match, mode=mode)
    assert (f"{linked} is linked" in said) == (linked in written) and ("went on" in said) == (linked not in written)


def test_empties_are_landmarks_and_are_kept_in_files(tmp_path, package):
    source, target, of = pair(landmarks=False, turned=False)
    place = package("operators.shapes.landmarks").place
    back = np.argsort(of)
    for vertex in corners_of(positions(source)):
        for obj, k in ((source, vertex), (target, int(back[vertex]))):
            (empty,) = place((source, target), obj, "LM_", obj.matrix_world @ obj.data.vertices[k].co, False)
            assert empty.parent == obj
    names = [sorted(e["omt_landmark"] for e in obj.children) for obj in (source, target)]
    assert names[0] == names[1] == [f"LM_{k}" for k in range(1, 6)]
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    source, target = bpy.data.objects["Source"], bpy.data.objects["Target"]
    choose(source, target)
    match(transfer={"GROUPS"})
    assert np.abs(weights(target, "up") - weights(source, "up")[of]).max() < 0.03
    assert bpy.ops.object.omt_landmarks_clear() == {"FINISHED"} and not source.children


def test_landmarks_are_suggested_and_mirrored(package):
    source, target, of = pair(landmarks=False, turned=False)
    assert bpy.ops.object.omt_landmarks_suggest(most=4) == {"FINISHED"}
    places = [{e["omt_landmark"]: np.array(e.matrix_world.translation) for e in o.children} for o in (source, target)]
    assert len(places[0]) >= 3
    assert all(np.allclose(places[0][name], places[1][name], atol=1e-5) for name in places[0])
    made = package("operators.shapes.landmarks").place((source, target), source, "LM_", (0.9, 0.1, 0), True)
    assert len(made) == 2 and made[1].matrix_world.translation.x < 0


def test_landmarks_are_picked_in_the_view_alone():
    source, target, _ = pair()
    assert "3D View" in scenes.error_of(bpy.ops.object.omt_landmarks)


def test_strain_of_keys_uvs_and_poses():
    source, target, _ = pair()
    scenes.select([source])
    source.active_shape_key_index = 1
    assert bpy.ops.object.omt_strain(of="KEY") == {"FINISHED"}
    values = np.zeros(len(source.data.polygons), np.float32)
    source.data.attributes["OMT Strain"].data.foreach_get("value", values)
    assert values.max() < 1e-4
    assert bpy.ops.object.omt_strain(of="UV") == {"FINISHED"}
    source.data.attributes["OMT Strain"].data.foreach_get("value", values)
    assert 0.05 < values.mean() <= 1
    vectors = np.zeros(3 * len(values), np.float32)
    source.data.attributes["OMT Stretch"].data.foreach_get("vector", vectors)
    assert np.allclose(np.linalg.norm(vectors.reshape(-1, 3), axis=1), values, atol=1e-5)
    copy = source.copy()
    copy.data = source.data.copy()
    bpy.context.collection.objects.link(copy)
    choose(copy, source)
    assert bpy.ops.object.omt_strain(of="OBJECT") == {"FINISHED"}
    choose(source, target)
    assert "one other object" in scenes.error_of(bpy.ops.object.omt_strain, of="OBJECT")
    assert "has no shape key" in scenes.error_of(bpy.ops.object.omt_strain, of="KEY")


def test_strain_asks_for_the_same_vertices_not_as_many_corners():
    """Else a vertex of one is anything of the other, or nothing."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    cube = scenes.add(corners, faces, "Cube")
    apart = [corners[v] for face in faces for v in face]
    loose = scenes.add(apart, [tuple(range(4 * k, 4 * k + 4)) for k in range(6)], "Loose")
    turned = scenes.add(corners, [face[1:] + face[:1] for face in faces], "Turned")
    for others in ((loose, cube), (cube, loose)):
        scenes.select(list(others))
        assert "one other object" in scenes.error_of(bpy.ops.object.omt_strain, of="OBJECT")
        assert "OMT Strain" not in others[1].data.attributes
    # From whichever corner on.
    scenes.select([turned, cube])
    assert bpy.ops.object.omt_strain(of="OBJECT") == {"FINISHED"}


def test_handles_are_no_hindrance_where_seams_cut_both_alike():
    (V, F), (W, G) = torus(16, 8), torus(24, 10)
    source, target = scenes.add(V, F, "Source"), scenes.add(W * [1.2, 1, 1], G, "Target")
    for obj, major, minor in ((source, 16, 8), (target, 24, 10)):
        long = {frozenset((k * minor, (k + 1) % major * minor)) for k in range(major)}
        short = {frozenset((k, (k + 1) % minor)) for k in range(minor)}
        for edge in obj.data.edges:
            edge.use_seam = frozenset(edge.vertices) in long | short
    choose(source, target)
    match(mode="WRAP", domain="CHARTS")
    expected = positions(source) * [1.2, 1, 1]
    assert np.linalg.norm(positions(source, "OMT Match") - expected, axis=1).max() < 0.2
    before = scenes.state(source)
    choose(source, target)
    with pytest.raises(RuntimeError, match="handle"):
        match(domain="SPHERE")
    assert scenes.state(source) == before
