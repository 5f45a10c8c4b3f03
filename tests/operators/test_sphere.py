"""uv.omt_sphere and the command `sphere`: closed parts, orientation, refusals that change nothing."""

from __future__ import annotations

import bpy

import meshes
import numpy as np
import pytest
import scenes
from globe_scenes import assert_lambert, ball, corner_vertices, open_ball, panorama, positions, project, red_of


def torus():
    return scenes.add(*meshes.torus(12, 8), "Torus")


@pytest.mark.parametrize("projection", ["LAMBERT", "OCTAHEDRAL"])
def test_every_face_has_its_share_of_the_texture(projection):
    obj = ball()
    project(projection=projection)
    space, uv = scenes.areas(obj)
    assert (uv > 0).all()
    assert np.abs(uv / uv.sum() - space / space.sum()).sum() < 0.08


def test_the_panel_says_how_exact_the_sphere_is(package):
    ball()
    project(projection="EQUIRECT")
    rows = package("session.last_run").state.summary.rows
    assert [name for name, _ in rows].count("Area error") == 1
    assert float(dict(rows)["Area error"].split()[0]) < 1


@pytest.mark.parametrize("order", [1, -1])
def test_of_several_globes_the_worst_figures_are_told(package, order):
    """Whichever object they are of."""
    alone = []
    for squash in ((1.0, 0.8, 1.3), (1.0, 0.3, 2.5)):
        obj = ball(squash=squash)
        project()
        alone.append(dict(package("session.last_run").state.summary.rows))
        bpy.data.objects.remove(obj)
    names = ("A", "B")[::order]
    made = [ball(name, squash, 9.0 * k) for k, (name, squash) in
            enumerate(zip(names, ((1.0, 0.8, 1.3), (1.0, 0.3, 2.5)), strict=True))]  # fmt: skip
    scenes.select(made[::order])
    project()
    rows = dict(package("session.last_run").state.summary.rows)
    for figure in ("Area error", "Shear"):
        values = [float(row[figure].split()[0]) for row in (*alone, rows)]
        assert values[2] == pytest.approx(max(values[:2]), rel=0.05), figure
    assert float(alone[1]["Shear"]) > 1.1 * float(alone[0]["Shear"])


def test_the_equirectangular_layout_is_north_up_and_front_in_the_middle():
    obj = ball()
    project(projection="EQUIRECT")
    direction = positions(obj)[corner_vertices(obj)]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    uv = scenes.uv_of(obj)
    assert np.corrcoef(direction[:, 2], uv[:, 1])[0, 1] > 0.95
    front = (direction @ [0, -1, 0]) > 0.95
    assert front.any() and np.abs(uv[front, 0] - 0.5).max() < 0.1
    east = (direction @ [1, 0, 0]) > 0.95
    assert east.any() and np.abs(uv[east, 0] - 0.75).max() < 0.1


def test_the_seam_is_no_face_across_the_texture():
    obj = ball()
    project(projection="EQUIRECT")
    _, uv = scenes.triangles_of(obj)
    assert np.ptp(uv[..., 0], axis=1).max() < 0.4
    assert uv[..., 0].mean(axis=1).min() > 0 and 1 < uv[..., 0].max() < 1.4


def test_edit_mode_with_everything_selected_equals_object_mode():
    obj = ball()
    project()
    expected = scenes.uv_of(obj)
    obj.data.uv_layers.remove(obj.data.uv_layers[0])
    scenes.edit(obj)
    project()
    scenes.leave_edit()
    assert (scenes.uv_of(obj) == expected).all()


def test_selected_parts_alone_are_written():
    V, F = meshes.icosphere(1)
    obj = scenes.add(np.concatenate([V, V + 3]), np.concatenate([F, F + len(V)]), "Two")
    before = np.random.default_rng(0).random((len(obj.data.loops), 2)).astype(np.float32)
    scenes.set_uv(obj, before)
    scenes.edit(obj, faces=range(len(F)))
    project()
    scenes.leave_edit()
    after, corner = scenes.uv_of(obj), 3 * len(F)
    assert (after[corner:] == before[corner:]).all()
    assert (after[:corner] != before[:corner]).any(axis=1).all()


def test_every_part_and_object_gets_a_globe_of_its_own():
    one = ball("One")
    V, F = positions(one), meshes.icosphere(2)[1]
    two = scenes.add(np.concatenate([V, 2 * V + 5]), np.concatenate([F, F + len(V)]), "Two")
    project()
    uv = scenes.uv_of(two).reshape(2, -1, 2)
    assert np.allclose(uv[0], uv[1], atol=1e-4)
    assert np.allclose(uv[0], scenes.uv_of(one), atol=1e-4)


def test_scale_and_place_do_not_matter():
    near, far = ball("Near"), ball("Far", offset=500.0)
    far.scale = (3, 3, 3)
    bpy.context.view_layer.update()
    project()
    assert np.abs(scenes.uv_of(near) - scenes.uv_of(far)).max() < 2e-3


def test_vertex_groups_turn_the_globe():
    obj = ball()
    V = positions(obj)
    pole, meridian = int(V[:, 0].argmax()), int(V[:, 2].argmax())
    for name, vertex in (("pole", pole), ("front", meridian)):
        obj.vertex_groups.new(name=name).add([vertex], 1.0, "REPLACE")
    project(projection="EQUIRECT", orientation="GROUPS", pole_group="pole", meridian_group="front")
    uv, vertex = scenes.uv_of(obj), corner_vertices(obj)
    assert np.allclose(uv[vertex == pole, 1], 1, atol=1e-6)
    assert np.allclose(uv[vertex == meridian, 0], 0.5, atol=1e-3)


def test_picked_vertices_turn_the_globe():
    obj = ball()
    V = positions(obj)
    picks = [int(V[:, 0].argmax()), int(V[:, 2].argmax()), int(V[:, 1].argmin())]
    if np.linalg.det(V[picks]) < 0:
        picks[2] = int(V[:, 1].argmax())
    scenes.edit(obj)
    import bmesh

    bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
    edit = bmesh.from_edit_mesh(obj.data)
    edit.verts.ensure_lookup_table()
    for k in picks:
        edit.select_history.add(edit.verts[k])
    project(projection="EQUIRECT", orientation="PICKED")
    scenes.leave_edit()
    uv, vertex = scenes.uv_of(obj), corner_vertices(obj)
    assert np.allclose(uv[vertex == picks[0], 1], 1, atol=1e-6)
    assert np.abs(uv[vertex == picks[1], 0] - 0.5).max() < 0.1
    assert np.abs(uv[vertex == picks[2], 0] - 0.75).max() < 0.1


@pytest.mark.parametrize("others", [0, 3])
def test_what_is_picked_on_the_active_object_turns_it_alone(others):
    """Whatever is picked on another one, which goes by its axes."""
    import bmesh

    alone = {}
    for chosen in ("both", "Ball", "Other"):
        scenes.open_empty()
        found = {name: ball() for name in ("Other", "Ball")}
        for name, obj in found.items():
            obj.name = name
        scenes.select([found[name] for name in ("Other", "Ball") if chosen in ("both", name)])
        bpy.context.view_layer.objects.active = found["Ball" if chosen == "both" else chosen]
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.scene.tool_settings.mesh_select_mode = (True, False, False)
        for name, picks in (("Ball", [3, 40, 17]), ("Other", [5, 30, 60][:others])):
            if found[name].mode == "EDIT":
                edit = bmesh.from_edit_mesh(found[name].data)
                edit.verts.ensure_lookup_table()
                for k in picks:
                    edit.select_history.add(edit.verts[k])
        project(quality="DRAFT", orientation="AXES" if chosen == "Other" else "PICKED")
        scenes.leave_edit()
        alone[chosen] = {name: scenes.uv_of(obj) for name, obj in found.items() if obj.data.uv_layers}
    for name in ("Ball", "Other"):
        np.testing.assert_allclose(alone["both"][name], alone[name][name], atol=1e-6)


def test_undo_takes_back_all():
    obj = ball()
    before = scenes.state(obj)
    bpy.ops.ed.undo_push()
    assert bpy.ops.uv.omt_sphere("EXEC_DEFAULT", True) == {"FINISHED"}
    bpy.ops.ed.undo()
    assert scenes.state(bpy.data.objects["Ball"]) == before


def two_fans():
    V, F = meshes.icosphere(1)
    far = V - 2 * V[0]
    joined = np.concatenate([V, far])
    other = F + len(V)
    twin = len(V) + int(np.linalg.norm(far + V[0], axis=1).argmin())
    other[other == twin] = 0
    return scenes.add(joined, np.concatenate([F, other]), "Fans")


def test_balls_that_touch_in_a_vertex_have_the_whole_texture_each():
    fans = two_fans()
    assert bpy.ops.uv.omt_sphere() == {"FINISHED"}
    one, other = np.split(scenes.uv_of(fans), 2)
    assert all(np.ptp(uv, axis=0).min() > 0.5 for uv in (one, other))


@pytest.mark.parametrize(
    ("make", "message", "kind"),
    [
        (open_ball, "not closed", "edges"),
        (torus, "a handle", "polygons"),
        (scenes.bump, "not closed", "edges"),
    ],
)
@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
def test_what_is_no_sphere_is_refused_and_nothing_changes(make, message, kind, mode):
    obj = make()
    scenes.set_uv(obj, np.random.default_rng(0).random((len(obj.data.loops), 2)))
    before = scenes.state(obj)
    if mode == "EDIT":
        scenes.edit(obj)
    assert message in scenes.error_of(bpy.ops.uv.omt_sphere)
    assert scenes.state(obj) == before
    if mode == "EDIT":
        scenes.leave_edit()
    assert any(element.select for element in getattr(obj.data, kind))


def test_one_bad_object_leaves_all_alone():
    good, bad = ball(), torus()
    before = scenes.state(good), scenes.state(bad)
    assert "Torus: " in scenes.error_of(bpy.ops.uv.omt_sphere)
    assert (scenes.state(good), scenes.state(bad)) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"orientation": "GROUPS"}, "Name the vertex group"),
        ({"orientation": "GROUPS", "pole_group": "nowhere"}, "no vertex group 'nowhere'"),
        ({"orientation": "PICKED"}, "Pick the markers"),
        ({"orientation": "GROUPS", "pole_group": "empty"}, "on no part"),
        ({"orientation": "GROUPS", "pole_group": "top", "meridian_group": "top"}, "at a pole"),
    ],
)
def test_markers_that_say_nothing_are_refused(arguments, message):
    obj = ball()
    obj.vertex_groups.new(name="empty")
    obj.vertex_groups.new(name="top").add([3], 1.0, "REPLACE")
    before = scenes.state(obj)
    assert message in scenes.error_of(bpy.ops.uv.omt_sphere, **arguments)
    assert scenes.state(obj) == before


# ---- images -------------------------------------------------------------------------------------------------


def test_the_operator_redraws_an_image_beside_the_old_one():
    obj, image = ball(), panorama()
    before = red_of(image).copy()
    project(image="World")
    assert (red_of(image) == before).all()
    assert_lambert(red_of(bpy.data.images["World lambert"]))
    bpy.data.images.remove(bpy.data.images["World lambert"])
    state = scenes.state(obj)
    assert "no image 'nowhere'" in scenes.error_of(bpy.ops.uv.omt_sphere, image="nowhere")
    assert scenes.state(obj) == state


# ---- the command --------------------------------------------------------------------------------------------


def test_the_flow_gives_the_same_areas():
    obj = ball()
    project(method="FLOW")
    space, uv = scenes.areas(obj)
    assert (uv > 0).all()
    assert np.abs(uv / uv.sum() - space / space.sum()).sum() < 0.08


def test_inside_the_tile_nothing_reaches_beyond_it():
    obj = ball()
    project(projection="EQUIRECT")
    beyond = scenes.uv_of(obj)
    project(projection="EQUIRECT", inside=True)
    inside = scenes.uv_of(obj)
    assert beyond[:, 0].max() > 1
    assert inside.min() > -1e-6 and inside.max() < 1 + 1e-6
    # Scaled, and nothing else.
    low, high = np.minimum(beyond.min(0), 0), np.maximum(beyond.max(0), 1)
    np.testing.assert_allclose(inside, (beyond - low) / (high - low), atol=1e-5)
