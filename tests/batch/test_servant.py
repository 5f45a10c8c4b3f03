"""Children that serve many files: one start, limits as of one file each, a new one after anything that went wrong."""

from __future__ import annotations

import os
import sys
import threading

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the stand-in obeys by signals of POSIX")
PROGRAM = """
import json, os, pathlib, signal, sys
from omt_uv import supervision
from omt_uv.commands.batches.serve import serve
def carry(words):
    source, output = pathlib.Path(words[1]), pathlib.Path(words[words.index("-o") + 1])
    with open(os.environ["OMT_UV_TEST_LOG"], "a") as log:
        log.write(f"{source.name} {os.getpid()}\\n")
    if "slow" in source.name:
        signal.pause()
    if "crash" in source.name:
        os.kill(os.getpid(), signal.SIGSEGV)
    if "large" in source.name:
        try:
            bytearray(10 ** 10)
        except MemoryError:
            return supervision.MEMORY
    print("printed")
    os.write(2, b"omt_uv: warning: told\\n")
    if "bad" in source.name:
        supervision.tell(f"{source}: face 17 is a line")
        return 1
    output.write_bytes(source.read_bytes()[::-1])
    if "--report" in words:
        pathlib.Path(words[words.index("--report") + 1]).write_text(json.dumps({"faces": 3}))
    return 0
assert sys.argv[1] == "serve"
serve(float(sys.argv[2]), carry)
"""


@pytest.fixture
def shared(package, work):
    (work.root / "program.py").write_text(PROGRAM)
    made = []

    def runner(width):
        def make(plan):
            made.append(package("batch.pool").LocalPool(plan, work.start, width, shared=True))
            return made[-1]

        return make

    yield runner
    for pool in made:
        pool.close()


def served(work):
    """Names of the files that each process has served."""
    by_process = {}
    for line in (work.root / "log.txt").read_text().splitlines():
        name, number = line.split()
        by_process.setdefault(number, []).append(name)
    return list(by_process.values())


def test_one_process_serves_all_files_and_an_error_that_is_told_does_no_harm(go, work, shared):
    work.put("a.obj", "b.obj", "bad.obj", "c.obj")
    result, rows = go(shared(1))
    assert result.counts == {"done": 3, "failed": 1} and len(served(work)) == 1
    assert "face 17 is a line" in rows["bad.obj"]["message"] and '"faces": 3' in rows["a.obj"]["report"]
    assert rows["a.obj"]["warnings"] == '["told"]' and rows["a.obj"]["memory"] > 10**6
    assert (work.root / "out" / "c.obj").read_bytes() == (work.root / "in" / "c.obj").read_bytes()[::-1]


@pytest.mark.parametrize("name, status", [("crash.obj", 3), ("slow.obj", 4), ("large.obj", 5)])
def test_what_crashes_hangs_or_takes_all_memory_takes_no_other_file_along(go, work, shared, name, status):
    work.put("a.obj", "b.obj", name, "z.obj")
    result, rows = go(shared(1), timeout=3.0, memory=2.0)
    assert result.counts == {"done": 3, "failed": 1} and rows[name]["status"] == status
    assert len(served(work)) == 2 and not [names for names in served(work) if names.index(names[-1]) < len(names) - 1]
    assert next(names for names in served(work) if name in names)[-1] == name


def test_limits_of_files_that_ended_in_time_end_with_them(go, work, shared):
    """A limit that is still waited for would end the process while it serves another file."""
    known = set(threading.enumerate())
    work.put("a.obj", "bad.obj", "c.obj")
    assert go(shared(1), timeout=600.0)[0].counts == {"done": 2, "failed": 1}
    limits = [each for each in threading.enumerate() if isinstance(each, threading.Timer) and each not in known]
    for each in limits:
        each.join(5)
    assert not any(each.is_alive() for each in limits)


def test_a_process_serves_no_more_than_so_many_files(package, go, work, shared, monkeypatch):
    monkeypatch.setattr(package("batch.servant"), "MOST_RUNS", 2)
    work.put(*(f"{k}.obj" for k in range(5)))
    assert go(shared(1))[0].counts == {"done": 5}
    assert [len(names) for names in served(work)] == [2, 2, 1]


def test_a_large_file_has_a_process_of_its_own(package, work, monkeypatch):
    module, supervision = package("batch.servant"), package("supervision")
    monkeypatch.setattr(module, "LARGEST", 3)
    work.put("a.obj")
    pool = module.Servants((sys.executable, "-c", "print(17)"), 0.0, lambda _child: None)
    outcome = pool.watch(supervision.Errand(pool.start, str(work.root / "in" / "a.obj")))
    assert outcome.status == 0 and outcome.out == "17\n"


@pytest.mark.parametrize("told", [{"VmHWM": 700, "VmRSS": 30}, {"VmRSS": 30}, {}])
def test_an_answer_has_the_memory_at_most_and_that_which_is_left(package, monkeypatch, tmp_path, told):
    serve = package("commands.batches.serve")
    monkeypatch.setattr(serve, "_memory", lambda: told)
    monkeypatch.setattr(serve, "FORGET", tmp_path / "forget")
    task = {"words": ["a", "b"], "out": str(tmp_path / "out"), "err": str(tmp_path / "err")}
    ran = []
    answer = serve._answered(task, lambda words: ran.append(words) or 7)
    assert ran == [["a", "b"]] and answer["status"] == 7 and answer["processor"] >= 0
    assert (answer["memory"], answer["at_rest"]) == (told.get("VmHWM"), told.get("VmRSS", 0))
    assert (tmp_path / "forget").read_text() == "5"
