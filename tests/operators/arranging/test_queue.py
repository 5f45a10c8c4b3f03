"""Objects one after the other: what is done stays, what fails is named and selected, each has a texture to itself."""

from __future__ import annotations

import types

import bpy

import numpy as np
import pytest
import scenes
import windows


@pytest.fixture(autouse=True)
def no_queue(package):
    yield
    package("session.queue").forget()


def event(kind, value="NOTHING"):
    return types.SimpleNamespace(type=kind, value=value)


def test_all_are_unwrapped_each_in_its_own_square(package):
    objects = [scenes.bump(name=f"B{k}", offset=2 * k) for k in range(3)]
    scenes.select(objects)
    assert bpy.ops.uv.omt_queue() == {"FINISHED"}
    for obj in objects:
        assert np.ptp(scenes.uv_of(obj), axis=0).max() > 0.9
    assert [job.state for job in package("session.queue").state.jobs] == ["DONE"] * 3


def test_one_that_fails_is_named_and_selected_and_the_others_are_done(package):
    good = [scenes.bump(name="A"), scenes.bump(name="C")]
    bad = scenes.add([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(0, 1, 2)], "Flat")
    scenes.select([*good, bad])
    assert bpy.ops.uv.omt_queue() == {"FINISHED"}
    assert all(obj.data.uv_layers for obj in good)
    summary = package("session.last_run").state.summary
    assert dict(summary.rows)["Done"] == "2 of 3" and summary.notices[0].text.startswith("Flat: ")
    # Once: the reason of its own names it, too.
    assert summary.notices[0].text.count("Flat") == 1
    assert [obj.name for obj in bpy.context.selected_objects] == ["Flat"]


def test_a_time_limit_gives_one_up(package):
    obj = scenes.bump(40, 40)
    operator = scenes.stand_in("uv.omt_queue", limit=1e-9)
    assert operator.begin(bpy.context) == {"RUNNING_MODAL"}
    while operator._advance(bpy.context) == {"RUNNING_MODAL"}:
        pass
    (job,) = package("session.queue").state.jobs
    assert job.state == "FAILED" and "took more than" in job.reason and not obj.data.uv_layers


def test_stop_keeps_what_is_done(package):
    objects = [scenes.bump(name=f"B{k}") for k in range(3)]
    scenes.select(objects)
    operator = scenes.stand_in("uv.omt_queue")
    operator.begin(bpy.context)
    queue = package("session.queue")
    while queue.state.jobs[0].state != "DONE":
        operator._advance(bpy.context)
    assert bpy.ops.uv.omt_queue_stop() == {"FINISHED"}
    assert operator.modal(bpy.context, event("TIMER")) == {"FINISHED"}
    done = [obj for obj in objects if obj.data.uv_layers]
    assert len(done) == 1 and queue.state.is_over
    assert [job.state for job in queue.state.jobs] == ["DONE", "WAITING", "WAITING"]


def test_what_may_not_be_written_is_told_before_it_is_unwrapped(package):
    """By the name that Unwrap writes to, which here is that of another attribute."""
    good, bad = scenes.bump(name="Good"), scenes.bump(name="Bad", offset=2.0)
    bad.data.attributes.new("mine", "FLOAT", "POINT")
    scenes.select([good, bad])
    settings = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    settings.uv_layer = "mine"
    assert bpy.ops.uv.omt_queue() == {"FINISHED"}
    settings.property_unset("uv_layer")
    jobs = {job.name: job for job in package("session.queue").state.jobs}
    assert jobs["Good"].state == "DONE" and "mine" in good.data.uv_layers
    assert jobs["Bad"].state == "FAILED" and "'mine' that is no UV layer" in jobs["Bad"].reason
    assert jobs["Bad"].progress == 0


def _under_way(package, monkeypatch, names=("A", "B")):
    """A queue whose first object is being unwrapped, and its objects."""
    windows.in_single_steps(monkeypatch, package)
    objects = [scenes.bump(12, 12, name=name, offset=2.0 * k) for k, name in enumerate(names)]
    scenes.select(objects)
    operator = scenes.stand_in("uv.omt_queue")
    assert operator.begin(bpy.context) == {"RUNNING_MODAL"}
    for _ in range(3):
        assert operator._advance(bpy.context) == {"RUNNING_MODAL"}
    jobs = package("session.queue").state.jobs
    assert [job.state for job in jobs] == ["RUNNING", "WAITING"]
    return operator, [bpy.data.objects[job.name] for job in jobs]


def _watching():
    """Handlers of those who watch what runs work on."""
    return [f for f in bpy.app.handlers.depsgraph_update_post if type(getattr(f, "__self__", None)).__name__ == "Watch"]


def _to_its_end(operator):
    while operator._advance(bpy.context) == {"RUNNING_MODAL"}:
        pass


def _moved(obj):
    obj.data.vertices[5].co.z += 0.5


def _with_a_hole(obj):
    mesh = bpy.data.meshes.new("Hole")
    places = [v.co.copy() for v in obj.data.vertices]
    mesh.from_pydata(places, [], [tuple(p.vertices) for p in obj.data.polygons][1:])
    obj.data = mesh


def _renamed(obj):
    obj.name = "Other"


def _with_a_seam(obj):
    obj.data.edges[30].use_seam = True


@pytest.mark.parametrize("change", [_moved, _with_a_hole, _with_a_seam])
def test_what_was_changed_while_it_was_unwrapped_is_left_as_it_is(package, monkeypatch, change):
    """UVs of a mesh that is no more would be wrong without a word, and the window lets everything be done meanwhile."""
    operator, (first, second) = _under_way(package, monkeypatch)
    change(first)
    _to_its_end(operator)
    jobs = package("session.queue").state.jobs
    assert [job.state for job in jobs] == ["FAILED", "DONE"] and "changed meanwhile" in jobs[0].reason
    assert not first.data.uv_layers and second.data.uv_layers
    assert any(text.startswith(f"{first.name}: ") for kind, text in operator.reports if kind == {"WARNING"})


def test_others_may_be_worked_on_meanwhile(package, monkeypatch):
    operator, (first, second) = _under_way(package, monkeypatch)
    third = scenes.bump(name="C", offset=9.0)
    scenes.edit(third)
    _to_its_end(operator)
    assert [job.state for job in package("session.queue").state.jobs] == ["DONE", "DONE"]
    assert first.data.uv_layers and second.data.uv_layers and not third.data.uv_layers


def test_who_is_renamed_meanwhile_is_gone(package, monkeypatch):
    operator, (first, second) = _under_way(package, monkeypatch)
    _renamed(first)
    _to_its_end(operator)
    jobs = package("session.queue").state.jobs
    assert [job.state for job in jobs] == ["FAILED", "DONE"] and not first.data.uv_layers


def test_a_second_queue_waits_for_the_first_and_may_begin_when_that_was_stopped(package, monkeypatch):
    operator, (first, second) = _under_way(package, monkeypatch)
    queue = package("session.queue")
    running, steps = queue.state, queue.state.jobs[0].steps
    other = scenes.stand_in("uv.omt_queue")
    assert other.begin(bpy.context) == {"CANCELLED"} and "still running" in other.reports[-1][1]
    assert queue.state is running and not running.is_over
    queue.stop()
    assert other.begin(bpy.context) == {"RUNNING_MODAL"} and queue.state is not running
    # Nothing of the first is left, and its operator ends without touching the second.
    assert running.is_over and steps.gi_frame is None and not _watching()
    assert operator._advance(bpy.context) == {"CANCELLED"}
    _to_its_end(other)
    assert [job.state for job in queue.state.jobs] == ["DONE", "DONE"] and not _watching()


def test_nothing_is_left_of_a_queue_that_is_forgotten_on_its_way(package, monkeypatch):
    _under_way(package, monkeypatch)
    queue = package("session.queue")
    steps = queue.state.jobs[0].steps
    assert len(_watching()) == 1
    queue.forget()
    assert queue.state is None and steps.gi_frame is None and not _watching()


def test_escape_in_the_window_keeps_what_is_done_and_closes_what_is_not(package, monkeypatch):
    operator, (first, second) = _under_way(package, monkeypatch)
    steps = package("session.queue").state.jobs[0].steps
    assert operator.modal(bpy.context, event("ESC", "PRESS")) == {"PASS_THROUGH"}
    assert operator.modal(bpy.context, event("TIMER")) == {"CANCELLED"}
    assert steps.gi_frame is None and not first.data.uv_layers and not second.data.uv_layers


@pytest.mark.parametrize("there", [False, True])
@pytest.mark.parametrize("setting", ["keep_free", "centre_group", "start_group", "corner_group"])
def test_a_group_that_none_of_the_objects_has_is_named_before_anything_is_begun(package, setting, there):
    objects = [scenes.bump(name="A"), scenes.bump(name="B", offset=2)]
    if there:
        # One of them is enough.
        objects[1].vertex_groups.new(name="mine").add([0], 1.0, "REPLACE")
    scenes.select(objects)
    queue = package("operators.arranging.queue")
    chosen = bpy.context.window_manager.operator_properties_last("uv.omt_unwrap")
    setattr(chosen, setting, "mine")
    # Where outlines are free, neither a centre nor corners count.
    chosen.boundary = "DISK"
    try:
        if there:
            queue._check_groups(bpy.context, objects)
        else:
            with pytest.raises(package("operators.base").Complaint, match="no vertex group 'mine'"):
                queue._check_groups(bpy.context, objects)
            if setting in ("centre_group", "corner_group"):
                chosen.boundary = "FREE"
                queue._check_groups(bpy.context, objects)
    finally:
        chosen.property_unset(setting)
        chosen.property_unset("boundary")
