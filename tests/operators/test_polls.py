"""Where every operator, panel and menu is offered is an interface: a table keeps it. Asking never fails."""

from __future__ import annotations

from pathlib import Path

import bpy

import pytest
import scenes
from kept import check

POLLS = Path(__file__).with_name("polls.tsv")


def curve():
    obj = bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE"))
    bpy.context.collection.objects.link(obj)
    scenes.select([obj])


def in_mode(mode):
    scenes.bump()
    bpy.ops.object.mode_set(mode=mode)


WHERE = {
    "nothing": lambda: None,
    "mesh": scenes.bump,
    "no active object": lambda: (scenes.bump(), scenes.select([])),
    "curve": curve,
    **{mode.lower().replace("_", " "): lambda mode=mode: in_mode(mode)
       for mode in ("EDIT", "SCULPT", "WEIGHT_PAINT", "VERTEX_PAINT", "TEXTURE_PAINT")},
}  # fmt: skip


@pytest.fixture
def no_runs(package):
    """What runs and tables of other tests have left is put away, and is there again afterwards."""
    queue = package("session.queue")
    state, queue.state = queue.state, None
    yield
    queue.state = state


def test_what_is_offered_where_is_that_of_the_table(package, no_runs):
    asked = [c for c in package("registration").CLASSES if hasattr(c, "poll")]
    offered = {c: [] for c in asked}
    for name, make in WHERE.items():
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        make()
        for cls in asked:
            answer = cls.poll(bpy.context)
            assert isinstance(answer, (bool, type(None))), (cls.__name__, name, answer)
            offered[cls] += [name] if answer else []
        if bpy.context.mode != "OBJECT":
            bpy.ops.object.mode_set(mode="OBJECT")
    assert len(asked) > 40
    check(
        POLLS,
        [f"{c.__name__}\t\t\t{', '.join(offered[c]) or 'nowhere'}" for c in sorted(asked, key=lambda c: c.__name__)],
    )


def test_a_queue_can_be_stopped_while_it_runs(package, no_runs):
    stop, queue = scenes.class_of("uv.omt_queue_stop"), package("session.queue")
    for over in (False, True):
        queue.state = queue.Queue([queue.Job("A")])
        queue.state.is_over = over
        assert stop.poll(bpy.context) == (not over)
