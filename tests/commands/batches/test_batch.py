"""The commands over many files, as a program and in this process."""

from __future__ import annotations

import argparse
import csv
import io
import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).resolve().parents[3]
SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3\nf 1 3 4\n"


@pytest.fixture
def run(package, capfd):
    """Run a command in this process: exit status, standard output, standard error."""

    def command(*arguments):
        capfd.readouterr()
        status = package("cli").main([str(a) for a in arguments])
        return status, *capfd.readouterr()

    return command


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "in" / "sub").mkdir(parents=True)
    (tmp_path / "in" / "a.obj").write_text(SQUARE)
    (tmp_path / "in" / "sub" / "-b $(touch x); .obj").write_text(SQUARE)
    (tmp_path / "in" / "bad.obj").write_text("v 0 0 0\n")
    return tmp_path


def test_a_folder_is_unwrapped_with_table_summary_and_page(run, folder):
    pytest.importorskip("scipy", reason="runs outside Blender, where the wheels of the extension are not")
    # In a folder that is not there yet.
    target = folder / "new" / "out"
    words = ["batch", "unwrap", folder / "in", "-o", target, "--", "--quality", "draft"]
    status, out, err = run(*words)
    assert status == 7 and out.startswith("2 of 3 files done, 3 of all runs now")
    assert err.count("\n") == 1 and "1 of 3 files could not be done" in err
    for name in ("a.obj", "sub/-b $(touch x); .obj"):
        assert (target / name).read_text().count("vt ") == 4
        assert (target.with_name("out.previews") / f"{name}.png").read_bytes().startswith(b"\x89PNG")
    assert not list(folder.glob("**/x"))
    status, out, _ = run(*words)
    assert status == 7 and "0 of all runs now" in out
    status, out, _ = run("table", target)
    rows = {row["name"]: row for row in csv.DictReader(io.StringIO(out))}
    assert rows["a.obj"]["faces"] == "2" and float(rows["a.obj"]["area_l1"]) < 0.01
    assert rows["bad.obj"]["status"] == "1" and "no faces" in rows["bad.obj"]["message"]
    status, out, _ = run("summary", target, "--json")
    assert json.loads(out)["counts"] == {"done": 2, "failed": 1}
    assert run("page", target)[0] == 0
    assert "out.previews/sub/-b%20%24%28touch%20x%29%3B%20.obj.png" in (target.with_name("out.html")).read_text()
    # Wherever a page is, it finds its pictures from there.
    (folder / "pages").mkdir()
    assert run("page", target, "-o", folder / "pages" / "one.html")[0] == 0
    for page in (target.with_name("out.html"), folder / "pages" / "one.html"):
        links = re.findall(r'"([^"]*out\.previews[^"]*)"', page.read_text())
        assert len(set(links)) == 2 and all((page.parent / unquote(link)).is_file() for link in links)
    assert run(*words[:5], "--allow-failures", *words[5:])[0] == 0
    assert run("table", target, "-o", folder / "t.txt")[0] == 1


@pytest.mark.parametrize(
    "words, said",
    [
        (["unwrap", "IN", "-o", "OUT", "--", "--quality", "none"], "invalid choice"),
        (["unwrap", "IN", "-o", "OUT", "--", "--report", "r.json"], "one file for all"),
        (["unwrap", "IN", "-o", "OUT", "--", "--timeout", "5"], "belongs before the --"),
        (["unwrap", "IN", "-o", "OUT", "--", "--memory=5"], "belongs before the --"),
        (["unwrap", "IN", "-o", "OUT", "--", "-o", "x.obj"], "-o belongs before"),
        (["batch", "IN", "-o", "OUT"], "no command for one file"),
        (["seams", "IN", "-o", "OUT", "--part", "3/2"], "no part"),
        (["seams", "IN", "-o", "OUT", "--jobs", "0"], "not a number of runs"),
    ],
)
def test_options_that_make_no_sense_are_status_2_before_anything_is_run(run, folder, words, said):
    status, out, err = run("batch", *(str(folder / w.lower()) if w in ("IN", "OUT") else w for w in words))
    assert (status, out) == (2, "") and said in err
    assert not list(folder.glob("out*"))


@pytest.mark.parametrize("name", ["table", "summary", "page"])
def test_what_reads_a_batch_says_where_there_is_none(run, tmp_path, name):
    status, _, err = run(name, tmp_path / "none")
    assert status == 1 and "no such manifest" in err and not list(tmp_path.iterdir())


@pytest.mark.skipif(os.name != "posix", reason="signals are those of POSIX")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_a_batch_in_one_line_and_it_goes_on(folder, number):
    """Children end with it, whatever they do."""
    words = [sys.executable, "-m", "omt_uv", "batch", "measure", str(folder / "in"), "-o", str(folder / "out")]
    batch = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    import sqlite3
    from threading import Event

    for _ in range(400):
        try:
            base = sqlite3.connect(f"file:{folder / 'out.manifest.sqlite'}?mode=ro", uri=True)
            if base.execute("SELECT COUNT(*) FROM runs WHERE state = 'running'").fetchone()[0]:
                break
        except sqlite3.Error:
            pass
        Event().wait(0.02)
    batch.send_signal(number)
    out, err = batch.communicate(timeout=60)
    assert batch.returncode == 130 and err.count("\n") == 1 and "The same command goes on" in err, err
    states = dict(sqlite3.connect(folder / "out.manifest.sqlite").execute("SELECT name, state FROM runs"))
    assert set(states.values()) <= {"running", "waiting", "done", "failed"} and len(states) == 3


def out_is_a_file(folder):
    (folder / "out").write_text("")
    return folder / "in", "out: "


def out_is_under_a_file(folder):
    (folder / "out").write_text("")
    return folder / "in", "out/more: "


def failures_is_a_file(folder):
    (folder / "out.failures").write_text("")
    return folder / "in", "bad.obj.txt: "


def the_lock_is_a_folder(folder):
    (folder / "out.manifest.lock").mkdir()
    return folder / "in", "out.manifest.lock: "


def the_list_has_a_zero(folder):
    (folder / "list").write_text("in/a.obj\0\n")
    return folder / "list", "list: "


@pytest.mark.parametrize(
    "spoil", [out_is_a_file, out_is_under_a_file, failures_is_a_file, the_lock_is_a_folder, the_list_has_a_zero]
)
def test_what_is_in_the_way_of_a_batch_is_one_line_that_names_it_and_no_defect(run, folder, spoil):
    source, named = spoil(folder)
    # Only what fails by itself: no run needs to come to an end.
    (folder / "in" / "a.obj").unlink()
    (folder / "in" / "sub" / "-b $(touch x); .obj").unlink()
    out = folder / ("out/more" if spoil is out_is_under_a_file else "out")
    status, _, err = run("batch", "unwrap", source, "-o", out)
    assert status == 1 and err.count("\n") == 1, err
    assert named in err and "defect" not in err and "another batch" not in err


@pytest.mark.parametrize(
    "rest, kept",
    [
        ("--quality draft", "--quality draft"),
        ("--report r.json --quality draft", "--quality draft"),
        ("--quality draft -o x.obj --size=3", "--quality draft --size=3"),
        ("--preview=p.png --size 3 --timeout 5 --memory=2 --quality draft", "--size 3 --quality draft"),
        ("--report --quality --size 3", "--size 3"),
        ("", ""),
    ],
)
def test_what_a_batch_gives_itself_is_left_out_with_its_value_and_nothing_else(package, rest, kept):
    parser = argparse.ArgumentParser()
    for name in ("--report", "--preview", "-o --output", "--timeout", "--memory", "--quality", "--size"):
        parser.add_argument(*name.split())
    given, rest = SimpleNamespace(parser=parser), tuple(rest.split())
    words = ["in.obj", "--", *rest]
    assert package("commands.batches.batch")._complete(given, words, rest) == ["in.obj", "--", *kept.split()]
