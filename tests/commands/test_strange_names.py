"""Files and folders may be called anything: every command works on them, and says each thing on one line."""

from __future__ import annotations

import shutil

import bpy

import command_runs
import pytest
from command_runs import words

STRANGE = "a\nb ü漢 'c\" %s {x} \udcff"
# Commands that find nothing to do on the bodies here.
NOTHING_TO_DO = ("symmetrize", "rectify")


@pytest.fixture(scope="module")
def folder(package, tmp_path_factory):
    """A folder of a strange name with files of strange names, which every command can work on."""

    def run(*arguments):
        return package("cli").main([str(a) for a in arguments]), "", ""

    plain = tmp_path_factory.mktemp("plain")
    command_runs.prepare(run, plain)
    path = tmp_path_factory.mktemp("strange") / STRANGE
    shutil.copytree(plain, path)
    (path / "in.blend").rename(path / f"{STRANGE}.blend")
    yield path
    # Blender's exporter of FBX writes down which file is open, and has no bytes for such a name.
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


@pytest.mark.parametrize("command", command_runs.CALLS)
def test_every_command_takes_and_writes_files_of_strange_names(package, run, folder, command):
    given = "" if command in command_runs.FOLDERS else f"{STRANGE}.blend"
    (parser,) = (p for name, p in command_runs.commands(package).items() if name == command)
    written = {a.dest for a in command_runs.paths_of(parser)} & command_runs.WRITTEN
    keys = {"npz"} if command in command_runs.ARRAYS else written
    files = {key: f"{STRANGE} {command} {key}.{command_runs.FILES[key].rpartition('.')[2]}" for key in keys}
    status, _, err = run(*words(command, folder, given, **files))
    if command in NOTHING_TO_DO:
        assert status == 1 and len(err.splitlines()) == 1 and "defect" not in err, err
        return
    assert status == 0, err
    assert all(line.startswith("omt_uv: warning: ") for line in err.splitlines()), err
    assert all((folder / name).stat().st_size for name in files.values())
