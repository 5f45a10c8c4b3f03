"""Every condition in operators and panels decides: keys let go of, who is selected and active, what is drawn active."""

from __future__ import annotations

from itertools import product
from types import SimpleNamespace

import bpy

import pytest
import scenes
from dressed_bodies import bodies_with_some_selected
from kept import Recorder
from windows import Instead, Window, event, in_front, in_single_steps

RUNNING = {"RUNNING_MODAL"}
KEYS = ("ESC", "RET", "NUMPAD_ENTER", "RIGHTMOUSE", "BACK_SPACE", "M")


MODAL = {"object.omt_flow": "VIEW_3D", "uv.omt_flow": "IMAGE_EDITOR", "object.omt_landmarks": "VIEW_3D",
         "uv.omt_live": "IMAGE_EDITOR", "uv.omt_seams": "VIEW_3D", "uv.omt_queue": "VIEW_3D"}  # fmt: skip


@pytest.mark.parametrize("name", MODAL)
def test_a_key_let_go_of_ends_nothing(package, monkeypatch, name):
    bodies_with_some_selected()
    in_front(monkeypatch, package)
    in_single_steps(monkeypatch, package)
    window = Window(MODAL[name])
    operator = scenes.stand_in(name, **({"pack": False} if name == "uv.omt_live" else {}))
    operator._place = lambda *_: (0.5, 0.5)
    assert operator.invoke(window, event("LEFTMOUSE", "RELEASE")) == RUNNING
    before = dict(vars(operator))
    for kind in KEYS:
        assert not operator.modal(window, event(kind, "RELEASE")) & {"FINISHED", "CANCELLED"}, kind
    if name != "object.omt_flow":
        assert vars(operator).keys() >= before.keys() and getattr(operator, "mirrored", False) is False
    if name == "uv.omt_flow":
        # Before the button is down, moves of the mouse and its release are none of a push.
        state = scenes.state(bpy.context.object)
        for kind, value in (("MOUSEMOVE", "NOTHING"), ("LEFTMOUSE", "RELEASE")):
            assert operator.modal(window, event(kind, value)) == RUNNING and scenes.state(bpy.context.object) == state
    ended = operator.modal(window, event("ESC"))
    while name == "uv.omt_queue" and ended & {"PASS_THROUGH", "RUNNING_MODAL"}:
        ended = operator.modal(window, event("TIMER"))
    assert ended & {"CANCELLED", "FINISHED"} and package("session.run").current is None


@pytest.mark.parametrize("keys", [("A", "PRESS", True), ("A", "PRESS", False), ("A", "RELEASE", True),
                                  ("LEFT_SHIFT", "PRESS", True)])  # fmt: skip
def test_a_step_of_undo_is_made_before_a_key_that_does_something(package, monkeypatch, keys):
    kind, value, unmarked = keys
    bodies_with_some_selected()
    live = scenes.stand_in("uv.omt_live")
    pushed = []
    undo = SimpleNamespace(ed=SimpleNamespace(undo_push=lambda message: pushed.append(message)))
    monkeypatch.setattr(package("operators.live"), "bpy", Instead(lambda: bpy, ops=undo))
    live._unmarked, live._marks = unmarked, 3
    live._mark_before(event(kind, value))
    marks = unmarked and value == "PRESS" and kind == "A"
    assert pushed == [live.bl_label] * marks and live._marks == 3 + marks and live._unmarked == (unmarked and not marks)


@pytest.mark.parametrize("early", [False, True])
@pytest.mark.parametrize("value", ["PRESS", "RELEASE"])
def test_enter_keeps_the_best_where_there_is_one_already(package, monkeypatch, early, value):
    run, asked = package("session.run"), []
    current = SimpleNamespace(end_early=lambda: asked.append(1) or early, text=lambda: "hint", label="it")
    monkeypatch.setattr(run, "current", current)
    window, operator = Window(), scenes.stand_in("uv.omt_unwrap")
    for kind in package("operators.base").KEEP:
        asked.clear()
        window.hints.clear()
        assert operator.modal(window, event(kind, value)) == RUNNING
        assert bool(asked) == (value == "PRESS") and window.hints == (["hint"] if early and asked else [])
    monkeypatch.setattr(run, "current", None)
    assert operator.modal(window, event("RET")) == RUNNING


def test_a_pair_is_two_meshes_of_which_one_is_active(package):
    pair = package("operators.shapes.match").source_and_target
    complaint = package("operators.base").Complaint
    first, second, third = scenes.cube("First"), scenes.cube("Second"), scenes.cube("Third")
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.collection.objects.link(empty)
    view = bpy.context.view_layer.objects
    for chosen, active in product(([], [first], [first, second], [first, second, third], [first, second, empty]),
                                  (None, first, second, third, empty)):  # fmt: skip
        scenes.select(chosen)
        view.active = active
        meshes = [obj for obj in chosen if obj != empty]
        if len(meshes) == 2 and active in meshes:
            source, target = pair(bpy.context)
            assert target == active and {source, target} == set(meshes)
        else:
            with pytest.raises(complaint, match="two mesh objects"):
                pair(bpy.context)
    second.data = first.data
    scenes.select([first, second])
    with pytest.raises(complaint, match="share their mesh"):
        pair(bpy.context)


@pytest.mark.parametrize("chosen", [(), ("a",), ("a", "b"), ("a", "b", "c")])
@pytest.mark.parametrize("active", ["a", "d"])
def test_a_distance_is_between_two_of_which_one_is_active(chosen, active):
    every = {name: scenes.bump(2, 2, name=name) for name in "abcd"}
    scenes.select([every[name] for name in chosen])
    bpy.context.view_layer.objects.active = every[active]
    if len(chosen) == 2 and active in chosen:
        assert bpy.ops.object.omt_distance() == {"FINISHED"}
    else:
        assert scenes.error_of(bpy.ops.object.omt_distance)
        assert not any("OMT" in a.name for obj in every.values() for a in obj.data.attributes)


@pytest.mark.parametrize("kind", ["MESH", "EMPTY", None])
def test_versions_are_compared_of_the_active_mesh_or_of_one_that_is_selected(kind):
    obj = scenes.bump(6, 6)
    assert "nothing to compare" in scenes.error_of(bpy.ops.object.omt_compare)
    assert bpy.ops.object.omt_remesh(target_vertices=20) == {"FINISHED"}
    made = bpy.data.objects["Bump_remesh"]
    scenes.select([made])
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.collection.objects.link(empty)
    bpy.context.view_layer.objects.active = {"MESH": made, "EMPTY": empty, None: None}[kind]
    assert bpy.ops.object.omt_compare() == {"FINISHED"}
    assert obj.visible_get() and not made.visible_get() and bpy.context.view_layer.objects.active == obj


def test_a_queue_goes_on_without_what_is_in_no_view_layer(package):
    found = bodies_with_some_selected()
    operator, queue = scenes.stand_in("uv.omt_queue"), package("session.queue")
    assert operator.begin(bpy.context) == RUNNING
    jobs = {job.name: job for job in queue.state.jobs}
    bpy.context.collection.objects.unlink(found[0])
    bpy.context.view_layer.update()
    while operator._advance(bpy.context) == RUNNING:
        pass
    assert jobs[found[0].name].state == "FAILED" and jobs[found[1].name].state == "DONE"


@pytest.mark.parametrize("handles", ["SELECTED", "EMPTIES"])
@pytest.mark.parametrize("area", ["VIEW_3D", None])
@pytest.mark.parametrize("region", [False, True])
def test_handles_are_dragged_where_there_is_a_view_to_drag_them_in(package, monkeypatch, handles, area, region):
    bodies_with_some_selected()
    in_front(monkeypatch, package)
    window = Window(area or "", region_data=object() if region else None)
    if area is None:
        window.__dict__["area"] = None
    operator = scenes.stand_in("object.omt_flow", handles=handles)
    ended = operator.invoke(window, event("LEFTMOUSE"))
    dragged = area is not None and region and handles == "SELECTED"
    # Without a drag nothing moves, which is refused.
    assert (operator._drag is not None) == dragged and ended == (RUNNING if dragged else {"CANCELLED"})
    assert bool(operator.reports) != dragged
    if dragged:
        operator.modal(window, event("ESC"))


@pytest.mark.parametrize("kind", ["MESH", "EMPTY", None])
def test_weights_are_shown_on_a_mesh_that_is_active(package, monkeypatch, kind):
    obj = scenes.bump()
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.collection.objects.link(empty)
    bpy.context.view_layer.objects.active = {"MESH": obj, "EMPTY": empty, None: None}[kind]
    in_front(monkeypatch, package)
    package("operators.regions.weights")._show(Window())
    assert bpy.context.mode == ("PAINT_WEIGHT" if kind == "MESH" else "OBJECT")


def magnify(**settings):
    return scenes.stand_in("uv.omt_magnify", **settings)


def test_the_group_of_a_region_is_the_one_named_or_that_of_the_active_mesh(package):
    module = package("operators.magnify")
    view = bpy.context.view_layer.objects
    obj = scenes.bump()
    assert module._active_group(bpy.context) == ""
    obj.vertex_groups.new(name="first"), obj.vertex_groups.new(name="second")
    obj.vertex_groups.active_index = 1
    assert module._active_group(bpy.context) == "second"
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.collection.objects.link(empty)
    for active in (empty, None):
        view.active = active
        assert module._active_group(bpy.context) == ""
    view.active = obj
    pairs = [(obj, package("blender.mesh").read(obj))]
    region = package("pipelines.magnify").Region
    regions = [region(r.surface, r.faces, None, r.all_pins) for _, r in pairs]
    by_attribute = {"region": "ATTRIBUTE", "weight_group": "first"}
    for settings, name in (({}, "second"), ({"weight_group": "first"}, "first"), (by_attribute, "Region"),
                           (by_attribute | {"attribute": "mine"}, "mine")):  # fmt: skip
        (found,) = magnify(**settings)._further(pairs, regions, [])
        assert found.name == name and found.factor == magnify().factor
    error = package("blender.vertex_groups").GroupError
    with pytest.raises(error, match="'second' is the region itself"):
        magnify()._further(pairs, regions, [("second", 2.0)])
    many = magnify(weight_group="first")._further(pairs, regions, [("second", 2.0)])
    assert [(r.name, r.factor) for r in many] == [("first", magnify().factor), ("second", 2.0)]


@pytest.mark.parametrize("kind", ["MESH", "EMPTY", None])
@pytest.mark.parametrize("chosen", ["", "there", "to come"])
def test_a_name_is_searched_for_among_those_of_a_mesh_that_has_it(package, kind, chosen):
    obj = scenes.bump()
    obj.vertex_groups.new(name="there")
    empty = bpy.data.objects.new("Empty", None)
    bpy.context.collection.objects.link(empty)
    bpy.context.view_layer.objects.active = {"MESH": obj, "EMPTY": empty, None: None}[kind]
    record: list[str] = []
    package("operators.properties").choose_group(Recorder(record), SimpleNamespace(name=chosen), "name")
    (line,) = record
    assert line.startswith("prop_search(") == (kind == "MESH" and chosen != "to come")


@pytest.mark.parametrize(("pack", "keep"), list(product((False, True), (False, True))))
def test_the_margin_counts_where_islands_are_packed(package, pack, keep):
    record: list[str] = []
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_refine")
    properties.pack, properties.keep_boundary = pack, keep
    try:
        package("operators.refine").draw_settings(Recorder(record), properties)
    finally:
        properties.property_unset("pack"), properties.property_unset("keep_boundary")
    (margin,) = [line for line in record if line.startswith("prop(margin")]
    (packs,) = [line for line in record if line.startswith("prop(pack")]
    assert margin.endswith(f"a{int(pack and not keep)}") and packs.endswith(f"a{int(not keep)}")


@pytest.mark.parametrize("refused", [False, True])
@pytest.mark.parametrize("outdated", ["", "the mesh has changed"])
@pytest.mark.parametrize("notices", [False, True])
@pytest.mark.parametrize("beyond", [(), ("Shear",), ("Folded faces",), ("Overlap", "Shear")])
def test_a_check_mark_stands_only_where_all_is_well(package, refused, outdated, notices, beyond):
    last_run, result = package("session.last_run"), package("panels.result")
    for rows in ((), (("Area", "1 %"),)):
        told = (last_run.Notice("told"),) if notices else ()
        summary = last_run.Summary("Unwrap", rows, told, ("a",), frozenset(beyond), refused=refused)
        bad = notices or {"Folded faces", "Overlap"} & set(beyond)
        expected = ("CANCEL" if refused else "FILE_REFRESH" if outdated else "ERROR" if bad
                    else "INFO" if beyond or not rows else "CHECKMARK")  # fmt: skip
        assert result.icon_of(summary, outdated) == expected


def test_a_result_is_about_an_object_or_about_several(package):
    last_run, about = package("session.last_run"), package("panels.result").about
    for names, text in (((), ""), (("One",), "One"), (("One", "Other"), "2 objects")):
        assert about(last_run.Summary("Unwrap", (), (), names)) == text


@pytest.mark.parametrize("kind", ["UI", "WINDOW", None])
def test_lines_are_as_long_as_the_sidebar_is_wide(package, kind):
    result = package("panels.result")
    region = None if kind is None else SimpleNamespace(type=kind, width=900)
    system = SimpleNamespace(system=SimpleNamespace(ui_scale=2.0))
    width = 450 if kind == "UI" else result.PANEL
    context = SimpleNamespace(region=region, preferences=system)
    assert result.characters(context) == int((width - result.BESIDE) / result.LETTER)


def test_a_list_of_regions_names_each_group_once(package):
    lists = package("session.region_list")
    assert lists.pairs_of(None) == []
    obj = scenes.bump()
    empty = bpy.data.objects.new("Empty", None)
    assert lists.pairs_of(empty) == [] == lists.pairs_of(obj)
    for group, factor in (("a", 2.0), ("b", 0.5)):
        row = lists.rows_of(obj).rows.add()
        row.group, row.factor = group, factor
    assert lists.pairs_of(obj) == [("a", 2.0), ("b", 0.5)]
    lists.rows_of(obj).rows.add().group = "a"
    with pytest.raises(lists.RegionListError, match="'a' stands in the list twice"):
        lists.pairs_of(obj)
    lists.rows_of(obj).rows[2].group = ""
    with pytest.raises(lists.RegionListError, match="Row 3 names no vertex group"):
        lists.pairs_of(obj)


def test_a_histogram_is_shown_in_the_image_editor_that_asks_for_it():
    obj = scenes.bump()
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    for kind in ("IMAGE_EDITOR", "VIEW_3D", None):
        space = None if kind is None else SimpleNamespace(type=kind, image=None)
        operator = scenes.stand_in("uv.omt_histogram")
        operator.act(Window(kind or "", space_data=space))
        shown = kind == "IMAGE_EDITOR"
        assert bool(operator.reports) != shown
        if shown:
            assert space.image.name in bpy.data.images
        elif space is not None:
            assert space.image is None


@pytest.mark.parametrize("mode", ["TRANSFER", "CHECKER", "WRAP", "KEY"])
def test_only_a_transfer_has_kinds_of_what_is_transferred(mode):
    match = scenes.stand_in("object.omt_match")
    prop = match.rna_type.properties["mode"]
    if mode not in {item.identifier for item in prop.enum_items}:
        mode = prop.enum_items[-1].identifier
    found = scenes.stand_in("object.omt_match", mode=mode, transfer={"UV", "GROUPS"}).kinds()
    assert found == ({"uv", "groups"} if mode == "TRANSFER" else set())


@pytest.mark.parametrize("about", [(), ("Cube",), ("Cube", ValueError("why"))])
def test_a_complaint_reads_as_its_message_whatever_it_is_about(package, about):
    found = package("operators.base").Complaint("Nothing is selected.", *about)
    assert str(found) == "Nothing is selected."
    assert (found.obj, found.error) == (*about, None, None)[:2]
