"""How the command line leaves: what lies in the folder for temporary files is nobody's to remove."""

import os
import runpy
import sys
from types import SimpleNamespace

import pytest


@pytest.mark.parametrize("version", [(4, 2, 0), (4, 4, 3)])
def test_leaving_removes_no_file_beside_its_own(tmp_path, monkeypatch, version):
    # Where Blender could make no folder of its own, its folder for temporary files is that of the system.
    (tmp_path / "somebody.txt").write_text("work")
    (tmp_path / "empty").mkdir()
    blender = SimpleNamespace(app=SimpleNamespace(version=version, tempdir=f"{tmp_path}/"))
    left = []

    def leave(status):
        left.append(status)
        raise SystemExit(status)

    monkeypatch.setitem(sys.modules, "bpy", blender)
    monkeypatch.setattr(os, "_exit", leave)
    monkeypatch.setattr("omt_uv.cli.main", lambda: 3)
    with pytest.raises(SystemExit):
        runpy.run_module("omt_uv", run_name="__main__")
    assert left == [3]
    assert (tmp_path / "somebody.txt").read_text() == "work"
    assert sorted(p.name for p in tmp_path.iterdir()) == ["empty", "somebody.txt"]
    blender.app.tempdir = f"{tmp_path}/empty/"
    with pytest.raises(SystemExit):
        runpy.run_module("omt_uv", run_name="__main__")
    assert not (tmp_path / "empty").exists()
