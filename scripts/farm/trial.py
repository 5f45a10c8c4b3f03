"""Try a batch on meshes made for it: what became of each, time beside the sum of the runs, and memory.

usage: trial.py FOLDER [--count 2000] [--most 200000] [--jobs 2] [--total-memory 8] [-- options of unwrap]
Called again, it goes on where it was, and tells the times of what it did now. Linux alone tells the memory.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))
PAGE = os.sysconf("SC_PAGE_SIZE")
GIGABYTE = 1e9
# Seconds between two looks at the memory.
PERIOD = 1.0


def tree(root: int) -> list[int]:
    """A process and all that descend from it."""
    parents = {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            # The name of a program, in brackets, may hold anything.
            parents[int(path.parent.name)] = int(path.read_text().rpartition(")")[2].split()[1])
        except OSError:
            continue
    found, new = [], [root]
    while new:
        found += new
        new = [process for process, parent in parents.items() if parent in new]
    return found


def resident(process: int) -> int:
    """Bytes of memory that a process has in use; 0 once it is gone."""
    try:
        return int(Path(f"/proc/{process}/statm").read_text().split()[1]) * PAGE
    except OSError:
        return 0


class Memory:
    """The most that a process and its descendants had in use together; what they share counts for each."""

    def __init__(self, root: int) -> None:
        self.root, self.most, self._over = root, 0, threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._thread.start()

    def _look(self) -> None:
        while not self._over.wait(PERIOD):
            self.most = max(self.most, sum(map(resident, tree(self.root))))

    def end(self) -> int:
        self._over.set()
        self._thread.join()
        return self.most


def run(folder: Path, options, rest: list[str]) -> dict:
    """Run the batch; its status, seconds, processor seconds and most bytes."""
    words = [sys.executable, "-m", "omt_uv", "batch", "unwrap", str(folder / "meshes"), "-o", str(folder / "out")]
    words += ["--jobs", str(options.jobs), "--total-memory", f"{options.total_memory:g}", *options.batch, "--", *rest]
    begin, clock = time.time(), time.monotonic()
    child = subprocess.Popen(words, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)})
    memory = Memory(child.pid)
    status = child.wait()
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return {
        "begin": begin,
        "status": status,
        "seconds": time.monotonic() - clock,
        "processor": used.ru_utime + used.ru_stime,
        "memory": memory.end(),
    }


def tell(folder: Path, options, found: dict) -> None:
    """Print the states of all files, what has failed that should not, times and memory."""
    from omt_uv.batch.manifest import DONE, FAILED, rows_of
    from omt_uv.batch.plan import FAILURES, MANIFEST

    rows = rows_of([folder / f"out{MANIFEST}"])
    done = [row for row in rows if row["state"] == DONE]
    failed = [row for row in rows if row["state"] == FAILED]
    named = [row for row in failed if row["message"] and (folder / f"out{FAILURES}" / f"{row['name']}.txt").is_file()]
    print(f"status {found['status']}; {len(rows)} files: {len(done)} done, {len(failed)} failed, {len(named)} named")
    for row in failed:
        # Names of broken files say what is broken.
        if "_" not in row["name"]:
            print(f"  not broken, but failed: {row['name']}: {row['message']}")
    broken = [row["name"] for row in done if "_" in row["name"]]
    print(f"broken, but done: {', '.join(broken) or 'none'}")
    now = [row for row in rows if row["ended"] and row["ended"] >= found["begin"]]
    seconds = sum(row["seconds"] for row in now)
    processor = sum(row["processor"] or 0 for row in now)
    print(
        f"{len(now)} runs now: {found['seconds']:.0f} s, of {options.jobs} at a time {seconds:.0f} s together: ", end=""
    )
    print(f"{found['seconds'] * options.jobs / max(seconds, 1e-9):.3f} x the sum of the runs / cores")
    print(f"processor: {found['processor']:.0f} s, of the runs {processor:.0f} s: ", end="")
    print(f"{found['processor'] / max(processor, 1e-9):.3f} x")
    most = max((row["memory"] or 0 for row in rows), default=0) / GIGABYTE
    print(f"memory: {found['memory'] / GIGABYTE:.2f} GB of {options.total_memory:g}, one run {most:.2f} GB")


def main():
    parser = argparse.ArgumentParser(description=__doc__, usage="%(prog)s FOLDER [options] [-- options of unwrap]")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--count", type=int, default=2000)
    parser.add_argument("--most", type=int, default=200_000)
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--total-memory", type=float, default=8.0)
    parser.add_argument("--batch", nargs="*", default=[], metavar="WORD", help="options of the batch, without dashes")
    words = sys.argv[1:]
    own, rest = (words[: words.index("--")], words[words.index("--") + 1 :]) if "--" in words else (words, [])
    options = parser.parse_args(own)
    options.batch = [f"--{word}" for word in options.batch]
    if not (options.folder / "meshes").is_dir():
        from make_meshes import write_meshes

        faces = write_meshes(options.folder / "meshes", options.count, options.most)
        print(f"{len(faces)} files, {(faces == 0).sum()} of them broken, {faces.sum()} faces", flush=True)
    tell(options.folder, options, run(options.folder, options, rest))


if __name__ == "__main__":
    main()
