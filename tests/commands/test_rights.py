"""Missing rights, by reflection over all commands: old files stay whole, one line names the file and the cause, and
nothing is left behind."""

from __future__ import annotations

import importlib
import pkgutil
import subprocess
import sys
from pathlib import Path

import command_runs
import pytest
from command_runs import CALLS, WRITTEN, contents, words
from without_rights import as_nobody, drop_rights, folder_of_nobody, own

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="modes of files are those of POSIX")
FORMATS = (".blend", ".obj", ".ply", ".stl", ".glb", ".gltf", ".fbx")
ROOT = Path(__file__).resolve().parents[2]
BODY = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3\nf 1 3 4\n"


@pytest.fixture(scope="module")
def folder(package):
    """Files that every command can work on, of nobody's; whatever commands import is imported."""
    with folder_of_nobody() as path:
        command_runs.prepare(lambda *given: (package("cli").main([str(a) for a in given]), "", ""), path)
        whole = importlib.import_module(package("cli").__name__.rpartition(".")[0])
        for module in pkgutil.walk_packages(whole.__path__, f"{whole.__name__}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
        own(path)
        yield path


@pytest.fixture
def nobody(run):
    """`run` without rights. Whatever it is asked for has to be refused before Blender does anything."""
    return as_nobody(run)


@pytest.fixture
def program():
    """The program in a process of its own, without rights."""

    def run(*words):
        call = [sys.executable, "-m", "omt_uv", *map(str, words)]
        done = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, preexec_fn=drop_rights)
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.fixture
def there():
    """An empty folder of nobody's."""
    with folder_of_nobody() as path:
        yield path


def kept(folder):
    """All of a folder, its modes too."""
    return contents(folder), {path: path.stat().st_mode for path in folder.rglob("*")}


def refused(run, there, call, named, cause="Permission denied"):
    before = kept(there)
    status, out, err = run(*call)
    assert status == 1 and out == "", (call, status, out, err)
    assert len(err.splitlines()) == 1 and err.startswith("omt_uv: error: "), (call, err)
    assert named in err and cause in err and "Errno" not in err, (call, err)
    assert kept(there) == before, call


def written_by(package):
    """Every command with every option that names a file it writes, and the key by which `words` knows it."""
    for command, parser in command_runs.commands(package).items():
        for action in command_runs.paths_of(parser):
            if action.dest in WRITTEN:
                key = {"test-texture": "made", "diagram": "made"}.get(command, action.dest)
                yield command, "npz" if command in command_runs.ARRAYS and key == "output" else key


def test_nothing_is_written_into_a_folder_that_forbids_it(package, nobody, folder, there):
    tried = set()
    shut = there / "shut"
    for command, key in written_by(package):
        shut.mkdir()
        name = command_runs.FILES[key]
        for old in (None, b"old"):
            if old:
                (shut / name).write_bytes(old)
            own(there)
            shut.chmod(0o555)
            # Others may go where they like: nothing is written before everything can be.
            files = {k: str(there / v) for k, v in command_runs.FILES.items() if k in (*WRITTEN, "npz")}
            refused(nobody, there, words(command, folder, **{**files, key: str(shut / name)}), f"shut/{name}")
            shut.chmod(0o755)
            tried.add((command, key))
        (shut / name).unlink()
        shut.rmdir()
    assert len(tried) > 40 and {command for command, _ in tried} >= CALLS.keys() - {"distance", "similar"}


def test_files_that_are_protected_are_not_replaced(package, nobody, folder, there):
    for command, key in written_by(package):
        path = there / command_runs.FILES[key]
        path.write_bytes(b"old")
        own(there)
        path.chmod(0o444)
        files = {k: str(there / v) for k, v in command_runs.FILES.items() if k in (*WRITTEN, "npz")}
        refused(nobody, there, words(command, folder, **files), path.name, "write-protected")
        path.unlink()


def test_a_file_that_nobody_may_read_is_told_by_every_command(nobody, folder, there):
    (there / "in.blend").write_bytes((folder / "in.blend").read_bytes())
    (there / "shapes").mkdir()
    own(there)
    (there / "in.blend").chmod(0)
    (there / "shapes").chmod(0)
    files = {k: str(there / f"new_{v}") for k, v in command_runs.FILES.items() if k in (*WRITTEN, "npz")}
    for command in CALLS:
        name = "shapes" if command in command_runs.FOLDERS else "in.blend"
        refused(nobody, there, words(command, folder, **{**files, "input": str(there / name)}), str(there / name))


@pytest.mark.parametrize("command", ["magnify", "flow", "compare", "match", "similar"])
def test_a_second_file_that_may_not_be_read_is_told_too(program, folder, tmp_path, command):
    """By the program itself: what Blender imports on its way it imports with rights."""
    (key,) = {"magnify": ("image",), "flow": ("handles",), "compare": ("others",), "match": ("target",),
              "similar": ("index",)}[command]  # fmt: skip
    shut = tmp_path / command_runs.FILES[key]
    shut.write_bytes((folder / shut.name).read_bytes())
    shut.chmod(0)
    files = {k: str(tmp_path / f"new_{v}") for k, v in command_runs.FILES.items() if k in (*WRITTEN, "npz")}
    refused(program, tmp_path, words(command, folder, **{**files, key: str(shut)}), str(shut))


@pytest.mark.parametrize("call", ["batch unwrap IN -o OUT", "library IN -o OUT/index.npz"])
def test_a_folder_within_that_may_not_be_read_is_told_and_not_left_out(program, tmp_path, call):
    for name in ("in", "in/shut", "out"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "a.obj").write_text(BODY)
    (tmp_path / "out" / "a.obj").unlink()
    (tmp_path / "in" / "shut").chmod(0)
    given = call.replace("IN", str(tmp_path / "in")).replace("OUT", str(tmp_path / "out")).split()
    status, out, err = program(*given)
    (tmp_path / "in" / "shut").chmod(0o755)
    assert (status, out) == (1, "")
    assert err.startswith(f"omt_uv: error: {tmp_path}/in/shut: cannot be read (Permission denied)"), err
    assert len(err.splitlines()) == 1 and not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize("suffix", [*FORMATS, ".off"])
def test_a_file_of_any_format_that_nobody_may_read_is_told_by_its_cause(nobody, folder, there, suffix):
    (there / f"shut{suffix}").write_text(BODY)
    own(there)
    (there / f"shut{suffix}").chmod(0)
    before = sorted(path.name for path in there.iterdir())
    status, out, err = nobody("unwrap", there / f"shut{suffix}", "-o", there / "out.blend")
    assert (status, out) == (1, "")
    assert err == f"omt_uv: error: {there}/shut{suffix}: cannot be read (Permission denied)\n"
    assert sorted(path.name for path in there.iterdir()) == before
