"""A batch on one machine: all files are done or named, and only what changed is done again."""

from __future__ import annotations

import json
import os
import sqlite3
import threading
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name != "posix", reason="the stand-in obeys by signals of POSIX")


def test_all_files_are_done_or_named_and_outputs_are_whole(go, work):
    work.put("a.obj", "b.obj", "bad.obj", "crash.obj", "sub/c.obj")
    result, rows = go()
    assert result.counts == {"done": 3, "failed": 2} and result.ran == 5
    assert [rows[name]["status"] for name in ("a.obj", "bad.obj", "crash.obj")] == [0, 1, 3]
    assert "face 17 is a line" in rows["bad.obj"]["message"] and "SIGSEGV" in rows["crash.obj"]["message"]
    for name in ("a.obj", "b.obj", "sub/c.obj"):
        assert (work.root / "out" / name).read_bytes() == (work.root / "in" / name).read_bytes()[::-1]
        assert json.loads(rows[name]["warnings"]) == ["told"]
        assert rows[name]["memory"] > 10**6 and rows[name]["processor"] > 0
    kept = {p.relative_to(work.root / "out.failures").as_posix() for p in (work.root / "out.failures").rglob("*.txt")}
    assert kept == {"bad.obj.txt", "crash.obj.txt"}
    text = (work.root / "out.failures" / "bad.obj.txt").read_text()
    assert str(work.root / "in" / "bad.obj") in text and "face 17" in text


def test_what_is_done_is_not_done_again_and_what_changed_is(go, work):
    work.put("a.obj", "b.obj", "c.obj", "bad.obj")
    go()
    assert go()[0].ran == 0
    # A new time of change alone is none, and neither are limits.
    (work.root / "in" / "a.obj").touch()
    assert go(timeout=50.0)[0].ran == 0
    work.put("a.obj", text=b"other")
    (work.root / "out" / "b.obj").unlink()
    assert go()[0].ran == 2
    assert work.runs() == ["a.obj", "a.obj", "b.obj", "b.obj", "bad.obj", "c.obj"]
    assert go(retry=True)[0].ran == 1
    result, rows = go(options=["--balance", "1"])
    assert result.ran == 4 and rows["a.obj"]["tries"] == 3
    assert go(version="2", options=["--balance", "1"])[0].ran == 4


def test_a_failure_that_is_mended_is_forgotten_and_files_that_are_gone_have_no_row(go, work):
    work.put("a.obj", "bad.obj")
    go()
    (work.root / "program.py").write_text((work.root / "program.py").read_text().replace('"bad" in', '"worse" in'))
    assert go(retry=True)[0].counts == {"done": 2}
    assert not list((work.root / "out.failures").rglob("*.txt"))
    (work.root / "in" / "a.obj").unlink()
    assert set(go()[1]) == {"bad.obj"}


def test_a_run_that_takes_too_long_is_ended_and_named(go, work):
    work.put("a.obj", "slow.obj")
    _, rows = go(timeout=2.0)
    assert rows["slow.obj"]["status"] == 4 and "not done within 2 s" in rows["slow.obj"]["message"]
    assert rows["a.obj"]["state"] == "done"


def test_a_stop_leaves_what_is_in_flight_due(package, go, work):
    """The pool is stopped while one run is going on: nothing is called a failure, and the next batch goes on."""
    work.put("a.obj", "slow.obj")
    pools = []

    def runner(plan):
        pools.append(package("batch.pool").LocalPool(plan, work.start, 1))
        threading.Timer(1.0, pools[0].stop).start()
        return pools[0]

    _, rows = go(runner)
    assert rows["slow.obj"]["state"] == "running" and rows["slow.obj"]["status"] is None
    (work.root / "program.py").write_text((work.root / "program.py").read_text().replace('if "slow"', 'if "never"'))
    assert go()[0].counts == {"done": 2}
    assert work.runs().count("slow.obj") <= 2 and work.runs().count("a.obj") == 1


def test_two_batches_on_one_manifest_are_one_too_many(package, go, work):
    module = package("batch.manifest")
    work.put("a.obj")
    with (
        module.only_one(work.root / "out.manifest.sqlite"),
        pytest.raises(package("batch.plan").BatchError, match="another batch"),
    ):
        go()
    assert go()[0].counts == {"done": 1}


def test_a_file_that_is_no_manifest_is_refused(package, tmp_path):
    (tmp_path / "x.manifest.sqlite").write_text("no data base, however long it may be " * 40)
    with pytest.raises(package("batch.plan").BatchError, match="cannot be used"):
        package("batch.manifest").Manifest(tmp_path / "x.manifest.sqlite")


def test_a_pool_is_as_wide_as_memory_allows(package, work):
    plans, pool = package("batch.plan"), package("batch.pool")
    plan = plans.BatchPlan("unwrap", (), work.root / "out", memory=1.0)
    made = pool.LocalPool(plan, work.start, 8, room=1.5)
    tasks = [plans.FileTask(f"{k}", work.root, size, 0, None) for k, size in enumerate((10**8, 10**6, 10**5))]
    assert made.expected(tasks[0]) == 10**9
    running = {}
    waiting = list(tasks)
    for k, name in enumerate(["0", "1", None]):
        task = made._next(waiting, running)
        assert (task.name if task else None) == name, k
        if task:
            running[task.name] = made.expected(task)
    assert [task.name for task in waiting] == ["2"]


def test_a_manifest_on_a_full_disk_says_that_it_is_full_and_keeps_its_rows(package, work):
    plans = package("batch.plan")
    plan = plans.BatchPlan("unwrap", (), work.root / "out")
    first = plans.FileTask("first", work.root / "first", 1, 0, None)
    many = [plans.FileTask(f"{k}" * 500, work.root / f"{k}", 1, 0, None) for k in range(1000, 2000)]
    with package("batch.manifest").Manifest(work.root / "x.manifest.sqlite") as manifest:
        manifest.due(plan, [first], retry=False)
        (pages,) = manifest._base.execute("PRAGMA page_count").fetchone()
        manifest._base.execute(f"PRAGMA max_page_count = {pages + 2}")
        with pytest.raises(package("batch.plan").BatchError, match=r"is full.*Make room") as told:
            manifest.due(plan, [first, *many], retry=False)
        assert str(manifest.path) in str(told.value) and "\n" not in str(told.value)
        assert [row["name"] for row in manifest.rows()] == ["first"]


def in_a_folder_that_takes_nothing(tmp_path):
    if not os.path.isdir("/proc/self"):
        pytest.skip("no folder here takes nothing, whoever asks")
    return Path("/proc/self")


def under_the_name_of_a_folder(tmp_path):
    for ending in ("lock", "sqlite"):
        (tmp_path / f"x.manifest.{ending}").mkdir()
    return tmp_path


def over_a_text(tmp_path):
    for ending in ("lock", "sqlite"):
        (tmp_path / f"x.manifest.{ending}").write_text("no data base, however long it may be " * 40)
    return tmp_path


@pytest.mark.parametrize("place", [in_a_folder_that_takes_nothing, under_the_name_of_a_folder, over_a_text])
@pytest.mark.parametrize("what", ["only_one", "Manifest"])
def test_what_sqlite_cannot_do_is_told_by_its_cause_and_never_as_another_batch(package, tmp_path, place, what):
    path = place(tmp_path) / "x.manifest.sqlite"
    with pytest.raises(package("batch.plan").BatchError) as told, getattr(package("batch.manifest"), what)(path):
        pass
    cause, text = told.value.__cause__, str(told.value)
    assert isinstance(cause, sqlite3.Error) and str(cause) in text and "another batch" not in text
    assert text.startswith(f"{path.with_suffix('')}.") and "start the same command again" in text


def test_every_question_to_a_damaged_manifest_is_an_error_that_names_it(package, work):
    """The rows are overwritten while the file is open; what is no error of SQLite, such as of a closed one, stays."""
    plans, module = package("batch.plan"), package("batch.manifest")
    plan, child = plans.BatchPlan("unwrap", (), work.root / "out"), package("batch.child")
    task = plans.FileTask("first", work.root / "first", 1, 0, None)
    path = work.root / "x.manifest.sqlite"
    with module.Manifest(path) as manifest:
        manifest.describe(plan)
        manifest.due(plan, [task], retry=False)
        path.write_bytes(path.read_bytes()[:24] + b"\xff" * (path.stat().st_size - 24))
        asked = [
            lambda: manifest.describe(plan),
            manifest.description,
            lambda: manifest.due(plan, [task], retry=False),
            lambda: manifest.begin(task),
            lambda: manifest.end(plan, task, child.Record(status=0, seconds=0.0)),
            manifest.rows,
            manifest.counts,
        ]
        for ask in asked:
            with pytest.raises(plans.BatchError, match=r"x\.manifest\.sqlite: .*Move it away"):
                ask()
    with pytest.raises(sqlite3.ProgrammingError):
        manifest.rows()


@pytest.mark.parametrize("defect", [KeyError, SystemExit])
def test_a_defect_of_the_pool_is_raised(package, go, work, monkeypatch, defect):
    work.put("a.obj")

    def fail(*_):
        raise defect("defect")

    monkeypatch.setattr(package("batch.pool"), "run_task", fail)
    with pytest.raises(defect, match="defect"):
        go()


def test_parts_have_manifests_of_their_own_that_are_read_as_one(package, work, tmp_path):
    module = package("batch.manifest")
    for name in ("out.part1of2", "out.part2of2"):
        with module.Manifest(tmp_path / f"{name}.manifest.sqlite"):
            pass
    assert len(module.found_beside(tmp_path / "out")) == 2
    assert module.rows_of(module.found_beside(tmp_path / "out")) == []
    with pytest.raises(package("batch.plan").BatchError, match="no such manifest"):
        module.found_beside(tmp_path / "other")


def test_the_bar_is_told_of_every_run_with_its_work_and_whether_it_failed(go, work, monkeypatch):
    from contextlib import contextmanager

    from omt_uv.batch import bar, engine

    told, begun = [], []

    @contextmanager
    def shown(count, whole):
        begun.append((count, whole))
        yield lambda part, failed: told.append((part, failed))

    monkeypatch.setattr(engine, "shown", shown)
    sizes = {"a.obj": 40, "bad.obj": 7, "crash.obj": 300, "b.obj": 0}
    for name, size in sizes.items():
        work.put(name, text=b"x" * size)
    go()
    parts = {name: bar.work_of(size + len(name)) for name, size in sizes.items()}
    assert begun == [(4, sum(parts.values()))]
    assert sorted(told) == sorted((part, name in ("bad.obj", "crash.obj")) for name, part in parts.items())
