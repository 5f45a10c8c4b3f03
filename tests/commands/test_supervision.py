"""A command in a child process: crashes, signals, limits of time and memory end as one line and a status."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).resolve().parents[2]
posix = pytest.mark.skipif(os.name != "posix", reason="signals")
# A child that leaves a temporary folder, says what its process is and where its temporary files go, and sleeps.
SLEEPER = """
import os, pathlib, time
folder = pathlib.Path(FOLDER)
(folder / f".omt_uv_{os.getpid()}_rest").mkdir()
print(os.getpid(), os.environ["TMPDIR"], flush=True)
time.sleep(60)
"""
PARENT = """
import sys
from pathlib import Path
from omt_uv.supervision import Errand, supervise
sys.exit(supervise(Errand([sys.executable, "-c", sys.argv[1]], "in.obj", (Path(sys.argv[2]),), timeout=50.0)))
"""


def supervise(package, code, **more):
    supervision = package("supervision")
    return supervision.supervise(supervision.Errand([sys.executable, "-c", code], "in.obj", **more))


def sleeper(folder):
    return SLEEPER.replace("FOLDER", repr(str(folder)))


@pytest.mark.parametrize("status", [0, 1, 2, 5, 6])
def test_a_status_of_the_child_is_that_of_the_parent_without_a_word(package, capfd, status):
    assert supervise(package, f"import sys; sys.exit({status})") == status
    assert capfd.readouterr() == ("", "")


@posix
@pytest.mark.parametrize(
    "number, status, word", [(11, 3, "SIGSEGV"), (6, 3, "SIGABRT"), (8, 3, "SIGFPE"), (9, 5, "memory")]
)
def test_a_crash_is_one_line_and_a_status(package, capfd, number, status, word):
    assert supervise(package, f"import os; os.kill(os.getpid(), {number})") == status
    out, err = capfd.readouterr()
    assert out == "" and len(err.splitlines()) == 1
    assert err.startswith("omt_uv: error: in.obj: ") and word in err


def test_what_takes_too_long_is_ended(package, capfd, tmp_path):
    assert supervise(package, sleeper(tmp_path), timeout=2.0, folders=(tmp_path,)) == 4
    assert "not done within 2 s" in capfd.readouterr().err
    assert not list(tmp_path.iterdir())


@posix
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_ends_the_child_leaves_nothing_and_is_one_line(tmp_path, number):
    """What lies beside the temporary files of the child, also those of another run, stays."""
    (tmp_path / ".omt_uv_1_other").mkdir()
    words = [sys.executable, "-c", PARENT, sleeper(tmp_path), str(tmp_path)]
    parent = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, cwd=ROOT, text=True)
    child, folder = parent.stdout.readline().split()
    assert Path(folder).is_dir()
    parent.send_signal(number)
    assert parent.wait(20) == 128 + number
    err = parent.stderr.read()
    assert len(err.splitlines()) == 1 and signal.Signals(number).name in err
    with pytest.raises(ProcessLookupError):
        os.kill(int(child), 0)
    assert sorted(p.name for p in tmp_path.iterdir()) == [".omt_uv_1_other"]
    assert not Path(folder).exists()


@posix
def test_in_blender_whose_handlers_are_none_of_python_a_child_runs_all_the_same(package, monkeypatch):
    """Blender catches signals before there is a Python: to that, these handlers are None."""
    set_handler = signal.signal

    def of_blender(number, handler):
        before = set_handler(number, handler)
        return None if before in (signal.SIG_DFL, signal.default_int_handler) else before

    monkeypatch.setattr(package("supervision").signal, "signal", of_blender)
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        assert supervise(package, "import sys; sys.exit(5)") == 5
    finally:
        for number, handler in before.items():
            set_handler(number, handler)


CHILD = """
import os, time
from omt_uv import supervision
folder = os.environ[supervision.MARK]
supervision.begin_child(0)
print(os.getpid(), folder, flush=True)
time.sleep(50)
"""


@posix
def test_a_child_ends_with_a_killed_parent_and_takes_its_folder_along(tmp_path):
    (tmp_path / "somebody.txt").write_text("work")
    words = [sys.executable, "-c", PARENT, CHILD, str(tmp_path)]
    more = {"TMPDIR": str(tmp_path), "PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen(words, stdout=subprocess.PIPE, cwd=ROOT, text=True, env={**os.environ, **more})
    _, folder = parent.stdout.readline().split()
    assert Path(folder).parent == tmp_path and Path(folder).is_dir()
    parent.kill()
    # The pipe is the child's as well, and ends with it.
    assert parent.stdout.read() == ""
    assert [p.name for p in tmp_path.iterdir()] == ["somebody.txt"]


@posix
@pytest.mark.parametrize("name", ["omt_uv_x", "other", "."])
def test_a_child_removes_no_folder_that_is_not_its_parents(tmp_path, name):
    """Whatever the environment names: one without the number of the parent in it is somebody's."""
    folder = tmp_path / name
    folder.mkdir(exist_ok=True)
    (folder / "somebody.txt").write_text("work")
    (folder / "omt_uv_parent").write_text("1" if name == "omt_uv_x" else str(os.getpid()))
    code = "from omt_uv import supervision; import time; supervision.begin_child(0); time.sleep(50)"
    more = {"OMT_UV_CHILD": str(folder), "TMPDIR": str(tmp_path)}
    child = subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE, cwd=ROOT, env={**os.environ, **more})
    child.stdin.close()
    assert child.wait(20) == 3
    assert (folder / "somebody.txt").read_text() == "work"


def test_leaving_removes_nothing_and_runs_no_end_of_blender(package, tmp_path, monkeypatch):
    """Where Blender made no folder of its own for temporary files, its name for it is that of everybody's."""
    (tmp_path / "somebody.txt").write_text("work")
    (tmp_path / "empty").mkdir()
    left = []
    monkeypatch.setitem(sys.modules, "bpy", SimpleNamespace(app=SimpleNamespace(tempdir=f"{tmp_path}/")))
    monkeypatch.setattr(os, "_exit", left.append)
    with pytest.raises(SystemExit):
        package("supervision").leave(3)
    assert left == [3]
    assert sorted(p.name for p in tmp_path.iterdir()) == ["empty", "somebody.txt"]


@pytest.mark.parametrize(
    "error, status, word",
    [
        (MemoryError("Unable to allocate 60 GiB"), 5, "60 GiB"),
        (KeyboardInterrupt(), 130, "SIGINT"),
        (KeyError("x"), 6, "KeyError"),
        (ValueError("min() arg is an empty\nsequence"), 6, "test_supervision.py"),
    ],
)
def test_whatever_is_raised_is_one_line(package, run, monkeypatch, error, status, word):
    def fail(options):
        raise error

    monkeypatch.setattr(package("commands.measure"), "run", fail)
    found, out, err = run("measure", "in.obj")
    assert (found, out) == (status, "")
    assert len(err.splitlines()) == 1 and err.startswith("omt_uv: error: ") and word in err


@posix
def test_as_a_program_a_crash_while_reading_is_one_line(tmp_path):
    """The whole way, with a Blender that ends itself while it reads."""
    code = (
        "import os, sys; import omt_uv.commands.measure as m, omt_uv.cli as c\n"
        "m.run = lambda options: os.abort()\n"
        "sys.argv[1:] = ['measure', 'in.obj']; c.script()"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True,
                          env={**os.environ, "PYTHONPATH": str(ROOT)})  # fmt: skip
    assert done.returncode == 3 and len(done.stderr.splitlines()) == 1, done.stderr


@pytest.mark.parametrize("words", [["--edge", "1e-6"], ["--edge", "1e-300"], ["--vertices", "300000000"]])
def test_impossible_counts_are_refused_before_memory_is_asked_for(run, tmp_path, words):
    (tmp_path / "in.off").write_text("OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n")
    status, _, err = run("remesh", tmp_path / "in.off", "-o", tmp_path / "out.obj", *words)
    assert status == 1 and len(err.splitlines()) == 1 and "memory" in err
    assert not (tmp_path / "out.obj").exists()


# Without variables that have Python write every word at once.
LEAVER = [sys.executable, "-E", "-c", "from omt_uv import supervision; print('figures'); supervision.leave(0)"]
# Files are opened, and everybody prints, as Blender does from C.
PRINTER = """
import os, sys
from omt_uv import supervision
supervision.open_streams()
with open(sys.argv[1], "w") as file:
    for number in (1, 2):
        os.write(number, b"noise")
    print("noise", flush=True)
    print("noise", file=sys.stderr, flush=True)
    assert sys.stdin.read() == ""
    file.write("mesh")
"""


@posix
def test_what_cannot_be_printed_is_no_success(tmp_path):
    if not os.path.exists("/dev/full"):
        pytest.skip("no disk here is full")
    with open("/dev/full", "w") as full:
        done = subprocess.run(LEAVER, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, text=True)
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "No space left" in done.stderr


@posix
def test_a_reader_that_has_gone_is_a_status_of_its_own_without_a_word(package, capfd):
    read, write = os.pipe()
    os.close(read)
    try:
        done = subprocess.run(LEAVER, cwd=ROOT, stdout=write, stderr=subprocess.PIPE, text=True)
    finally:
        os.close(write)
    assert (done.returncode, done.stderr) == (141, "")
    assert supervise(package, "import sys; sys.exit(141)") == 141
    assert capfd.readouterr() == ("", "")


@posix
@pytest.mark.parametrize("closed", ["<&-", ">&-", "2>&-", "<&- >&- 2>&-", ">&- 2>&-"])
def test_what_is_printed_to_a_closed_stream_goes_into_no_file(tmp_path, closed):
    words = [sys.executable, "-c", PRINTER, str(tmp_path / "out")]
    done = subprocess.run(["sh", "-c", f'"$@" {closed}', "sh", *words], cwd=ROOT, stdin=subprocess.DEVNULL)
    assert done.returncode == 0 and (tmp_path / "out").read_text() == "mesh"


@pytest.mark.parametrize("number, defect", [(28, False), (13, False), (30, False), (5, False), (2, True), (20, True)])
def test_what_the_system_refuses_is_no_defect_of_ours_and_a_missing_file_nobody_named_is(
    package, capfd, monkeypatch, number, defect
):
    def fail(_):
        raise OSError(number, os.strerror(number), "/some/where")

    status = package("cli").carry_out(SimpleNamespace(run=fail, input=Path("in.obj")))
    err = capfd.readouterr().err
    assert status == (6 if defect else 1) and err.count("\n") == 1
    assert "/some/where" in err and os.strerror(number) in err and ("defect" in err) == defect


def test_a_child_that_cannot_be_started_is_one_line(package, capfd, monkeypatch):
    def fail(*_, **__):
        raise OSError(11, os.strerror(11))

    monkeypatch.setattr(package("supervision"), "begun", fail)
    assert package("cli").main(["table", "nowhere"]) == 1
    capfd.readouterr()
    assert package("cli").program(["measure", "in.obj"], ["omt_uv", "measure", "in.obj"]) == 1
    err = capfd.readouterr().err
    assert err.startswith("omt_uv: error: in.obj: no child process") and err.count("\n") == 1
