"""The zip that users get: built and validated for this platform, installed into an empty user folder, run, removed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import bpy

import pytest

ROOT = Path(__file__).resolve().parents[2]

# In a process of its own: an empty user folder has to be known before Blender starts.
SESSION = """
import json, sys
import bpy

ADDON = "bl_ext.user_default.omt_uv"
classes = set(dir(bpy.types))
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
result = {"enabled": ADDON in bpy.context.preferences.addons}
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.mesh.primitive_grid_add(x_subdivisions=6, y_subdivisions=6)
mesh = bpy.context.object.data
for v in mesh.vertices:
    v.co.z = v.co.x * v.co.y
result["loaded_at_startup"] = [name for name in ("scipy", "xatlas") if name in sys.modules]
result["run"] = list(bpy.ops.uv.omt_unwrap())
result["spread"] = max(d.uv[0] for d in mesh.uv_layers.active.data) - min(d.uv[0] for d in mesh.uv_layers.active.data)
import scipy, xatlas
result["scipy"], result["xatlas"] = scipy.__file__, xatlas.__file__
bpy.ops.preferences.addon_disable(module=ADDON)
result["left_over"] = sorted(name for name in set(dir(bpy.types)) - classes if "omt" in name.lower())
bpy.ops.preferences.addon_enable(module=ADDON)
result["again"] = list(bpy.ops.uv.omt_unwrap())
bpy.ops.preferences.addon_disable(module=ADDON)
print("RESULT" + json.dumps(result))
"""


@pytest.fixture(scope="module")
def archive():
    given = os.environ.get("OMT_UV_ZIP")
    if given:
        return Path(given)
    done = subprocess.run(
        [sys.executable, str(ROOT / "scripts" / "release" / "build_extension.py"), "--here"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    return ROOT / done.stdout.split()[0]


def test_contents(archive):
    with zipfile.ZipFile(archive) as content:
        names = content.namelist()
    assert "blender_manifest.toml" in names
    assert "__init__.py" in names
    modules = {str(p.relative_to(ROOT)) for p in (ROOT / "omt_uv").glob("**/*.py")}
    assert {name for name in names if name.startswith("omt_uv/")} == modules
    wheels = [name for name in names if name.endswith(".whl")]
    assert {name.split("-")[0] for name in wheels} == {"wheels/scipy", "wheels/xatlas"}
    assert {name.split("-")[2] for name in wheels} == {"cp311", "cp312", "cp313", "cp314"}
    assert archive.stat().st_size < 200e6
    assert not [name for name in names if "tests" in name or "__pycache__" in name or "numpy-" in name]


def test_installs_runs_and_unregisters(archive, tmp_path):
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "BLENDER"))}
    environment["BLENDER_USER_RESOURCES"] = str(tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", SESSION, str(archive)], capture_output=True, text=True, env=environment, cwd=tmp_path
    )
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads(next(line for line in done.stdout.splitlines() if line.startswith("RESULT"))[6:])
    assert result["enabled"]
    assert not result["loaded_at_startup"], "Blender should not wait for scipy when it starts"
    assert result["run"] == result["again"] == ["FINISHED"]
    assert result["spread"] > 0.5
    assert result["left_over"] == []
    if os.environ.get("OMT_UV_ZIP"):
        # The environment of the matrix has neither; elsewhere they may come first on the path.
        assert Path(result["scipy"]).is_relative_to(tmp_path)
        assert Path(result["xatlas"]).is_relative_to(tmp_path)


def test_blender_can_subscribe_to_a_repository_of_it(archive, tmp_path):
    """The index names the zip, and the page has it to be dragged."""
    program = ROOT / "scripts" / "release" / "repository.py"
    done = subprocess.run(
        [sys.executable, str(program), "--to", str(tmp_path / "web"), str(archive)], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    (entry,) = json.loads((tmp_path / "web" / "index.json").read_text())["data"]
    page = (tmp_path / "web" / "index.html").read_text()
    assert entry["id"] == "omt_uv" and entry["archive_url"] == f"./{archive.name}"
    assert entry["archive_size"] == (tmp_path / "web" / archive.name).stat().st_size
    for name in entry["platforms"]:
        assert f"./{archive.name}?repository=./index.json&blender_version_min=4.2.13&platforms={name}" in page


def test_everything_is_registered_from_one_list(package):
    registration = package("registration")
    for cls in registration.CLASSES:
        assert cls.is_registered
    names = {getattr(cls, "bl_idname", "") for cls in registration.CLASSES}
    assert names >= {"uv.omt_unwrap", "uv.omt_measure"}


def test_registration_that_fails_takes_everything_back(package, monkeypatch):
    registration = package("registration")
    registration.unregister()

    class Broken(bpy.types.Operator):
        bl_idname = "not a valid name"
        bl_label = "Broken"

    monkeypatch.setattr(registration, "CLASSES", (*registration.CLASSES, Broken))
    with pytest.raises((ValueError, RuntimeError)):
        registration.register()
    assert not hasattr(bpy.types, "UV_OT_omt_unwrap")
    monkeypatch.undo()
    registration.register()
    assert hasattr(bpy.types, "UV_OT_omt_unwrap")
