"""Runs that are killed leave the old file whole, or the new one, and the next run clears what they left.

OMT_UV_KILLS=200 kills more often than `make test` does.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from threading import Event

import mesh_bytes
import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
KILLS = int(os.environ.get("OMT_UV_KILLS", "1"))
# Seconds within which a run ends.
LONGEST = 120.0
INPUTS = {
    ".obj": mesh_bytes.obj_bytes(),
    ".ply": mesh_bytes.ply_bytes("binary_little_endian"),
    ".glb": mesh_bytes.glb_bytes(),
}
TARGETS = [".obj", ".ply", ".glb", ".blend", ".fbx", ".stl"]
# A disk that takes its time to flush, as those do that hold more than these files: a file is written in milliseconds.
FLUSH = 0.05
SLOW_DISK = f"""
import os, time
flush = os.fsync
def slow(handle):
    time.sleep({FLUSH})
    flush(handle)
    time.sleep({FLUSH})
os.fsync = slow
"""


def start(folder, source, target, slow=None):
    words = [sys.executable, "-m", "omt_uv", "unwrap", folder / f"in{source}", "-o", folder / f"out{target}"]
    places = [str(slow), os.environ.get("PYTHONPATH", "")] if slow else [os.environ.get("PYTHONPATH", "")]
    return subprocess.Popen(list(map(str, [*words, "--quality", "draft"])), cwd=ROOT, stdout=subprocess.PIPE,
                            stderr=subprocess.DEVNULL,
                            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, places))})  # fmt: skip


def parts(folder):
    """What a run has begun to write, and its lock."""
    return [path for path in folder.glob(".omt_uv_*") if not path.name.endswith(".lock.new")]


def written(folder):
    """What is being written; a lock alone is there before the work as well, when the folder is tried."""
    return [path for path in parts(folder) if not path.name.endswith(".lock")]


def wait(process, seconds, until=lambda: False):
    """Wait for the end of a process, for so long, or until something is so."""
    step = 0.002
    for _ in range(int(seconds / step)):
        if process.poll() is not None or until():
            return
        with suppress(subprocess.TimeoutExpired):
            process.wait(step)


@pytest.mark.skipif(os.name == "nt", reason="signals are those of POSIX")
def test_killed_runs_leave_a_whole_file(package, tmp_path):
    pytest.importorskip("scipy", reason="runs outside Blender, where the wheels of the extension are not")
    sweep = package("files.verified").sweep
    (tmp_path / "slow").mkdir()
    (tmp_path / "slow" / "sitecustomize.py").write_text(SLOW_DISK)
    rng = np.random.default_rng(KILLS)
    while_writing = 0
    for k in range(1, KILLS + 1):
        source, target = list(INPUTS)[k % 3], TARGETS[k % 3 if k % 2 else k % 6]
        folder = tmp_path / str(k)
        folder.mkdir()
        (folder / f"in{source}").write_bytes(INPUTS[source])
        out = folder / f"out{target}"
        out.write_bytes(b"old")
        process = start(folder, source, target, tmp_path / "slow")
        # Two of three while something is written, or put in its place; the others at any time.
        if k % 3:
            wait(process, LONGEST, lambda folder=folder: bool(written(folder)))
            wait(process, rng.random() * 3 * FLUSH)
        else:
            wait(process, rng.random() * 4)
        process.send_signal(signal.SIGKILL)
        process.wait()
        while_writing += bool(written(folder))
        # The child ends with it, if not at once: the pipe is its, too.
        process.stdout.read()
        assert (folder / f"in{source}").read_bytes() == INPUTS[source]
        done = out.read_bytes()
        assert done == b"old" or len(done) > 100
        # The child of the run ends with it, if not at once.
        for _ in range(100):
            sweep(folder)
            if not parts(folder):
                break
            Event().wait(0.1)
        if k % 10 == 1 or done != b"old":
            assert start(folder, source, target).wait(LONGEST) == 0
            if done != b"old" and target not in (".blend", ".fbx"):
                assert done == out.read_bytes()
        assert {path.name for path in folder.iterdir()} == {f"in{source}", out.name}
    # So that the test sees what it is there for.
    assert KILLS < 20 or while_writing > KILLS // 4
