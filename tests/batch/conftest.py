"""A stand-in for the program: a child that obeys the name of its input, without Blender, in a tenth of a second."""

from __future__ import annotations

import sys
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import pytest

PROGRAM = """
import json, os, pathlib, signal, sys
words = sys.argv[1:]
source, output = pathlib.Path(words[1]), pathlib.Path(words[words.index("-o") + 1])
name = source.name
with open(os.environ["OMT_UV_TEST_LOG"], "a") as log:
    log.write(f"{name}\\n")
if "slow" in name:
    # As the program does: it ends with its parent.
    os.read(0, 1)
    sys.exit(3)
if "crash" in name:
    os.kill(os.getpid(), signal.SIGSEGV)
if "bad" in name:
    sys.exit("omt_uv: error: " + str(source) + ": face 17 is a line")
if "killer" in name and os.environ.get("OMT_UV_TEST_WORKERS"):
    os.kill(os.getppid(), signal.SIGKILL)
print("omt_uv: warning: told", file=sys.stderr)
output.write_bytes(source.read_bytes()[::-1])
if "--report" in words:
    figures = {"faces": len(source.read_bytes()), "area_l1": 0.5, "folds": 1}
    path = pathlib.Path(words[words.index("--report") + 1])
    path.write_text(json.dumps({"charts": [figures, figures], "gate": {"overlap": 0.0}, "warnings": []}))
"""


@dataclass
class Work:
    """A folder of inputs, one of results, the words that start the program, and the log of its runs."""

    root: Path
    start: tuple[str, ...]
    files: dict = field(default_factory=dict)

    def put(self, *names, text=b"mesh"):
        for name in names:
            path = self.root / "in" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text + name.encode())

    def runs(self):
        log = self.root / "log.txt"
        return sorted(log.read_text().splitlines()) if log.exists() else []


@pytest.fixture
def work(tmp_path, monkeypatch):
    (tmp_path / "in").mkdir()
    (tmp_path / "program.py").write_text(PROGRAM)
    monkeypatch.setenv("OMT_UV_TEST_LOG", str(tmp_path / "log.txt"))
    yield Work(tmp_path, (sys.executable, str(tmp_path / "program.py")))
    for _ in range(200):
        left = processes_of(tmp_path)
        if not left:
            break
        threading.Event().wait(0.05)
    assert not left, f"processes were left behind: {left}"


def processes_of(folder):
    """The words of all processes that name a folder, where the system tells."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):
            words = path.read_bytes().split(b"\0")
            found += [words] if any(str(folder).encode() in word for word in words) else []
    return found


@pytest.fixture
def go(package, work):
    """Run the batch over the folder: its result, and the rows of its manifest by name."""

    def run(runner=None, retry=False, part=(1, 1), **more):
        plans, manifests, engine = (package(f"batch.{name}") for name in ("plan", "manifest", "engine"))
        plan = plans.BatchPlan("unwrap", tuple(more.pop("options", ())), work.root / "out", previews=False, **more)
        tasks = plans.tasks_of(plan, work.root / "in", part)
        runner = runner(plan) if runner else package("batch.pool").LocalPool(plan, work.start, 2)
        path = plan.beside(plans.MANIFEST)
        with manifests.only_one(path), manifests.Manifest(path) as manifest:
            result = engine.carry_out(plan, tasks, manifest, runner, retry)
            return result, {row["name"]: row for row in manifest.rows()}

    return run
