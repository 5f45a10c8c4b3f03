"""Figures of the last run: those of the active UVs, and none where there is nothing to measure."""

from __future__ import annotations

import types

import bpy

import pytest
import scenes
from windows import Instead


@pytest.mark.parametrize("value, text", [(0.0123, "0.01 s"), (9.994, "9.99 s"), (10.0, "10 s"), (123.4, "123 s")])
def test_seconds(package, value, text):
    assert package("session.last_run").seconds(value) == text


def test_figures_do_not_depend_on_the_scale_of_the_uvs_but_the_texel_density_does(package):
    figures, read = package("session.last_run").figures, package("blender.mesh").read
    obj = scenes.bump()
    assert figures([read(obj)], 1024, 1.0).rows == ()
    uv = scenes.seen_from_above(obj, 0.4)
    scenes.set_uv(obj, uv)
    first = dict(figures([read(obj)], 1024, 1.0).rows)
    scenes.set_uv(obj, uv / 2)
    second = dict(figures([read(obj)], 1024, 1.0).rows)
    density = [float(rows.pop("Texel density").split()[0]) for rows in (first, second)]
    assert first == second and first["Folded faces"] == "0" and first["Islands"] == "1"
    assert density[0] == pytest.approx(2 * density[1], rel=1e-3)


@pytest.fixture
def last_run(package):
    yield package("session.last_run")
    package("session.last_run").forget()


def test_figures_that_hold_no_more_are_marked(last_run):
    """After undo, another selection, a mesh or UVs that changed; and they hold again when it is as it was."""
    obj, other = scenes.bump(), scenes.cube()
    scenes.select([obj])
    bpy.ops.uv.omt_unwrap()
    assert last_run.look_again() == ""
    scenes.select([other])
    assert last_run.look_again() == "others are selected"
    scenes.select([obj])
    assert last_run.look_again() == ""
    uv = scenes.uv_of(obj)
    scenes.set_uv(obj, uv + 0.1)
    assert last_run.look_again() == "the mesh has changed"
    scenes.set_uv(obj, uv)
    assert last_run.look_again() == ""
    obj.data.vertices[0].co.z += 0.1
    assert last_run.look_again() == "the mesh has changed"
    bpy.data.objects.remove(obj)
    assert last_run.look_again() == "an object is gone"


def test_undo_marks_them(last_run):
    scenes.bump()
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.uv.omt_unwrap("EXEC_DEFAULT", True)
    assert last_run.look_again() == ""
    bpy.ops.ed.undo()
    assert last_run.look_again()


def test_colours_weights_and_modes_do_not(last_run):
    obj = scenes.bump()
    bpy.ops.uv.omt_unwrap()
    bpy.ops.uv.omt_overlay(show="AREA")
    bpy.ops.object.omt_weights()
    scenes.edit(obj)
    assert last_run.look_again() == ""
    scenes.leave_edit()
    bpy.ops.uv.omt_overlay(show="NONE")


def test_a_file_that_is_loaded_has_no_result(last_run):
    scenes.bump()
    bpy.ops.uv.omt_unwrap()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert last_run.state.summary is None


@pytest.mark.parametrize(
    ("told", "good"),
    [({}, True), ({"rows": (("A", "1"),)}, True), ({"refused": True}, False), ({"beyond": frozenset("A")}, False),
     ({"notices": "One"}, False)],
)  # fmt: skip
def test_whatever_there_is_to_say_against_a_run_is_against_it(package, told, good):
    last_run = package("session.last_run")
    told = {name: (last_run.Notice(value),) if name == "notices" else value for name, value in told.items()}
    assert last_run.Summary("Unwrap", **told).is_good is good


def test_a_check_mark_is_for_what_is_within_all_bounds(last_run, package):
    icon_of = package("panels.result").icon_of
    scenes.bump(height=0.1)
    bpy.ops.uv.omt_unwrap()
    good = last_run.state.summary
    assert good.is_good and icon_of(good, "") == "CHECKMARK"
    assert icon_of(good, "the mesh has changed") != "CHECKMARK"
    bad = scenes.bump(height=4.0)
    scenes.set_uv(bad, scenes.seen_from_above(bad))
    scenes.select([bad])
    bpy.ops.uv.omt_measure()
    assert last_run.state.summary.beyond >= {"Area error", "Shear"}
    assert icon_of(last_run.state.summary, "") != "CHECKMARK"


def test_the_panel_is_drawn_anew_where_the_figures_stop_to_hold_and_only_then(last_run, monkeypatch):
    obj, drawn = scenes.bump(), []
    scenes.select([obj])
    bpy.ops.uv.omt_unwrap()
    monkeypatch.setattr(last_run, "redraw", drawn.append)
    last_run._look()
    assert not drawn
    obj.data.vertices[0].co.z += 0.1
    last_run._look()
    last_run._look()
    assert len(drawn) == 1 and last_run.state.outdated


def test_a_result_that_is_about_an_object_that_is_gone_watches_the_others(package):
    last_run = package("session.last_run")
    obj = scenes.bump()
    last_run.keep(last_run.Summary("Unwrap", (), (), (obj.name, "gone")))
    assert set(last_run.state.marks) == {obj.name} and last_run.look_again() == ""
    obj.data.uv_layers.new(name="another")
    assert last_run.look_again() == "the mesh has changed"
    last_run.keep(last_run.Summary("Unwrap", (), (), (obj.name,)))
    other = scenes.cube()
    scenes.select([other])
    assert last_run.look_again() == "others are selected"
    scenes.select([])
    assert last_run.look_again() == ""
    bpy.data.objects.remove(obj)
    assert last_run.look_again() == "an object is gone"
    last_run.forget()
    assert last_run.look_again() == "" and last_run.state.summary is None and not last_run.state.marks


def test_the_panel_is_brought_up_to_date_once_it_is_quiet(package, monkeypatch):
    last_run = package("session.last_run")
    timers = {}
    app = Instead(lambda: bpy.app, background=True, timers=types.SimpleNamespace(
        is_registered=lambda f: f in timers, unregister=timers.pop,
        register=lambda f, first_interval: timers.update({f: first_interval})))  # fmt: skip
    monkeypatch.setattr(last_run, "bpy", Instead(lambda: bpy, app=app))
    last_run._suspect()
    assert not timers
    app.__dict__["background"] = False
    for _ in range(3):
        last_run._suspect()
    assert timers == {last_run._look: last_run.PATIENCE}
    last_run.forget()
    assert not timers


@pytest.mark.parametrize("go_on", ["keep", "forget"])
def test_nothing_of_the_run_before_is_left(package, go_on):
    """Each field of what the panel knows is as in the beginning, but for what is kept."""
    last_run = package("session.last_run")
    kept = last_run.Summary("Unwrap", notices=(last_run.Notice("One"), last_run.Notice("Two")))
    last_run.state.summary, last_run.state.shown, last_run.state.outdated = kept, 1, "the mesh has changed"
    last_run.state.marks = {"Gone": b"mark"}
    new = last_run.Summary("Refine")
    last_run.keep(new) if go_on == "keep" else last_run.forget()
    state, fresh = last_run.state, last_run.State()
    assert state.summary is (new if go_on == "keep" else None)
    assert (state.shown, state.outdated, state.marks) == (fresh.shown, fresh.outdated, fresh.marks)
    last_run.forget()
