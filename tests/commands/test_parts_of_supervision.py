"""Pieces of supervision by themselves: what a child is told, how its end is read, and what is left of it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace

import pytest

posix = pytest.mark.skipif(os.name != "posix", reason="signals and limits of POSIX")


@pytest.fixture
def supervision(package):
    return package("supervision")


def test_what_runs_alone_has_no_child_and_a_child_runs_itself(package, supervision, monkeypatch):
    cli, ran = package("cli"), []
    monkeypatch.setattr(cli, "carry_out", lambda options: ran.append(options) or 0)
    monkeypatch.setattr(supervision, "supervise", lambda _: pytest.fail("a child of a child"))
    limits = []
    monkeypatch.setattr(supervision, "begin_child", limits.append)
    assert cli.program(["table", "out"], ["python", "-m", "omt_uv", "table", "out"]) == 0
    assert ran[-1].start == ["python", "-m", "omt_uv"] and not limits
    monkeypatch.setenv(supervision.MARK, "folder")
    more = ["--memory", "2"] if supervision.MEMORY_IS_LIMITED else []
    assert cli.program(["measure", "a.obj", *more], ["python", "measure", "a.obj", *more]) == 0
    assert len(ran) == 2 and limits == [2.0 if more else 0.0]


@posix
@pytest.mark.parametrize("returned, late, status, words", [
    (0, False, 0, ""), (1, False, 1, ""), (6, False, 6, ""), (-11, False, 3, "SIGSEGV"), (-9, False, 5, "memory"),
    (77, False, 3, "status 77"), (0, True, 4, "not done within 2.5 s"), (-9, True, 4, "not done within 2.5 s"),
])  # fmt: skip
@pytest.mark.parametrize("memory", [False, True])
def test_how_an_end_is_read(supervision, returned, late, status, words, memory):
    errand = supervision.Errand(["x"], "about", timeout=2.5, memory=memory)
    found, text = supervision.end_of(errand, returned, late)
    assert found == status and words in text and bool(text) == bool(words)
    assert ("lacked the memory" in text) == (memory and status == 3)


@posix
def test_what_a_child_has_used_is_its_own(supervision):
    import resource  # Not on Windows.

    code = "x = bytearray(150 * 10**6); sum(i * i for i in range(10**6))"
    child = subprocess.Popen([sys.executable, "-c", code])
    seconds, memory = supervision._wait(child)
    assert child.returncode == 0 and seconds > 0
    # Between its fork and its own program a child has the memory of whoever began it.
    mine = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    assert 150 * 10**6 < memory < 10**9 + mine
    # Its status was taken by whoever ended it.
    child = subprocess.Popen([sys.executable, "-c", ""])
    child.wait()
    again = SimpleNamespace(pid=child.pid, wait=lambda: 0)
    assert supervision._wait(again) == (None, None)


def test_seconds_are_those_of_the_program_and_of_the_system_for_it(supervision, monkeypatch):
    import os

    usage = SimpleNamespace(ru_utime=1.5, ru_stime=0.25, ru_maxrss=3)
    monkeypatch.setattr(os, "wait4", lambda pid, _: (pid, 3 << 8, usage), raising=False)
    child = SimpleNamespace(pid=7)
    assert supervision._wait(child) == (1.75, 3 if sys.platform == "darwin" else 3 * 1024)
    assert child.returncode == 3


def test_where_the_system_tells_nothing_of_a_child_its_end_is_waited_for(supervision, monkeypatch):
    monkeypatch.delattr(os, "wait4", raising=False)
    waited = []
    assert supervision._wait(SimpleNamespace(wait=lambda: waited.append(1))) == (None, None) and waited == [1]


@posix
def test_signals_end_what_is_going_on_and_handlers_are_what_they_were(supervision):
    before = {number: signal.getsignal(number) for number in supervision.SIGNALS}
    ended = []
    for number in supervision.SIGNALS:
        with supervision.ended_by_signals(lambda: ended.append(1)) as received:
            assert received == []
            os.kill(os.getpid(), number)
            for _ in range(1000):
                if received:
                    break
                threading.Event().wait(0.001)
            assert received == [number]
        assert {n: signal.getsignal(n) for n in supervision.SIGNALS} == before
    assert len(ended) == len(supervision.SIGNALS)


def test_threads_beside_the_first_hear_no_signals(supervision):
    found = []

    def work():
        with supervision.ended_by_signals(lambda: None) as received:
            found.append((received, signal.getsignal(signal.SIGINT)))

    before = signal.getsignal(signal.SIGINT)
    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert found == [([], before)]


def test_what_a_child_has_left_is_removed_by_its_number_alone(supervision, tmp_path):
    for name in (".omt_uv_77_file", ".omt_uv_77_folder", ".omt_uv_777_file", ".omt_uv_7_file", "omt_uv_77_file"):
        (tmp_path / name).mkdir() if "folder" in name else (tmp_path / name).touch()
    (tmp_path / ".omt_uv_77_folder" / "in").touch()
    other = tmp_path / "other"
    other.mkdir()
    (other / "kept").touch()
    (tmp_path / ".omt_uv_77_link").symlink_to(other)
    supervision.tidy(supervision.Errand(["x"], "about", (tmp_path,)), SimpleNamespace(pid=77))
    left = {path.name for path in tmp_path.iterdir()}
    assert left == {".omt_uv_777_file", ".omt_uv_7_file", "omt_uv_77_file", "other"} and (other / "kept").exists()


def test_what_could_not_be_printed_is_told_unless_nobody_reads(supervision, capfd):
    assert supervision.lost(BrokenPipeError()) == supervision.UNREAD == 141
    assert capfd.readouterr().err == ""
    assert supervision.lost(OSError(28, "No space left on device")) == supervision.FAILURE
    assert capfd.readouterr().err == "omt_uv: error: what is printed cannot be written: No space left on device\n"


@pytest.mark.parametrize("text", ["one", "two\nlines", "  many   blanks\t"])
def test_an_error_is_one_line(supervision, capfd, text):
    supervision.tell(text)
    assert capfd.readouterr() == ("", f"omt_uv: error: {' '.join(text.split())}\n")


@posix
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="a limit of memory")
@pytest.mark.parametrize("gigabytes", ["0", "0.5"])
def test_a_child_has_no_more_memory_than_it_may(gigabytes):
    code = (
        "import sys, resource; from omt_uv import supervision; supervision.begin_child(float(sys.argv[1]))\n"
        "print(resource.getrlimit(resource.RLIMIT_DATA)[0])"
    )
    root = Path(__file__).resolve().parents[2]
    with subprocess.Popen(
        [sys.executable, "-c", code, gigabytes], cwd=root, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as child:
        # The child ends with what it is told through its input, which is open until it has told.
        told = child.stdout.readline()
    import resource

    own = resource.getrlimit(resource.RLIMIT_DATA)[0]
    assert int(told) == {"0": own, "0.5": 5 * 10**8}[gigabytes]


@pytest.mark.parametrize("shown", [False, True])
def test_progress_is_shown_on_a_terminal_and_wiped_off(package, monkeypatch, shown):
    common, progress = package("commands.common"), package("solver.progress").Progress
    written, flushed = [], []
    stream = SimpleNamespace(isatty=lambda: shown, write=written.append, flush=lambda: flushed.append(len(written)))
    monkeypatch.setattr(sys, "stderr", stream)

    def steps():
        for k in range(3):
            yield progress("Solving", k / 4)
        return "result"

    assert common.drain_shown(steps()) == "result"
    text = "".join(written)
    assert text == ("\r\033[K  0 % Solving\r\033[K 25 % Solving\r\033[K 50 % Solving\r\033[K" if shown else "")
    # Seen at once: there is no end of a line that would bring it there.
    assert len(flushed) == (3 if shown else 0)

    def fails():
        yield progress("Solving", 0.5)
        raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        common.drain_shown(fails())
    assert "".join(written).endswith("\r\033[K" if shown else "")


def test_a_servant_prints_to_the_files_of_a_task_and_then_where_it_did_before(package, tmp_path, capfd):
    serve = package("commands.batches.serve")
    out, err = tmp_path / "out", tmp_path / "err"
    out.write_text("before ")
    with serve._printing_to(str(out), str(err)):
        os.write(1, b"printed\n")
        os.write(2, b"by C")
    os.write(1, b"after\n")
    assert (out.read_text(), err.read_text()) == ("before printed\n", "by C") and capfd.readouterr() == ("after\n", "")

    def fails(_):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        serve._answered({"out": str(out), "err": str(err), "words": []}, fails)
    os.write(1, b"again\n")
    assert capfd.readouterr().out == "again\n"
    seen = []
    answer = serve._answered({"out": str(out), "err": str(err), "words": ["a"]}, lambda words: seen.append(words) or 4)
    assert answer["status"] == 4 and seen == [["a"]] and answer["processor"] >= 0
    if serve.STATUS.is_file():
        assert answer["memory"] >= answer["at_rest"] > 10**6


def test_what_python_still_holds_goes_where_it_was_printed_to(tmp_path):
    """Streams that are no terminals keep what is printed for a while."""
    lines = [
        "import sys",
        "from omt_uv.commands.batches.serve import _printing_to",
        "print('before', end=' ')",
        "with _printing_to(*sys.argv[1:]):",
        "    print('out of the task')",
        "    print('error of the task', file=sys.stderr)",
        "print('after')",
    ]
    files = tmp_path / "out", tmp_path / "err"
    words = [sys.executable, "-c", "\n".join(lines), *map(str, files)]
    held = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    done = subprocess.run(words, env=held, capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("before after\n", "")
    assert [path.read_text() for path in files] == ["out of the task\n", "error of the task\n"]


@pytest.mark.parametrize("cuts", [(), (7,), (3, 4, 40), tuple(range(1, 90, 5))], ids=str)
def test_a_servant_answers_every_line_however_they_come(package, tmp_path, monkeypatch, cuts):
    """Several at once, and one in parts."""
    serve = package("commands.batches.serve")
    lines = b"".join(json.dumps({"words": [str(k)]}).encode() + b"\n" for k in range(6))
    done, answers, ends = [], [], (0, *cuts, len(lines))

    def begin(gigabytes, hear):
        assert gigabytes == 1.5
        for a, b in pairwise(ends):
            hear(lines[a:b])
        # What ends the process in truth.
        hear(None)

    monkeypatch.setattr(serve, "begin_child", begin)
    monkeypatch.setattr(serve, "_answered", lambda task, carry: done.append(carry(task["words"])) or {"status": 0})
    monkeypatch.setattr(serve.os, "write", lambda number, text: answers.append(json.loads(text)))
    with pytest.raises(TypeError):
        serve.serve(1.5, lambda words: int(words[0]))
    assert done == list(range(6)) and answers == [{"status": 0}] * 6


@pytest.mark.parametrize("text, expected", [
    ("Name:\tpython\nVmHWM:\t  12 kB\nVmRSS:\t 7 kB\nThreads:\t3\n", {"VmHWM": 12288, "VmRSS": 7168}), (None, {}),
])  # fmt: skip
def test_memory_is_what_the_system_says(package, monkeypatch, tmp_path, text, expected):
    serve = package("commands.batches.serve")
    monkeypatch.setattr(serve, "STATUS", tmp_path / "status")
    if text is not None:
        (tmp_path / "status").write_text(text)
    assert serve._memory() == expected


@pytest.mark.parametrize(
    "words, program", [(["blender", "-b", "--command", "omt_uv", "unwrap"], True), (["blender"], False)]
)
def test_a_second_blender_gets_the_words_that_started_this_one(words, program, package, monkeypatch):
    import bpy

    asked, cli = [], package("cli")
    monkeypatch.setattr(cli, "main", lambda given: asked.append(given) or 3)
    monkeypatch.setattr(cli, "program", lambda given, start: asked.append((given, start)) or 4)
    monkeypatch.setattr("sys.argv", words)
    assert package("registration")._command(["unwrap"]) == (4 if program else 3)
    assert asked == [(["unwrap"], [bpy.app.binary_path, *words[1:]]) if program else ["unwrap"]]


@pytest.mark.parametrize("memory", [None, "2"])
def test_what_is_told_of_an_end_knows_whether_memory_was_limited(package, supervision, monkeypatch, memory):
    """Without a limit a process that the system ends has not gone beyond it."""
    cli, errands = package("cli"), []
    monkeypatch.setattr(supervision, "supervise", lambda errand: errands.append(errand) or 0)
    if memory and not supervision.MEMORY_IS_LIMITED:
        pytest.skip("no limits here")
    words = ["measure", "a.obj", *(["--memory", memory] if memory else [])]
    assert cli.program(words, ["python", *words]) == 0
    assert [(errand.about, errand.memory) for errand in errands] == [("a.obj", memory == "2")]
