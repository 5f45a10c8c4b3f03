"""What every operator promises while it runs, when it is cancelled, undone and redone, in both modes."""

from __future__ import annotations

import gc
import threading
import types
from typing import ClassVar

import bpy

import numpy as np
import pytest
import scenes

# Every operator that changes a mesh, and the settings that make it change this one. New ones are added here.
OPERATORS = {
    "uv.omt_unwrap": {},
    "uv.omt_refine": {},
    "uv.omt_seams": {},
    "uv.omt_magnify": {"weight_group": "Region"},
    "uv.omt_sphere": {"quality": "DRAFT"},
    "object.omt_weights": {},
    "object.omt_remesh": {"target_vertices": 60},
}
# What needs handles, tetrahedra, a second object or an object of its own is tested in its room.
IN_ROOMS = {
    "object.omt_diagram",
    "object.omt_similar",
    "object.omt_match",
    "object.omt_flow",
    "uv.omt_flow",
    "object.omt_volume",
    "mesh.omt_partition",
}
# What makes new objects works in Object Mode alone.
CASES = [
    (name, mode) for name in OPERATORS for mode in ("OBJECT", "EDIT") if name != "object.omt_remesh" or mode == "OBJECT"
]


def scene(name, mode):
    """A mesh on which the operator has something to do."""
    if name in {"uv.omt_seams", "uv.omt_sphere"}:
        bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=3)
        obj = bpy.context.object
        obj.scale = (1, 2, 1)
        bpy.context.view_layer.update()
    else:
        obj = scenes.bump(20, 16)
        scenes.set_uv(obj, scenes.seen_from_above(obj))
        obj.vertex_groups.new(name="Region").add(list(range(100, 160)), 1.0, "REPLACE")
    if mode == "EDIT":
        scenes.edit(obj)
    return obj


def everything():
    """The whole state of every mesh object in the file."""
    return {obj.name: scenes.state(obj) for obj in bpy.data.objects if obj.type == "MESH"}


def event(kind, value="NOTHING"):
    return types.SimpleNamespace(type=kind, value=value)


def step(operator, count=None):
    """Start the operator and give it timer events until it ends, or `count` of them."""
    state = operator.begin(bpy.context)
    while "RUNNING_MODAL" in state and (count is None or count > 0):
        state = operator.modal(bpy.context, event("TIMER"))
        count = None if count is None else count - 1
    return state


@pytest.fixture(autouse=True)
def short_slices(package, monkeypatch):
    """One step of the solver a slice, and none aside, so that small meshes take many and phases are told apart."""
    monkeypatch.setattr(package("session.run"), "threads", False)
    monkeypatch.setattr(package("session.run").Run.advance, "__defaults__", (0.0,))
    yield
    assert package("session.run").current is None


def test_every_operator_on_meshes_is_listed(package):
    base = package("operators.base").SolverOperator
    names = {scenes.name_of(c) for c in package("registration").CLASSES if issubclass(c, base)}
    assert names == set(OPERATORS) | IN_ROOMS


@pytest.mark.parametrize(("name", "mode"), CASES)
def test_slices_and_one_go_give_the_same_and_undo_and_redo_are_exact(name, mode):
    group, verb = name.split(".")
    operator = getattr(getattr(bpy.ops, group), verb)
    scene(name, mode)
    before = everything()
    bpy.ops.ed.undo_push(message="before")
    assert operator("EXEC_DEFAULT", True, **OPERATORS[name]) == {"FINISHED"}
    after = everything()
    assert after != before
    bpy.ops.ed.undo()
    assert everything() == before
    bpy.ops.ed.redo()
    assert everything() == after
    bpy.ops.ed.undo()
    assert step(scenes.stand_in(name, **OPERATORS[name])) == {"FINISHED"}
    assert everything() == after


@pytest.mark.parametrize(("name", "mode"), CASES)
def test_cancel_in_every_phase_leaves_no_trace(name, mode, package):
    scene(name, mode)
    before = everything()
    handlers = [len(kind) for kind in (bpy.app.handlers.undo_post, bpy.app.handlers.depsgraph_update_post)]
    phases = 0
    while True:
        operator = scenes.stand_in(name, **OPERATORS[name])
        if step(operator, phases) != {"RUNNING_MODAL"}:
            break
        assert not scenes.class_of(name).poll(bpy.context)  # nothing else may start meanwhile
        assert operator.modal(bpy.context, event("ESC", "PRESS")) == {"CANCELLED"}
        assert operator.reports
        assert everything() == before
        assert [len(k) for k in (bpy.app.handlers.undo_post, bpy.app.handlers.depsgraph_update_post)] == handlers
        phases += 1 + phases // 3
    assert phases > 0


def test_a_second_run_is_refused(package):
    scene("uv.omt_unwrap", "OBJECT")
    first, second = scenes.stand_in("uv.omt_unwrap"), scenes.stand_in("uv.omt_refine")
    assert step(first, 1) == {"RUNNING_MODAL"}
    assert second.begin(bpy.context) == {"CANCELLED"}
    assert "still running" in second.reports[0][1]
    first.cancel(bpy.context)


def move_a_vertex(obj):
    obj.data.vertices[0].co.z += 1


def change_uvs(obj):
    obj.data.attributes["UVMap"].data[3].vector = (9, 9)


DISTURBANCES = {
    "vertex": move_a_vertex,
    "uv": change_uvs,
    "mode": lambda obj: bpy.ops.object.mode_set(mode="EDIT"),
    "renamed": lambda obj: setattr(obj, "name", "Other"),
    "deleted": lambda obj: bpy.data.objects.remove(obj),
    "scale": lambda obj: setattr(obj, "scale", (1, 2, 3)) or bpy.context.view_layer.update(),
    "undo": lambda obj: bpy.ops.ed.undo(),
}


@pytest.mark.parametrize("kind", DISTURBANCES)
def test_a_mesh_that_changes_meanwhile_ends_the_run(kind):
    obj = scene("uv.omt_unwrap", "OBJECT")
    bpy.ops.ed.undo_push(message="before")
    obj = bpy.data.objects[obj.name]
    obj.data.name = "Patch"
    bpy.ops.ed.undo_push(message="one more")
    operator = scenes.stand_in("uv.omt_unwrap")
    assert step(operator, 2) == {"RUNNING_MODAL"}
    DISTURBANCES[kind](bpy.data.objects[obj.name] if kind != "undo" else None)
    mesh = bpy.data.meshes["Patch"] if "Patch" in bpy.data.meshes else bpy.data.meshes[0]
    uv = uv_bytes(mesh) if kind not in {"mode", "deleted"} else None
    state = {"RUNNING_MODAL"}
    while "RUNNING_MODAL" in state:
        state = operator.modal(bpy.context, event("TIMER"))
    assert state == {"CANCELLED"}
    assert operator.reports[0][0] == {"ERROR"}
    assert "meanwhile" in operator.reports[0][1]
    if uv is not None:
        assert uv_bytes(mesh) == uv


# What ends a run though no mesh may look otherwise then: what it works on is another one.
EXCHANGES = ("undo_post", "redo_post", "load_pre")


@pytest.mark.parametrize("kind", EXCHANGES)
def test_what_blender_exchanges_is_heard_of_and_no_longer_than_the_run_lasts(kind, package):
    obj = scene("uv.omt_unwrap", "OBJECT")
    handlers = [getattr(bpy.app.handlers, name) for name in dir(bpy.app.handlers)]
    handlers = [found for found in handlers if isinstance(found, list)]
    before = [list(found) for found in handlers]
    watch = package("session.run").Watch(bpy.context, [obj])
    watch.check()
    (heard,) = (f for f in getattr(bpy.app.handlers, kind) if getattr(f, "__self__", None) is watch)
    heard(None)
    with pytest.raises(package("session.run").Disturbed, match="meanwhile"):
        watch.check()
    watch.close()
    assert [list(found) for found in handlers] == before


@pytest.mark.parametrize("which", [0, 1])
@pytest.mark.parametrize("kind", ["vertex", "uv", "renamed", "deleted"])
def test_one_of_several_that_changes_meanwhile_ends_the_run(kind, which):
    objects = [scene("uv.omt_unwrap", "OBJECT"), scenes.bump(6, 6)]
    objects[1].name = "Second"
    scenes.set_uv(objects[1], scenes.seen_from_above(objects[1]))
    scenes.select(objects)
    operator = scenes.stand_in("uv.omt_unwrap")
    assert step(operator, 2) == {"RUNNING_MODAL"}
    DISTURBANCES[kind](objects[which])
    state = {"RUNNING_MODAL"}
    while "RUNNING_MODAL" in state:
        state = operator.modal(bpy.context, event("TIMER"))
    assert state == {"CANCELLED"} and "meanwhile" in operator.reports[0][1]


def uv_bytes(mesh):
    values = np.zeros(2 * len(mesh.loops), np.float32)
    mesh.uv_layers.active.uv.foreach_get("vector", values)
    return values.tobytes()


def offered(package, operator):
    """Timer events until the run has a whole map to offer."""
    running = package("session.run")
    assert step(operator, 0) == {"RUNNING_MODAL"}
    while running.current.early is None:
        assert "Enter" not in running.current.text()
        assert operator.modal(bpy.context, event("RET", "PRESS")) == {"RUNNING_MODAL"}
        assert not running.current.is_ending
        assert operator.modal(bpy.context, event("TIMER")) == {"RUNNING_MODAL"}
    return running.current


def steep(package, monkeypatch):
    """A part that several rounds of seams cut, since the first is content with anything."""
    monkeypatch.setattr(package("solver.parameterization.shear_search"), "SPREAD_OF_SHEAR", 1e4)
    return scenes.bump(20, 16, height=1.5)


def test_enter_keeps_the_best_so_far_and_escape_restores_everything(package, monkeypatch):
    """Enter does nothing before there is a whole map; what it keeps is one undo step, and says why it shears."""
    obj = steep(package, monkeypatch)
    before = everything()
    operator = scenes.stand_in("uv.omt_unwrap", max_shear=1.02)
    current = offered(package, operator)
    assert "Enter: Keep Best So Far" in current.text() and "Esc: Cancel" in current.text()
    assert operator.modal(bpy.context, event("ESC", "PRESS")) == {"CANCELLED"}
    assert everything() == before
    operator = scenes.stand_in("uv.omt_unwrap", max_shear=1.02)
    current = offered(package, operator)
    assert operator.modal(bpy.context, event("RET", "PRESS")) == {"RUNNING_MODAL"}
    assert "Keeping" in current.text()
    state = {"RUNNING_MODAL"}
    while "RUNNING_MODAL" in state:
        state = operator.modal(bpy.context, event("TIMER"))
    assert state == {"FINISHED"}
    summary = package("session.last_run").state.summary
    assert any("seams were done" in notice.text for notice in summary.notices)
    kept = scenes.uv_of(obj)
    bound = package("solver.parameterization.shear_bound")
    monkeypatch.setattr(bound, "MOST_ROUNDS", 1)
    monkeypatch.setattr(bound, "MOST_HALVINGS", 0)
    assert bpy.ops.uv.omt_unwrap(max_shear=1.02) == {"FINISHED"}
    assert np.array_equal(scenes.uv_of(obj), kept)


def test_the_view_can_be_moved_and_nothing_else_gets_through():
    scene("uv.omt_unwrap", "OBJECT")
    operator = scenes.stand_in("uv.omt_unwrap")
    assert step(operator, 1) == {"RUNNING_MODAL"}
    assert operator.modal(bpy.context, event("WHEELUPMOUSE", "PRESS")) == {"PASS_THROUGH"}
    for kind in ("LEFTMOUSE", "TAB", "X", "Z"):
        assert operator.modal(bpy.context, event(kind, "PRESS")) == {"RUNNING_MODAL"}
    operator.cancel(bpy.context)


@pytest.fixture
def threads(package, monkeypatch):
    monkeypatch.setattr(package("session.run"), "threads", True)


@pytest.mark.parametrize("name", OPERATORS)
def test_a_solver_aside_finds_the_same(name, threads):
    scene(name, "OBJECT")
    group, verb = name.split(".")
    bpy.ops.ed.undo_push(message="before")
    assert getattr(getattr(bpy.ops, group), verb)("EXEC_DEFAULT", True, **OPERATORS[name]) == {"FINISHED"}
    expected = everything()
    bpy.ops.ed.undo()
    assert step(scenes.stand_in(name, **OPERATORS[name])) == {"FINISHED"}
    assert everything() == expected


def test_a_solver_aside_is_thrown_away_at_once(threads, package):
    obj = scene("uv.omt_unwrap", "OBJECT")
    before = scenes.state(obj)
    for slices in (0, 1, 3):
        operator = scenes.stand_in("uv.omt_unwrap")
        if step(operator, slices) == {"RUNNING_MODAL"}:
            assert operator.modal(bpy.context, event("ESC", "PRESS")) == {"CANCELLED"}
            assert scenes.state(obj) == before


def test_garbage_is_collected_in_front(threads, package, monkeypatch):
    """It may hold what is Blender's, which crashes when it is freed while Blender is drawing."""

    class Cycle:
        freed: ClassVar[list] = []

        def __init__(self):
            self.me = self

        def __del__(self):
            self.freed.append(threading.current_thread())

    def solver():
        for k in range(200):
            Cycle()
            assert len([[] for _ in range(2000)]) == 2000
            yield package("solver.progress").Progress("Making garbage", k / 200)

    # A solver that was cancelled before ends at its next step.
    for thread in threading.enumerate():
        # What else there is, of who runs the tests, does not end.
        if thread.name == "omt_uv solver":
            thread.join(30)
            assert not thread.is_alive()
    with monkeypatch.context() as patch:
        patch.setattr(package("session.run"), "current", object())
        package("solver.progress").drain(package("session.run").aside(solver()))
    gc.collect()
    assert set(Cycle.freed) == {threading.main_thread()} and gc.isenabled()


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("how", ["end", "close", "fail"])
def test_garbage_waits_until_the_last_of_several_solvers_has_ended(package, first, how):
    """One that was cancelled ends a little later, while the next is at work already."""
    run = package("session.run")

    def solver():
        yield 1
        if how == "fail":
            raise ValueError("no result")
        yield 2

    def end(steps):
        if how == "close":
            steps.close()
        elif how == "fail":
            with pytest.raises(ValueError, match="no result"):
                list(steps)
        else:
            assert list(steps) == [2]

    assert gc.isenabled()
    both = [run._without_collector(solver()) for _ in range(2)]
    try:
        for steps in both:
            assert next(steps) == 1 and not gc.isenabled()
        end(both[first])
        assert not gc.isenabled()
        end(both[1 - first])
        assert gc.isenabled()
    finally:
        gc.enable()


def test_a_solver_aside_complains_as_any_other(threads):
    bpy.ops.mesh.primitive_cube_add()
    operator = scenes.stand_in("uv.omt_unwrap", seams="EXISTING")
    assert step(operator) == {"CANCELLED"}
    assert operator.reports[0][0] == {"ERROR"}


def test_bad_input_is_refused_in_the_first_slice():
    bpy.ops.mesh.primitive_cube_add()
    operator = scenes.stand_in("uv.omt_unwrap", seams="EXISTING")
    assert step(operator) == {"CANCELLED"}
    assert operator.reports[0][0] == {"ERROR"}


@pytest.mark.parametrize("way", ["run", "queue"])
def test_a_slice_has_the_one_thread_of_linear_algebra_that_a_script_has(package, way, monkeypatch):
    """Sums differ in their last bits by the number of threads: a click made another mesh than a script."""
    threads = package("solver.blas_threads")
    obj, seen = scenes.bump(), []
    np.ones((4, 4)) @ np.ones((4, 4))
    before = [library.count() for library in threads.libraries()]
    for library in threads.libraries():
        library.limit(2)

    def steps(*_):
        for _ in range(3):
            seen.append([library.count() for library in threads.libraries()])
            yield package("solver.progress").Progress("", 0.0)

    try:
        if way == "run":
            run = package("session.run").Run("", bpy.context, [obj], steps())
            while not run.advance():
                assert [library.count() for library in threads.libraries()] == [2] * len(before)
            run.close()
        else:
            operator = scenes.stand_in("uv.omt_queue")
            monkeypatch.setattr(type(operator), "_steps", steps)
            monkeypatch.setattr(package("operators.arranging.queue"), "_write", lambda *_: [])
            operator.execute(bpy.context)
        assert seen == [[1] * len(before)] * 3
        assert [library.count() for library in threads.libraries()] == [2] * len(before)
    finally:
        for library, count in zip(threads.libraries(), before, strict=True):
            library.limit(count)


@pytest.mark.parametrize("asked_at", [None, 0, 1, 2])
def test_the_bar_never_goes_back_and_what_comes_later_is_asked_to_end_as_well(package, asked_at):
    """Of several objects each has a solver that may end early, and begins a round of its own."""
    module, progress = package("session.run"), package("solver.progress")
    obj, asked = scenes.bump(), []
    ends = [types.SimpleNamespace(ask=lambda k=k: asked.append(k)) for k in range(3)]

    def steps():
        for k, fraction in enumerate((0.5, 0.2, 0.7)):
            yield progress.Progress(f"{k}", fraction, None if asked_at is None else ends[k])
        return "done"

    run, seen = module.Run("", bpy.context, [obj], steps()), []
    for k in range(3):
        assert not run.advance(seconds=0.0)
        seen.append(run.fraction)
        if k == asked_at:
            assert run.end_early()
    assert asked_at is not None or not run.end_early()
    assert run.advance(seconds=0.0) and run.result == "done"
    assert seen == [0.5, 0.5, 0.7]
    assert asked == ([] if asked_at is None else list(range(asked_at, 3)))
    run.close()
