"""Batches that are killed at any time, with their workers and schedulers, end complete when they are called again.

OMT_UV_KILLS=20 kills more often than `make test` does.
"""

from __future__ import annotations

import json
import os
import shlex
import signal
import sqlite3
import subprocess
import sys
from collections import Counter
from contextlib import closing, suppress
from threading import Event

import numpy as np
import pytest

KILLS = int(os.environ.get("OMT_UV_KILLS", "2"))
FILES = 30
pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals are those of POSIX")
# A child that takes a while, ends with its parent, says when it begins and ends, and writes a file whole or not at all.
PROGRAM = """
import os, pathlib, random, sys, time
from omt_uv import supervision
from omt_uv.commands.batches.serve import serve
def carry(words):
    source, output = pathlib.Path(words[1]), pathlib.Path(words[words.index("-o") + 1])
    def say(what):
        with open(os.environ["OMT_UV_TEST_LOG"], "a") as log:
            log.write(f"{what} {source.name}\\n")
    say("begin")
    time.sleep(random.random() * 0.3)
    made = output.with_name(f".part{os.getpid()}")
    made.write_bytes(source.read_bytes()[::-1] * 1000)
    os.replace(made, output)
    say("end")
    return 0
if sys.argv[1] == "serve":
    serve(0, carry)
supervision.begin_child(0)
carry(sys.argv[1:])
"""
BATCH = """
import json, sys
from pathlib import Path
from omt_uv.batch.plan import BatchPlan, tasks_of
from omt_uv.batch.engine import carry_out
from omt_uv.batch.manifest import Manifest, only_one
root, start, address = Path(sys.argv[1]), json.loads(sys.argv[2]), sys.argv[3]
plan = BatchPlan("unwrap", (), root / "out", previews=False, reports=False)
path = root / "out.manifest.sqlite"
with only_one(path), Manifest(path) as manifest:
    if address:
        from omt_uv.batch.cluster import Cluster
        runner = Cluster(plan, start, address)
    else:
        from omt_uv.batch.pool import LocalPool
        runner = LocalPool(plan, start, 2, shared=sys.argv[4] == "shared")
    carry_out(plan, tasks_of(plan, root / "in"), manifest, runner)
"""
DASK = "import sys; from distributed.cli.dask_{0} import main; main(sys.argv[1:])"


@pytest.fixture
def work(work, monkeypatch):
    (work.root / "program.py").write_text(PROGRAM)
    monkeypatch.setenv("OMT_UV_PROGRAM", shlex.join(work.start))
    work.put(*(f"m{k}.obj" for k in range(FILES)))
    return work


def start(*words):
    return subprocess.Popen([sys.executable, *map(str, words)], stderr=subprocess.DEVNULL, start_new_session=True)


def batch(work, address="", shared=False):
    return start("-c", BATCH, work.root, json.dumps(work.start), address, "shared" if shared else "apart")


def running(work):
    """Files that the manifest says are in flight; none while there is no manifest.

    It is opened to be written: what was killed within a transaction is rolled back first, as the next batch does.
    """
    path = work.root / "out.manifest.sqlite"
    if not path.exists():
        return set()
    with closing(sqlite3.connect(path, timeout=20)) as base:
        if not base.execute("SELECT COUNT(*) FROM sqlite_master WHERE name = 'runs'").fetchone()[0]:
            return set()
        return {name for (name,) in base.execute("SELECT name FROM runs WHERE state = 'running'")}


def check(work, flights):
    """All is done and whole, the manifest agrees, and nothing was done twice but what was in flight."""
    with closing(sqlite3.connect(work.root / "out.manifest.sqlite")) as base:
        assert base.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert dict(base.execute("SELECT state, COUNT(*) FROM runs GROUP BY state")) == {"done": FILES}
    for k in range(FILES):
        source = (work.root / "in" / f"m{k}.obj").read_bytes()
        assert (work.root / "out" / f"m{k}.obj").read_bytes() == source[::-1] * 1000
    ended = Counter(line.split()[1] for line in work.runs() if line.startswith("end"))
    assert set(ended) == {f"m{k}.obj" for k in range(FILES)}
    assert not {name: n for name, n in ended.items() if n > 1 + flights[name]}


@pytest.mark.parametrize("shared", [False, True], ids=["apart", "shared"])
def test_a_killed_batch_goes_on(work, shared):
    rng, flights = np.random.default_rng(1), Counter()
    for _ in range(KILLS):
        process = batch(work, shared=shared)
        with suppress(subprocess.TimeoutExpired):
            process.wait(0.4 + rng.random())
        process.kill()
        process.wait()
        flights.update(running(work))
    assert batch(work, shared=shared).wait(120) == 0
    check(work, flights)


def test_killed_batches_workers_and_schedulers_go_on(work):
    pytest.importorskip("distributed", reason="the extra omt-uv[farm]")
    rng, flights = np.random.default_rng(2), Counter()
    port = 20000 + os.getpid() % 20000
    address = f"tcp://127.0.0.1:{port}"

    def begin(name):
        if name == "batch":
            return batch(work, address)
        more = (
            ["--host", "127.0.0.1", "--port", port] if name == "scheduler" else [address, "--nthreads", 1, "--no-nanny"]
        )
        return start("-c", DASK.format(name.rstrip("12")), *more, "--no-dashboard")

    names = ("scheduler", "worker1", "worker2", "batch")
    processes = {name: begin(name) for name in names}
    try:
        for k in range(KILLS):
            Event().wait(2.0 + rng.random() * 2)
            victim = names[k % 4] if KILLS > 4 else names[(3, 1)[k % 2]]
            before = running(work)
            processes[victim].send_signal(signal.SIGKILL)
            processes[victim].wait()
            flights.update(before | running(work))
            for name in names:
                # A worker ends with its scheduler, a batch with either an error or what it had to do.
                if name == victim or processes[name].poll() is not None or victim == "scheduler":
                    processes[name].kill()
                    processes[name].wait()
                    processes[name] = begin(name)
        processes["batch"].wait(120)
        processes["batch"] = begin("batch")
        assert processes["batch"].wait(120) == 0
    finally:
        for process in processes.values():
            process.kill()
            process.wait()
    check(work, flights)


@pytest.mark.parametrize("shared", [False, True], ids=["apart", "shared"])
def test_a_killed_batch_leaves_no_folders_after_the_next(work, monkeypatch, shared):
    place = work.root / "temporary"
    place.mkdir()
    monkeypatch.setenv("TMPDIR", str(place))
    process = batch(work, shared=shared)
    for _ in range(2000):
        if len(list(place.iterdir())) > 4:
            break
        Event().wait(0.01)
    process.kill()
    process.wait()
    # Its children take their folders along; those of the batch itself stay.
    assert list(place.glob("omt_uv_*"))
    assert batch(work, shared=shared).wait(120) == 0
    assert not list(place.iterdir())
