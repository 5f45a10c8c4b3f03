"""A batch on a cluster of dask.distributed: the same results, and workers and schedulers that die."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import threading

import pytest

pytest.importorskip("distributed", reason="the extra omt-uv[farm]")
pytestmark = pytest.mark.skipif(os.name != "posix", reason="the stand-in obeys by signals of POSIX")


@pytest.fixture
def program(work, monkeypatch):
    """Workers start the stand-in instead of the program."""
    monkeypatch.setenv("OMT_UV_PROGRAM", shlex.join(work.start))
    return work


@pytest.fixture
def on_cluster(package, work):
    """Makers of runners; what they have made ends with the test."""
    made = []

    def maker(address="local:2", send=False):
        def runner(plan):
            made.append(package("batch.cluster").Cluster(plan, work.start, address, send))
            return made[-1]

        return runner

    yield maker
    for cluster in made:
        cluster.close()


def results(folder):
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def test_files_that_are_shared_and_files_that_are_sent_give_the_results_of_the_loop(go, program, on_cluster):
    program.put("a.obj", "b c;$(d).obj", "bad.obj", "crash.obj", "sub/e.obj")
    _, loop = go(memory=1.0)
    first = results(program.root / "out")
    for send in (False, True):
        for path in (program.root / "out").rglob("*.obj"):
            path.unlink()
        result, rows = go(on_cluster(send=send), retry=True, memory=1.0)
        assert result.counts == {"done": 3, "failed": 2} and result.ran == 5
        assert results(program.root / "out") == first
        for name, row in rows.items():
            assert (row["message"], row["report"]) == (loop[name]["message"], loop[name]["report"]), name
            assert row["outputs"] == loop[name]["outputs"] and row["words"] == loop[name]["words"]
        assert go(memory=1.0)[0].ran == 0


def test_a_worker_that_dies_costs_a_retry_and_a_file_that_kills_two_is_set_aside(go, program, on_cluster, monkeypatch):
    monkeypatch.setenv("OMT_UV_TEST_WORKERS", "1")
    program.put("killer.obj", *(f"m{k}.obj" for k in range(6)))
    result, rows = go(on_cluster())
    assert result.counts == {"done": 6, "set aside": 1}
    assert "ended 2 workers" in rows["killer.obj"]["message"]
    assert program.runs().count("killer.obj") == 2
    # Others may have been on a worker when it died, and are done again, but none for ever.
    assert all(program.runs().count(f"m{k}.obj") <= 3 for k in range(6))
    assert go(on_cluster())[0].ran == 0


def test_without_a_scheduler_or_dask_the_error_says_what_to_do(package, work, monkeypatch):
    plan = package("batch.plan").BatchPlan("unwrap", (), work.root / "out")
    error, cluster = package("batch.plan").BatchError, package("batch.cluster").Cluster
    with pytest.raises(error, match="write local:N"):
        cluster(plan, work.start, "local:two")
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(error, match=r"pip install 'omt-uv\[farm\]'"):
        cluster(plan, work.start, "local")


def test_our_own_cluster_is_bound_to_this_machine(package, work):
    cluster = package("batch.cluster").Cluster(package("batch.plan").BatchPlan("unwrap", (), work.root), (), "local:1")
    try:
        assert cluster.client.scheduler_info()["address"].startswith("tcp://127.0.0.1:")
        assert all(w.startswith("tcp://127.0.0.1:") for w in cluster.client.scheduler_info()["workers"])
        assert cluster.warnings() == []
    finally:
        cluster.close()


def test_a_scheduler_that_dies_ends_the_batch_and_the_next_one_goes_on(package, go, program, on_cluster):
    program.put("a.obj", "slow.obj")
    words = ["-c", "import sys; from distributed.cli.dask_scheduler import main; main(sys.argv[1:])"]
    options = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(program.root / "s.json")]
    scheduler = subprocess.Popen([sys.executable, *words, *options], stderr=subprocess.DEVNULL)
    words[1] = words[1].replace("scheduler", "worker")
    options = ["--nthreads", "1", "--no-dashboard", "--no-nanny", "--scheduler-file", str(program.root / "s.json")]
    worker = subprocess.Popen([sys.executable, *words, *options, "--death-timeout", "5"], stderr=subprocess.DEVNULL)
    try:
        for _ in range(300):
            if (program.root / "s.json").is_file():
                break
            threading.Event().wait(0.1)
        address = __import__("json").loads((program.root / "s.json").read_text())["address"]

        def kill():
            for _ in range(300):
                if "slow.obj" in program.runs():
                    break
                threading.Event().wait(0.1)
            scheduler.send_signal(signal.SIGKILL)

        threading.Thread(target=kill, daemon=True).start()
        with pytest.raises(package("batch.plan").BatchError, match="scheduler has gone"):
            go(on_cluster(address))
    finally:
        for process in (scheduler, worker):
            process.kill()
            process.wait()
    path = program.root / "program.py"
    path.write_text(path.read_text().replace('if "slow"', 'if "never"'))
    assert go()[0].counts == {"done": 2}
    assert program.runs().count("a.obj") <= 2
