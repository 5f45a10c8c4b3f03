"""Objects one after the other: what is done stays, what fails is named and selected, each has a texture to itself."""

from __future__ import annotations

import types

import bpy

import numpy as np
import scenes


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
