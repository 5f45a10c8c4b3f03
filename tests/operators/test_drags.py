"""What is dragged goes by the last place of the mouse alone, and is back to the bit when it is let be: every drag."""

from __future__ import annotations

from types import SimpleNamespace

import bpy

import numpy as np
import pytest
import scenes
from mathutils import Matrix
from sphere_shapes import blob
from windows import Window, in_front

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

        operator.hears = hears
        return operator

    return objects, begin, request.param


class View:
    """A view from above of 200 by 100 pixels, of which 50 are a unit, as its region and itself tell of it."""

    width, height = 200, 100
    type, is_perspective, view_perspective = "WINDOW", False, "ORTHO"
    view_matrix = Matrix()
    perspective_matrix = Matrix.Diagonal((1 / 2, 1 / 1, -1 / 100, 1))

    @staticmethod
    def pixel(point):
        """Where a point of the world is seen."""
        return (100 + 50 * point[0], 50 + 50 * point[1])

    view2d = SimpleNamespace(region_to_view=lambda x, y: (x / 200, y / 100))


def in_view(package, monkeypatch, area):
    """A window whose mouse is over an area of this kind, seen from above."""
    in_front(monkeypatch, package)
    return Window(area, region=View, region_data=View)


@pytest.mark.parametrize(("name", "area"), [("object.omt_flow", "VIEW_3D"), ("uv.omt_flow", "IMAGE_EDITOR")])
@pytest.mark.parametrize("end", ["ESC", "keep"])
def test_a_drag_begins_by_a_click_and_goes_with_the_mouse(package, monkeypatch, name, area, end):
    objects = bodies()
    window, before = in_view(package, monkeypatch, area), state(objects)
    operator = scenes.stand_in(name, **({"result": "MESH"} if name == "object.omt_flow" else {"radius": 0.3}))
    assert operator.invoke(window, mouse("LEFTMOUSE", "PRESS", (100, 50))) == {"RUNNING_MODAL"}
    assert window.listeners == [operator] and not window.timers and "Esc: Back" in window.hints[-1]
    operator.modal(window, mouse("LEFTMOUSE", "PRESS", (100, 50))) if name == "uv.omt_flow" else None
    assert operator.modal(window, mouse("MOUSEMOVE", at=(110, 55))) == {"RUNNING_MODAL"}
    # Ten pixels of two hundred of the UV square, and of fifty for a unit of the world.
    expected = (0.2, 0.1, 0.0) if name == "object.omt_flow" else (0.05, 0.05)
    assert tuple(operator.move) == pytest.approx(expected, abs=1e-6)
    assert state(objects) != before and window.hints[-1] is not None
    if name == "uv.omt_flow":
        assert window.redrawn and tuple(operator.start) == pytest.approx((0.5, 0.5))
    if end == "ESC":
        assert operator.modal(window, mouse("ESC", "PRESS")) == {"CANCELLED"} and state(objects) == before
    else:
        release = ("LEFTMOUSE", "RELEASE") if name == "uv.omt_flow" else ("RET", "PRESS")
        assert operator.modal(window, mouse(*release, at=(110, 55))) == {"FINISHED"} and state(objects) != before
    assert window.hints[-1] is None and operator._drag is None


@pytest.mark.parametrize(("name", "area", "settings"), [
    ("object.omt_flow", "IMAGE_EDITOR", {"move": (0.0, 0.0, 0.25)}), ("uv.omt_flow", "VIEW_3D", {}),
    ("object.omt_flow", "VIEW_3D", {"move": (0.0, 0.0, 0.25)}), ("object.omt_flow", "VIEW_3D", {"rotate": (0.5, 0, 0)}),
])  # fmt: skip
def test_where_nothing_is_dragged_the_settings_are_what_moves(package, monkeypatch, name, area, settings):
    objects = bodies()
    for obj in objects:
        for vertex in obj.data.vertices:
            vertex.select = vertex.co.z > 0.7
    window, before = in_view(package, monkeypatch, area), state(objects)
    operator = scenes.stand_in(name, **settings)
    found = operator.invoke(window, mouse("LEFTMOUSE", "PRESS"))
    while found == {"RUNNING_MODAL"}:
        assert operator._drag is None and window.timers
        found = operator.modal(window, mouse("TIMER"))
    assert found == {"FINISHED"} and state(objects) != before and not window.timers


@pytest.mark.parametrize(("name", "area"), [("object.omt_flow", "VIEW_3D"), ("uv.omt_flow", "IMAGE_EDITOR")])
def test_a_drag_of_nothing_is_refused(package, monkeypatch, name, area):
    objects = bodies()
    for obj in objects:
        for vertex in obj.data.vertices:
            vertex.select = False
        while obj.data.uv_layers:
            obj.data.uv_layers.remove(obj.data.uv_layers[0])
    window = in_view(package, monkeypatch, area)
    operator = scenes.stand_in(name)
    assert operator.invoke(window, mouse("LEFTMOUSE", "PRESS")) == {"CANCELLED"}
    assert operator.reports[0][0] == {"ERROR"} and not window.listeners and window.hints == [None]


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


def test_a_turn_of_the_wheel_is_as_if_the_drag_had_begun_with_that_radius(drag):
    objects, begin, name = drag
    before = state(objects)
    turned = begin()
    turned.hears("MOUSEMOVE", at=(40, 60))
    for kind in ("WHEELUPMOUSE", "WHEELUPMOUSE", "WHEELDOWNMOUSE"):
        turned.hears(kind, at=(40, 60))
    turned.hears("MOUSEMOVE", at=END)
    shown = state(objects)
    turned.hears("ESC", "PRESS")
    assert state(objects) == before != shown
    other = begin()
    other.radius = turned.radius
    other.begin_drag(bpy.context)
    other.hears("MOUSEMOVE", at=END)
    assert state(objects) == shown
    other.hears("ESC", "PRESS")
    assert state(objects) == before


@pytest.mark.parametrize("axis", range(3), ids="xyz")
def test_what_is_dragged_along_an_axis_is_where_the_mouse_is(axis):
    objects = bodies()
    shift = 0.1 * np.eye(3)[axis]
    operator = scenes.stand_in("object.omt_flow", result="MESH")
    operator.begin_drag(bpy.context)
    held = [[v.index for v in obj.data.vertices if v.select] for obj in objects]
    start = [np.array([obj.data.vertices[k].co[:] for k in chosen]) for obj, chosen in zip(objects, held, strict=True)]
    for times in (1.0, 2.0, -1.0):
        assert operator._drag.to(times * shift)
        for obj, chosen, places in zip(objects, held, start, strict=True):
            now = np.array([obj.data.vertices[k].co[:] for k in chosen])
            np.testing.assert_allclose(now, places + times * shift, atol=2e-3)


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


def picking(package, monkeypatch, **settings):
    """Two bodies, a view of them from above, and what picks landmarks on them."""
    objects = bodies()
    for obj in objects:
        # Their middles, four apart in the mesh, at -1 and 1.
        obj.location, obj.scale = (-1, 0, 0), (0.5, 0.5, 0.5)
    bpy.context.view_layer.update()
    window = in_view(package, monkeypatch, "VIEW_3D")
    operator = scenes.stand_in("object.omt_landmarks", **settings)
    assert operator.invoke(window, mouse("LEFTMOUSE", "RELEASE")) == {"RUNNING_MODAL"}
    assert window.listeners == [operator] and window.hints[-1]
    return objects, window, operator


def empties():
    return {obj.name: obj for obj in bpy.data.objects if obj.type == "EMPTY"}


def test_landmarks_are_where_they_are_clicked_and_go_where_they_are_dragged(package, monkeypatch):
    objects, window, operator = picking(package, monkeypatch)
    for obj, at in zip(objects, ((-1.1, 0.05), (0.9, 0.1)), strict=True):
        pixel = View.pixel(at)
        assert operator.modal(window, mouse("LEFTMOUSE", "PRESS", pixel)) == {"RUNNING_MODAL"}
        (made,) = (e for e in empties().values() if e.parent == obj)
        bpy.context.view_layer.update()
        assert tuple(made.matrix_world.translation.xy) == pytest.approx(at, abs=1e-5)
        # Seen from above, so on the upper side, which the eye sees.
        assert made.matrix_world.translation.z > 0.1
        # Held until it is let go of, and only ever on its own object.
        to = (at[0] + 0.2, at[1])
        operator.modal(window, mouse("MOUSEMOVE", at=View.pixel(to)))
        bpy.context.view_layer.update()
        assert tuple(made.matrix_world.translation.xy) == pytest.approx(to, abs=1e-5)
        for other in ((-at[0], 0.0), (0.0, 0.95)):
            operator.modal(window, mouse("MOUSEMOVE", at=View.pixel(other)))
            bpy.context.view_layer.update()
            assert tuple(made.matrix_world.translation.xy) == pytest.approx(to, abs=1e-5)
        operator.modal(window, mouse("LEFTMOUSE", "RELEASE", View.pixel(to)))
        operator.modal(window, mouse("MOUSEMOVE", at=pixel))
        bpy.context.view_layer.update()
        assert tuple(made.matrix_world.translation.xy) == pytest.approx(to, abs=1e-5)
    assert len(empties()) == 2
    # One that is there already is taken up again, the nearest one, where a click is within a few pixels.
    for obj, at in zip(objects, ((-0.9, 0.05), (1.1, 0.1)), strict=True):
        x, y = View.pixel(at)
        assert operator.near(window, mouse("LEFTMOUSE", "PRESS", (x + 2, y - 1))).parent == obj
        grasp = package("operators.shapes.landmarks").GRASP
        assert operator.near(window, mouse("LEFTMOUSE", "PRESS", (x, y + grasp - 0.5))) is not None
        assert operator.near(window, mouse("LEFTMOUSE", "PRESS", (x, y + grasp + 0.5))) is None
        operator.modal(window, mouse("LEFTMOUSE", "PRESS", (x, y)))
        operator.modal(window, mouse("LEFTMOUSE", "RELEASE", (x, y)))
    assert len(empties()) == 2
    # Beside both objects there is nothing.
    operator.modal(window, mouse("LEFTMOUSE", "PRESS", View.pixel((0.0, 0.95))))
    assert len(empties()) == 2 and operator._held is None
    assert operator.modal(window, mouse("RET", "PRESS")) == {"FINISHED"}
    assert window.hints[-1] is None and len(empties()) == 2


@pytest.mark.parametrize("made", [(2, 10), (10, 2), (1, 2, 3), (9, 10, 11), (100, 20, 3)], ids=str)
def test_halves_that_wait_are_met_in_the_order_of_their_numbers(package, made):
    """Not in that of their letters, by which 10 is before 2, and not in that in which they were made."""
    place = package("operators.shapes.landmarks").place
    objects = (scenes.bump(name="A"), scenes.bump(name="B", offset=3.0))
    put = package("blender.shapes.landmarks").put_landmark
    for number in made:
        put(objects[0], f"LM_{number}", (0.1, 0.2, 0.3))
    met = [place(objects, objects[1], "LM_", (3.5, 0.5, 0.1), False) for _ in made]
    assert [e.name.partition(".")[0] for (e,) in met] == [f"LM_{number}" for number in sorted(made)]
    # And then there is a new one.
    (free,) = place(objects, objects[1], "LM_", (3.2, 0.5, 0.1), False)
    missing = next(k for k in range(1, len(made) + 2) if k not in made)
    assert free.name == f"LM_{missing}"


def test_keys_while_landmarks_are_picked(package, monkeypatch):
    objects, window, operator = picking(package, monkeypatch)
    assert operator.mirrored is False
    for expected in (True, False):
        assert operator.modal(window, mouse("M", "PRESS")) == {"RUNNING_MODAL"}
        operator.modal(window, mouse("M", "RELEASE"))
        assert operator.mirrored is expected
    for kind in package("operators.base").NAVIGATION - {"MOUSEMOVE"}:
        assert operator.modal(window, mouse(kind, "PRESS")) == {"PASS_THROUGH"}
    window.__dict__["region"] = SimpleNamespace(type="UI")
    assert operator.modal(window, mouse("LEFTMOUSE", "PRESS", View.pixel((-1, 0)))) == {"PASS_THROUGH"}
    assert operator.modal(window, mouse("ESC", "PRESS")) == {"CANCELLED"} and window.hints[-1] is None


@pytest.mark.parametrize("area", ["IMAGE_EDITOR", None])
def test_landmarks_are_picked_in_a_view_of_two_meshes_alone(package, monkeypatch, area):
    objects = bodies()
    window = in_view(package, monkeypatch, area or "VIEW_3D")
    if area is None:
        scenes.select(objects[:1])
    operator = scenes.stand_in("object.omt_landmarks")
    assert operator.invoke(window, mouse("LEFTMOUSE", "PRESS")) == {"CANCELLED"}
    assert ("3D View" if area else "two mesh objects") in operator.reports[0][1] and not window.listeners
