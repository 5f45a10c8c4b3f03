"""One Blender session for all folders that need one, with OMT UV registered from the sources, or installed from a zip.

With OMT_UV_ZIP=path the extension is installed from that zip into an empty user folder and runs with its own
wheels; that is how scripts/release/matrix.py tests every Blender version.
"""

from __future__ import annotations

import contextlib
import gc
import importlib
import os
import sys
from pathlib import Path

import pytest

ADDON = "bl_ext.user_default.omt_uv"
FOLDERS = ("blender", "commands", "display", "extension", "operators", "panels", "session")
# Files of a minute and more.
LONG = {"test_what_every_function_tells.py", "test_what_is_told_on_wider_runs.py", "test_what_is_told_on_rare_runs.py",
        "test_what_is_found_on_wider_inputs.py", "test_every_warning_arrives.py", "test_fuzz.py"}  # fmt: skip
STATUS = pytest.StashKey[int]()
# Where Linux lists what a process holds open.
TOLD_OPEN = Path("/proc/self/fd")


def needs_blender(path: Path) -> bool:
    return path.relative_to(Path(__file__).parent).parts[0] in FOLDERS


def pytest_sessionstart(session):
    """Tests import scipy while they are collected, and some environments have none but that of the zip."""
    archive = os.environ.get("OMT_UV_ZIP")
    if archive:
        import bpy

        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
        # What tests start in processes of their own finds it there, too.
        import scipy

        os.environ["PYTHONPATH"] = str(Path(scipy.__file__).parents[1])


def pytest_configure(config):
    """Whatever any test runs: how far a solver says to be lies in [0, 1], and so do parts of a longer job."""
    if os.environ.get("OMT_UV_ZIP"):
        return
    told = importlib.import_module("omt_uv.solver.progress")
    init, part_of = told.Progress.__init__, told.part_of

    def within(self, stage, fraction, early=None):
        assert 0 <= fraction < 1 + 1e-9, f"{stage} says it is {fraction} done"
        init(self, stage, fraction, early)

    def part_within(steps, start, width, stage=None):
        assert start >= 0 and width >= 0 and start + width < 1 + 1e-9, f"a part from {start} of {width}"
        return part_of(steps, start, width, stage)

    told.Progress.__init__, told.part_of = within, part_within


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """What is collected stays to the end: nobody looks for garbage among its million objects, now or in a test."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items):
    """What takes longest in one file comes first, so that processes that run side by side end together."""
    items.sort(key=lambda item: item.path.name not in LONG)


@pytest.fixture(scope="session")
def package():
    """Import a module of the package that is registered: `package("cli")`."""
    import bpy

    archive = os.environ.get("OMT_UV_ZIP")
    if archive:
        root = f"{ADDON}.omt_uv"
        assert ADDON in bpy.context.preferences.addons, f"{archive} was not enabled"
    else:
        root = "omt_uv"
        importlib.import_module("omt_uv.registration").register()
    yield lambda name: importlib.import_module(f"{root}.{name}")
    # A class that is still registered at exit crashes some versions of Blender.
    if archive:
        bpy.ops.preferences.addon_disable(module=ADDON)
    else:
        importlib.import_module("omt_uv.registration").unregister()
    assert not hasattr(bpy.types, "UV_OT_omt_unwrap")
    assert not hasattr(bpy.types, "VIEW3D_PT_omt_uv")


@pytest.fixture(scope="module", autouse=True)
def registered(request):
    """OMT UV is registered wherever Blender is tested, and only there."""
    if needs_blender(request.path):
        request.getfixturevalue("package")


def opened_in(folder: Path) -> list[str]:
    """Files in a folder, and folders, that this process holds open; none where the system does not tell."""
    found = []
    for number in os.listdir(TOLD_OPEN) if TOLD_OPEN.is_dir() else ():
        # That by which the list was read is closed by now.
        with contextlib.suppress(OSError):
            path = os.readlink(TOLD_OPEN / number)
            # What is deleted is in nobody's way; Python's last error, in an exporter of Blender, may hold one.
            here = path.startswith(f"{folder}/") or path == str(folder)
            found += [path] if here and not path.endswith(" (deleted)") else []
    return found


@pytest.fixture(autouse=True)
def closed_files(request):
    """Whatever a test does with files in a folder of its own, it leaves none of them open."""
    yield
    folder = request.node.funcargs.get("tmp_path")
    if folder is not None and opened_in(folder.resolve()):
        # What nobody holds any more is closed with what it refers to, and that to it.
        gc.collect()
        still = opened_in(folder.resolve())
        assert not still, f"still open: {still}"


@pytest.fixture(autouse=True)
def empty_scene(request):
    """Every test of Blender starts from an empty scene; this keeps add-ons enabled. Whatever it does, and however
    often, Blender calls nothing of ours twice for one thing then."""
    if not needs_blender(request.path):
        yield
        return
    import bpy

    import scenes

    scenes.open_empty()
    yield
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    for name in ("depsgraph_update_post", "undo_post", "redo_post", "load_pre", "load_post"):
        called = getattr(bpy.app.handlers, name)
        twice = [function for function in called if "omt_uv" in function.__module__ and called.count(function) > 1]
        assert not twice, f"{name} calls somebody twice: {twice}"


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """Blender 4.2 as a Python module crashes at exit once anything was exported to glTF, OMT UV or not."""
    bpy = sys.modules.get("bpy")
    if bpy is not None and bpy.app.version < (4, 5, 0):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash.get(STATUS, 1))


def pytest_sessionfinish(session, exitstatus):
    session.config.stash[STATUS] = int(exitstatus)
