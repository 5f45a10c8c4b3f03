"""What panels show only now and then: a queue, the ends of a session, what is missing, preferences, keys."""

from __future__ import annotations

import sys
from types import SimpleNamespace

import bpy

import pytest
import scenes
from kept import Recorder
from windows import Instead


def section(package, module, draw):
    """What a section draws."""
    record: list[str] = []
    getattr(package(f"panels.{module}"), draw)(Recorder(record), bpy.context)
    return record


@pytest.mark.parametrize("over", [False, True])
def test_every_job_of_a_queue_has_a_line_with_its_state(package, monkeypatch, over):
    module, icons = package("session.queue"), package("panels.arrange").ICONS
    jobs = [module.Job(f"Object {k}") for k in range(4)]
    for job, state, progress in zip(jobs, ("DONE", "FAILED", "RUNNING", "WAITING"), (1.0, 0.25, 0.5, 0.0), strict=True):
        job.state, job.progress = state, progress
    queue = module.Queue(jobs)
    queue.is_over = over
    monkeypatch.setattr(module, "state", queue)
    found = section(package, "arrange", "draw_queue")
    assert ("operator(uv.omt_queue_stop,text=Stop, Keep What Is Done,icon=X)" in found) != over
    assert any(entry.startswith("operator(uv.omt_queue,") for entry in found) == over
    for job, percent in zip(jobs, (100, 25, 50, 0), strict=True):
        (line,) = [entry for entry in found if f"text={job.name}," in entry]
        # Only what has failed is red.
        assert f"icon={icons[job.state]}" in line and line.endswith("a1" if job.state == "FAILED" else "a0")
        assert any(f"{percent} %" in entry for entry in found[found.index(line) : found.index(line) + 2])
    assert len(set(icons.values())) == len(icons) == 4


def test_a_session_can_be_ended_both_ways_in_place_of_the_button(package, monkeypatch):
    def button(found):
        return any("operator(uv.omt_unwrap" in entry for entry in found)

    assert button(section(package, "unwrap", "draw"))
    monkeypatch.setattr(package("session.following"), "current", object())
    found = section(package, "unwrap", "draw")
    assert sum("operator(uv.omt_live_end" in entry for entry in found) == 2 and not button(found)
    ends = []
    layout = SimpleNamespace(
        row=lambda **_: layout, operator=lambda *_, text, **__: ends.append((text, Kept())) or ends[-1][1]
    )

    class Kept:
        end = ""

    package("panels.unwrap").draw_end(layout)
    assert [(text, made.end) for text, made in ends] == [("Accept", "KEEP"), ("Cancel", "BACK")]


@pytest.mark.parametrize("packages", ["", "some-package other"])
def test_a_library_that_is_missing_is_named_as_pip_wants_it(package, monkeypatch, packages):
    monkeypatch.setattr(package("panels.volumes"), "missing", lambda _: packages)
    found = section(package, "volumes", "_draw_volume")
    lines = [entry for entry in found if "pip install" in entry or "some-package" in entry]
    assert len(lines) == (2 if packages else 0)
    assert any("Needs a library" in entry for entry in found) == bool(packages)


@pytest.mark.parametrize("source", ["MESH", "UV"])
def test_an_image_goes_along_with_existing_uvs_alone(package, source):
    properties = bpy.context.window_manager.operator_properties_last("uv.omt_magnify")
    properties.source = source
    try:
        found = section(package, "tools", "draw_magnify_image")
        assert any("Existing UVs alone" in entry for entry in found) == (source == "MESH")
    finally:
        properties.property_unset("source")


class Keymaps(dict):
    """Blender's key maps: made by name, and found by it."""

    def new(self, name, space_type):
        items = self.setdefault(name, Items())
        items.space = space_type
        return SimpleNamespace(name=name, keymap_items=items)

    def get(self, name):
        return SimpleNamespace(name=name, keymap_items=self[name]) if name in self else None


class Items(list):
    """Keys of a map."""

    def new(self, idname, key, value, **modifiers):
        self.append(
            SimpleNamespace(
                idname=idname, type=key, value=value, active=True, properties=SimpleNamespace(), **modifiers
            )
        )
        return self[-1]


def test_keys_come_turned_off_and_go_with_the_extension(package, monkeypatch):
    keymap = package("panels.keymap")
    maps = Keymaps()
    monkeypatch.setattr(keymap, "_made", [])
    config = SimpleNamespace(addon=SimpleNamespace(keymaps=maps), user=SimpleNamespace(keymaps=maps))
    manager = SimpleNamespace(keyconfigs=config)
    context = Instead(lambda: bpy.context, window_manager=manager)
    monkeypatch.setattr(keymap, "bpy", Instead(lambda: bpy, context=context))
    keymap.register()
    made = [(name, item) for name, items in maps.items() for item in items]
    assert len(made) == len(keymap.KEYS) and not any(item.active for _, item in made)
    for key in keymap.KEYS:
        (item,) = [i for name, i in made if name == key.keymap and i.idname == key.operator
                   and getattr(i.properties, "name", "") == key.menu]  # fmt: skip
        assert (item.type, item.shift, item.alt, item.value) == (key.key, key.shift, key.alt, "PRESS")
        assert maps[key.keymap].space == key.space
        # What a key runs exists.
        group, verb = key.operator.split(".")
        assert verb in dir(getattr(bpy.ops, group)) and (not key.menu or hasattr(bpy.types, key.menu))
    # Each is drawn once, under the name of its map, as the artist has it, and no other call of the same operator.
    for items in maps.values():
        for other in (SimpleNamespace(name="VIEW3D_MT_object"), SimpleNamespace()):
            items.insert(0, SimpleNamespace(idname="wm.call_menu", properties=other))
        items.insert(0, SimpleNamespace(idname="uv.unwrap", properties=SimpleNamespace()))
    shown = []
    ui = SimpleNamespace(draw_kmi=lambda _, c, mine, item, row, level: shown.append((mine.name, item)))
    monkeypatch.setitem(sys.modules, "rna_keymap_ui", ui)
    record: list[str] = []
    keymap.draw(Recorder(record), context)
    assert len(shown) == len(made) and {id(item) for _, item in shown} == {id(item) for _, item in made}
    assert record == [f"label(text={name})" for name, _ in shown]
    maps.clear()
    keymap.draw(Recorder(record), context)
    assert len(shown) == len(made)
    removed = []
    keymap._made[:] = [(SimpleNamespace(keymap_items=SimpleNamespace(remove=removed.append)), item) for _, item in made]
    keymap.unregister()
    assert not keymap._made and {id(item) for item in removed} == {id(item) for _, item in made}
    # Without a window there are none, and nothing is said.
    monkeypatch.setattr(keymap, "bpy", Instead(lambda: bpy, context=SimpleNamespace(window_manager=None)))
    keymap.register()
    assert not keymap._made


@pytest.mark.parametrize("bugs", ["", "https://example.org/bugs"])
def test_preferences_show_every_setting_once(package, monkeypatch, bugs):
    module = package("panels.preferences")
    monkeypatch.setattr(package("links"), "BUGS", bugs)
    monkeypatch.setattr(package("panels.keymap"), "_made", [])
    record: list[str] = []
    module.OMTUVPreferences.draw(SimpleNamespace(layout=Recorder(record)), bpy.context)
    settings = [p.identifier for p in module.OMTUVPreferences.bl_rna.properties if p.is_runtime and not p.is_hidden]
    assert set(settings) == {*module.DEFAULTS, "own_thread"}
    for name in settings:
        assert sum(entry.startswith(f"prop({name}") for entry in record) == 1, name
    assert sum("operator(wm.url_open" in entry for entry in record) == bool(bugs)
    assert sum("operator(wm.omt_copy_report" in entry for entry in record) == 1


def test_preferences_are_applied_once_blender_is_up(package, monkeypatch):
    """At once where they change, and the tab is looked for until it was shown once."""
    module = package("panels.preferences")
    timers, applied = [], []
    chosen = SimpleNamespace(tab_was_shown=False)
    monkeypatch.setattr(module, "apply", lambda preferences, _: applied.append(preferences))
    monkeypatch.setattr(module, "get", lambda _: chosen)
    app = Instead(
        lambda: bpy.app,
        background=True,
        timers=SimpleNamespace(register=lambda f, first_interval: timers.append((f, first_interval))),
    )
    monkeypatch.setattr(module, "bpy", Instead(lambda: bpy, app=app))
    module.apply_soon()
    assert not timers
    app.__dict__["background"] = False
    module.apply_soon()
    ((first, seconds),) = timers
    assert seconds == 0.0 and first() is None and applied == [chosen] and len(timers) == 2
    assert timers[1][1] == module.LOOK_AGAIN > 0
    chosen.tab_was_shown = True
    assert first() is None and len(timers) == 2 and len(applied) == 2
    module._changed(chosen, bpy.context)
    assert len(applied) == 3
    monkeypatch.setattr(module, "get", lambda _: None)
    assert first() is None and len(applied) == 3


def test_menus_are_drawn_behind_a_line(package):
    menus = package("panels.menus")
    for draw, entry in ((menus.draw_menu, "menu(UV_MT_omt"), (menus.draw_remesh, "operator(object.omt_remesh")):
        record: list[str] = []
        calls: list[str] = []
        layout = Recorder(record)
        stand_in = SimpleNamespace(separator=lambda calls=calls: calls.append("separator"),
                                   menu=layout.menu, operator=layout.operator)  # fmt: skip
        draw(SimpleNamespace(layout=stand_in), bpy.context)
        assert calls == ["separator"] and len(record) == 1 and record[0].startswith(entry)
    assert menus.remesh_menus() == [bpy.types.DATA_PT_remesh]
    # Before 4.5 the UV menu of the 3D View had nothing of the editor's.
    assert (bpy.types.VIEW3D_MT_uv_map in menus.menus()) == (bpy.app.version < (4, 5, 0))


class Shader:
    """A shader of Blender's that keeps what is drawn with it."""

    def __init__(self, name, drawn):
        self.name, self.drawn = name, drawn

    def bind(self):
        self.drawn.append(("bind", self.name))

    def uniform_float(self, name, value):
        self.drawn.append((name, tuple(value)))


@pytest.mark.parametrize("mode", ["OBJECT", "EDIT_MESH"])
def test_faces_are_filled_in_uv_editors_and_outlined_where_blender_draws_no_outlines(package, monkeypatch, mode):
    overlay, versions = package("display.overlay"), package("blender.versions")
    obj = scenes.bump(3, 2)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    bpy.ops.uv.omt_overlay(show="SHEAR")
    drawn, made = [], []

    def batch(shader, kind, content):
        made.append((shader.name, kind, content))
        return SimpleNamespace(draw=lambda with_shader: drawn.append((kind, with_shader.name)))

    gpu = SimpleNamespace(shader=SimpleNamespace(from_builtin=lambda name: Shader(name, drawn)),
                          state=SimpleNamespace(blend_set=lambda kind: drawn.append(("blend", kind))))  # fmt: skip
    monkeypatch.setitem(sys.modules, "gpu", gpu)
    monkeypatch.setitem(sys.modules, "gpu_extras.batch", SimpleNamespace(batch_for_shader=batch))
    editor = SimpleNamespace(space_data=None, area=SimpleNamespace(ui_type="IMAGE_EDITOR"), mode=mode)
    monkeypatch.setattr(overlay, "bpy", Instead(lambda: bpy, context=editor))
    overlay._draw()
    assert not drawn
    for editor.area, editor.space_data in (
        (SimpleNamespace(ui_type="UV"), None),
        (None, SimpleNamespace(show_uvedit=True)),
    ):
        drawn.clear()
        overlay._draw()
        lines = [("bind", versions.UNIFORM_COLOUR_SHADER), ("color", tuple(overlay.OUTLINE)),
                 ("LINES", versions.UNIFORM_COLOUR_SHADER)]  # fmt: skip
        fill = [("blend", "ALPHA"), ("TRIS", versions.SMOOTH_COLOUR_SHADER)]
        assert drawn == [*fill, *(lines if mode == "OBJECT" else []), ("blend", "NONE")]
    # Made once and not for every look: two triangles for each of six faces, and all of their edges.
    assert [(name, kind) for name, kind, _ in made] == [(versions.SMOOTH_COLOUR_SHADER, "TRIS")] + (
        [(versions.UNIFORM_COLOUR_SHADER, "LINES")] if mode == "OBJECT" else []
    )
    assert len(made[0][2]["pos"]) == len(made[0][2]["color"]) == 36
    assert {round(colour[3], 6) for colour in made[0][2]["color"]} == {overlay.OPACITY}
    if mode == "OBJECT":
        ends = made[1][2]["pos"]
        assert len(ends) == 2 * 4 * 6 and {tuple(p) for p in ends} == {tuple(map(float, p)) for p in scenes.uv_of(obj)}
    monkeypatch.undo()
    bpy.ops.uv.omt_overlay(show="NONE")


def test_a_handler_draws_while_colours_are_shown(package, monkeypatch):
    overlay = package("display.overlay")
    obj = scenes.bump(3, 2)
    scenes.set_uv(obj, scenes.seen_from_above(obj))
    on = []

    def add(draw, _, region, kind):
        on.append((draw, region, kind))
        return on[-1]

    editor = SimpleNamespace(draw_handler_add=add, draw_handler_remove=lambda handle, region: on.remove(handle))
    there = Instead(lambda: bpy, app=Instead(lambda: bpy.app, background=False),
                    types=Instead(lambda: bpy.types, SpaceImageEditor=editor))  # fmt: skip
    monkeypatch.setattr(overlay, "bpy", there)
    for end in ("NONE", "written", "forget"):
        for show in ("AREA", "SHEAR"):
            assert bpy.ops.uv.omt_overlay(show=show) == {"FINISHED"}
            assert on == [(overlay._draw, "WINDOW", "POST_VIEW")] and overlay.kind() == show
        if end == "NONE":
            bpy.ops.uv.omt_overlay(show="NONE")
        elif end == "written":
            overlay.show_written(bpy.context)
            assert overlay.kind() == "OTHER"
        else:
            overlay.forget()
        assert not on
    monkeypatch.undo()
    bpy.ops.uv.omt_overlay(show="NONE")


def test_preferences_are_those_of_the_add_on_that_blender_knows(package):
    """The package itself, or where it is in an extension the package that this is in."""
    module = package("panels.preferences")
    root = package("registration").__name__.rpartition(".")[0]
    assert module.OMTUVPreferences.bl_idname == module.ADDON == (root.rpartition(".")[0] or root)
    assert module.ADDON and root == module.PACKAGE


@pytest.mark.parametrize("kind", ["AREA", "SHEAR", "NONE", ""])
def test_the_scale_of_colours_is_as_high_with_colours_and_without(package, monkeypatch, kind):
    """Two lines, so that nothing below moves when colours come or go."""
    module, lines = package("panels.inspect"), []

    class Line:
        def __init__(self):
            self.labels = 0
            lines.append(self)

        def row(self, **_):
            return self

        def label(self, **_):
            self.labels += 1

    column = SimpleNamespace(row=lambda **_: Line(), split=lambda **_: Line())
    monkeypatch.setattr(module.colour_bar, "icons", lambda _: [1, 2, 3])
    module.draw_bar(SimpleNamespace(column=lambda **_: column), kind)
    assert [line.labels for line in lines] == ([3, 3] if kind in ("AREA", "SHEAR") else [1, 1])


@pytest.mark.parametrize("live", [False, True])
@pytest.mark.parametrize("running", [False, True])
def test_what_is_red_and_pressed_is_a_session_that_follows_the_slider_and_nothing_else(
    package, monkeypatch, running, live
):
    monkeypatch.setattr(package("session.following"), "current", object() if live else None)
    run = SimpleNamespace(fraction=0.5, stage="Packing", seconds=1.0, keys=lambda: "Esc: Cancel")
    monkeypatch.setattr(package("session.run"), "current", run if running else None)
    found = section(package, "unwrap", "draw")
    red = [entry for entry in found if "a1" in entry.rpartition(")")[2]]
    assert bool(red) == (live and not running)
    assert all("omt_live," in entry or "balance" in entry or "pins" in entry for entry in red)
    buttons = [entry for entry in found if entry.startswith("operator(uv.omt_live,")]
    assert len(buttons) == (not running) and all(f"depress={live}" in entry for entry in buttons)
    assert any(entry.startswith("operator(uv.omt_live_end") for entry in found) == (live and not running)
    assert any(entry.startswith("operator(uv.omt_unwrap") for entry in found) == (not live and not running)
    assert any("Esc: Cancel" in entry for entry in found) == running
