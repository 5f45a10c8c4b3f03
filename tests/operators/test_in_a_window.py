"""What operators do in a window, which stands in for Blender's: timers, listeners, hints, and what comes of it."""

from __future__ import annotations

import bpy

import pytest
import scenes
from dressed_bodies import bodies_with_some_selected, state
from windows import Window, event, in_front, in_single_steps

# Solvers that two bodies with UVs and a painted group are enough for; numbers that single precision holds.
SOLVERS = {
    "uv.omt_unwrap": {"quality": "DRAFT", "balance": 0.5},
    "uv.omt_refine": {"quality": "DRAFT"},
    "uv.omt_magnify": {"quality": "DRAFT", "weight_group": "painted here", "factor": 2.0},
    "uv.omt_sphere": {"quality": "DRAFT"},
    "uv.omt_seams": {},
    "uv.omt_flow": {"start": (0.25, 0.25), "move": (0.0625, 0.03125)},
    "object.omt_weights": {"kind": "GAUSSIAN", "show": False},
    "object.omt_remesh": {"target_vertices": 40},
    "object.omt_flow": {"move": (0.0, 0.125, 0.25), "result": "MESH"},
}
RUNNING = {"RUNNING_MODAL"}


@pytest.fixture
def window(package, monkeypatch):
    """A window, in which a slice of a run is one step of it."""
    in_front(monkeypatch, package)
    in_single_steps(monkeypatch, package)
    # In the UV editor some begin a drag.
    yield Window("VIEW_3D")
    run = package("session.run")
    left, run.current = run.current, None
    if left is not None:
        left.close()


def all_of():
    """The state of every mesh object that there is."""
    return {obj.name: state(obj) if obj.data.uv_layers else scenes.state(obj)
            for obj in bpy.data.objects if obj.type == "MESH"}  # fmt: skip


def solvers(package):
    """Operators with a solver behind them."""
    base = package("operators.base").SolverOperator
    return {scenes.name_of(c) for c in package("registration").CLASSES if issubclass(c, base)}


def changed(before, after):
    """What of a state is another one."""
    return {key for key in before.keys() | after.keys() if before.get(key) != after.get(key)}


def is_over(window, package):
    """Nothing is left of a run: no timer, no hint, no bar."""
    return not window.timers and window.hints[-1] is None and package("session.run").current is None


@pytest.mark.parametrize("name", SOLVERS)
def test_a_click_ends_as_a_script_does(package, window, name):
    bodies_with_some_selected()
    module, verb = name.split(".")
    assert getattr(getattr(bpy.ops, module), verb)(**SOLVERS[name]) == {"FINISHED"}
    expected = all_of()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bodies_with_some_selected()
    operator, seen = scenes.stand_in(name, **SOLVERS[name]), 0
    assert operator.invoke(window, event("LEFTMOUSE")) == RUNNING
    assert window.listeners == [operator] and [w for _, w in window.timers] == [window.window]
    assert 0 < window.timers[0][0] <= 0.1
    while (now := operator.modal(window, event("TIMER"))) == RUNNING:
        assert len(window.timers) == 1
        seen = max(seen, package("session.run").current.fraction)
    assert now == {"FINISHED"} and 0 < seen <= 1 and is_over(window, package)
    after = all_of()
    assert after.keys() == expected.keys() and not any(changed(expected[key], after[key]) for key in after)
    assert not [text for kind, text in operator.reports if kind == {"ERROR"}]
    summary = package("session.last_run").state.summary
    assert summary.title == operator.bl_label and summary.rows[-1][0] == "Time" and not summary.refused
    # One line in the status bar for each look, of this operator, with the keys that end it.
    told = [hint for hint in window.hints if hint]
    assert all(hint.startswith(f"{operator.bl_label}: ") and "Esc: Cancel" in hint for hint in told)


# All by the key, and some in every way.
ENDED = [(name, "ESC") for name in SOLVERS] + [
    (name, how) for name in ("uv.omt_seams", "uv.omt_flow", "object.omt_flow") for how in ("cancel", "changed")
]


@pytest.mark.parametrize(("name", "how"), ENDED)
def test_what_is_let_be_has_changed_nothing(package, window, name, how):
    found = bodies_with_some_selected()
    before = all_of()
    operator = scenes.stand_in(name, **SOLVERS[name])
    assert operator.invoke(window, event("LEFTMOUSE")) == RUNNING
    if how == "ESC":
        # The key let go of is none that is pressed.
        assert operator.modal(window, event("ESC", "RELEASE")) == RUNNING
        assert operator.modal(window, event("ESC")) == {"CANCELLED"}
        ((kind, text),) = operator.reports
        assert kind == {"INFO"} and text.startswith("Cancelled after 0.") and text.endswith("nothing was changed")
    elif how == "cancel":
        operator.cancel(window)
        assert not operator.reports
    else:
        found[0].name = "Another name"
        assert operator.modal(window, event("TIMER")) == {"CANCELLED"}
        assert "renamed" in operator.reports[-1][1] and operator.reports[-1][0] == {"ERROR"}
        found[0].name = next(iter(before.keys() - {obj.name for obj in found}))
    assert is_over(window, package) and all_of() == before


def test_no_setting_hides_what_an_operator_does(package):
    """Blender looks among the properties first: one called as a method was run in its place."""
    base, mode = package("operators.base"), []
    for cls in package("registration").CLASSES:
        if issubclass(cls, bpy.types.Operator):
            own = {name for c in cls.__mro__ if "omt" in c.__module__ for name in vars(c)} - set(cls.__annotations__)
            own |= {name for c in (base.SolverOperator, base.QuickOperator) if issubclass(cls, c) for name in vars(c)}
            mode += [(cls.__name__, p.identifier) for p in scenes.stand_in(scenes.name_of(cls)).rna_type.properties
                     if p.identifier in own and p.identifier != "rna_type"]  # fmt: skip
    assert not mode


def test_the_view_can_be_moved_and_nothing_else_begun_while_one_runs(package, window):
    bodies_with_some_selected()
    operator = scenes.stand_in("uv.omt_unwrap")
    operator.invoke(window, event("LEFTMOUSE"))
    navigation = package("operators.base").NAVIGATION
    assert {"MIDDLEMOUSE", "WHEELUPMOUSE", "MOUSEMOVE", "NUMPAD_5", "NDOF_MOTION"} <= navigation
    for kind in navigation:
        assert operator.modal(window, event(kind)) == {"PASS_THROUGH"}, kind
    for kind in ("LEFTMOUSE", "RIGHTMOUSE", "A", "TAB", "Z", "DEL"):
        assert operator.modal(window, event(kind)) == RUNNING, kind
    for name in SOLVERS:
        other = scenes.stand_in(name, **SOLVERS[name])
        assert other.begin(window) == {"CANCELLED"}
        assert f"{operator.bl_label} is still running" in other.reports[-1][1]
        assert not scenes.class_of(name).poll(window)
    assert len(window.timers) == 1 and window.listeners == [operator]
    operator.modal(window, event("ESC"))
    assert all(scenes.class_of(name).poll(window) for name in SOLVERS)


def test_every_solver_refuses_to_begin_without_a_mesh(package, window):
    names = solvers(package)
    assert names > set(SOLVERS)
    for name in names:
        operator = scenes.stand_in(name)
        assert operator.invoke(window, event("LEFTMOUSE")) == {"CANCELLED"}, name
        assert [kind for kind, _ in operator.reports] == [{"ERROR"}] and is_over(window, package), name


@pytest.mark.parametrize("name", ["uv.omt_seams", "uv.omt_flow", "object.omt_flow", "uv.omt_queue"])
def test_without_a_window_all_is_done_at_once(package, window, name):
    bodies_with_some_selected()
    window.__dict__["window"] = None
    operator = scenes.stand_in(name, **SOLVERS.get(name, {}))
    assert operator.invoke(window, event("LEFTMOUSE")) == {"FINISHED"}
    assert not window.timers and not window.listeners


def test_a_queue_ends_as_a_script_does_and_says_what_it_did(package, window):
    queue = package("session.queue")
    names = [obj.name for obj in bodies_with_some_selected()]
    assert bpy.ops.uv.omt_queue() == {"FINISHED"}
    expected = all_of()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bodies_with_some_selected()
    operator = scenes.stand_in("uv.omt_queue")
    assert operator.invoke(window, event("LEFTMOUSE")) == RUNNING
    assert len(window.timers) == 1 and window.listeners == [operator]
    for kind in ("MOUSEMOVE", "LEFTMOUSE", "A"):
        assert operator.modal(window, event(kind)) == {"PASS_THROUGH"}
    while operator.modal(window, event("TIMER")) == RUNNING:
        assert 0 <= queue.state.jobs[0].progress <= 1
    assert is_over(window, package) and all_of() == expected
    assert [(job.name, job.state) for job in queue.state.jobs] == [(name, "DONE") for name in sorted(names)] or {
        job.name for job in queue.state.jobs
    } == set(names)
    assert operator.reports == [({"INFO"}, "Unwrapped 2 of 2 objects")]
    assert dict(package("session.last_run").state.summary.rows) == {"Done": "2 of 2", "Failed, selected": "0"}


@pytest.mark.parametrize("how", ["ESC", "cancel", "gone", "out of sight"])
def test_a_queue_that_is_stopped_keeps_what_is_done(package, window, how):
    found = bodies_with_some_selected()
    before = all_of()
    operator = scenes.stand_in("uv.omt_queue")
    operator.invoke(window, event("LEFTMOUSE"))
    queue = package("session.queue")
    while queue.state.jobs[0].state != "DONE":
        assert operator.modal(window, event("TIMER")) == RUNNING
    first = queue.state.jobs[0].name
    other = next(obj for obj in found if obj.name != first)
    name = other.name
    if how in ("gone", "out of sight"):
        # Whether it is no more, or in no collection that the view layer has.
        for collection in list(other.users_collection) if how != "gone" else ():
            collection.objects.unlink(other)
        if how == "gone":
            bpy.data.objects.remove(other)
        bpy.context.view_layer.update()
        while operator.modal(window, event("TIMER")) == RUNNING:
            pass
        assert (queue.state.jobs[1].state, queue.state.jobs[1].reason) == ("FAILED", "it is gone")
        assert ({"WARNING"}, f"{name}: it is gone") in operator.reports
    else:
        if how == "ESC":
            assert operator.modal(window, event("ESC", "RELEASE")) == {"PASS_THROUGH"}
            assert not queue.state.is_stopped
            operator.modal(window, event("ESC"))
            assert operator.modal(window, event("TIMER")) == {"FINISHED"}
        else:
            operator.cancel(window)
        assert scenes.state(bpy.data.objects[name]) and state(bpy.data.objects[name]) == before[name]
    assert is_over(window, package) and state(bpy.data.objects[first]) != before[first]
    assert queue.state.is_over and operator.reports[-1] == ({"INFO"}, "Unwrapped 1 of 2 objects")


def test_live_balance_hears_a_window_until_its_button_is_clicked_again(package, window):
    bodies_with_some_selected()
    following = package("session.following")
    operator = scenes.stand_in("uv.omt_live", pack=False)
    assert operator.invoke(window, event("LEFTMOUSE")) == RUNNING and following.current is not None
    assert window.listeners == [operator] and [w for _, w in window.timers] == [window.window]
    for _ in range(3):
        assert operator.modal(window, event("TIMER")) == {"PASS_THROUGH"}
    assert "Enter: Accept" in window.hints[-1] and "Esc" in window.hints[-1]
    assert scenes.stand_in("uv.omt_live").invoke(window, event("LEFTMOUSE")) == {"CANCELLED"}
    assert operator.modal(window, event("TIMER")) == {"FINISHED"}
    assert is_over(window, package) and following.current is None
    # Another file is loaded.
    assert operator.invoke(window, event("LEFTMOUSE")) == RUNNING
    operator.cancel(window)
    assert is_over(window, package) and following.current is None


def drawn(owner):
    """Names of the properties that an operator draws with its settings."""
    record = []

    class Layout:
        def __getattr__(self, kind):
            if kind in ("column", "row", "box", "split"):
                return lambda *_, **__: self
            if kind in ("prop", "prop_search"):
                return lambda data, prop, *_, **__: record.append(prop)
            return lambda *_, **__: type("Properties", (), {})()

    owner.layout, owner.bl_rna = Layout(), owner.rna_type
    owner.draw(bpy.context)
    return record


def states(name):
    """Settings of an operator in which all of its choices come."""
    props = [p for p in scenes.stand_in(name).rna_type.properties if not p.is_readonly and p.identifier != "rna_type"]
    yield {}
    for prop in props:
        if prop.type == "BOOLEAN" and not prop.is_array:
            yield {prop.identifier: not prop.default}
        elif prop.type == "ENUM" and not prop.is_enum_flag:
            yield from ({prop.identifier: item.identifier} for item in prop.enum_items)
        elif prop.type == "STRING":
            yield {prop.identifier: "some"}
        elif prop.type == "INT" and not prop.is_array:
            yield {prop.identifier: prop.default + 1}


def test_every_operator_draws_each_setting_that_is_not_hidden_once(package):
    scenes.bump()
    tried = 0
    for cls in package("registration").CLASSES:
        if not issubclass(cls, bpy.types.Operator) or "draw" not in vars(cls):
            continue
        name = scenes.name_of(cls)
        shown = set()
        for settings in states(name):
            found = drawn(scenes.stand_in(name, **settings))
            assert len(found) == len(set(found)), (name, settings)
            shown |= set(found)
        visible = {p.identifier for p in scenes.stand_in(name).rna_type.properties
                   if not p.is_hidden and p.identifier != "rna_type"}  # fmt: skip
        assert visible <= shown, (name, visible - shown)
        tried += 1
    assert tried > 10


def test_help_opens_the_page_of_what_it_stands_beside(package, monkeypatch):
    import webbrowser

    opened = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    page = package("links").page
    classes = [c for c in package("registration").CLASSES if issubclass(c, bpy.types.Operator)]
    for name in ["", *map(scenes.name_of, classes[::4])]:
        assert scenes.stand_in("wm.omt_help", operator=name).execute(bpy.context) == {"FINISHED"}
        assert opened[-1] == page(name), name
    assert len(set(opened)) > 1


def test_a_report_goes_to_the_clipboard_as_it_is(package, window):
    bodies_with_some_selected()
    operator = scenes.stand_in("wm.omt_copy_report")
    assert operator.execute(window) == {"FINISHED"}
    assert window.window_manager.clipboard == package("operators.report").report_text(bpy.context)
    assert operator.reports[0][0] == {"INFO"} and "clipboard" in operator.reports[0][1]


def test_warnings_are_shown_in_full_in_a_window_of_their_own(package, window):
    last_run = package("session.last_run")
    texts = ["one " * 60 + "end", "short"]
    last_run.keep(last_run.Summary("Unwrap", (), tuple(last_run.Notice(text) for text in texts), ()))
    assert scenes.stand_in("uv.omt_notices", whole=True).execute(window) == {"FINISHED"}
    ((draw, title),) = window.menus
    lines = []

    class Layout:
        def label(self, text, translate=True):
            # Words of a result were translated before they were put together.
            assert not translate
            lines.append(text)

        def separator(self):
            lines.append("--")

    draw(type("Menu", (), {"layout": Layout()}), window)
    assert title == "Warnings" and lines.count("--") == len(texts) and lines[-1] == "--"
    assert max(map(len, lines)) <= 100
    assert " ".join(" ".join(lines).split("--")).split() == " ".join(texts).split()


@pytest.mark.parametrize("action", ["MERGE", "NORMALS", "CUT_FURTHER"])
def test_a_remedy_is_done_by_a_click(package, window, action):
    found = bodies_with_some_selected()
    for obj in found:
        scenes.set_uv(obj, scenes.uv_of(obj) * 0, obj.data.uv_layers.active.name)
    before = all_of()
    operator = scenes.stand_in("uv.omt_remedy", action=action)
    expected = {"CANCELLED"} if action == "CUT_FURTHER" else {"FINISHED"}
    assert operator.invoke(window, event("LEFTMOUSE")) == expected
    assert (all_of() != before) == (action == "CUT_FURTHER")
    assert len(operator.reports) == (action != "CUT_FURTHER")


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT"])
@pytest.mark.parametrize("show", [False, True])
def test_weights_are_shown_where_they_can_be_painted(package, window, monkeypatch, mode, show):
    found = bodies_with_some_selected()
    spaces = [type("Space", (), {"overlay": type("Overlay", (), {"show_weight": False})()})() for _ in range(2)]
    monkeypatch.setattr(package("operators.regions.weights"), "view_spaces", lambda _: spaces)
    if mode == "EDIT":
        scenes.edit(*found)
    operator = scenes.stand_in("object.omt_weights", kind="GAUSSIAN", show=show)
    assert operator.execute(window) == {"FINISHED"}
    assert bpy.context.mode == {"OBJECT": "PAINT_WEIGHT" if show else "OBJECT", "EDIT": "EDIT_MESH"}[mode]
    assert [space.overlay.show_weight for space in spaces] == [show and mode == "EDIT"] * 2
