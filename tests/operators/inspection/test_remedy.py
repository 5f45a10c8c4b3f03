"""What a warning or a refusal advises is done by one click, on the objects it is about, and can be undone."""

from __future__ import annotations

import bpy

import numpy as np
import pytest
import scenes


def doubled():
    """A patch in two halves whose vertices along the middle lie on one another."""
    obj = scenes.bump(8, 6)
    points = np.array([v.co for v in obj.data.vertices])
    faces = np.array([p.vertices for p in obj.data.polygons])
    right = points[faces].mean(1)[:, 0] > 0.5
    bpy.data.objects.remove(obj)
    return scenes.add(np.concatenate([points, points]), np.where(right[:, None], faces + len(points), faces))


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_vertices_that_lie_on_one_another_are_merged(mode):
    obj = doubled()
    count = len({v for p in obj.data.polygons for v in p.vertices})
    if mode == "EDIT":
        scenes.edit(obj)
    assert bpy.ops.uv.omt_remedy(action="MERGE") == {"FINISHED"}
    if mode == "EDIT":
        scenes.leave_edit()
    assert len({v for p in obj.data.polygons for v in p.vertices}) < count
    assert len(obj.data.vertices) == 63 and len(obj.data.polygons) == 48


def test_faces_that_look_inside_are_turned_over(package):
    obj = scenes.cube()
    faces = [list(p.vertices) for p in obj.data.polygons]
    points = [v.co[:] for v in obj.data.vertices]
    bpy.data.objects.remove(obj)
    obj = scenes.add(points, [faces[0][::-1], *faces[1:]])
    assert bpy.ops.uv.omt_unwrap() == {"FINISHED"}
    told = package("session.last_run").state.summary.notices
    assert "NORMALS" in {notice.action for notice in told}
    assert bpy.ops.uv.omt_remedy(action="NORMALS") == {"FINISHED"}
    middle = np.mean(points, axis=0)
    assert all(p.normal.dot(p.center) > p.normal.dot(middle) for p in obj.data.polygons)


def test_a_face_without_area_is_dissolved():
    obj = scenes.add([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0, 0)], [(0, 4, 1), (0, 1, 2, 3)])
    assert bpy.ops.uv.omt_remedy(action="DISSOLVE") == {"FINISHED"}
    assert min(p.area for p in obj.data.polygons) > 0


def test_cut_further_unwraps_again_with_more_seams(package):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=24, ring_count=16)
    obj = bpy.context.object
    ends = np.array([e.vertices for e in obj.data.edges])
    x = np.array([v.co for v in obj.data.vertices])
    # A seam from pole to pole, by hand.
    on = (np.abs(x[:, 1]) < 1e-6) & (x[:, 0] > -1e-6)
    for k in np.flatnonzero(on[ends].all(1)).tolist():
        obj.data.edges[k].use_seam = True
    bpy.ops.uv.omt_unwrap(max_shear=1.2)
    state = package("session.last_run").state
    assert [notice.action for notice in state.summary.notices] == ["CUT_FURTHER"]
    before = float(dict(state.summary.rows)["Shear"])
    assert bpy.ops.uv.omt_remedy(action="CUT_FURTHER") == {"FINISHED"}
    assert float(dict(state.summary.rows)["Shear"]) < before


def test_it_acts_on_what_the_result_is_about_whatever_is_selected(package):
    obj = doubled()
    bpy.ops.uv.omt_unwrap()
    other = scenes.cube("Other")
    scenes.select([other])
    assert bpy.ops.uv.omt_remedy(action="MERGE") == {"FINISHED"}
    assert len(obj.data.vertices) == 63


def test_without_objects_it_says_so(package):
    package("session.last_run").forget()
    assert "Select one or more mesh objects" in scenes.error_of(bpy.ops.uv.omt_remedy, action="MERGE")


def test_the_notices_are_paged(package):
    last_run = package("session.last_run")
    assert not bpy.ops.uv.omt_notices.poll()
    last_run.keep(last_run.Summary("Unwrap", notices=(last_run.Notice("One"), last_run.Notice("Two"))))
    for shown in (1, 0):
        assert bpy.ops.uv.omt_notices(whole=False) == {"FINISHED"}
        assert last_run.state.shown == shown
    assert bpy.ops.uv.omt_notices() == {"FINISHED"} and last_run.state.shown == 0
    last_run.forget()


def test_one_level_of_a_modifier_is_applied_and_areas_become_right(package):
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    modifier = obj.modifiers.new("Smooth", "SUBSURF")
    modifier.levels = modifier.render_levels = 2

    def evaluated():
        mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
        return np.sort([v.co[:] for v in mesh.vertices], axis=0)

    def area_error():
        text = dict(package("session.last_run").state.summary.rows)["Area error"]
        return float(text.split()[0])

    bpy.ops.uv.omt_unwrap()
    before, places = area_error(), evaluated()
    assert [n.action for n in package("session.last_run").state.summary.notices] == ["APPLY_LEVEL"]
    assert bpy.ops.uv.omt_remedy(action="APPLY_LEVEL") == {"FINISHED"}
    assert len(obj.data.polygons) == 24 and [m.levels for m in obj.modifiers] == [1]
    np.testing.assert_allclose(evaluated(), places, atol=1e-5)
    bpy.ops.uv.omt_unwrap()
    assert area_error() < 0.5 * before


@pytest.mark.parametrize("why", ["shape keys", "share", "come before"])
def test_a_level_that_cannot_be_applied_is_refused(why):
    obj = scenes.cube()
    if why == "come before":
        obj.modifiers.new("Mirror", "MIRROR")
    obj.modifiers.new("Smooth", "SUBSURF")
    if why == "shape keys":
        obj.shape_key_add(name="Basis")
    if why == "share":
        bpy.data.objects.new("Twin", obj.data)
    with pytest.raises(RuntimeError, match=why):
        bpy.ops.uv.omt_remedy(action="APPLY_LEVEL")
    assert len(obj.data.polygons) == 6 and obj.modifiers[-1].levels == 1


@pytest.mark.parametrize("action", ["MERGE", "NORMALS", "DISSOLVE", "APPLY_LEVEL"])
def test_what_never_ends_on_faces_that_use_a_vertex_twice_is_not_begun(package, monkeypatch, action):
    """Of several objects none is touched where one of them has such a face, and that one is named."""
    good = scenes.cube("Good")
    bad = scenes.add([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)], [(0, 1, 2, 3), (0, 1, 2, 1)], "Bad")
    scenes.select([bad, good])
    package("session.last_run").forget()
    begun = []
    for module, names in (
        ("blender.clean", ("merge", "turn_outside", "dissolve")),
        ("blender.subdivision", ("apply_level",)),
    ):
        for name in names:
            monkeypatch.setattr(package(module), name, lambda obj: begun.append(obj.name) or 0)
    if action in ("MERGE", "NORMALS"):
        said = scenes.error_of(bpy.ops.uv.omt_remedy, action=action)
        assert "Bad" in said and "uses a vertex twice" in said and not begun
    else:
        assert bpy.ops.uv.omt_remedy(action=action) == {"FINISHED"} and sorted(begun) == ["Bad", "Good"]
