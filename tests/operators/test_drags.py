"""What is dragged goes by the last place of the mouse alone, and is back to the bit when it is let be: every drag."""

from __future__ import annotations

from contextlib import suppress
from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from sphere_shapes import blob

NAMES = ["object.omt_flow", "uv.omt_flow"]
# Places in pixels; those of a drag are a hundredth of a unit each.
START, END = (50, 50), (58, 47)


def bodies():
    """Two bodies with UVs and selected vertices."""
    found = []
    for k in range(2):
        V, F = blob(2, seed=k)
        obj = scenes.add(V + [4.0 * k, 0, 0], F, f"Body {k}")
        for vertex in obj.data.vertices:
            vertex.select = vertex.index in (int(V[:, 2].argmax()), int(V[:, 0].argmin()))
        found.append(obj)
    scenes.select(found)
    bpy.ops.uv.omt_unwrap(quality="DRAFT", max_shear=0.0)
    return found


def state(objects):
    """Positions and UVs to the bit, and what else the objects have."""
    found = []
    for obj in objects:
        keys = obj.data.shape_keys.key_blocks if obj.data.shape_keys else ()
        points = np.array([v.co[:] for v in obj.data.vertices])
        found.append((points.tobytes(), scenes.state(obj), [key.name for key in keys]))
    return found


def mouse(kind, value="NOTHING", at=START):
    return SimpleNamespace(type=kind, value=value, mouse_region_x=at[0], mouse_region_y=at[1])


@pytest.fixture(params=NAMES)
def drag(request, monkeypatch):
    """Objects, and what begins a drag of them, whose places of the mouse are hundredths of a unit."""
    objects = bodies()

    def begin():
        operator = scenes.stand_in(request.param)
        if request.param == "uv.omt_flow":
            operator._place = lambda _, event: (event.mouse_region_x / 100, event.mouse_region_y / 100)
            operator.radius = 0.3
        else:

            def shift(_, event):
                return ((event.mouse_region_x - START[0]) / 100, (event.mouse_region_y - START[1]) / 100, 0.0)

            operator._shift, operator.result = shift, "MESH"
        operator.begin_drag(bpy.context)
        area = SimpleNamespace(tag_redraw=lambda: None, type="IMAGE_EDITOR")

        class Context:
            def __getattr__(self, name):
                return area if name == "area" else getattr(bpy.context, name)

        context = Context()
        if request.param == "uv.omt_flow":
            operator.modal(context, mouse("LEFTMOUSE", "PRESS"))

        def hears(*event, **at):
            return operator.modal(context, mouse(*event, **at))

        def cancel(context, cancelled=operator.cancel):
            # What stands in is no instance of the class whose method goes on with its base's, last of all.
            with suppress(TypeError):
                cancelled(context)

        operator.hears, operator.cancel = hears, cancel
        return operator

    return objects, begin, request.param


@pytest.mark.parametrize("how", ["ESC", "RIGHTMOUSE", "cancel"])
def test_what_is_let_be_is_back_to_the_bit(drag, how):
    objects, begin, name = drag
    before = state(objects)
    operator = begin()
    for at in (END, (40, 60), (70, 52)):
        assert operator.hears("MOUSEMOVE", at=at) == {"RUNNING_MODAL"}
    assert state(objects) != before
    if how == "cancel":
        operator.cancel(bpy.context)
    else:
        assert operator.hears(how, "PRESS") == {"CANCELLED"}
    assert state(objects) == before and operator._drag is None


def test_only_the_last_place_counts(drag):
    objects, begin, name = drag
    before, shown = state(objects), []
    for way in ([END], [(40, 60), (70, 52), END], [(70, 52), START, END], [END, START, END]):
        operator = begin()
        for at in way:
            operator.hears("MOUSEMOVE", at=at)
        shown.append(state(objects))
        operator.hears("ESC", "PRESS")
        assert state(objects) == before
    assert all(each == shown[0] for each in shown)


def test_the_start_is_as_it_was(drag):
    objects, begin, name = drag
    before = state(objects)
    operator = begin()
    for at in (END, START, (70, 52), START):
        operator.hears("MOUSEMOVE", at=at)
        assert (state(objects) == before) == (at == START)


def test_what_is_kept_is_what_the_operator_makes_of_what_was_there(drag):
    objects, begin, name = drag
    operator = begin()
    for at in ((40, 60), END):
        operator.hears("MOUSEMOVE", at=at)
    before_end = tuple(operator.move)
    assert operator.hears("LEFTMOUSE", "RELEASE" if name == "uv.omt_flow" else "PRESS", at=END) == {"FINISHED"}
    kept = state(objects)
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    objects = bodies()
    if name == "uv.omt_flow":
        arguments = {"start": (START[0] / 100, START[1] / 100), "move": before_end, "radius": 0.3}
        assert bpy.ops.uv.omt_flow(**arguments) == {"FINISHED"}
    else:
        assert bpy.ops.object.omt_flow(move=before_end, result="MESH") == {"FINISHED"}
    for (points, data, keys), (other_points, other_data, other_keys) in zip(kept, state(objects), strict=True):
        assert keys == other_keys and data.keys() == other_data.keys()
        np.testing.assert_allclose(np.frombuffer(points), np.frombuffer(other_points), atol=1e-6)
        layer = objects[0].data.uv_layers.active.name
        uv, other = (np.frombuffer(d[layer][2], np.float32) for d in (data, other_data))
        np.testing.assert_allclose(uv, other, atol=1e-6)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("kind", ["ESC", "BACK_SPACE"])
def test_landmarks_that_were_picked_are_taken_back(mirrored, kind):
    objects = bodies()
    operator = scenes.stand_in("object.omt_landmarks", mirrored=mirrored)
    operator._objects, operator._made, operator._held = tuple(objects), [], None
    before = set(bpy.data.objects)
    operator.near = lambda *_: None
    context = SimpleNamespace(region=SimpleNamespace(type="WINDOW"), workspace=bpy.context.workspace)
    every = [set(bpy.data.objects)]
    for k in range(3):
        for obj in objects:
            point = obj.matrix_world @ obj.data.vertices[7 * k + 3].co
            operator.hit = lambda *_, obj=obj, point=point: (obj, point)
            operator.modal(context, mouse("LEFTMOUSE", "PRESS"))
            operator.modal(context, mouse("LEFTMOUSE", "RELEASE"))
            every.append(set(bpy.data.objects))
    assert len(every[-1]) == len(before) + 6 * (1 + mirrored)
    if kind == "ESC":
        assert operator.modal(context, mouse("ESC", "PRESS")) == {"CANCELLED"}
        assert set(bpy.data.objects) == before
    else:
        for _ in range(3):
            count = len(bpy.data.objects)
            operator.modal(context, mouse("BACK_SPACE", "PRESS"))
            assert len(bpy.data.objects) == count - 1
