"""Pieces of a batch by themselves: what is sent where, what is told of a cluster, how much may run at once."""

from __future__ import annotations

import json
import os
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from omt_uv.batch import child, cluster, manifest, plan, pool, servant
from omt_uv.supervision import GIGABYTE, Outcome

PLAN = plan.BatchPlan("unwrap", ("--balance", "0.5"), Path("/results/out"), timeout=7.0, memory=2.0)


def task_of(root, name="sub/a b.obj", size=100, changed=7):
    return plan.FileTask(name, root / "in" / name, size, changed, root / "out" / name)


def test_a_plan_and_a_task_come_back_from_json_as_they_were(tmp_path):
    for each in (PLAN, replace(PLAN, writes=False, reports=False, previews=False, suffix=".ply")):
        assert cluster._plan_of(json.loads(json.dumps(cluster._plain(each)))) == each
    for each in (task_of(tmp_path), replace(task_of(tmp_path), output=None)):
        assert cluster._task_of(json.loads(json.dumps(cluster._plain(each)))) == each


@pytest.mark.parametrize("field, value, stale", [
    ("command", "refine", True), ("options", ("--balance", "1"), True), ("suffix", ".ply", True),
    ("previews", False, True), ("version", "2", True), ("timeout", 9.0, False), ("memory", 1.0, False),
    ("output", Path("/other"), False), ("reports", False, False),
])  # fmt: skip
def test_what_makes_runs_stale(field, value, stale):
    assert (replace(PLAN, **{field: value}).key() != PLAN.key()) == stale


class Client:
    """A cluster's client, as far as it is asked."""

    def __init__(self, address="tcp://127.0.0.1:8786", threads=2, allowed=cluster.DEATHS):
        self.address, self.threads, self.allowed, self.sent = address, threads, allowed, []

    def scheduler_info(self):
        return {"address": self.address}

    def nthreads(self):
        return {f"worker {k}": 1 for k in range(self.threads)}

    def run_on_scheduler(self, function):
        return function(SimpleNamespace(allowed_failures=str(self.allowed)))

    def submit(self, function, *given, **named):
        self.sent.append((function, given, named))
        return SimpleNamespace(key=named["key"], add_done_callback=lambda _: None)


def made(client, send=False):
    found = cluster.Cluster.__new__(cluster.Cluster)
    found.plan, found.start, found.send, found.client, found._stopped = PLAN, ("program",), send, client, False
    return found


@pytest.mark.parametrize("address, open_to_others", [
    ("tcp://127.0.0.1:8786", False), ("tls://10.0.0.1:8786", False), ("tcp://10.0.0.1:8786", True),
])  # fmt: skip
@pytest.mark.parametrize("threads", [0, 3])
@pytest.mark.parametrize("allowed", [cluster.DEATHS, cluster.DEATHS + 2])
def test_what_is_told_of_a_cluster(address, open_to_others, threads, allowed):
    told = made(Client(address, threads, allowed)).warnings()
    assert sum("nor encrypted" in text for text in told) == open_to_others
    assert sum("no workers yet" in text for text in told) == (threads == 0)
    assert sum(f"end {allowed + 1} workers" in text for text in told) == (allowed != cluster.DEATHS)
    assert len(told) == open_to_others + (threads == 0) + (allowed != cluster.DEATHS)
    assert all(address in text for text in told)


@pytest.mark.parametrize("send", [False, True])
def test_what_is_handed_to_a_cluster(tmp_path, send):
    task, client = task_of(tmp_path), Client()
    mine = made(client, send)
    task.path.parent.mkdir(parents=True)
    task.path.write_bytes(b"mesh")
    mine._submit(task)
    task.path.unlink()
    mine._submit(task)
    (function, (text, data), named), (_, (_, gone), _) = client.sent
    assert function is cluster.run_remote and named["pure"] is False and task.name in named["key"]
    given = json.loads(text)
    assert cluster._plan_of(given["plan"]) == PLAN and cluster._task_of(given["task"]) == task
    # A file that has gone meanwhile is as an empty one: the run says what is wrong with it.
    assert (data, gone) == ((b"mesh", b"") if send else (None, None))


@pytest.mark.parametrize("kept", ["", "preview"])
def test_files_that_come_back_are_written_where_they_belong(tmp_path, kept):
    mine = made(Client(), True)
    mine.plan = replace(PLAN, output=tmp_path / "out")
    task = task_of(tmp_path)
    files = {"a b.obj": b"new", "a b.mtl": b"material", **({"preview": b"\x89PNG"} if kept else {})}
    record = mine._received(task, child.Record(status=0, seconds=1.0), files)
    for name in ("a b.obj", "a b.mtl"):
        path = tmp_path / "out" / "sub" / name
        assert path.read_bytes() == files[name] and record.outputs[str(path)] == (plan.hash_of(path), len(files[name]))
    assert len(record.outputs) == 2
    picture = tmp_path / "out.previews" / "sub" / "a b.obj.png"
    assert record.preview == (str(picture) if kept else "") and picture.is_file() == bool(kept)
    assert not list(tmp_path.rglob(".omt_uv_*"))


def test_a_worker_sends_back_what_belongs_to_a_result(tmp_path, monkeypatch):
    monkeypatch.setenv("OMT_UV_PROGRAM", "the 'pro gram' -x")
    assert cluster.started_by() == ("the", "pro gram", "-x")
    seen = {}

    def run_task(inner, task, start, watched):
        seen.update(plan=inner, task=task, start=start, data=task.path.read_bytes(), before=str(task.path))
        task.output.parent.mkdir(exist_ok=True)
        for name in ("a b.obj", "a b.mtl", "a b.txt"):
            (task.output.parent / name).write_bytes(name.encode())
        picture = task.output.parent / "p.png"
        picture.write_bytes(b"picture")
        outputs = {str(task.output): ("hash", 3)}
        return child.Record(0, 1.0, message=f"{task.path}: told", outputs=outputs, preview=str(picture))

    monkeypatch.setattr(cluster, "run_task", run_task)
    task = task_of(tmp_path)
    text, files = cluster.run_remote(json.dumps({"plan": cluster._plain(PLAN), "task": cluster._plain(task)}), b"data")
    assert seen["data"] == b"data" and seen["start"] == cluster.started_by() and seen["plan"].options == PLAN.options
    assert Path(seen["before"]).name == task.path.name and not Path(seen["before"]).exists()
    assert files == {"a b.obj": b"a b.obj", "a b.mtl": b"a b.mtl", "preview": b"picture"}
    record = child.Record(**json.loads(text))
    # Places on the worker mean nothing here.
    assert record.message == f"{task.path}: told" and record.outputs == {} and record.preview == ""


@pytest.mark.parametrize("memory", [0.0, 2.0])
@pytest.mark.parametrize("size", [0, 10**5, 10**12])
def test_what_a_run_is_expected_to_take_is_no_more_than_it_may(memory, size):
    mine = pool.LocalPool(replace(PLAN, memory=memory), ("program",), 2, 5.0)
    expected = mine.expected(task_of(Path("/"), size=size))
    assert expected == min(pool.BASE_MEMORY + pool.MEMORY_PER_BYTE * size, (memory or 5.0) * GIGABYTE)
    assert mine.plan.memory == pytest.approx(memory or 5.0)


def test_the_largest_file_that_fits_beside_the_others_is_next():
    mine = pool.LocalPool(replace(PLAN, memory=100.0), ("program",), 3, 3.0)
    tasks = [task_of(Path("/"), str(size), size) for size in (10**8, 5 * 10**7, 10**7, 10**6)]
    need = [mine.expected(task) for task in tasks]
    # One that fits nowhere runs alone.
    waiting = list(tasks)
    assert mine._next(waiting, {}) is tasks[0] and waiting == tasks[1:]
    free = 3 * GIGABYTE
    for taken in (0.0, free - need[1], free - need[1] + 1, free - need[2], free - need[3], free - need[3] + 1):
        waiting = tasks[1:]
        fits = [task for task, bytes_ in zip(tasks[1:], need[1:], strict=True) if bytes_ <= free - taken]
        assert mine._next(waiting, {"other": taken}) is (fits[0] if fits else None)
        assert len(waiting) == 3 - bool(fits)
    assert mine._next(list(tasks), dict.fromkeys("abc", 0.0)) is None


@pytest.mark.parametrize("said", ["MemAvailable:    1000 kB\n", "MemTotal:  5 kB\n", None])
@pytest.mark.parametrize("group", [None, ("max", "1"), ("800000", "300000"), ("9000000000000000", "0")])
def test_memory_that_is_free_is_that_of_the_machine_or_of_its_group(monkeypatch, said, group):
    real = Path.read_text

    def read_text(path, *given, **named):
        text = {"/proc/meminfo": said, "/sys/fs/cgroup/memory.max": group and group[0],
                "/sys/fs/cgroup/memory.current": group and group[1]}.get(str(path), "")  # fmt: skip
        if text == "":
            return real(path, *given, **named)
        if text is None:
            raise FileNotFoundError(path)
        return text

    monkeypatch.setattr(Path, "read_text", read_text)
    whole = float(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    machine = 1000 * 1024.0 if said and "Available" in said else whole
    most = float(group[0]) - float(group[1]) if group and group[0] != "max" else machine
    assert pool.free_memory() == min(machine, most)
    monkeypatch.delattr(os, "sysconf")
    if machine == whole:
        with pytest.raises(plan.BatchError, match="--total-memory"):
            pool.free_memory()


def test_cores_are_those_that_this_process_may_use(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 3, 5}, raising=False)
    assert pool.cores() == 3
    monkeypatch.delattr(os, "sched_getaffinity")
    for count in (7, None):
        monkeypatch.setattr(os, "cpu_count", lambda count=count: count)
        assert pool.cores() == (count or 1)


def test_a_run_that_cannot_begin_is_one_that_failed(monkeypatch, tmp_path):
    mine, task = pool.LocalPool(PLAN, ("program",), 1, 1.0), task_of(tmp_path)

    def fails(*_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(pool, "run_task", fails)
    mine._work(task)
    found, record = mine._ended.get()
    assert found is task and record.status == 1 and record.message.startswith(f"{task.path}: ")
    assert "Permission denied" in record.message
    # One that begins while all is ended is ended, too.
    killed = []

    class Process:
        returncode = None

        def kill(self):
            killed.append(self)

    one, other = Process(), Process()
    mine._begin(one)
    assert not killed and mine._children == {one}
    mine._stopped, one.returncode = True, 0
    mine._begin(other)
    assert killed == [other] and mine._children == {other}


@pytest.mark.parametrize("status", [0, 1, 3])
def test_a_run_that_is_done_leaves_results_and_one_that_is_not_a_message(tmp_path, status):
    task = task_of(tmp_path)
    task = replace(task, output=tmp_path / "out" / "a b.obj")
    task.path.parent.mkdir(parents=True, exist_ok=True)
    task.path.write_bytes(b"mesh")

    def watched(errand):
        words = list(errand.words)
        for option, text in (("--report", "{}"), ("--preview", "png"), ("-o", "result")):
            Path(words[words.index(option) + 1]).write_text(text)
        said = "omt_uv: warning: rounded\n" + ("omt_uv: error: cut off\n" if status else "")
        return Outcome(status, "", "", said, 1.5, 1.0, 10)

    made = child.run_task(replace(PLAN, output=tmp_path / "out"), task, ("program",), watched)
    assert made.status == status and made.warnings == ["rounded"] and (made.seconds, made.memory) == (1.5, 10)
    assert made.message == ("cut off" if status else "")
    found = (made.report, list(made.outputs), bool(made.preview))
    assert found == (("", [], False) if status else ("{}", [str(task.output)], True))
    assert made.input_hash == plan.hash_of(task.path) and str(task.path) in " ".join(made.words)


@pytest.mark.parametrize("err, text, expected", [
    ("", "", "status 3, without a word"),
    ("one\n\ntwo\n  \n", "", "two"),
    ("omt_uv: error: a\nomt_uv: error: b\nlater\n", "", "b"),
    ("omt_uv: error: a\n", "not done within 3 s", "not done within 3 s"),
    ("x" * 5000, "", "x" * child.LONGEST),
])  # fmt: skip
def test_the_message_of_a_failure_is_what_tells_most(err, text, expected):
    assert child.message_of(Outcome(3, text, "", err, 1.0, None, None)) == expected


def test_every_level_of_detail_that_was_written_is_one_of_the_outputs(tmp_path):
    task = task_of(tmp_path, "a.obj")
    assert child.outputs_of(replace(task, output=None)) == {} == child.outputs_of(task)
    task.output.parent.mkdir()
    names = ["a.obj", "a_LOD0.obj", "a_LOD1.obj", "a_LOD3.obj", "a_LOD0.ply", "b.obj"]
    for name in names:
        (task.output.parent / name).write_bytes(name.encode() * 3)
    found = child.outputs_of(task)
    assert {Path(path).name for path in found} == {"a.obj"}
    # Without one of its own name, those that follow one another.
    task.output.unlink()
    found = child.outputs_of(task)
    assert {Path(path).name for path in found} == {"a_LOD0.obj", "a_LOD1.obj"}
    for path, (name_hash, size) in found.items():
        assert size == os.path.getsize(path) and name_hash == plan.hash_of(Path(path)) != ""
    assert plan.hash_of(tmp_path / "none") == "" == plan.hash_of(tmp_path)


def test_manifests_are_read_as_one_and_what_is_none_is_refused(tmp_path):
    with pytest.raises(plan.BatchError, match=r"there is no such manifest"):
        manifest.rows_of([tmp_path / "none.sqlite"])
    path = tmp_path / "m.sqlite"
    with manifest.Manifest(path) as mine:
        assert len(mine.due(PLAN, [task_of(tmp_path, name) for name in ("b", "a", "c")], False)) == 3
    assert [row["name"] for row in manifest.rows_of([path])] == ["a", "b", "c"]
    with manifest.Manifest(path) as mine:
        mine._ask(f"PRAGMA user_version = {manifest.EDITION + 1}")
    with pytest.raises(
        plan.BatchError, match=f"edition {manifest.EDITION + 1}, and this program knows {manifest.EDITION}"
    ):
        manifest.Manifest(path)


def test_parts_of_a_batch_are_shared_out_whole():
    names = [f"folder/{k} file.obj" for k in range(200)]
    for count in (1, 2, 3, 7):
        parts = Counter(plan._part_of(name, count) for name in names)
        assert set(parts) == set(range(1, count + 1)) and sum(parts.values()) == len(names)
        assert min(parts.values()) > 0.4 * len(names) / count


def test_a_child_that_is_gone_answers_nothing(tmp_path):
    mine = servant.Servant.__new__(servant.Servant)

    def gone(*_):
        raise BrokenPipeError

    reads = iter([b'{"status": 0}\n', b'{"status":', b""])
    pipe = SimpleNamespace(write=lambda _: None, flush=lambda: None)
    mine.child = SimpleNamespace(stdin=pipe, stdout=SimpleNamespace(readline=lambda: next(reads)))
    assert [mine._asked({}) for _ in range(3)] == [{"status": 0}, None, None]
    pipe.write = gone
    assert mine._asked({}) is None
    assert servant._text(tmp_path / "none") == "" == servant._text(tmp_path)


def test_a_record_travels_as_json():
    record = child.Record(1, 2.0, 3.0, 4, "m", ["w"], ["a", "b"], "{}", {"p": ("h", 5)}, "q", "i", "host", True)
    back = child.Record(**json.loads(json.dumps(asdict(record))))
    assert replace(back, outputs={k: tuple(v) for k, v in back.outputs.items()}) == record


def test_what_is_due_is_what_is_new_changed_failed_or_was_never_ended(tmp_path):
    """Every state of a row, with the file as it was, touched, changed, and with results gone."""
    plan_, tasks = replace(PLAN, output=tmp_path / "out"), []
    for name in ("done", "failed", "aside", "running", "waiting"):
        task = task_of(tmp_path, name)
        task.path.parent.mkdir(exist_ok=True)
        task.output.parent.mkdir(exist_ok=True)
        task.path.write_bytes(name.encode())
        task.output.write_bytes(b"result")
        tasks.append(replace(task, size=len(name), changed=1))

    def due(retry=False, tasks=tasks, plan_=plan_):
        with manifest.Manifest(tmp_path / "m.sqlite") as mine:
            before = mine.rows()
            found = [task.name for task in mine.due(plan_, tasks, retry)]
            # Rows are put back as they were: what is due is asked, and not done.
            mine._ask("DELETE FROM runs")
            for row in before:
                marks = ", ".join("?" * len(row))
                mine._ask(f"INSERT INTO runs ({', '.join(row)}) VALUES ({marks})", tuple(row.values()))
        return found

    with manifest.Manifest(tmp_path / "m.sqlite") as mine:
        mine.due(plan_, tasks, False)
        for task in tasks[:4]:
            mine.begin(task)
        for task, status, aside in zip(tasks[:3], (0, 1, 5), (False, False, True), strict=True):
            outputs = {str(task.output): (plan.hash_of(task.output), 6)} if status == 0 else {}
            mine.end(
                plan_, task, child.Record(status, 1.0, outputs=outputs, input_hash=plan.hash_of(task.path), aside=aside)
            )
        assert mine.counts() == {"done": 1, "failed": 1, "set aside": 1, "running": 1, "waiting": 1}
        assert {row["name"]: row["tries"] for row in mine.rows()} == {
            "done": 1, "failed": 1, "aside": 1, "running": 1, "waiting": 0}  # fmt: skip
    assert due() == ["running", "waiting"] and due(retry=True) == ["failed", "aside", "running", "waiting"]
    # A time alone is none; other bytes are, also as many.
    touched = [replace(task, changed=2) for task in tasks]
    assert due(tasks=touched) == ["running", "waiting"]
    tasks[0].path.write_bytes(b"DONE")
    assert due(tasks=touched) == ["done", "running", "waiting"] and due() == ["running", "waiting"]
    tasks[0].path.write_bytes(b"done")
    assert due(tasks=[replace(task, size=task.size + 1) for task in tasks]) == [task.name for task in tasks]
    assert due(plan_=replace(plan_, version="2")) == [task.name for task in tasks]
    tasks[0].output.write_bytes(b"result of another size")
    assert due() == ["done", "running", "waiting"]
    tasks[0].output.unlink()
    assert due() == ["done", "running", "waiting"]
    with manifest.Manifest(tmp_path / "m.sqlite") as mine:
        mine.due(plan_, tasks[3:], False)
        assert [row["name"] for row in mine.rows()] == ["running", "waiting"]


def test_growth_is_that_of_the_larger_half_of_what_is_known():
    from omt_uv.batch import figures, statistics

    pairs = [(x, 3 * x**1.5) for x in (1.0, 2, 4, 8, 16, 32, 64, 128)]
    # What every run takes counts less in the larger half.
    slow = [(x, y + (100 if x < 16 else 0)) for x, y in pairs]
    for given in (pairs, slow, [*pairs, (0.0, 5.0), (5.0, 0.0), (-1.0, 2.0)], pairs[::-1]):
        assert statistics.growth_of(given) == pytest.approx(1.5)
    few = pairs[: statistics.LEAST - 1]
    for given in (few, [*few, (0.0, 5.0), (5.0, 0.0)]):
        assert statistics.growth_of(given) is None
    assert statistics.growth_of([(7.0, y) for _, y in pairs]) is None
    rows = [{"a": 1, "b": None}, {"a": 2.5}, {"a": "x", "b": 3}]
    assert statistics._column(rows, "a") == [1.0, 2.5, None] and statistics._column(rows, "b") == [None, None, 3.0]
    row = dict.fromkeys(figures.OWN, 1) | {"warnings": None, "report": None}
    assert figures.flat_row(row)["warnings"] == 0
    assert figures.flat_row(row | {"warnings": '["a", "b"]', "report": '{"faces": 3}'})["faces"] == 3
    assert figures.figures_of("[]") == {} == figures.figures_of("no JSON")


@pytest.mark.parametrize("name, suffix, expected", [
    ("a.obj", "", "a.obj"), ("a.OFF", "", "a.ply"), ("b/a.obj", ".ply", "b/a.ply"), ("a.off", ".obj", "a.obj"),
])  # fmt: skip
def test_a_result_has_the_name_of_its_file_and_the_format_that_can_be_written(tmp_path, name, suffix, expected):
    asked = replace(PLAN, suffix=suffix, output=tmp_path / "out")
    task = plan._task(asked, name, tmp_path / name)
    assert task.output == tmp_path / "out" / expected and (task.size, task.changed) == (0, 0)
    assert plan._task(replace(asked, writes=False), name, tmp_path / name).output is None
    plan._check_outputs([task, replace(task, output=None)])
    other = replace(task, name="other")
    with pytest.raises(plan.BatchError, match="would both become"):
        plan._check_outputs([task, other])
    with pytest.raises(plan.BatchError, match="would replace it"):
        plan._check_outputs([replace(task, path=task.output)])


def test_results_that_go_below_the_folder_of_the_files_are_no_files_of_it(tmp_path):
    for name in ("a.obj", "out/b.obj", "sub/c.obj", ".hidden/d.obj", "sub/.e.obj", "f.txt", "sub/out/g.obj"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"x")
    found = plan._of_folder(tmp_path, tmp_path / "out")
    assert [name for name, _ in found] == ["a.obj", "sub/c.obj", "sub/out/g.obj"]


@pytest.mark.parametrize("parts", [("abcdef",), ("af", "bcde"), ("f", "e", "dcba"), ("bd", "", "fae", "c")], ids=str)
def test_rows_of_all_parts_are_those_of_the_whole_in_the_order_of_names(tmp_path, parts):
    """Whichever part is read first, and however its files came."""
    paths = []
    for k, names in enumerate(parts):
        paths.append(tmp_path / f"out.part{k + 1}of{len(parts)}{plan.MANIFEST}")
        with manifest.Manifest(paths[-1]) as mine:
            tasks = [plan.FileTask(name, tmp_path / name, ord(name), 1, None) for name in names]
            mine.due(PLAN, tasks, False)
            for task in tasks:
                mine.begin(task)
                mine.end(PLAN, task, child.Record(ord(task.name) % 2, 1.0))
    for order in (paths, paths[::-1]):
        rows = manifest.rows_of(order)
        assert [(row["name"], row["size"]) for row in rows] == [(name, ord(name)) for name in "abcdef"]
        assert [row["state"] for row in rows] == ["failed", "done"] * 3
    assert sorted(manifest.found_beside(tmp_path / "out")) == sorted(paths)
