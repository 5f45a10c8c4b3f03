"""What servants, pools and clusters decide, as tables: one row for each case, on both sides of each bound.

With children and schedulers that are written in advance: whether a process serves again, who serves which file, what
becomes of a task whose worker is gone, and what is told of that.
"""

from __future__ import annotations

import io
import json
import threading
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from omt_uv.batch import bar, child, cluster, engine, plan, pool, servant
from omt_uv.supervision import FAILURE, GIGABYTE, Errand, Outcome

PLAN = plan.BatchPlan("unwrap", ("--balance", "0.5"), Path("/results/out"))


def task_of(root, name="a.obj", size=100):
    return plan.FileTask(name, Path(root) / name, size, 7, Path(root) / "out" / name)


# ---- servants ----------------------------------------------------------------------------------------------------


class Child:
    """A child with answers that are written: a dict is one, None its end."""

    def __init__(self, answers, code=-9):
        lines = b"".join(b"" if a is None else json.dumps(a).encode() + b"\n" for a in answers)
        self.stdin, self.stdout, self.returncode, self._code = io.BytesIO(), io.BytesIO(lines), None, code
        self.pid, self.killed = 0, 0

    def kill(self):
        self.killed += 1

    def wait(self):
        self.returncode = self._code
        return self._code


def serving(folder, *answers, runs=0):
    found = servant.Servant.__new__(servant.Servant)
    found.child, found.folder, found.start = Child(answers), Path(folder), ("program", "-m")
    found.runs, found.usable, found._stack = runs, True, SimpleNamespace(close=lambda: None)
    return found


ANSWER = {"status": 0, "at_rest": 10**9, "processor": 1.5, "memory": 700}


@pytest.mark.parametrize("answer, runs, usable", [
    (ANSWER, 0, True), ({**ANSWER, "status": FAILURE}, 0, True), ({**ANSWER, "status": FAILURE + 1}, 0, False),
    ({**ANSWER, "status": -11}, 0, False), ({**ANSWER, "at_rest": 10**9 + 1}, 0, False), (ANSWER, 48, True),
    (ANSWER, 49, False),
])  # fmt: skip
def test_a_servant_serves_again_as_long_as_it_ended_well_is_small_and_not_old(tmp_path, answer, runs, usable):
    mine = serving(tmp_path, answer, runs=runs)
    (tmp_path / f"{runs + 1}_stdout").write_text("said")
    for name in servant.STREAMS:
        (tmp_path / f"{runs + 1}_{name}").write_text(f"to {name}")
    outcome = mine.watch(Errand(["program", "-m", "unwrap", "x y.obj"], "x y.obj", timeout=60.0))
    assert mine.usable == usable and mine.runs == runs + 1
    assert (outcome.status, outcome.text, outcome.processor, outcome.memory) == (answer["status"], "", 1.5, 700)
    assert [outcome.out, outcome.err] == [f"to {name}" for name in servant.STREAMS] and outcome.seconds >= 0
    # The words of the program are its own already, and what it wrote does not stay.
    sent = json.loads(mine.child.stdin.getvalue())
    assert sent["words"] == ["unwrap", "x y.obj"]
    assert [sent["out"], sent["err"]] == [str(tmp_path / f"{runs + 1}_{name}") for name in servant.STREAMS]
    assert not any((tmp_path / f"{runs + 1}_{name}").exists() for name in servant.STREAMS)
    assert not mine.child.killed


def test_a_servant_that_is_gone_is_not_asked_again_and_its_last_words_are_kept(tmp_path, monkeypatch):
    ended = []
    monkeypatch.setattr(servant, "end_of", lambda errand, code, late: ended.append((code, late)) or (5, "it crashed"))
    monkeypatch.setattr(servant, "tidy", lambda errand, child: ended.append("tidy"))
    for own in (False, True):
        mine = serving(tmp_path, None)
        (tmp_path / servant.STREAMS[1]).write_text("at the start")
        if own:
            (tmp_path / f"1_{servant.STREAMS[1]}").write_text("in this run")
        outcome = mine.watch(Errand(["program", "-m", "unwrap"], "a.obj"))
        assert not mine.usable and (outcome.status, outcome.text) == (5, "it crashed")
        assert outcome.err == ("in this run" if own else "at the start")
        assert outcome.processor is None and outcome.memory is None
    assert ended == [(-9, False), "tidy", (-9, False), "tidy"]


def test_a_servant_that_takes_too_long_is_ended_as_late(tmp_path, monkeypatch):
    told, gone = [], threading.Event()
    mine = serving(tmp_path, None)
    mine.child.kill = gone.set
    mine._asked = lambda task: None if gone.wait(30) else ANSWER
    monkeypatch.setattr(servant, "end_of", lambda errand, code, late: told.append(late) or (3, "late"))
    monkeypatch.setattr(servant, "tidy", lambda *_: None)
    assert mine.watch(Errand(["program", "-m"], "a.obj", timeout=0.01)).status == 3 and told == [True]


@pytest.mark.parametrize("line", [b"", b'{"status": 0', b'{"status": 0}'])
def test_half_an_answer_is_none(tmp_path, line):
    mine = serving(tmp_path)
    mine.child.stdout = io.BytesIO(line)
    assert mine._asked({}) is None


@pytest.mark.parametrize("size, own", [(servant.LARGEST, False), (servant.LARGEST + 1, True), (None, False)])
def test_a_file_that_is_larger_than_the_bound_has_a_process_of_its_own(size, own, monkeypatch):
    """One that is not there is served, and fails there."""
    begun, made = [], []

    def stat(path):
        if size is None:
            raise FileNotFoundError(path)
        return SimpleNamespace(st_size=size)

    class Serving:
        def __init__(self, start, memory):
            made.append((start, memory))
            self.child, self.usable = "child", True

        def watch(self, errand):
            return "served"

    monkeypatch.setattr(servant, "Path", lambda about: SimpleNamespace(stat=lambda: stat(about)))
    monkeypatch.setattr(servant, "Servant", Serving)
    monkeypatch.setattr(servant, "watch", lambda errand, begin: "alone")
    mine = servant.Servants(("program",), 2.5, begun.append)
    assert mine.watch(Errand(["program"], "a.obj")) == ("alone" if own else "served")
    assert made == ([] if own else [(("program",), 2.5)]) and begun == ([] if own else ["child"])


def test_servants_wait_for_the_next_file_while_they_are_usable(monkeypatch):
    made, closed = [], []

    class Serving:
        def __init__(self, start, memory):
            self.number, self.child, self.usable = len(made), len(made), True
            made.append(self)

        def watch(self, errand):
            self.usable = errand.about != "bad"
            return self.number

        def close(self):
            closed.append(self.number)

    monkeypatch.setattr(servant, "Servant", Serving)
    begun = []
    mine = servant.Servants(("program",), 0.0, begun.append)
    assert [mine.watch(Errand(["program"], about)) for about in ("a", "b", "bad", "c")] == [0, 0, 0, 1]
    # Every child that works is known to who may end it.
    assert begun == [0, 0, 0, 1] and closed == [0]
    mine.close()
    mine.close()
    assert closed == [0, 1]


# ---- clusters ----------------------------------------------------------------------------------------------------


def made(client=None, send=False, root="/"):
    found = cluster.Cluster.__new__(cluster.Cluster)
    found.plan, found.start, found.send, found.client = replace(PLAN, output=Path(root) / "out"), ("omt",), send, client
    found._stopped, found._local, found._ended = False, None, cluster.queue.SimpleQueue()
    return found


class Threads:
    """A client with so many threads."""

    def __init__(self, count):
        self.count = count

    def nthreads(self):
        return {"one": self.count} if self.count < 2 else {"one": 1, "other": self.count - 1}


@pytest.mark.parametrize("threads, most", [(0, 1), (1, 1), (2, 2), (3, 3), (9, 5)])
def test_a_cluster_has_as_many_tasks_as_threads_and_one_if_there_are_none(threads, most):
    mine, begun, released, at_once = made(Threads(threads)), [], [], []

    def submit(task):
        future = SimpleNamespace(key=task.name, release=lambda: released.append(task.name))
        future.add_done_callback = lambda done: begun.append((future, done))
        return future

    def ended():
        # Whatever was handed over first ends first.
        at_once.append(len(begun))
        return begun.pop(0)[0]

    mine._submit, mine._ended = submit, SimpleNamespace(get=ended, put=None)
    mine._record = lambda task, future: f"record of {task.name} {future.key}"
    tasks = [task_of("/", f"{k}.obj") for k in range(5)]
    seen = [(task.name, record) for task, record in mine.run(tasks)]
    names = [t.name for t in tasks]
    assert [name for name, record in seen if record is None] == names and released == names
    assert [r for _, r in seen if r] == [f"record of {n} {n}" for n in names]
    assert max(at_once) == at_once[0] == most and not begun


def test_a_cluster_that_is_stopped_hands_out_nothing_more():
    mine = made(Threads(2))
    mine._submit = lambda task: SimpleNamespace(key=task.name, add_done_callback=lambda done: mine.stop())
    assert [(task.name, record) for task, record in mine.run([task_of("/", "a"), task_of("/", "b")])] == [
        ("a", None), ("b", None),
    ]  # fmt: skip
    assert list(mine.run([task_of("/", "c")])) == []


@pytest.mark.parametrize("send", [False, True])
@pytest.mark.parametrize("status", [0, 1, 3])
def test_what_a_worker_has_done_is_a_record_and_its_files_come_back_where_it_went_well(send, status, tmp_path):
    record = child.Record(
        status, 2.0, 1.0, 5, "message", ["w"], ["omt of the worker"], outputs={"/there/a.obj": ["h", 3]}
    )
    mine = made(send=send, root=tmp_path)
    future = SimpleNamespace(status="finished", result=lambda: (json.dumps(asdict(record)), {"a.obj": b"new"}))
    task = task_of(tmp_path)
    found = mine._record(task, future)
    back = send and status == 0
    outputs = {str(task.output): (plan.hash_of(task.output), 3)} if back else {"/there/a.obj": ["h", 3]}
    # It is told with the words that start it here.
    words = ["omt", *plan.words_of(mine.plan, task, {})]
    assert found == replace(record, outputs=outputs, words=words) and task.output.exists() == back


@pytest.mark.parametrize("status, error, said", [
    ("cancelled", None, "The scheduler has gone away"), ("lost", None, "The scheduler has gone away"),
    ("error", ImportError("no such module"), r"A worker cannot do its work \(ImportError: no such module\)"),
])  # fmt: skip
def test_what_no_retry_mends_ends_the_batch_in_words(status, error, said):
    pytest.importorskip("distributed")
    with pytest.raises(plan.BatchError, match=said):
        made()._record(task_of("/"), SimpleNamespace(status=status, exception=lambda: error))


def test_a_file_that_ended_two_workers_is_set_aside(tmp_path):
    killed = pytest.importorskip("distributed.scheduler").KilledWorker
    task = task_of(tmp_path)
    task.path.write_bytes(b"mesh")
    future = SimpleNamespace(status="error", exception=lambda: killed.__new__(killed))
    found = made()._record(task, future)
    text = f"{task.path}: ended 2 workers and is set aside; --retry tries it again"
    assert found == child.Record(5, 0.0, message=text, aside=True, input_hash=plan.hash_of(task.path))


@pytest.mark.parametrize("address, count", [("local", 7), ("local:3", 3), ("local:x", None), ("local:-1", None)])
def test_a_cluster_of_this_machine_has_so_many_workers(address, count, monkeypatch):
    distributed = pytest.importorskip("distributed")
    given = []
    monkeypatch.setattr(distributed, "LocalCluster", lambda **named: given.append(named) or "cluster")
    monkeypatch.setattr(pool, "cores", lambda: 7)
    if count is None:
        with pytest.raises(plan.BatchError, match=f"{address}: write local:N for N workers"):
            cluster._local_cluster(address)
        return
    assert cluster._local_cluster(address) == "cluster"
    assert given == [{"host": "127.0.0.1", "n_workers": count, "threads_per_worker": 1, "memory_limit": 0,
                      "dashboard_address": "127.0.0.1:0"}]  # fmt: skip


@pytest.mark.parametrize("address", ["local", "local:2", "tcp://10.0.0.1:8786", "localhost:8786", "locals"])
@pytest.mark.parametrize("fails", [None, OSError("refused"), ValueError("no address")])
def test_who_is_asked_for_workers_and_what_is_told_if_nobody_answers(address, fails, monkeypatch):
    distributed = pytest.importorskip("distributed")
    asked, closed = [], []

    def client(address, **named):
        if fails is not None:
            raise fails
        asked.append((address, named))
        return SimpleNamespace(close=lambda timeout: closed.append(f"client {timeout}"))

    own = SimpleNamespace(scheduler_address="tcp://127.0.0.1:1", close=lambda timeout: closed.append(f"own {timeout}"))
    monkeypatch.setattr(distributed, "Client", client)
    monkeypatch.setattr(cluster, "_local_cluster", lambda address: own)
    is_own = address in ("local", "local:2")
    at = "tcp://127.0.0.1:1" if is_own else address
    if fails is not None:
        with pytest.raises(plan.BatchError, match=rf"{at}: no scheduler answers \({fails}\)"):
            cluster.Cluster(PLAN, ["a", "b"], address, True)
        return
    mine = cluster.Cluster(PLAN, ["a", "b"], address, True)
    assert asked == [(at, {"timeout": 20, "set_as_default": False})] and mine.start == ("a", "b") and mine.send
    mine.close()
    assert closed == ["client 5", *(["own 10"] if is_own else [])]


@pytest.mark.parametrize("sent", [False, True])
def test_a_worker_runs_what_it_shares_in_place_and_what_is_sent_apart(sent, tmp_path, monkeypatch):
    seen = []

    def run(inner, task, start, watched):
        seen.append((inner.output, task.path, start, watched is cluster._alone))
        return child.Record(0, 1.0, outputs={})

    monkeypatch.setattr(cluster, "run_task", run)
    task = task_of(tmp_path)
    text = json.dumps({"plan": cluster._plain(PLAN), "task": cluster._plain(task)})
    record, files = cluster.run_remote(text, b"mesh" if sent else None)
    ((output, path, start, alone),) = seen
    assert (path == task.path) != sent and (output == PLAN.output) != sent and start == cluster.started_by() and alone
    assert files == {} and child.Record(**json.loads(record)).status == 0


# ---- pools and engines -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("memory, room, free, limited, expected", [
    (2.0, 0.0, 8e9, True, (2.0, 7.2)), (0.0, 0.0, 8e9, True, (round(7.2e9 / GIGABYTE, 3), 7.2)),
    (0.0, 0.0, 8e9, False, (0.0, 7.2)), (0.0, 3.0, 8e9, True, (3.0, 3.0 * GIGABYTE / 1e9)),
])  # fmt: skip
@pytest.mark.parametrize("width", [0, 3])
def test_a_pool_takes_what_it_is_given_or_what_this_machine_has(
    memory, room, free, limited, expected, width, monkeypatch
):
    monkeypatch.setattr(pool, "free_memory", lambda: free)
    monkeypatch.setattr(pool, "cores", lambda: 5)
    monkeypatch.setattr(pool, "MEMORY_IS_LIMITED", limited)
    mine = pool.LocalPool(replace(PLAN, memory=memory), ("omt",), width, room, shared=True)
    assert mine.width == (width or 5) and mine.room == pytest.approx(expected[1] * 1e9)
    assert mine.plan.memory == pytest.approx(expected[0]) and mine._servants.memory == mine.plan.memory
    assert pool.LocalPool(PLAN, ("omt",), width, 1.0)._servants is None


def test_children_are_ended_that_begin_after_the_stop_and_those_that_are_there():
    mine = pool.LocalPool(PLAN, ("omt",), 1, 1.0)
    first, second, third = (Child([]) for _ in range(3))
    mine._begin(first)
    assert not first.killed
    mine.stop()
    assert first.killed == 1
    mine._begin(second)
    assert second.killed == 1 and list(mine.run([task_of("/")])) == []
    # One that has ended is no more one of them.
    first.returncode = 0
    mine._begin(third)
    assert mine._children == {second, third}


@pytest.mark.parametrize("status", [0, 1])
def test_a_failure_is_kept_beside_the_results_until_the_file_works(status, tmp_path):
    mine, task = replace(PLAN, output=tmp_path / "out"), task_of(tmp_path, "sub/a.obj")
    path = tmp_path / "out.failures" / "sub" / "a.obj.txt"
    path.parent.mkdir(parents=True)
    path.write_text("of last time")
    engine.keep_failure(mine, task, child.Record(status, 1.0, message="no area", words=["omt", "a b.obj"]))
    assert (path.read_text() if path.exists() else None) == ("omt 'a b.obj'\n\nstatus 1\nno area\n" if status else None)


@pytest.mark.parametrize("interrupted", [False, True])
@pytest.mark.parametrize("retry", [False, True])
def test_what_has_ended_is_counted_and_what_was_ended_by_a_signal_is_not(interrupted, retry, tmp_path, monkeypatch):
    tasks, signals, steps, done = [task_of(tmp_path, n, s) for n, s in (("a", 10), ("b", 20), ("c", 30))], [], [], []

    class Kept:
        def describe(self, given):
            done.append("describe")

        def due(self, given, tasks, again):
            assert again == retry
            return tasks[1:]

        def begin(self, task):
            done.append(f"begin {task.name}")

        def end(self, given, task, record):
            done.append(f"end {task.name} {record.status}")

        def counts(self):
            return {"done": 1}

    class Runner:
        def stop(self):
            raise AssertionError

        def run(self, due):
            for k, task in enumerate(due):
                yield task, None
                if k and interrupted:
                    signals.append(15)
                yield task, child.Record(k, 1.0)

    @contextmanager
    def shown(count, work):
        assert (count, work) == (2, 20 + 30 + 2 * bar.BASE_SIZE)
        yield lambda part, failed: steps.append((part - bar.BASE_SIZE, failed))

    @contextmanager
    def ended(stop):
        yield signals

    monkeypatch.setattr(engine, "shown", shown)
    monkeypatch.setattr(engine, "ended_by_signals", ended)
    found = engine.carry_out(replace(PLAN, output=tmp_path / "out"), tasks, Kept(), Runner(), retry)
    assert done == ["describe", "begin b", "end b 0", "begin c", *([] if interrupted else ["end c 1"])]
    assert steps == [(20, False), *([] if interrupted else [(30, True)])]
    assert found == engine.BatchResult({"done": 1}, 1 if interrupted else 2, 15 if interrupted else 0)


@pytest.mark.parametrize("outcome, message", [
    (Outcome(0, "", "", "omt_uv: error: x", 1.0, None, None), ""),
    (Outcome(1, "late", "", "omt_uv: error: x", 1.0, None, None), "late"),
    (Outcome(1, "", "", "omt_uv: error: x\n\romt_uv: error: y\nmore", 1.0, None, None), "y"),
    (Outcome(2, "", "", "usage\nlast words\n\n", 1.0, None, None), "last words"),
    (Outcome(9, "", "", "", 1.0, None, None), "status 9, without a word"),
    (Outcome(1, "x" * (child.LONGEST + 1), "", "", 1.0, None, None), "x" * child.LONGEST),
])  # fmt: skip
def test_a_run_is_recorded_with_what_it_told(outcome, message, tmp_path):
    task = task_of(tmp_path)
    task.path.write_bytes(b"mesh")
    seen = []

    def watched(errand):
        seen.append(errand)
        (Path(errand.words[errand.words.index("--report") + 1])).write_text('{"a": 1}')
        task.output.write_bytes(b"made")
        return outcome

    mine = replace(PLAN, output=tmp_path / "out", timeout=7.0, memory=1.5)
    found = child.run_task(mine, task, ("omt",), watched)
    done = outcome.status == 0
    assert found.message == message and found.report == ('{"a": 1}' if done else "") and found.status == outcome.status
    assert found.outputs == ({str(task.output): (plan.hash_of(task.output), 4)} if done else {})
    assert found.input_hash == plan.hash_of(task.path) and found.words == ["omt", *plan.words_of(mine, task, {})]
    assert (seen[0].timeout, seen[0].memory, seen[0].about) == (7.0, True, str(task.path))
    assert set(seen[0].folders) == {task.output.parent, tmp_path / "out.previews"}


def test_what_is_left_is_as_fast_for_its_size_as_what_is_done():
    now = [100.0]
    found = bar.Progressed(4, 1000.0, lambda: now[0])
    assert found.seconds_left() == 0 and found.left_text() == "0:00:00 left"
    now[0] += 90.0
    found.add(10.0, False)
    assert found.seconds_left() == pytest.approx(90 * 99) and found.left_text() == "2:28:30 left"
    assert found.text() == "1 of 4, 0.7 a minute"
    found.add(490.0, True)
    assert found.seconds_left() == pytest.approx(90) and found.text() == "2 of 4, 1 failed, 1.3 a minute"
    assert bar.work_of(7) == 100_007
