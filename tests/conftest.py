"""One Blender session for all tests, with OMT UV registered from the sources, or installed from a zip.

With OMT_UV_ZIP=path the extension is installed from that zip into an empty user folder and runs with its own
wheels; that is how scripts/matrix.py tests every Blender version.
"""

from __future__ import annotations

import importlib
import os
import sys

import pytest

bpy = pytest.importorskip("bpy", reason="bpy is not installed")

ADDON = "bl_ext.user_default.omt_uv"
STATUS = pytest.StashKey[int]()


@pytest.fixture(scope="session", autouse=True)
def package():
    """Import a module of the package that is registered: `package("cli")`."""
    archive = os.environ.get("OMT_UV_ZIP")
    if archive:
        root = f"{ADDON}.omt_uv"
        bpy.ops.extensions.package_install_files(filepath=archive, repo="user_default", enable_on_install=True)
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


@pytest.fixture(autouse=True)
def empty_scene():
    """Every test starts from an empty scene; this keeps add-ons enabled."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    yield
    if bpy.context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")


@pytest.hookimpl(trylast=True)
def pytest_unconfigure(config):
    """Blender 4.2 as a Python module crashes at exit once anything was exported to glTF, OMT UV or not."""
    if bpy.app.version < (4, 5, 0):
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(config.stash.get(STATUS, 1))


def pytest_sessionfinish(session, exitstatus):
    session.config.stash[STATUS] = int(exitstatus)
