"""What is loaded ahead of the first click: once, in a window alone, and all that an unwrap needs."""

from __future__ import annotations

import subprocess
import sys
from types import SimpleNamespace

import bpy

import pytest
from windows import Instead

UNWRAPPED = """
import importlib, sys
import bpy
from omt_uv import registration
from omt_uv.session import ahead
registration.register()
for name in ahead.MODULES:
    before = set(sys.modules)
    importlib.import_module(name, ahead.PACKAGE)
    assert set(sys.modules) - before, f"{name} is there already"
bpy.ops.wm.read_factory_settings()
before = set(sys.modules)
assert bpy.ops.uv.omt_unwrap() == {"FINISHED"}
print("LATE", sorted(set(sys.modules) - before))
# A class that is still registered at exit crashes some versions of Blender.
registration.unregister()
"""


@pytest.fixture
def timers(monkeypatch, package):
    """A window, and the timers that run in it with their first interval."""
    running = {}
    timers = SimpleNamespace(
        register=lambda function, first_interval, persistent: running.update({function: (first_interval, persistent)}),
        is_registered=running.__contains__,
        unregister=running.pop,
    )
    app = Instead(lambda: bpy.app, background=False, timers=timers)
    monkeypatch.setattr(package("session.ahead"), "bpy", Instead(lambda: bpy, app=app))
    yield running
    package("session.ahead").forget()


def test_an_unwrap_imports_nothing_that_was_not_loaded_ahead():
    done = subprocess.run([sys.executable, "-c", UNWRAPPED], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "LATE []" in done.stdout, done.stdout


def test_modules_come_one_by_one_and_whoever_looks_again_loads_nothing_more(timers, package, monkeypatch):
    ahead, loaded = package("session.ahead"), []
    monkeypatch.setattr(ahead, "import_module", lambda *name: loaded.append(name))
    ahead.begin()
    assert timers == {ahead._load_next: (ahead.PAUSE, True)}
    while ahead._load_next() == ahead.PAUSE:
        assert len(loaded) <= len(ahead.MODULES)
    assert loaded == [(name, ahead.PACKAGE) for name in ahead.MODULES]
    timers.clear()
    ahead.begin()
    assert not timers
    ahead.forget()
    ahead.begin()
    assert timers


def test_without_a_window_nothing_is_loaded(timers, package):
    ahead = package("session.ahead")
    ahead.bpy.app.__dict__["background"] = True
    ahead.begin()
    assert not timers


def test_where_a_library_is_missing_the_click_says_so(timers, package, monkeypatch):
    ahead, tried = package("session.ahead"), []

    def missing(name, _package):
        tried.append(name)
        raise ImportError(name)

    monkeypatch.setattr(ahead, "import_module", missing)
    ahead.begin()
    assert ahead._load_next() is None
    assert tried == [ahead.MODULES[0]]


def test_what_takes_the_extension_away_ends_it(timers, package):
    package("session.ahead").begin()
    package("session.ahead").forget()
    assert not timers


def test_the_tab_begins_it(package, monkeypatch):
    sidebar, begun = package("panels.sidebar"), []
    monkeypatch.setattr(package("session.ahead"), "begin", lambda: begun.append(True))
    monkeypatch.setattr(sidebar.TabPanel, "draw", lambda *_: begun.append(False))
    sidebar.MainPanel.draw(None, bpy.context)
    assert begun == [True, False]
